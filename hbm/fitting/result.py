"""Measured responses that a fit takes, and what it finds."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm import tables
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.drawing.figure import Curve, Item, Marks, Panel
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import numbers, positive

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

MOST_MISFIT = 0.05  # above what scatter of a measurement is, a root mean square


@dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """A measured response at one level of the force.

    hz : (n,) Hz
    response : (n,) m - amplitude at the frequency of the force, or complex with its phase
    output : (r,) - row of what was measured, or (m, r), of which the largest amplitude counts
    level : factor on the force of the fit
    deviation : (n,) m or one number - standard deviation, by which the points are weighted;
        default: the same at all points of a curve, in proportion to its largest
    Raises InputError where these do not fit.

    >>> MeasuredResponse([700.0, 720.0], [1e-5, 2e-5], [1.0], level=5.0).values
    2
    """

    hz: np.ndarray
    response: np.ndarray
    output: np.ndarray
    level: float = 1.0
    deviation: "ArrayLike | None" = None

    def __post_init__(self) -> None:
        hz = np.atleast_1d(numbers("hz", self.hz, "must be frequencies in Hz"))
        response = np.atleast_1d(np.asarray(self.response))
        rows = np.atleast_2d(numbers("output", self.output, "must be a row (r,)"))
        if hz.shape != response.shape or hz.ndim != 1:
            raise InputError(
                f"measured response: hz is {hz.shape} and response {response.shape}, both must be "
                "(n,)"
            )
        if not (np.isfinite(hz).all() and (hz > 0).all() and np.isfinite(response).all()):
            raise InputError("measured response: hz must be above 0, and all values finite")
        if not response.any():
            raise InputError("measured response: all amplitudes are 0")
        if np.iscomplexobj(response) and len(rows) > 1:
            raise InputError("measured response: with its phase it is of one output, a row (r,)")
        positive("level", self.level, "")
        size = np.abs(response).max() if self.deviation is None else self.deviation
        deviation = np.broadcast_to(np.asarray(size, dtype=float), hz.shape)
        if not (deviation > 0).all():
            raise InputError("measured response: deviation must be above 0")
        order = np.argsort(hz)
        for name, value in {"hz": hz, "response": response, "deviation": deviation}.items():
            object.__setattr__(self, name, value[order])
        object.__setattr__(self, "output", rows)

    @property
    def values(self) -> int:
        """Real numbers that were measured."""
        return len(self.hz) * (1 + np.iscomplexobj(self.response))

    def within(self, low: float, high: float) -> "MeasuredResponse":
        """The part in a band; InputError where there is none."""
        inside = (self.hz >= low) & (self.hz <= high)
        if not inside.any():
            raise InputError(
                f"measured response from {self.hz[0]:g} to {self.hz[-1]:g} Hz: no point lies in "
                f"the band {low:g} to {high:g} Hz"
            )
        deviation = np.asarray(self.deviation)[inside]
        return MeasuredResponse(
            self.hz[inside], self.response[inside], self.output, self.level, deviation
        )


@dataclass(frozen=True, eq=False)
class DampingFit:
    """What a fit to measured responses has found.

    names (p,); values, low, high, start (p,) : damping ratios, and factors on mu ('mu'), on kn and
        kt ('stiffness') or on a measured curve; low to high is the 95 % interval, from the scatter
        about the fit: by the derivatives there, of a factor on the contacts also as far as other
        values of it fit as well
    measured : the measured responses, in the band; computed : for each of them (n,) m, as it was
        measured, at its frequencies
    misfit : for each of them the root mean square of the difference, weighted by the deviations,
        relative to its largest
    iterations; converged : whether the last step was small
    problem : with the values found
    weak : names of the factors on the contacts of which values beyond the derivatives' interval, or
        twice and half of what was found, fit as well

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> curve = damped.force(0, 5.0).follow_band((600, 1000), outputs={"tip": 0})
    >>> hz = curve.frequency[::2]
    >>> run = MeasuredResponse(hz, abs(curve.harmonics[::2, 0, 1]), [1.0], level=5.0)
    >>> from dataclasses import replace
    >>> guess = replace(damped.contact_problem, damping_ratio=0.02)
    >>> found: DampingFit = fit_damping(guess, [1.0], [run])
    >>> found.names, f"{found.values[0]:.4f}"
    (('damping ratio',), '0.0100')
    """

    names: tuple[str, ...]
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    measured: tuple[MeasuredResponse, ...]
    computed: tuple[np.ndarray, ...]
    misfit: tuple[float, ...]
    iterations: int
    converged: bool
    problem: ContactProblem
    weak: tuple[str, ...] = ()

    @property
    def doubts(self) -> tuple[str, ...]:
        """Sentences where the values found are to be doubted, whatever their intervals."""
        found: tuple[str, ...] = ()
        if not self.converged:
            found = ("the fit has not converged: values are doubtful",)
        for name, low, high in zip(self.names, self.low, self.high, strict=True):
            if name in self.weak:
                found += (
                    f"{name} is weakly determined: factors from {low:.2g} to {high:.2g} fit the "
                    "measured curves as well within their scatter; measure at a level at which "
                    "more contacts slip",
                )
        worst = int(np.argmax(self.misfit))
        if self.misfit[worst] <= MOST_MISFIT:
            return found
        return (
            *found,
            f"measured curve {worst + 1} is {self.misfit[worst]:.0%} of its largest amplitude away "
            "from the fit (root mean square): the model is not that of the measurement, and its "
            "intervals do not hold the truth; check the level, the place, the direction and what "
            "is held fast, and whether the curve has points of two branches beside a fold: those "
            "that no sweep passes belong to none",
        )

    def __str__(self) -> str:
        """A line for each unknown."""
        return "\n".join(f"{name} {said}" for name, said in self._said().items())

    def _said(self) -> dict[str, str]:
        rows = zip(self.names, self.values, self.low, self.high, self.start, strict=True)
        return {
            name: f"{value:.4g} ({low:.4g} to {high:.4g}), from {start:.4g}"
            for name, value, low, high, start in rows
        }

    def plot(self, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw the amplitudes: hollow circles as measured, lines as the fit computes them.

        unit : 'm', 'mm' or 'um'; ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed.
        """
        factor, items = pictures.factor_of(unit), list[Item]()
        for k, (one, found) in enumerate(zip(self.measured, self.computed, strict=True)):
            color, of = pictures.free_color(ax, k), f"at level {one.level:g}"
            y = factor * np.abs(one.response)
            items.append(Marks(one.hz, y, "", color, filled=False, size=4.0))
            items.append(Curve(one.hz, factor * np.abs(found), f"fit {of}", color))
        label = f"harmonic ({pictures.SHOWN[unit]})"
        return pictures.on_axes(Panel("", "frequency (Hz)", label, tuple(items)), ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each unknown: its name, value, the ends of its interval and what it started
        from. Raises InputError where pandas is not installed."""
        columns: dict[str, Any] = {"unknown": list(self.names)}
        columns |= {name: vars(self)[name] for name in ("values", "low", "high", "start")}
        return tables.frame(columns, "row")

    def _repr_html_(self) -> str:
        rows = self._said() | {"misfit": ", ".join(f"{one:.2%}" for one in self.misfit)}
        return tables.notebook_table("Fit to measured responses", rows)
