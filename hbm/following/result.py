"""Followed: a peak or a fold of a curve over a parameter as read-only arrays."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.drawing.figure import Curve, Panel
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_files import save_npz
from tipdamp.hbm.io.array_record import ArrayRecord, read_record
from tipdamp.hbm.result import FACTOR, in_words

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Followed(ArrayRecord):
    """A peak, or a fold, over a parameter: n places in their order, m outputs, P contacts,
    harmonics 0..H.

    what : 'peak' or 'fold'; output, kind : whose peak, in which amplitude
    parameter_name, parameter : what varies, (n,) its values; parameter_unit : '' without, 'factor'
        where they are factors on what the problem has
    frequency : (n,) Hz; height : (n,) m, the amplitude of the output there
    peak_of : (n,) str, the output whose peak it is: of several the largest
    output_names : (m,) str; harmonics : (n, m, H+1) complex, m, of all outputs
    share_stick, share_slip, share_open : (n, P) share of the cycle
    friction_W : (n, P) W, mean power that each contact takes, over all components of the law
    curvature : (n,) of the logarithm of what is extreme, by the arc length of the curve: negative
        at a maximum, zero where it meets a minimum
    jumps : (n,) bool, places that the way does not lead to from the one before: another peak was
        taken up there
    fitted : (n,) bool, maxima of a piece of the curve, which has a kink there: no curvature
    ended : why it ends; complete : it reaches the last value
    unknowns : (n, N) of the curve, a `guess` for it; calls : evaluations of the residual
    seconds : cost

    The arrays are copies that cannot be written to.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, band=(600, 1000), harmonics=1)
    >>> peaks: Followed = follow_peak(problem, np.array([5.0]), "level", (1.0, 8.0), **given)
    >>> peaks.complete, bool((np.diff(peaks.height) > 0).all())
    (True, True)
    >>> Followed.load(peaks.save("peaks.npz")) == peaks
    True
    """

    what: str
    output: str
    kind: str
    parameter_name: str
    parameter_unit: str
    parameter: np.ndarray
    frequency: np.ndarray
    height: np.ndarray
    peak_of: np.ndarray
    output_names: np.ndarray
    harmonics: np.ndarray
    share_stick: np.ndarray
    share_slip: np.ndarray
    share_open: np.ndarray
    friction_W: np.ndarray
    curvature: np.ndarray
    jumps: np.ndarray
    fitted: np.ndarray
    ended: str
    complete: bool
    H: int
    unknowns: np.ndarray
    calls: int
    seconds: float = field(compare=False)

    def __repr__(self) -> str:
        p, f = self.parameter, self.frequency
        return (
            f"<Followed {self.what} of '{self.output}': {self.over} {p[0]:.6g} to "
            f"{p[-1]:.6g}, {len(p)} places, {f.min():.6g} to {f.max():.6g} Hz, H = {self.H}; "
            f"{self.ended}>"
        )

    @property
    def over(self) -> str:
        """What varies, for axes and tables: 'mu factor' where the values are factors on mu."""
        return in_words(self.parameter_name, self.parameter_unit)

    def __len__(self) -> int:
        """Number of places."""
        return len(self.parameter)

    def at(self, value: float) -> int:
        """The place, 0 for the first, at which it is solved at a value of the parameter, as at
        those of the option `at`; of several the highest. InputError where there is none, with the
        nearest."""
        there = np.flatnonzero(np.isclose(self.parameter, value, rtol=1e-12, atol=0.0))
        if not len(there):
            p = self.parameter[np.abs(self.parameter - value).argmin()]
            raise InputError(
                f"value = {value:g}: no place is solved there, the nearest is {p:g}; ask for "
                "it with at="
            )
        return int(there[self.height[there].argmax()])

    def plot(self, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw the height over the parameter, apart where another peak was taken up.

        unit : 'm', 'mm' or 'um'; ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed.
        """
        y = pictures.factor_of(unit) * self.height
        color = pictures.free_color(ax)
        runs = np.cumsum(self.jumps)
        lines = tuple(
            Curve(self.parameter[runs == k], y[runs == k], self.output * (not k), color)
            for k in np.unique(runs)
        )
        label = f"{self.what} ({pictures.SHOWN[unit]})"
        unit = self.parameter_unit.removeprefix(FACTOR)
        over = f"{self.over} ({unit})" if unit else self.over
        return pictures.on_axes(Panel("", over, label, lines), ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each place: the parameter, frequency in Hz, height in m, whose peak it is,
        whether the way does not lead there, whether it is fitted. Raises InputError where pandas is
        not installed."""
        columns: dict[str, Any] = {
            self.over: self.parameter,
            "frequency": self.frequency,
            "height": self.height,
            "peak_of": self.peak_of,
            "jump": self.jumps,
            "fitted": self.fitted,
        }
        return tables.frame(columns, "place")

    def to_xarray(self) -> "xarray.Dataset":
        """The arrays of the branch by place, output, harmonic and contact, with their units. Raises
        InputError where xarray is not installed."""
        return tables.places_as_dataset(self)

    def _repr_html_(self) -> str:
        p, h = self.parameter, self.height
        rows = {
            f"{which} height": f"{h[i]:.4g} m at {self.over} {p[i]:.6g}, {self.frequency[i]:.6g} Hz"
            for which, i in (("lowest", h.argmin()), ("largest", h.argmax()))
        }
        rows |= {"places": f"{len(self)}", "harmonics": f"{self.H}", "ended": self.ended}
        caption = f"{self.what} of '{self.output}' over {self.over}".capitalize()
        return tables.notebook_table(caption, rows)

    def save(self, path: str | Path) -> Path:
        """One .npz of plain arrays."""
        return save_npz(path, **vars(self))

    @classmethod
    def load(cls, path: str | Path) -> "Followed":
        """Read what `save` wrote; InputError where the file is not there or holds something
        else."""
        return read_record(cls, path, "followed peaks", "what Followed.save writes")
