"""Derivatives: what a peak, a point or a stuck frequency depends on, as a record with its pictures
and tables."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.npz import open_npz, save_npz

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

WHAT = ("amplitude", "frequency")


@dataclass(frozen=True)
class Derivatives:
    """Of a frequency in Hz and an amplitude in m, by relative changes of the settings.

    amplitude_by, frequency_by : {setting: (P,) m or Hz} by a relative change of kn, kt, mu or the
        preload of each contact; 'damping' and 'level' (of the force): (1,). One per cent more of a
        setting of contact c changes the amplitude by 0.01 amplitude_by[setting][c]

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

    def total(self, setting: str) -> tuple[float, float]:
        """(Hz, m) by a relative change of a setting of all contacts at once."""
        if setting not in self.amplitude_by:
            known = ", ".join(self.amplitude_by)
            raise InputError(f"setting '{setting}': must be one of {known}")
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
        if of not in WHAT:
            raise InputError(f"of = '{of}': must be 'amplitude' or 'frequency'")
        by, size = vars(self)[f"{of}_by"], vars(self)[of]
        if setting is None:
            values = {name: float(part.sum()) / size for name, part in by.items()}
            rows = sorted(values.items(), key=lambda row: abs(row[1]))
        else:
            self.total(setting)
            rows = [(f"contact {c}", one / size) for c, one in enumerate(by[setting])][::-1]
        label = f"{of}, % by 1 %" + ("" if setting is None else f" of {setting}")
        return pictures.bars(rows, label, ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each setting of each contact: by how much one per cent more of it changes the
        amplitude and the frequency, in per cent. Raises InputError where pandas is not
        installed."""
        return tables.influence_as_frame(self)

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
        """One .npz of plain arrays, to lie beside that of the curve."""
        path = Path(path)
        parts = {f"{of}_by {name}": x for of in WHAT for name, x in vars(self)[f"{of}_by"].items()}
        save_npz(path, frequency=self.frequency, amplitude=self.amplitude, **parts)
        return path

    @classmethod
    def load(cls, path: str | Path) -> "Derivatives":
        """Read what `save` wrote; InputError where the file is not there or holds something
        else."""
        path = Path(path)
        if not path.is_file():
            raise InputError(f"derivatives not found: {path}")
        try:
            with open_npz(path) as z:
                parts = {
                    f"{of}_by": {
                        key.split(" ", 1)[1]: z[key] for key in z if key.startswith(f"{of}_by ")
                    }
                    for of in WHAT
                }
                return cls(float(z["frequency"]), float(z["amplitude"]), **parts)
        except (OSError, ValueError, KeyError) as error:
            raise InputError(f"{path}: is not what Derivatives.save writes ({error})") from None
