"""Forced responses from a backbone: one nonlinear mode, all others stuck and linear.

At the amplitude of a free motion with shape psi, frequency w0 and damping ratio zeta a force F
excites it at W where

    (w0^2 - W^2 + 2 i w0 (zeta_s W + zeta_c w0)) psi^H M psi exp(i theta) = psi^H F

with two solutions below the peak, one at it and none above [Krack 2015; Schwarz, Krack, Thouverez
2019, with one viscous ratio zeta]. zeta_s is that of the structure, zeta_c = zeta - zeta_s what the
contacts add: a hysteresis does the same work at any frequency.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from tipdamp.hbm import fourier, tables
from tipdamp.hbm.amplitude import amplitude
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import correct
from tipdamp.hbm.continuation.point import Metric, Plane
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_record import ArrayRecord, column_of
from tipdamp.hbm.modes.backbone import mode_equation
from tipdamp.hbm.modes.free_motion import ModeEquation
from tipdamp.hbm.modes.result import Backbone
from tipdamp.hbm.modes.stuck_modes import StuckModalSystem, stuck_modes
from tipdamp.hbm.validation import brief, check_forcing, numbers

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

FINER = 20  # places between two points of the backbone
NEARER = 0.5 ** np.arange(1, 12)  # of the last way to the peak: places on it
NEWTON = 20  # steps for a frequency
SOLVED = 1e-9  # what is left of W / w0
SLOW = 1e-9  # of a contact force: less of it does not depend on the speed
SAME = 1e-6  # of a stuck frequency: by more it is another problem
SOLVES = 1e-3  # residual of a free motion, whose samples are not known: by more likewise
STILL = 1e-6  # of the motion of the contacts: with less one has no stiffness in that motion
SHORT = "the backbone ends below the amplitude of the peak: give it larger ones"
OVERLAP = 0.1  # of an output at phase resonance: more of it from other modes is told
# damping ratio of the contacts: with more the amplitude, and with it shape and stiffness, differ
# much between phase resonance and peak
MUCH = 0.2
OFF = 0.01  # of a peak: by more it is told to be too high or too low
AROUND = (0.995, 0.98, 0.95, 0.9, 0.8, 0.7)  # of the amplitude of the mode at its peak: places
NEARBY = 0.01  # of the frequency: a unit of arc length along the way
# of the residual there: a per cent of a peak is told
ROUGH = Settings(tolerance=1e-5, max_iterations=30, max_stalls=6)


@dataclass(frozen=True, eq=False)
class Synthesis(ArrayRecord):
    """A forced response made of a nonlinear mode and the linear ones beside it: n places, from low
    to high amplitude and back, m outputs.

    frequency : (n,) Hz; output_names : (m,) str; harmonics : (n, m, H+1) complex, m
    others : (n, m) share of harmonic 1 that is of the other modes
    top : place of phase resonance, where the mode has its largest amplitude
    peak_reached : whether the backbone reaches the amplitude of the peak
    said : how much the peak is too high or too low, where by more than 1 %; where other modes
        overlap, stuck or as the contacts are at the peak, or the contacts damp much; empty where
        this mode rules

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> mode = backbone(damped, 1, (1e-7, 1e-3), outputs={"tip": [1.0]})
    >>> made: Synthesis = synthesis(mode, damped, np.array([5.0]))
    >>> print(f"{made.peak('tip')[0]:.1f} Hz")  # the forced peak lies at 858.6 Hz
    858.6 Hz
    """

    frequency: np.ndarray
    output_names: np.ndarray
    harmonics: np.ndarray
    others: np.ndarray
    top: int
    peak_reached: bool
    said: str

    def __repr__(self) -> str:
        name = str(self.output_names[0])
        hz = self.frequency
        top = "{1:.4g} m at {0:.6g} Hz".format(*self.peak(name)) if self.peak_reached else "none"
        said = f"; {self.said}" if self.said else ""
        return (
            f"<Synthesis of {len(hz)} places, {hz.min():.6g} to {hz.max():.6g} Hz: peak of "
            f"'{name}' {top}{said}>"
        )

    def amplitude(self, kind: str = "half_peak_to_peak") -> np.ndarray:
        """(n, m) m, of a kind as in `ForcedResponse.amplitude`."""
        return amplitude(self.harmonics, kind, [1])

    def peak(self, name: str, kind: str = "half_peak_to_peak") -> tuple[float, float]:
        """(Hz, m) of the peak of the mode: the maximum uphill from its phase resonance; NaN where
        the backbone does not reach it. Another one further away is that of a linear mode."""
        j = column_of(name, self.output_names, "synthesis")
        if not self.peak_reached:
            return float("nan"), float("nan")
        a = self.amplitude(kind)[:, j]
        i = self.top
        for step in (-1, 1):
            while 0 <= i + step < len(a) and a[i + step] > a[i]:
                i += step
        return float(self.frequency[i]), float(a[i])

    def plot(self, name: str | None = None, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw half of peak to peak of an output, as it stands among the curves of a forced
        response.

        name : of the output, the first without; unit : 'm', 'mm' or 'um'; ax : axes of matplotlib
            to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed, and for an unknown
        output.
        """
        j = 0 if name is None else column_of(name, self.output_names, "synthesis")
        return pictures.over_frequency(
            self.frequency, self.amplitude()[:, j], "synthesis", unit, ax
        )

    def to_pandas(self, kind: str = "half_peak_to_peak") -> "pandas.DataFrame":
        """A row for each place: frequency in Hz and the amplitude of each output in m, of a kind as
        in `amplitude`. Raises InputError where pandas is not installed."""
        outputs = zip(self.output_names.tolist(), self.amplitude(kind).T, strict=True)
        return tables.frame({"frequency": self.frequency, **dict(outputs)}, "place")

    def to_xarray(self) -> "xarray.Dataset":
        """Harmonics, amplitudes and shares of other modes by place, output and harmonic, with their
        units. Raises InputError where xarray is not installed."""
        data = {
            "harmonics": (("place", "output", "harmonic"), self.harmonics, "m"),
            "amplitude": (("place", "output"), self.amplitude(), "m"),
            "others": (("place", "output"), self.others, "1"),
        }
        places = {
            "frequency": ("place", self.frequency, {"units": "Hz"}),
            "output": self.output_names,
            "harmonic": np.arange(self.harmonics.shape[-1]),
        }
        return tables.dataset(data, places, said=self.said, top=self.top)

    def _repr_html_(self) -> str:
        rows = {
            f"peak of {name}": "{1:.4g} m at {0:.6g} Hz".format(*self.peak(name))
            if self.peak_reached
            else "beyond the backbone"
            for name in self.output_names.tolist()
        }
        return tables.notebook_table("Synthesis from a backbone", rows | {"said": self.said})


