"""Derivatives: what a peak, a point or a stuck frequency depends on, as a record with its pictures
and tables."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.drawing.figure import Panel
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.hbm.validation import check_kind

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

WHAT = ("amplitude", "frequency")
OF_CONTACTS = ("preload", "mu", "kn", "kt")
ROW = [("output", "U200"), ("setting", "U80"), ("contact", int), *((of, float) for of in WHAT)]


def as_table(by: Mapping[str, "Derivatives"]) -> np.ndarray:
    """(k,) with a row for each setting of each contact, after one without for the quantities
    themselves; by : {output: of its peak}."""
    rows: list[tuple] = []
    for output, one in by.items():
        rows.append((output, "", -1, one.amplitude, one.frequency))
        rows += [
            (output, name, c, *both)
            for name in one.amplitude_by
            for c, both in enumerate(
                zip(one.amplitude_by[name], one.frequency_by[name], strict=True)
            )
        ]
    return np.array(rows, dtype=ROW)


def from_table(table: np.ndarray) -> dict[str, "Derivatives"]:
    """What `as_table` made."""
    found = {}
    for output in dict.fromkeys(table["output"].tolist()):
        mine = table[table["output"] == output]
        names = [name for name in dict.fromkeys(mine["setting"].tolist()) if name]
        by = ({name: mine[of][mine["setting"] == name] for name in names} for of in WHAT)
        amplitude, frequency = (float(mine[of][0]) for of in WHAT)
        found[output] = Derivatives(frequency, amplitude, *by)
    return found


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Of a frequency in Hz and an amplitude in m, by relative changes of the settings.

    amplitude_by, frequency_by : {setting: (P,) m or Hz} by a relative change of kn, kt, mu or the
        preload of each contact; 'damping', 'level' (of the force) and parameters of one's own:
        (1,). One per cent more of a setting of contact c changes the amplitude by 0.01
        amplitude_by[setting][c]

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> curve = damped.follow_band((600, 1000), outputs={"tip": 0})
    >>> by: Derivatives = peak_derivatives(curve, damped, "tip")
    >>> largest = max(by.amplitude_by, key=lambda name: abs(by.total(name)[1]))
    >>> largest  # what counts most
    'level'
    >>> Derivatives.load(by.save("of_the_peak.npz")).total("mu") == by.total("mu")
    True
    """

    frequency: float
    amplitude: float
    amplitude_by: dict[str, np.ndarray]
    frequency_by: dict[str, np.ndarray]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Derivatives):
            return NotImplemented
        return np.array_equal(as_table({"": self}), as_table({"": other}))

    def total(self, setting: str) -> tuple[float, float]:
        """(Hz, m) by a relative change of a setting of all contacts at once."""
        self._check(setting)
        return float(self.frequency_by[setting].sum()), float(self.amplitude_by[setting].sum())

    def plot(
        self, setting: str | None = None, of: str = "amplitude", ax: "Axes | None" = None
    ) -> "Axes":
        """Draw by how many per cent the amplitude or the frequency changes with one per cent more.

        setting : None draws a bar for each setting of all contacts together, the largest on top
            (a tornado); the name of one draws a bar for each contact: whose friction matters
        of : 'amplitude' or 'frequency'; ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed, and for an unknown
        setting.
        """
        if setting is None:
            return pictures.on_axes(self.tornado_panel(of), ax)
        values = self.relative(setting, of)
        rows = [(f"contact {c}", float(one)) for c, one in enumerate(values)][::-1]
        return pictures.bars(rows, f"{of}, % by 1 % of {setting}", ax)

    def map(
        self,
        pairs: ContactTable,
        setting: str = "mu",
        of: str = "amplitude",
        ax: "Axes | None" = None,
    ) -> "Axes":
        """Draw on a map of the pairs by how many per cent the amplitude or the frequency changes
        with one per cent more of a setting of each: the area of a disk, vermilion where it grows.

        pairs : of the problem, or with those that are detached; of, ax : as in `plot`
        Returns the axes. Raises InputError as `plot`, and where the pairs are others.
        """
        return pictures.on_axes(self.map_panel(pairs, setting, of), ax)

    def map_panel(self, pairs: ContactTable, setting: str, of: str) -> Panel:
        """What `map` draws."""
        values = self.relative(setting, of)
        pairs = check_kind("pairs", pairs, ContactTable, "ContactTable.load(file)")
        if len(values) == int(pairs.carrying.sum()):
            pairs = pairs.select(pairs.carrying)
        if len(values) != len(pairs):
            raise InputError(
                f"pairs: has {len(pairs)}, '{setting}' is of {len(values)}; give the table that "
                "the problem was made with"
            )
        return pictures.pair_panel(pairs, values, f"{of}, % by 1 % of {setting}")

    def relative(self, setting: str, of: str = "amplitude") -> np.ndarray:
        """(P,) or (1,) per cent by one per cent more; InputError for an unknown setting."""
        if of not in WHAT:
            raise InputError(f"of = '{of}': must be 'amplitude' or 'frequency'")
        self._check(setting)
        return vars(self)[f"{of}_by"][setting] / vars(self)[of]

    def _check(self, setting: str) -> None:
        if setting not in self.amplitude_by:
            known = ", ".join(self.amplitude_by)
            raise InputError(f"setting '{setting}': must be one of {known}")

    def tornado_panel(self, of: str) -> Panel:
        """A bar for each setting, the largest on top."""
        rows = [(name, float(self.relative(name, of).sum())) for name in self.amplitude_by]
        return pictures.bar_panel(sorted(rows, key=lambda row: abs(row[1])), f"{of}, % by 1 %")

    def of_pairs(self, kept: np.ndarray) -> "Derivatives":
        """Of all pairs, (P,) bool : those that it knows; the others change nothing."""

        def spread(by: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
            found = {}
            for name, part in by.items():
                found[name] = part
                if len(part) == kept.sum() and name in OF_CONTACTS:
                    found[name] = np.zeros(len(kept))
                    found[name][kept] = part
            return found

        return replace(
            self, amplitude_by=spread(self.amplitude_by), frequency_by=spread(self.frequency_by)
        )

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each setting of each contact: by how much one per cent more of it changes the
        amplitude and the frequency, in per cent. Raises InputError where pandas is not
        installed."""
        rows = [(name, c) for name, part in self.amplitude_by.items() for c in range(len(part))]
        columns: dict[str, Any] = {
            "setting": [name for name, _ in rows],
            "contact": [c for _, c in rows],
        }
        for of in WHAT:
            columns[f"{of}_percent"] = [
                vars(self)[f"{of}_by"][k][c] / vars(self)[of] for k, c in rows
            ]
        return tables.frame(columns, "row")

    def _repr_html_(self) -> str:
        of = {"amplitude": self.amplitude, "frequency": self.frequency}
        rows = {
            name: ", ".join(
                f"{part / of[what]:+.3g} % in {what}"
                for what, part in zip(("frequency", "amplitude"), self.total(name), strict=True)
                if np.isfinite(of[what])
            )
            for name in self.amplitude_by
        }
        return tables.notebook_table(f"By 1 % more, at {self.frequency:.6g} Hz", rows)

    def save(self, path: str | Path) -> Path:
        """One .npz of a table, to lie beside that of the curve."""
        return save_npz(path, derivatives=as_table({"": self}))

    @classmethod
    def load(cls, path: str | Path) -> "Derivatives":
        """Read what `save` wrote; InputError where the file is not there or holds something
        else."""
        path = Path(path)
        if not path.is_file():
            raise InputError(f"derivatives not found: {path}")
        try:
            with open_npz(path) as z:
                return from_table(z["derivatives"])[""]
        except (OSError, ValueError, KeyError, IndexError) as error:
            raise InputError(f"{path}: is not what Derivatives.save writes ({error})") from None
