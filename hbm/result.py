"""ForcedResponse: a curve of periodic solutions as read-only arrays."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm import fourier, influence, tables
from tipdamp.hbm.amplitude import KINDS, amplitude, local_maxima, orders_of, parabola_top
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.influence import Derivatives
from tipdamp.hbm.io.array_files import save_npz
from tipdamp.hbm.io.array_record import ArrayRecord, column_of, read_record
from tipdamp.hbm.named_point import NamedPoint, as_table, from_table
from tipdamp.hbm.periodic_solution import PeriodicSolution
from tipdamp.hbm.validation import check_whole, in_hz, positive

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

SOLVED = 1e-8  # of the amplitude: to what peaks are solved
MOVES = 1e-6  # of the cycle, above which a pair slips or is open
DOUBTFUL = 0.1  # of the vibration: a larger estimate of the truncation is no estimate
NOT_SEARCHED = "not looked for further curves"
FACTOR = "factor"  # unit of what scales a quantity of the problem
SEARCH_STOPPED = "stopped after"  # of a search that did not look everywhere
OF_POINT = (  # arrays of a curve that a point of it has a row of
    "harmonics",
    "contact_motion",
    "share_stick",
    "share_slip",
    "share_open",
    "dissipated",
    "unknowns",
)


def in_words(parameter: str, unit: str) -> str:
    """Name of what varies: 'mu factor' where its values are factors on mu."""
    return f"{parameter} {FACTOR}" if unit == FACTOR else parameter


def _none(*shape: int, dtype: type = float) -> Any:
    return field(default_factory=lambda: np.empty(shape, dtype))


def _row_if_known(known: np.ndarray, i: int) -> np.ndarray:
    """What is known of a point; empty where it is of none."""
    return known[i] if known.size else np.empty(0, known.dtype)


@dataclass(frozen=True, eq=False)
class ForcedResponse(ArrayRecord):
    """A branch of periodic solutions: n points, m outputs, P contact pairs, harmonics 0..H, a model
    with r dofs.

    The arrays are copies that cannot be written to; two curves are equal where all but `seconds`
    is.

    frequency : (n,) Hz, in the order of the branch (not monotone where it folds)
    output_names : (m,) str
    harmonics : (n, m, H+1) complex, m - x(t) = X0 + Re sum X_k exp(i k w t); NaN where a point
    failed
    parameter_name, parameter : what varies along the branch, and its (n,) values: 'frequency' in
        Hz, or another parameter at one frequency (see `tipdamp.hbm.balance.parameter`);
        parameter_unit : of these, '' without, 'factor' where they are factors on what the problem
        has
    share_stick, share_slip, share_open : (n, P) share of the cycle; of a law without sliders a
        contact that loses energy slips wherever it is closed; all 0 of a force that is no contact
    dissipated : (n, P) J per cycle, over all components of the law
    converged : (n,) bool; iterations : (n,) evaluations of the residual
    ended : why the curve ends, with the remedy; complete : it covers the band without a failed
    point
    further : what is known of solutions at the end of the band that the branch does not reach
        inside it, in words; empty where none was found (see `tipdamp.hbm.curve.band_end`)
    end_confirmed : whether the solution at the end of the band to which the linear response leads
        is that of the curve
    searched : what was looked for beside the curve and found, in words (see `curves_beside`)
    reached_end : the end of the band, perhaps past failed points; a curve that did not has no peak
    periods : of the excitation in one of the motion, of whose orders `harmonics` are: 1, or that of
        a subharmonic curve; the frequency is always that of the excitation
    H, origin, start : harmonics; 'preloaded' or 'unloaded'; 'zero_slider', 'zero_force' or 'given'
    force_residual : (n,) residual of the equation of motion with the contact law on the motion of
        each point, over the force scale (see `tipdamp.hbm.curve.equilibrium`); at most 5e-9, or
        with the rounding of stiff contacts 1e-8, or that of the given matrices (more, said by
        `ended` with what the vibration is known to), NaN where a point failed
    energy_error : (n,) of the energies of a period, input = damping + friction, relative to the
        input; friction by the slip of the contacts; NaN where a point failed
    truncation : (n, m) m, estimate of what the orders above H (and more samples) would change in
        the vibration of an output, as root mean square over a cycle (see
        `tipdamp.hbm.curve.truncation`); NaN where a point failed, infinite where its Jacobian is
        singular, empty where it was not asked for
    multipliers : (n, 4) complex, the leading Floquet multipliers of each point, the largest first
        (see `tipdamp.hbm.stability`); NaN where there are no more, where a point failed, or where
        the law does not say how its force follows a disturbance; empty where they were not asked
        for
    named_points : where the curve folds, changes its stability, or a contact begins to slip or
        opens (see `named_points`), in the order of the curve; empty where the stability of all
        points was not asked for
    derivatives : {output: Derivatives} of its highest peak, where they were asked for
    seconds, residual_calls : cost; the calls are those of the continuation
    restarts : (k, 2) parameters at which a branch that folds without progress was left, and at
        which a solution further ahead was taken up; between them there may be points solved one
        from the other, or none; empty for one branch
    contact_force : (n, P, nd, H+1) complex, N - force of the damper on the blade in the order of
        the law; empty unless asked for
    held : (h,) str, the rigid motions that are held
    reaction : (n, h, H+1) complex, N or N m - force on what holds them, beside the one of the
    preload
    held_change : largest relative change of the peak and the mean reactions at it when the springs
        that hold are ten times as stiff, these as a share of the excitation where that is larger; 0
        without such springs, NaN where that was not solved
    held_reaction_change : of mean reactions that follow the stiffness, as a share of themselves:
        near 0.9 where sticking contacts carry them, else 0
    peak_points : (n, m) bool, the points solved at the largest half peak to peak of an output;
    empty in other curves

    What the functions of a curve and its problem need (`solutions_at`, `find_peaks`, `compare`):

    unknowns : (n, N) m - real coefficients of the relative motion of the carrying contacts, contact
    by contact
    carrying : (P,) bool, the contacts that take part
    force_orders, forces : (k,) int and (k, r) complex, N - the forcing; output_rows : (m, r)
    orientation : (n,) of the branch at each point (see `tipdamp.hbm.continuation.point`)
    jumps : (n,) bool, points to which the branch does not lead from the point before: taken up
    after it was left
    slider_start : (P', nt) m, where the sliders start, if 'given'; samples : of a cycle

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> hz, height = curve.peak("tip")
    >>> print(f"{hz:.1f} Hz, slip in {curve.share_slip[curve.frequency == hz].item():.0%}")
    858.6 Hz, slip in 25%
    >>> ForcedResponse.load(curve.save("curve.npz")) == curve
    True
    """

    frequency: np.ndarray
    output_names: np.ndarray
    harmonics: np.ndarray
    parameter_name: str
    parameter: np.ndarray
    share_stick: np.ndarray
    share_slip: np.ndarray
    share_open: np.ndarray
    dissipated: np.ndarray
    converged: np.ndarray
    iterations: np.ndarray
    ended: str
    complete: bool
    H: int
    origin: str
    start: str
    seconds: float = field(compare=False)
    residual_calls: int
    restarts: np.ndarray = _none(0, 2)
    contact_force: np.ndarray = _none(0, 0, 0, 0, dtype=complex)
    held: np.ndarray = _none(0, dtype=str)
    reaction: np.ndarray = _none(0, 0, 0, dtype=complex)
    held_change: float = 0.0
    held_reaction_change: float = 0.0
    peak_points: np.ndarray = _none(0, 0, dtype=bool)
    unknowns: np.ndarray = _none(0, 0)
    carrying: np.ndarray = _none(0, dtype=bool)
    force_orders: np.ndarray = _none(0, dtype=int)
    forces: np.ndarray = _none(0, 0, dtype=complex)
    output_rows: np.ndarray = _none(0, 0)
    slider_start: np.ndarray = _none(0, 0)
    orientation: np.ndarray = _none(0)
    jumps: np.ndarray = _none(0, dtype=bool)
    samples: int = 0
    reached_end: bool = False
    further: str = ""
    end_confirmed: bool = False
    searched: str = NOT_SEARCHED
    force_residual: np.ndarray = _none(0)
    energy_error: np.ndarray = _none(0)
    truncation: np.ndarray = _none(0, 0)
    multipliers: np.ndarray = _none(0, 0, dtype=complex)
    periods: int = 1
    named_points: tuple[NamedPoint, ...] = ()
    derivatives: dict[str, Derivatives] = field(default_factory=dict)
    parameter_unit: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "reached_end", self.reached_end or self.complete)
        if not np.size(self.jumps):
            object.__setattr__(self, "jumps", np.zeros(len(self.parameter), dtype=bool))
        super().__post_init__()

    def __repr__(self) -> str:
        f, failed = self.parameter, int((~self.converged).sum())
        over = (
            f"{f.min():g} to {f.max():g} Hz"
            if self.parameter_name == "frequency"
            else f"{self.over} {f.min():g} to {f.max():g} at {self.frequency[0]:g} Hz"
        )
        pairs = int(tables.in_contact(self.share_stick, self.share_slip, self.share_open).sum())
        moving = len(self.slipping_pairs)
        contacts = f"{moving} of {pairs} pairs slip or open, " if pairs else ""
        return (
            f"<ForcedResponse: {over}, {len(f)} points ({failed} failed), output_names "
            f"{', '.join(self.output_names)}; {contacts}H = {self.H}; {self.ended}>"
        )

    def __len__(self) -> int:
        return len(self.parameter)

    def __bool__(self) -> bool:
        return True  # a curve without a point is a curve

    @overload
    def __getitem__(self, i: int) -> "PeriodicSolution": ...

    @overload
    def __getitem__(self, i: slice) -> "list[PeriodicSolution]": ...

    def __getitem__(self, i: int | slice) -> "PeriodicSolution | list[PeriodicSolution]":
        """The solution of a point of the curve, counted from 0, or from the last with -1; those of
        a slice as a list."""
        if isinstance(i, slice):
            return [self[k] for k in range(len(self))[i]]
        if not -len(self) <= index(i) < len(self):
            raise IndexError(f"point {i}: the curve has the points 0 to {len(self) - 1}")
        i = range(len(self))[index(i)]
        P = len(self.carrying)
        forces = self.contact_force[i] if self.contact_force.size else np.empty((P, 0, self.H + 1))
        at_point: dict[str, Any] = {name: getattr(self, name)[i] for name in OF_POINT}
        at_point |= {
            name: _row_if_known(vars(self)[name], i) for name in ("truncation", "multipliers")
        }
        return PeriodicSolution(
            frequency=float(self.frequency[i]),
            output_names=tuple(self.output_names.tolist()),
            held=tuple(self.held.tolist()),
            reaction=self.reaction[i] if len(self.reaction) else np.empty((0, self.H + 1)),
            contact_force=forces,
            converged=bool(self.converged[i]),
            iterations=int(self.iterations[i]),
            force_orders=tuple(self.force_orders.tolist()),
            force_residual=float(self.force_residual[i] if self.force_residual.size else np.nan),
            periods=self.periods,
            stable=bool(self.stable[i]),
            unstable=bool(self.unstable[i]),
            **at_point,
        )

    def __iter__(self) -> Iterator["PeriodicSolution"]:
        return (self[i] for i in range(len(self)))

    def at(
        self, value: float | None = None, which: int | None = None, *, omega: float | None = None
    ) -> "PeriodicSolution":
        """The computed point nearest to a frequency in Hz, or omega in rad/s, or to another
        parameter along the curve: its `frequency` is not the value. `solutions_at(curve, problem,
        value)` solves at the very value, and lists all solutions where the curve folds.

        which : of the crossings, 0 for the first along the curve, where it crosses the value
            several times
        Raises InputError outside the curve, and where `which` is missing or none.
        """
        value = positive("value", along(self, value, omega))
        if which is not None:
            check_whole("which", which, 0)
        p, known = self.parameter, self.converged
        passed = (p[:-1] - value) * (p[1:] - value) <= 0
        passed &= known[:-1] & known[1:] & ~self.jumps[1:]
        begins = np.flatnonzero(passed)
        nearer = begins + (np.abs(p[begins + 1] - value) < np.abs(p[begins] - value))
        points = list(dict.fromkeys(nearer.tolist()))
        if not points:
            raise InputError(
                f"value = {value:g}: no solved part of the curve passes it; its points lie from "
                f"{p.min():g} to {p.max():g}"
            )
        if which is None and len(points) > 1:
            sizes = ", ".join(f"{a:.3g}" for a in self.amplitude()[points].max(axis=1))
            raise InputError(
                f"value = {value:g}: the curve passes it {len(points)} times, with amplitudes "
                f"{sizes} m; say which = 0 to {len(points) - 1}"
            )
        if not 0 <= (which or 0) < len(points):
            raise InputError(f"which = {which}: the curve passes {value:g} {len(points)} times")
        return self[points[which or 0]]

    def plot(
        self,
        *names: str,
        kind: str = "half_peak_to_peak",
        order: int | None = None,
        unit: str = "m",
        label: str | None = None,
        color: str | None = None,
        width: float = 1.6,
        ax: "Axes | None" = None,
    ) -> "Axes":
        """Draw amplitudes of outputs along the curve, as the report does: unstable parts dashed,
        folds, changes of stability and of contacts marked, a hollow circle at the solved peak,
        shaded what the harmonics left out may change by estimate.

        names : of outputs, all without any; kind, order : as in `amplitude`
        unit : 'm', 'mm' or 'um'; label : instead of the names; color : of matplotlib, one for all
        ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed, and for an unknown
        output.
        """
        drawn = names or tuple(self.output_names.tolist())
        styles = [
            (label or name, color or pictures.free_color(ax, k), width)
            for k, name in enumerate(drawn)
        ]
        return pictures.response(self, drawn, (kind, order), unit, styles, ax)

    def to_pandas(
        self, kind: str = "half_peak_to_peak", order: int | None = None
    ) -> "pandas.DataFrame":
        """A row for each point: frequency in Hz (and another parameter), the amplitude of each
        output in m, energy that the contacts dissipate in J, whether it is solved; `stable` (None
        where that is not known) and `relative_truncation` where the curve has them. kind, order :
        as in `amplitude`. Raises InputError where pandas is not installed."""
        return tables.as_frame(self, kind, order)

    def to_xarray(self) -> "xarray.Dataset":
        """The arrays of the curve by point, output, harmonic and contact, with their units; shares
        of the cycle where something is a contact. Raises InputError where xarray is not
        installed."""
        return tables.as_dataset(self)

    def _repr_html_(self) -> str:
        p, over = self.parameter, self.over
        rows = {
            "band": f"{p.min():g} to {p.max():g}" + " Hz" * (over == "frequency"),
            "points": f"{len(self)}, {int((~self.converged).sum())} failed",
            "harmonics": f"{self.H}",
            "ended": self.ended,
        }
        for name in self.output_names.tolist():
            at, height = self.at_least(name)
            rows[f"largest of {name}"] = f"{height:.4g} m at {at:.6g}"
        for kind in dict.fromkeys(one.kind for one in self.named_points):
            places = (f"{one.parameter:.6g}" for one in self.named_points if one.kind == kind)
            rows[kind] = f"at {', '.join(places)}"
        return tables.notebook_table(f"Forced response over {over}", rows)

    def amplitude(self, kind: str = "half_peak_to_peak", order: int | None = None) -> np.ndarray:
        """(n, m) amplitude, m: 'half_peak_to_peak' of the whole cycle, 'rms' of the vibration, or
        'harmonic'.

        order : of the harmonic |X_k|; None takes that of the force, and of a force of several
            orders the root of the sum of the squares |X_k|^2
        Raises InputError for another kind, and for an order that is not one of 1..H or is given for
        another kind.
        """
        return amplitude(self.harmonics, kind, orders_of(kind, order, self.H, self.force_orders))

    def column(self, name: str) -> int:
        """Column of an output; InputError where there is none of that name."""
        return column_of(name, self.output_names, "response")

    def peak(
        self, name: str, kind: str = "half_peak_to_peak", order: int | None = None
    ) -> tuple[float, float]:
        """(Hz, m) largest amplitude of an output; over another parameter, (value of that, m).

        kind, order : as in `amplitude`
        Solved to 1e-8 of the amplitude, else with a warning that says why not (`why_unsolved`): the
        largest amplitude of the computed points then stands for it. A measured curve has the
        parabola through its three highest points. A curve that stopped before the end of its band,
        or whose largest amplitude lies beside a failed point, has no peak: (NaN, NaN), with a
        warning that gives `at_least` and the reason.
        """
        a = self._amplitudes(name, kind, order)
        reason = self._why_no_peak(a)
        if reason:
            warnings.warn(f"no peak of '{name}': {reason}", Doubt, stacklevel=2)
            return float("nan"), float("nan")
        doubt = self.why_unsolved(name, kind, order)
        if doubt:
            warnings.warn(f"peak of '{name}': {doubt}", Doubt, stacklevel=2)
        i = int(np.nanargmax(a))
        if self.peak_points.size or not 0 < i < len(a) - 1:
            return float(self.parameter[i]), float(a[i])
        return parabola_top(self.parameter[i - 1 : i + 2], a[i - 1 : i + 2])

    def _amplitudes(self, name: str, kind: str, order: int | None) -> np.ndarray:
        """(n,) of an output."""
        return self.amplitude(kind, order)[:, self.column(name)]

    def why_unsolved(
        self, name: str, kind: str = "half_peak_to_peak", order: int | None = None
    ) -> str:
        """Why the largest amplitude of an output is no solved maximum, in words; empty where it is
        one.

        Half peak to peak is solved with the curve; `tipdamp.hbm.curve.peaks.find_peaks` solves the
        other kinds. The largest amplitude at the border of a frequency band is no resonance; over
        another parameter it is as good as any.
        """
        a, j = self._amplitudes(name, kind, order), self.column(name)
        if not self.peak_points.size or not np.nanmax(a, initial=0.0) > 0:
            return ""
        i = int(np.nanargmax(a))
        if self.at_border(name, kind, order):
            return self._why_at_border(a, i) if self.parameter_name == "frequency" else ""
        if self.jumps[i : i + 2].any():
            return (
                "its largest amplitude lies where the branch was left and taken up again: it is "
                "not solved, and the points left out may exceed it"
            )
        if kind != KINDS[0]:
            return (
                "the largest of the computed points, not solved: find_peaks(curve, problem, "
                f"'{name}', '{kind}') solves it"
            )
        solved = a[self.peak_points[:, j]]
        if (solved >= (1 - SOLVED) * a[i]).any():  # of two solved peaks one is highest by rounding
            return ""
        return "the maximum is not solved, the highest point found stands for it"

    def _why_at_border(self, a: np.ndarray, i: int) -> str:
        said = (
            f"its largest amplitude lies at the border of the band, {self.parameter[i]:g} Hz; the "
            "resonance may be outside, widen the band"
        )
        inside = local_maxima(a, self.jumps)
        if not inside:
            return said
        top = inside[np.argmax(a[inside])]
        return (
            f"{said} (inside, the highest maximum is {a[top]:.4g} at {self.parameter[top]:.6g} Hz)"
        )

    def at_least(
        self, name: str, kind: str = "half_peak_to_peak", order: int | None = None
    ) -> tuple[float, float]:
        """(Hz, m) of the solved point with the largest amplitude of an output; over another
        parameter, (value, m).

        A lower bound of the peak, whether the curve has one or not; (NaN, NaN) where no point is
        solved.
        """
        a = self._amplitudes(name, kind, order)
        if not np.isfinite(a).any():
            return float("nan"), float("nan")
        i = int(np.nanargmax(a))
        return float(self.parameter[i]), float(a[i])

    def _why_no_peak(self, a: np.ndarray) -> str:
        """Why the largest of the amplitudes a (n,) is no peak, with what it is at least; empty
        where it is one."""
        if not np.isfinite(a).any():
            return f"no point is solved, {self.ended}"
        i = int(np.nanargmax(a))
        gap = not np.isfinite(a[max(i - 1, 0) : i + 2]).all()
        if self.reached_end and not gap:
            return ""
        at = (
            f"at {self.parameter[i]:g} Hz"
            if self.parameter_name == "frequency"
            else f"at {self.over} = {self.parameter[i]:g}"
        )
        return f"at least {a[i]:.6g} m {at}, " + (
            f"beside a point that failed: {self.ended}" if self.reached_end else self.ended
        )

    def at_border(
        self, name: str, kind: str = "half_peak_to_peak", order: int | None = None
    ) -> bool:
        """Whether the largest amplitude of an output is that of an end of the curve: then `peak` is
        no resonance."""
        a = self._amplitudes(name, kind, order)
        good = np.flatnonzero(np.isfinite(a))
        return bool(len(good) and a[good].max() > 0 and a[good].argmax() in (0, len(good) - 1))

    @property
    def relative_truncation(self) -> np.ndarray:
        """(n,) largest `truncation` over the outputs, of the largest vibration of an output at that
        point, both as root mean square; empty where there is none. Above `DOUBTFUL` it is large,
        how large is not known: the correction is then none of first order, as beside a fold."""
        if not self.truncation.size:
            return np.empty(0)
        largest = self.amplitude("rms").max(axis=1, initial=0.0)
        change = self.truncation.max(axis=1, initial=0.0)
        return np.divide(change, largest, out=np.zeros_like(change), where=change > 0)

    @property
    def doubtful(self) -> np.ndarray:
        """(n,) bool: `truncation` is no estimate, or there is none."""
        if not self.truncation.size:
            return np.ones(len(self), dtype=bool)
        return ~(self.relative_truncation <= DOUBTFUL)

    def peak_truncation(self, name: str) -> float:
        """Estimated `truncation` of an output where its half peak to peak is largest, of its
        vibration there, both as root mean square; NaN where there is none."""
        j = self.column(name)
        a = self.amplitude()[:, j]
        if not self.truncation.size or not np.nanmax(a, initial=0.0) > 0:
            return float("nan")
        i = int(np.nanargmax(a))
        return float(self.truncation[i, j] / self.amplitude("rms")[i, j])

    @property
    def alike_backwards(self) -> bool:
        """Whether the band followed from its other end would be this curve again: its solution
        there is found from the linear response, too, and it is one whole branch."""
        whole = self.complete and not len(self.restarts) and not self.jumps.any()
        return whole and self.end_confirmed and not self.further

    @property
    def stable(self) -> np.ndarray:
        """(n,) bool: every disturbance of the point dies out. False, too, where `multipliers` are
        not known, or more harmonics would change the motion by more than can be estimated."""
        return self._largest_multiplier < 1

    @property
    def unstable(self) -> np.ndarray:
        """(n,) bool: a disturbance of the point grows; False, too, where that is not known, as in
        `stable`."""
        return self._largest_multiplier > 1

    @property
    def _largest_multiplier(self) -> np.ndarray:
        """(n,) modulus, NaN where it is not known."""
        if not self.multipliers.size:
            return np.full(len(self.frequency), np.nan)
        modulus = np.abs(self.multipliers[:, 0])
        if self.truncation.size:
            modulus[self.doubtful] = np.nan
        return modulus

    @property
    def contact_motion(self) -> np.ndarray:
        """(n, P, nd, H+1) complex, m - relative motion of each pair; zero of pairs that do not take
        part."""
        n, P, kept = len(self.frequency), len(self.carrying), int(self.carrying.sum())
        nd = self.unknowns.shape[1] // max(kept * fourier.n_real(self.H), 1)
        motion = np.zeros((n, P, nd, self.H + 1), dtype=complex)
        motion[:, self.carrying] = fourier.to_complex(
            self.unknowns.reshape(n, kept, nd, fourier.n_real(self.H))
        )
        return motion

    @property
    def widest_gap(self) -> float:
        """Of the parameter, between the neighbouring solved points furthest apart where the branch
        was left; 0 where it is one branch."""
        return widest_gap(self.parameter, self.converged, self.restarts)

    @property
    def slipping_pairs(self) -> np.ndarray:
        """Indices of the pairs that slip or open anywhere in the band; not of those that stay open
        all along, as where they are open at rest."""
        slips = np.nanmax(self.share_slip, axis=0, initial=0.0) > MOVES
        opens = np.nanmax(self.share_open, axis=0, initial=0.0) > MOVES
        closes = np.nanmin(self.share_open, axis=0, initial=1.0) < 1 - MOVES
        return np.flatnonzero(slips | opens & closes)

    @property
    def over(self) -> str:
        """What varies, for axes and tables: 'mu factor' where the values are factors on mu."""
        return in_words(self.parameter_name, self.parameter_unit)

    @property
    def opening_pairs(self) -> np.ndarray:
        """Indices of the pairs that open anywhere in the band."""
        return np.flatnonzero(np.nanmax(self.share_open, axis=0, initial=0.0) > MOVES)

    def save(self, path: str | Path) -> Path:
        """One .npz of plain arrays."""
        tables_of = {
            "named_points": as_table(self.named_points, len(self.output_names)),
            "derivatives": influence.as_table(self.derivatives),
        }
        return save_npz(path, **vars(self) | tables_of)

    @classmethod
    def load(cls, path: str | Path) -> "ForcedResponse":
        """Read what `save` wrote; InputError where the file is not there or holds something
        else."""
        what = "a forced response as ForcedResponse.save writes it"
        return read_record(cls, path, "forced response", what, _from_tables)


def _from_tables(found: dict[str, Any]) -> dict[str, Any]:
    """Fields of a curve, its named points and derivatives from their tables; older files have
    none."""
    for name, read in (("named_points", from_table), ("derivatives", influence.from_table)):
        if name in found:
            found[name] = read(found[name])
    return found


def widest_gap(parameter: ArrayLike, converged: ArrayLike, restarts: ArrayLike) -> float:
    """Between the neighbouring solved points furthest apart in any of the restarts (k, 2); 0
    without any."""
    solved = np.asarray(parameter)[np.asarray(converged)]
    return max(
        (
            float(
                np.diff(np.unique([low, *solved[(low < solved) & (solved < high)], high])).max(
                    initial=0.0
                )
            )
            for low, high in np.sort(np.reshape(restarts, (-1, 2)), axis=1)
        ),
        default=0.0,
    )


def along(curve: ForcedResponse, value: float | None, omega: float | None) -> Any:
    """A value of the parameter of a curve, or in its place a frequency in rad/s, in Hz."""
    if omega is not None and curve.parameter_name != "frequency":
        raise InputError(f"omega: the curve runs over {curve.parameter_name}; give value")
    return in_hz("value", value, omega)