def synthesis(
    mode: Backbone, problem: AnyProblem, forcing: "ArrayLike", level: float = 1.0
) -> Synthesis:
    """The response to a force of order 1 near the resonance of a nonlinear mode.

    mode : of `backbone`, from amplitudes far below those of the response; problem : that of it
    forcing : (r,) real or complex amplitude F of Re F exp(i w t) in N; level : factor on it
    Equations are solved at some places around the peak alone, to tell how far it is off: every
    level costs milliseconds. Raises InputError where the force does
    not excite the mode, and where the backbone is not one of the problem.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> mode = backbone(damped, 1, (1e-7, 1e-3), outputs={"tip": [1.0]})
    >>> made = synthesis(mode, damped, np.array([1.0]), level=5.0)
    >>> curve = damped.force(0, 5.0).follow_band((600, 1000), outputs={"tip": 0})
    >>> print(f"{abs(made.peak('tip')[1] / curve.peak('tip')[1] - 1):.0%}")
    0%
    """
    problem = contact_problem_of(problem)
    if not isinstance(mode, Backbone):
        raise InputError(f"mode = {brief(mode)}: must be the Backbone of `backbone`")
    factor = numbers("level", level, "must be one number")
    if factor.shape:
        raise InputError(f"level = {brief(level)}: must be one number")
    equation = _same_equation(mode, problem)
    F = float(factor) * check_forcing(np.asarray(forcing), len(problem.K), 1)[1]
    if not F.any():
        raise InputError("forcing: is zero, so that nothing moves; give a force")
    line = _OverAmplitude.of(mode, problem)
    s, reached = line.up_to_the_peak(F)
    if not len(s):
        raise InputError(
            f"forcing: excites mode {mode.mode} to less than {mode.amplitude[0]:g} m, where its "
            "backbone begins; begin it lower"
        )
    way, W, turn, top = line.held_by(F, s, reached)
    turn = turn[:, None, None] ** np.arange(mode.H + 1)
    X = line.harmonics(way) * turn
    Q = _other_modes(mode, equation.modes, F, W)
    beside = Q @ (mode.output_rows @ equation.modes.shapes).T
    X[..., 1] += beside
    others = np.abs(beside) / np.maximum(np.abs(X[..., 1]), 1e-300)
    said = [SHORT]
    if reached:
        at = _around(np.exp(line.known["amplitude"](way)), top)
        balance = equation.balance.rebuilt(problem, {1: F})
        u = _at_contacts(mode, equation, way[at]) * turn[at]
        u[..., 1] += Q[at] @ equation.modes.at_contacts.T
        said = _off(mode, X[at], *_solved(balance, u, W[at], mode.output_rows))
    moving = _others_in_motion(mode, equation, int(way[top].round()), F, W[top])
    most = max(float(others[top].max()), moving)
    said += [f"other modes are {most:.0%} of an output at its resonance"] * (most > OVERLAP)
    contacts = float(line.known["contacts"](way)[top])
    said += [f"contacts damp by {contacts:.0%}"] * (contacts > MUCH)
    return Synthesis(W / (2 * np.pi), mode.output_names, X, others, top, reached, "; ".join(said))


