"""The backbone of a nonlinear mode: frequency, damping ratio and shape over the amplitude.

mode = backbone(problem, 1, (1e-6, 1e-3), outputs={"tip": row}, harmonics=5)
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.balance.problem import AnyProblem, contact_problem_of
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import insert_crossings
from tipdamp.hbm.continuation.follow import Budget, follow
from tipdamp.hbm.continuation.point import Point, failed
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.trace import slides
from tipdamp.hbm.curve.watched import watched
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.modes.free_motion import ModeEquation
from tipdamp.hbm.modes.result import Backbone
from tipdamp.hbm.modes.stuck_modes import seen_alone, stuck_modes
from tipdamp.hbm.ties import first_largest
from tipdamp.hbm.validation import (
    LEAST,
    MOST,
    brief,
    check_harmonics,
    check_outputs,
    check_settings,
    check_whole,
    numbers,
)

REACHED = "reached the last amplitude"
# of the stuck mode in the first output, beside what its largest dof would give: less is not seen
UNSEEN = 1e-9
LOWER = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6)  # times the first amplitude: where everything sticks
# times the amplitude: steps of a tenth of it at most, so that slip does not begin in a wide one
WIDEST = 4.0
HALVINGS = 12  # of the way on which the first contact leaves
CLOSE = 1e-4  # of the amplitude at which it leaves
# of the stuck frequency: a mode that is slower is no vibration any more
SLOWEST = 1e-2


class NoFreeMotion(InputError):
    """No free motion of the mode was found at the first amplitude."""


def backbone(
    problem: AnyProblem,
    mode: int,
    amplitudes: Sequence[float],
    *,
    outputs: "Mapping[str, ArrayLike] | None" = None,
    harmonics: int = 5,
    samples: int | None = None,
    settings: Settings | None = None,
    progress: Callable[[float, float, int], None] | bool | None = None,
) -> Backbone:
    """The nonlinear mode that begins as a mode of the stuck system, over its amplitude, by the
    extended periodic motion concept [Krack 2015].

    problem : ContactProblem of `contact_problem` or `Problem.contact_problem`
    mode : number of the stuck mode, 1 is the lowest
    amplitudes : (k,) m, ascending, two or more: of harmonic 1 of the first output. The mode is
        followed from the first to the last; at each in between it is solved
    outputs : {name: a dof, or the (r,) row that takes the output out of q}; None takes the dof that
        moves most in the mode, by the name "dof 7"
    harmonics : H, orders 0..H are kept; samples, settings : as in CurveOptions
    progress : function (amplitude, step, calls), called at each point; without one a terminal or a
        notebook shows a line, and False shows nothing

    Forces of the problem play no part, its damping counts: `damping_ratio` is that of structure and
    contacts together, by which a force that balances it at phase resonance is known. Raises
    InputError for a mode that does not exist, an output that does not see it, amplitudes that are
    none, and where no motion exists at the first amplitude. Where none exists up to the last one
    `complete` is False and `ended` says where.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> mode = backbone(problem, 1, (1e-6, 1e-3), outputs={"tip": [1.0]}, harmonics=1)
    >>> print(f"{mode.damping_ratio[0]:.1%} stuck, {mode.damping_ratio.max():.1%} at most")
    0.0% stuck, 6.5% at most
    """
    began = time.perf_counter()
    at = _check_amplitudes(amplitudes)
    equation, rows, names = mode_equation(
        problem, mode, outputs, check_harmonics(harmonics), samples
    )
    settings = check_settings(settings, progress)
    settings = replace(settings, widest=min(settings.widest, WIDEST))
    begin = _first(equation, at[0], settings)
    if not begin.converged:
        raise NoFreeMotion(
            f"amplitudes begin at {at[0]:g} m: no free motion of mode {mode} was found there; "
            "begin lower"
        )
    with watched(progress, at[0], at[-1], " m", by_factors=True) as told:
        budget = Budget(settings, told, at[0], len(equation.weights))
        branch = _followed(equation, begin, at[-1], settings, budget)
    missed = insert_crossings(equation.evaluate, branch, at[1:-1], equation.weights, settings)
    _end_of_sticking(equation, branch, settings)
    return _record(equation, branch, (names, rows), missed, (mode, time.perf_counter() - began))


def _check_amplitudes(amplitudes: Sequence[float]) -> np.ndarray:
    given = numbers("amplitudes", amplitudes, "must be numbers in m")
    good = given.ndim == 1 and len(given) > 1 and np.isfinite(given).all()
    if not good or given[0] <= LEAST or given[-1] >= MOST or (np.diff(given) <= 0).any():
        raise InputError(
            f"amplitudes = {brief(amplitudes)}: must be two or more in m, positive and ascending, "
            f"below {MOST:g}"
        )
    return given


def mode_equation(
    problem: AnyProblem,
    mode: int,
    outputs: "Mapping[str, ArrayLike] | None",
    H: int,
    samples: int | None,
) -> tuple[ModeEquation, np.ndarray, list[str]]:
    """(equation of a mode, rows (m, r) of the outputs, their names); InputError as `backbone`."""
    problem = contact_problem_of(problem)
    problem.check_plain("backbone")
    given = None if outputs is None else check_outputs(outputs, len(problem.K))
    if H < 1:
        raise InputError(f"harmonics = {H}: a mode vibrates in order 1, at least that many")
    modes = stuck_modes(problem)
    index = check_whole("mode", mode, 1) - 1
    if index >= len(modes.frequencies):
        raise InputError(
            f"mode = {mode}: the stuck system has {len(modes.frequencies)}, the lowest is 1"
        )
    if given is None:
        dof = first_largest(np.abs(modes.shapes[:, index]))
        given = check_outputs({f"dof {dof}": dof}, len(problem.K))
    names, rows = given
    modes = seen_alone(modes, index, rows[0])
    row = rows[0] @ modes.shapes
    if abs(row[index]) <= UNSEEN * np.linalg.norm(rows[0]) * np.abs(modes.shapes[:, index]).max():
        raise InputError(
            f"outputs: '{names[0]}', the first, does not see mode {mode}; put one that does first"
        )
    if modes.unmoved[index]:
        raise InputError(f"mode = {mode}: does not move any contact, it is linear")
    balance = HarmonicBalance(problem, {}, H, samples=samples)
    return ModeEquation(balance, modes, index, row), rows, names


def _first(equation: ModeEquation, a: float, settings: Settings) -> Point:
    """The motion at the first amplitude: from the stuck mode, where need be by way of lower
    amplitudes."""
    few = replace(settings, max_points=500)
    for share in LOWER:
        begin = solve_fixed(
            equation.evaluate, equation.stuck(), share * a, equation.weights, settings, 40
        )
        if begin.converged and share < 1:
            begin = follow(equation.evaluate, begin, a, equation.weights, few).points[-1]
        if begin.converged and begin.parameter == a:
            return begin
    return failed(len(equation.weights), a)


def _followed(
    equation: ModeEquation, begin: Point, last: float, settings: Settings, budget: Budget
) -> Branch:
    """The branch to the last amplitude; it ends where the frequency falls to zero: beyond it runs
    back, with the time reversed."""

    def report(point: Point, step: float) -> None:
        budget.point(point.parameter, step, point.iterations)

    equation.balance.on_call = budget.call
    branch = follow(equation.evaluate, begin, last, equation.weights, settings, report)
    equation.balance.on_call = None
    slow = [i for i, p in enumerate(branch.points) if p.converged and p.x[-2] < SLOWEST]
    if slow:
        branch.points = branch.points[: slow[0]]
        branch.finish("no point", branch.points[-1].parameter)
    return branch


def _end_of_sticking(equation: ModeEquation, branch: Branch, settings: Settings) -> None:
    """Insert places around the amplitude at which the first contact slips or lifts: between places
    far apart the kink there would be rounded off."""
    for _ in range(HALVINGS):
        points = [p for p in branch.points if p.converged]
        moves = [bool((p.detail.forces.shares[:, 0] < 1).any()) for p in points]
        if moves[0] or True not in moves:
            return
        last, first = (points[moves.index(True) - k].parameter for k in (1, 0))
        middle = np.array([np.sqrt(last * first)])
        if first < (1 + CLOSE) * last or insert_crossings(
            equation.evaluate, branch, middle, equation.weights, settings
        ):
            return


def _record(
    equation: ModeEquation,
    branch: Branch,
    named: tuple[list[str], np.ndarray],
    missed: Sequence[Any],
    made: tuple[int, float],
) -> Backbone:
    names, rows = named
    mode, seconds = made
    points = [p for p in branch.points if p.converged]
    Q = np.array([p.detail.modal for p in points])
    shapes = equation.modes.shapes
    shape = Q[:, 1] @ shapes.T
    inertia = np.einsum("nr,nr->n", shape.conj(), shape @ equation.balance.problem.M).real
    shares = np.array([p.detail.forces.shares for p in points])
    frequency = equation.frequency / (2 * np.pi)
    unknowns = np.array([p.x for p in points])
    return Backbone(
        mode=mode,
        amplitude=np.array([p.parameter for p in points]),
        frequency=frequency * unknowns[:, -2],
        damping_ratio=unknowns[:, -1],
        output_names=np.array(names, dtype=str),
        harmonics=np.einsum("jr,nkr->njk", rows @ shapes, Q),
        shape=shape,
        modal_amplitude=np.sqrt(inertia),
        share_stick=shares[..., 0],
        share_slip=shares[..., 1],
        share_open=shares[..., 2],
        stuck_frequency=frequency,
        stuck_damping_ratio=equation.damping_ratio,
        ended=_ended(branch, equation, unknowns[-1, -2], missed) + _turns(points),
        complete=bool(branch.complete and len(points) == len(branch.points) and not missed),
        H=equation.balance.H,
        unknowns=unknowns,
        output_rows=rows,
        seconds=seconds,
    )


def _ended(branch: Branch, equation: ModeEquation, relative: float, missed: Sequence[Any]) -> str:
    if branch.complete:
        failed = [f"{p.parameter:.6g} m" for p in branch.points if not p.converged]
        failed += [f"{a:g} m" for a in missed]
        return REACHED + "".join(f"; {where} could not be solved" for where in failed)
    if relative < 10 * SLOWEST:
        return f"stopped at {branch.at:.6g} m: the frequency falls to zero, beyond it no vibration"
    return slides(equation.balance.problem) + branch.sentence(lambda a: f"{a:.6g} m")


def _turns(points: Sequence[Point]) -> str:
    """In words, how often the amplitude turns back on the way."""
    forward = np.diff([p.parameter for p in points]) > 0
    turns = int((forward[1:] != forward[:-1]).sum())
    if not turns:
        return ""
    return (
        f"; the amplitude turns back or on {turns} times, as where an order of the mode meets "
        "another mode (internal resonance): fewer harmonics leave that out"
    )