@dataclass(frozen=True)
class _OverAmplitude:
    """A backbone as smooth functions of the place s along it, monotone between its points.

    places : (k,), FINER of them between two points
    known : functions of s, relative to the amplitude
    """

    places: np.ndarray
    known: dict

    @classmethod
    def of(cls, mode: Backbone, problem: ContactProblem) -> "_OverAmplitude":
        s = np.arange(len(mode.amplitude))
        a = mode.amplitude
        structure = _ratios_of_structure(mode, problem)
        columns = {
            "amplitude": np.log(a),
            "w0": 2 * np.pi * mode.frequency,
            "structure": structure,
            "contacts": mode.damping_ratio - structure,
            "shape": mode.shape / a[:, None],
            "modal": mode.modal_amplitude / a,
            "harmonics": mode.harmonics / a[:, None, None],
        }
        places = np.linspace(0, s[-1], FINER * s[-1] + 1)
        return cls(places, {name: _through(s, part) for name, part in columns.items()})

    def excitation(self, s: np.ndarray, F: np.ndarray) -> tuple[np.ndarray, ...]:
        """(psi^H F / psi^H M psi, w0, zeta_s, zeta_c), each (k,), at places."""
        a = np.exp(self.known["amplitude"](s))
        shape, modal = self.known["shape"](s), self.known["modal"](s)
        own = (self.known[name](s) for name in ("w0", "structure", "contacts"))
        return shape.conj() @ F / (a * modal**2), *own

    def reach(self, s: np.ndarray, F: np.ndarray) -> np.ndarray:
        """(k,) positive where the force holds the amplitude of a place at two frequencies."""
        pull, w0, *zeta = self.excitation(s, F)
        return (np.abs(pull) / w0**2) ** 2 - _least(*zeta)[1]

    def up_to_the_peak(self, F: np.ndarray) -> tuple[np.ndarray, bool]:
        """(places whose amplitude the force holds, from the first to phase resonance, whether that
        is reached); no places where it does not hold the first."""
        s = self.places
        above = self.reach(s, F) > 0
        if above.all():
            return s, False
        last = int(above.argmin()) - 1
        if last < 0:
            return s[:0], False
        top = brentq(lambda t: self.reach(np.array([t]), F)[0], s[last], s[last + 1], xtol=1e-13)
        return np.r_[s[: last + 1], top - (top - s[last]) * NEARER, top], True

    def held_by(
        self, F: np.ndarray, s: np.ndarray, reached: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
        """(places (n,) up to the peak and back, W (n,) rad/s at which the force holds them, phase
        exp(i theta) (n,), number of the place of phase resonance); s : up to the peak."""
        way = np.r_[s, s[::-1][reached:]]
        side = np.r_[np.full(len(s), -1.0), np.full(len(way) - len(s), 1.0)]
        pull, w0, *zeta = self.excitation(way, F)
        v = _excited_at(np.abs(pull) / w0**2, zeta, side)
        top = int((v > 0)[: len(s) - 1].sum())
        own = zeta[0] * v + zeta[1]
        pull, w0, way, W, own = (part[v > 0] for part in (pull, w0, way, v * w0, own))
        turn = pull / (w0**2 - W**2 + 2j * w0**2 * own)
        return way, W, turn / np.abs(turn), min(top, len(W) - 1)

    def harmonics(self, s: np.ndarray) -> np.ndarray:
        """(k, m, H+1) of the outputs."""
        return np.exp(self.known["amplitude"](s))[:, None, None] * self.known["harmonics"](s)


def _least(structure: np.ndarray, contacts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(v, |D|^2) each (k,): where D = 1 - v^2 + 2 i (zeta_s v + zeta_c), with v = W / w0, is least:
    the largest root of v^3 - c v + 2 zeta_s zeta_c, c = 1 - 2 zeta_s^2."""
    c = np.maximum(1 - 2 * structure**2, 1e-300)
    turn = -3 * structure * contacts / c * np.sqrt(3 / c)
    v = 2 * np.sqrt(c / 3) * np.cos(np.arccos(np.clip(turn, -1, 1)) / 3)
    return v, (1 - v**2) ** 2 + 4 * (structure * v + contacts) ** 2


def _excited_at(pull: np.ndarray, zeta: Sequence[np.ndarray], side: float) -> np.ndarray:
    """(k,) W / w0 below (side -1) or above where |D| is least, with |D| = pull; 0 where there is
    none.

    |D|^2 - least = (v - v0)^2 (v^2 + 2 v0 v + 3 v0^2 - 2 c), which Newton's method solves from the
    solution without damping of the contacts."""
    v0, least = _least(*zeta)
    rest = np.sqrt(np.maximum(pull**2 - least, 0.0))
    c = 1 - 2 * zeta[0] ** 2
    v = np.sqrt(np.maximum(v0**2 + side * rest, 0.0))
    for _ in range(NEWTON):
        h = np.maximum(v**2 + 2 * v0 * v + 3 * v0**2 - 2 * c, 1e-300)
        slope = np.sqrt(h) + (v - v0) * (v + v0) / np.sqrt(h)
        step = ((v - v0) * np.sqrt(h) - side * rest) / np.where(slope > 0, slope, np.inf)
        v = np.maximum(v - step, 0.0)
    solved = np.abs((v - v0) * np.sqrt(h) - side * rest) <= SOLVED
    return np.where(solved, v, 0.0)


def _ratios_of_structure(mode: Backbone, problem: ContactProblem) -> np.ndarray:
    """(n,) damping ratio of a backbone that is not the contacts': all of it where a law depends on
    the speed of the motion, as a dashpot does."""
    psi = mode.shape
    w0 = 2 * np.pi * mode.frequency
    if _by_speed(problem, psi[-1], w0[-1]):
        return mode.damping_ratio
    if problem.C is not None:
        work = np.einsum("nr,rs,ns->n", psi.conj(), problem.C, psi).real
    else:
        modes = stuck_modes(problem)
        moves = modes.moves[1]
        q = np.linalg.lstsq(modes.shapes[:, moves], psi.T, rcond=None)[0]
        work = modes.damping[moves] @ np.abs(q) ** 2
    return work / (2 * w0 * mode.modal_amplitude**2)


def _by_speed(problem: ContactProblem, psi: np.ndarray, w: float) -> bool:
    """Whether contact forces depend on the speed of a motion of order 1."""
    balance = HarmonicBalance(problem, {}, 1)
    u = np.zeros((balance.n_components, 2), dtype=complex)
    u[:, 1] = problem.B @ psi
    forces = balance.contact_forces(fourier.to_real(u).reshape(-1, balance.nd, balance.nh), w)
    return forces.by_omega is not None and bool(
        np.abs(w * forces.by_omega).max() > SLOW * np.abs(forces.g).max()
    )


def _through(s: np.ndarray, values: np.ndarray) -> Callable:
    """Function of the place through values, real or complex."""
    parts = [PchipInterpolator(s, part, axis=0) for part in (values.real, values.imag)]
    if np.iscomplexobj(values):
        return lambda at: parts[0](at) + 1j * parts[1](at)
    return parts[0]


def _same_equation(mode: Backbone, problem: ContactProblem) -> ModeEquation:
    """The equation of a backbone; InputError where its stuck mode is none of the problem, or its
    free motions none with the contacts of the problem."""
    fits = mode.shape.shape[1] == len(problem.K)
    if fits:
        modes = stuck_modes(problem)
        j = mode.mode - 1
        hz = np.sqrt(modes.stiffness[j] / modes.mass[j]) / (2 * np.pi)
        fits = abs(hz / mode.stuck_frequency - 1) < SAME
    if not fits:
        raise InputError(
            f"problem: has not the stuck mode {mode.mode} of the backbone, at "
            f"{mode.stuck_frequency:.6g} Hz; give the problem that the backbone was made with"
        )
    outputs = dict(zip(mode.output_names.tolist(), mode.output_rows, strict=True))
    equation = mode_equation(problem, mode.mode, outputs, mode.H, None)[0]
    for i in {len(mode.amplitude) // 2, len(mode.amplitude) - 1}:
        x, a = mode.unknowns[i], mode.amplitude[i]
        known = len(x) == len(equation.weights)
        if not known or np.linalg.norm(equation.evaluate(x, a).residual) > SOLVES:
            raise InputError(
                f"problem: the free motion of the backbone at {a:g} m is none with its contacts; "
                "give the problem that the backbone was made with"
            )
    return equation


def _other_modes(
    mode: Backbone, modes: StuckModalSystem, F: np.ndarray, W: np.ndarray
) -> np.ndarray:
    """(n, m) coordinates in harmonic 1 of the stuck modes but for the one of the backbone."""
    damping = modes.damping if modes.damping.ndim == 1 else modes.damping.diagonal()
    own = modes.stiffness - W[:, None] ** 2 * modes.mass + 1j * W[:, None] * damping
    beside = modes.moves[1] & (np.arange(len(modes.mass)) != mode.mode - 1)
    return np.where(beside, (modes.shapes.T @ F) / own, 0.0)


def _others_in_motion(
    mode: Backbone, equation: ModeEquation, i: int, F: np.ndarray, W: float
) -> float:
    """Share of an output that is of the other modes, at most, where every contact has the stiffness
    and damping that it has in harmonic 1 of free motion i: with slip the modes lie elsewhere than
    stuck."""
    here = equation.evaluate(mode.unknowns[i], mode.amplitude[i])
    modes = equation.modes
    vibrates = modes.moves[1]
    shapes = modes.shapes[:, vibrates]
    S = modes.at_contacts[:, vibrates]
    psi = here.modal[1, vibrates]
    Z = modes.impedance(W, 0.0, 1)[1]
    Z = np.diag(Z[vibrates]) if Z.ndim == 1 else Z[np.ix_(vibrates, vibrates)]
    u = S @ psi
    g = fourier.to_complex(here.forces.g.reshape(len(u), -1))[:, 1]
    moves = np.abs(u) > STILL * np.abs(u).max()
    springs = np.where(moves, g, 0.0) / np.where(moves, u, 1.0)
    Z = Z + (S.T * springs) @ S
    push = shapes.T @ F
    rows = mode.output_rows @ shapes
    own = psi * (psi.conj() @ push) / (psi.conj() @ Z @ psi)
    whole = np.linalg.solve(Z, push)
    return float((np.abs(rows @ (whole - own)) / np.maximum(np.abs(rows @ whole), 1e-300)).max())


def _around(amplitude: np.ndarray, top: int) -> np.ndarray:
    """Places from below the peak over it to beyond, at shares of the amplitude (n,) there."""
    found = {top}
    for share in AROUND:
        lower = np.flatnonzero(amplitude <= share * amplitude[top])
        found.update(lower[lower < top][-1:].tolist(), lower[lower > top][:1].tolist())
    return np.array(sorted(found))


def _at_contacts(mode: Backbone, equation: ModeEquation, way: np.ndarray) -> np.ndarray:
    """(n, nc, H+1) complex motion of the contacts at places of the backbone: the free motion."""
    i = np.minimum(way.astype(int), len(mode.amplitude) - 2)
    known = zip(mode.unknowns, mode.amplitude, strict=True)
    u = np.array([equation.motion(x, a)[0].reshape(-1, equation.balance.nh) for x, a in known])
    part = (way - i)[:, None, None]
    return fourier.to_complex((1 - part) * u[i] + part * u[i + 1])


def _solved(
    balance: HarmonicBalance, u: np.ndarray, W: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """((k, m, H+1) of outputs, rows (m, r), of the response with all modes; (n,) where): from
    motions of the contacts (n, nc, H+1) at W (n,) on planes across their way, where these lead to
    one."""
    x = fourier.to_real(u).reshape(len(W), -1)
    size = np.linalg.norm(balance.weights * x, axis=1).max()
    metric = Metric(balance.weights, size, NEARBY * W.max())
    found = []
    where = np.zeros(len(W), dtype=bool)
    for i in range(len(W)):
        before, after = max(i - 1, 0), min(i + 1, len(W) - 1)
        across = metric.border(x[after] - x[before], W[after] - W[before])
        point = correct(balance.evaluate, Plane(x[i], W[i], *across), metric, ROUGH)
        if point.converged:
            where[i] = True
            found.append(point.detail.outputs(rows))
    return np.array(found).reshape(-1, len(rows), balance.H + 1), where


def _off(mode: Backbone, made: np.ndarray, solved: np.ndarray, where: np.ndarray) -> list[str]:
    """In words, of which output the peak is too high or too low, and by how much; solved : at the
    places `where` (n,)."""
    tops = amplitude(made, "half_peak_to_peak", [1]).argmax(axis=0)
    beside = [where[max(top - 1, 0) : top + 2].any() for top in tops]
    if len(solved) < len(made) / 2 or not all(beside):
        return ["the response does not lie near enough to tell how far the peak is off"]
    kind = "half_peak_to_peak"
    off = np.divide(*(amplitude(X, kind, [1]).max(axis=0) for X in (made, solved))) - 1
    j = int(np.abs(off).argmax())
    if abs(off[j]) <= OFF:
        return []
    return [
        f"the peak of '{mode.output_names[j]}' is some {abs(off[j]):.0%} too "
        + ("high" if off[j] > 0 else "low")
    ]
