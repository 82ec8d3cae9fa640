"""From an equation to its branch between two values of the parameter, and from the branch to a
curve."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.beyond import cut_at_end
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.closed import follow_both_ways
from tipdamp.hbm.continuation.follow import Budget, BudgetExceeded, follow
from tipdamp.hbm.continuation.point import Point, failed, size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.drift_end import goes_on
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.parent import end_at_parent
from tipdamp.hbm.curve.starts import first_of, starts
from tipdamp.hbm.curve.unmoved import follow_unmoved, moves_contacts
from tipdamp.hbm.hold.named_motion import mostly
from tipdamp.hbm.hold.rigid_motion import HOLD, share_faced
from tipdamp.hbm.result import ForcedResponse, widest_gap

ROLLS = "the damper rolls"
NO_PERIOD = "no periodic state exists there"
SLIDES = "nothing but friction restrains a motion"
MOSTLY = 0.9  # of a change, for it to be that of one part
LEFT = ("left", "closed")  # ends of branches that leave the band for good


def trace(
    equation: Equation,
    first: float,
    last: float,
    settings: Settings,
    progress: Callable | None = None,
    note: Callable | None = None,
    beyond: float | None = None,
    begin: Point | None = None,
) -> Branch:
    """The branch from `first` to `last`, in units of the branch; progress(value, step, calls) or
    None.

    beyond : up to where it is followed past `last`, for what comes back; None ends it at `last`
    note(point) : called for every point with its tangent, before the next one, or None: a journal
    knows these alone
    begin : a solution through which it runs: from `first`, or from a value inside both ways

    Of the branches from several solutions at `first`, the first one that does not leave the band
    for good.
    """
    budget = Budget(settings, progress, first / equation.parameter.scale, len(equation.weights))
    equation.balance.on_call = budget.call
    found: list[Branch] = []
    try:
        stop = last if beyond is None else beyond
        if begin is not None and begin.parameter != first:
            found.append(_both_ways(equation, begin, first, stop, settings, budget, note))
            end_at_parent(equation, found[0], begin)
            return found[0]
        _first_staying(equation, first, stop, settings, budget, found, note, begin)
        if begin is not None:
            end_at_parent(equation, found[-1], begin)
    except BudgetExceeded:  # while further first points were sought
        pass
    finally:
        equation.balance.on_call = None
    if not found:
        found.append(Branch([failed(len(equation.weights), first)]))
        found[0].finish("no start", first)
    best = found[-1] if found[-1].end not in LEFT else found[0]
    best.calls = budget.calls
    if beyond is not None:
        cut_at_end(equation.evaluate, best, last, equation.weights, settings)
    return best


def _both_ways(
    equation: Equation,
    begin: Point,
    first: float,
    last: float,
    settings: Settings,
    budget: Budget,
    note: Callable | None,
) -> Branch:
    """The branch through a solution inside the band, in the direction of the band."""

    def report(point: Point, step: float) -> None:
        budget.point(point.parameter / equation.parameter.scale, step, point.iterations)
        if note:
            note(point)

    branch = follow_both_ways(
        equation.evaluate,
        begin,
        (first, last),
        equation.weights,
        settings,
        settings.max_points,
        report,
    )
    branch.calls = budget.calls
    return branch


def _first_staying(
    equation: Equation,
    first: float,
    last: float,
    settings: Settings,
    budget: Budget,
    found: list[Branch],
    note: Callable | None,
    begin: Point | None,
) -> None:
    """Fill `found` with branches from `first`, up to the first one that does not leave the band for
    good."""
    known: list[Point] = []

    def report(point: Point, step: float) -> None:
        budget.point(point.parameter / equation.parameter.scale, step, point.iterations)
        if note and point.converged and point.tangent is not None:
            note(point)

    for start in [begin] if begin else _starts(equation, first, settings, True):
        if not start.converged or any(_same(start, other, equation.weights) for other in known):
            continue
        known.append(start)
        report(start, 0.0)
        if (
            not any(np.any(F) for F in start.detail.balance.forces.values())
            or np.isnan(equation.hz)
            and not moves_contacts(start.detail.balance)
        ):
            found.append(follow_unmoved(equation, start, last, settings, report))
            return
        found.append(
            follow(
                equation.evaluate,
                start,
                last,
                equation.weights,
                settings,
                report,
                lambda p: first_of(_starts(equation, p, settings, False)),
            )
        )
        if found[-1].end not in LEFT:
            return


def _starts(equation: Equation, p: float, settings: Settings, off_band: bool) -> Iterator:
    """Solutions at a value, one way after the other, as points of the branch."""
    return equation.solutions(
        p, lambda balance, w: starts(balance, w, settings, off_band), settings
    )


def _same(a: Point, b: Point, weights: np.ndarray) -> bool:
    return size(weights * (a.x - b.x)) <= 1e-6 * size(weights * b.x)


def record(
    branch: Branch,
    equation: Equation,
    named: tuple[list, Outputs],
    contact: bool,
    checked: tuple[np.ndarray, tuple[float, float]],
    seconds: float,
) -> ForcedResponse:
    """ForcedResponse of a branch; named : (names, outputs); contact : whether to keep the contact
    forces;
    checked : peak_points, and what stiffer holds change: (held_change, held_reaction_change)."""
    balance = equation.balance
    parameter = equation.parameter
    names, outputs = named
    found: dict[str, Any] = of_contacts(branch.points, equation, contact)
    values = np.array([p.parameter for p in branch.points]) / parameter.scale
    start = balance.given_start
    return ForcedResponse(
        frequency=parameter.frequencies(equation.hz, values),
        output_names=np.array(names, dtype=str),
        harmonics=outputs.harmonics(branch.points, balance.H),
        parameter_name=parameter.name,
        parameter_unit=parameter.measured_in(balance.forces),
        parameter=values,
        converged=np.array([p.converged for p in branch.points]),
        iterations=np.array([p.iterations for p in branch.points]),
        ended=_ended(branch, equation),
        complete=bool(branch.complete and all(p.converged for p in branch.points)),
        H=balance.H,
        origin="preloaded" if balance.problem.preloaded else "unloaded",
        start=start if isinstance(start, str) else "given",
        seconds=seconds,
        residual_calls=branch.calls,
        restarts=np.reshape(branch.restarts, (-1, 2)) / parameter.scale,
        peak_points=checked[0],
        held_change=checked[1][0],
        held_reaction_change=checked[1][1],
        held=np.array([one.name for one in balance.problem.held], dtype=str),
        unknowns=np.array([p.x for p in branch.points]),
        carrying=np.ones(len(balance.problem.contacts), dtype=bool),
        force_orders=np.array(list(balance.forces), dtype=int),
        output_rows=outputs.rows,
        forces=np.array(list(balance.forces.values()), dtype=complex).reshape(
            -1, balance.problem.K.shape[0]
        ),
        slider_start=np.empty((0, 0)) if isinstance(start, str) else np.asarray(start, dtype=float),
        orientation=np.array([p.orientation for p in branch.points]),
        jumps=np.array([p.jump for p in branch.points]),
        samples=balance.grid.samples,
        periods=equation.periods,
        reached_end=bool(branch.complete),
        **found,
    )


def of_contacts(
    points: Sequence[Point], equation: Equation, contact: bool
) -> dict[str, np.ndarray]:
    """{field of the curve: values at the points} of contacts and holds, NaN where a point failed;
    contact : whether with the contact forces."""
    balance = equation.balance
    parameter = equation.parameter
    n = len(points)
    P = len(balance.problem.contacts)
    shares = np.full((n, P, 3), np.nan)
    work = np.full((n, P), np.nan)
    reaction = np.full((n, len(balance.problem.held), balance.H + 1), np.nan, dtype=complex)
    of_force = (n, P, balance.nd, balance.H + 1) if contact else (0, 0, 0, 0)
    force = np.full(of_force, np.nan, dtype=complex)
    for i, point in enumerate(points):
        if not point.converged:
            continue
        detail = point.detail
        shares[i] = detail.forces.shares
        reaction[i] = detail.balance.reaction_rows @ detail.modal
        # of all components: springs take nothing, and which of them rub is the law's affair
        work[i] = fourier.work(detail.forces.g, point.x.reshape(-1, balance.nd, balance.nh))
        if contact:
            value = point.parameter / parameter.scale
            there, _ = parameter.rebuild(balance.problem, balance.forces, value)
            force[i] = detail.contact_force(there.rest_force(there.contacts))
    return {
        "share_stick": shares[..., 0],
        "share_slip": shares[..., 1],
        "share_open": shares[..., 2],
        "dissipated": work,
        "contact_force": force,
        "reaction": reaction,
    }


def explain(branch: Branch, parameter: Parameter) -> str:
    """Why the curve ends, and where points failed or the branch was left."""
    scale = parameter.scale

    def named(p: float) -> str:
        return parameter.named(p / scale)

    ended = branch.sentence(named)
    good, failures = (
        [p for p in branch.points if p.converged == wanted] for wanted in (True, False)
    )
    if not good:
        return ended
    if branch.outside is not None and branch.complete:
        ended += (
            "; it left the band where it starts and was followed outside, to "
            f"{named(branch.outside)}, and back"
        )
    if branch.beyond is not None:
        ended += (
            "; it left the band before its fold and was followed beyond, "
            f"to {named(branch.beyond)}, and back"
        )
    if branch.restarts:
        places = ", ".join(f"{named(a)} to {named(b)}" for a, b in branch.restarts)
        gap = widest_gap(
            [p.parameter for p in branch.points],
            [p.converged for p in branch.points],
            branch.restarts,
        )
        ended += (
            "; not one branch: it folds again and again, was left, and taken up further on: "
            f"{places}; solved points there are up to {gap / scale:.3g}{parameter.unit} apart "
            "(more damping, or more or fewer harmonics, may give one)"
        )
    if (branch.restarts or branch.end == "points") and (opens := _lifts_off(good)):
        ended += opens
    if failures and branch.complete:
        ended += (
            f"; {len(failures)} point{'s' * (len(failures) > 1)} failed near "
            f"{named(failures[0].parameter)}: run in the other direction, or with other "
            "harmonics, there"
        )
    return ended


def _ended(branch: Branch, equation: Equation) -> str:
    """As `explain`, with the mean motion in which a branch drifts at its end, where it does so with
    more orders, too."""
    problem = equation.balance.problem
    parameter = equation.parameter
    good = [point for point in branch.points if point.converged]
    if branch.end == "drift" and not _of_the_mean(good, equation.balance.nh):
        branch.end = "upright"
    ended = explain(branch, parameter)
    if not good:
        return slides(problem) + ended
    if branch.complete:
        return ended
    drift = unrestrained(good[-1], problem)
    if not drift or not (H := goes_on(equation, good)):
        return ended + drift
    at = parameter.named(good[-1].parameter / parameter.scale)
    return (
        f"stopped at {at}: too few harmonics; with harmonics = {H} the curve goes on there, with "
        f"{equation.balance.H} a mean motion drifts"
    )


def slides(problem: ContactProblem) -> str:
    """The motions that nothing but friction restrains, and what holds them, in words, before what
    else may be tried; empty where there are none."""
    motions = problem.held_by_friction()
    if not motions.shape[1]:
        return ""
    named = [
        problem.describe(motion) if problem.describe else mostly(motion) for motion in motions.T
    ]
    return (
        f"{SLIDES} ({'; '.join(map(str, named))}): where the contacts slide it drifts, and then "
        f"no periodic state exists: {named[0].remedy}. Where they are not to slide: "
    )


def _lifts_off(points: Sequence[Point]) -> str:
    """How far contacts that lift off are open at the points of a branch that folds again and again,
    in words."""
    share = np.array(
        [p.detail.forces.shares[:, 2].max(initial=0.0) for p in points if p.detail is not None]
    )
    share = share[share > 0]
    if not len(share) or 2 * len(share) < len(points):
        return ""
    return (
        "; contacts lift off there and close again, at half of the points open for "
        f"{100 * np.median(share):.0f} % of the cycle or more: with fewer harmonics their impacts "
        "are smoother, and the branch folds less"
    )


def _of_the_mean(points: list[Point], nh: int) -> bool:
    """Whether it is mostly the mean in which the last points of a branch differ."""
    change = (points[-1].x - points[-2].x).reshape(-1, nh)
    return bool(np.linalg.norm(change[:, 0]) > MOSTLY * np.linalg.norm(change))


def unrestrained(last: Point, problem: ContactProblem) -> str:
    """The mean motion in which the Jacobian is singular at the last point, in words; empty where
    there is none."""
    value, q = last.detail.smallest_motion()
    if q is None or value >= 1e-4 or np.abs(q[:, 0]).max() <= 0.9 * np.abs(q).max():
        return ""
    motion = q[:, 0].real
    named = problem.describe(motion) if problem.describe else mostly(motion)
    verb = ROLLS if named.turns else "nothing restrains a mean motion"
    held = " (contact normals hold it only while enough of them are closed)"
    said = held if _faces(problem, motion) else ""
    return f"; {verb} ({named}): {NO_PERIOD}; {named.remedy}{said}"


def _faces(problem: ContactProblem, motion: np.ndarray) -> bool:
    """Whether the normals of contacts face a motion (r,), which `held_motions` doubts to need a
    hold."""
    nd = len(problem.law.components)
    if problem.law.components[-1:] != ("n",):
        return False
    return share_faced(problem.B[nd - 1 :: nd], motion) > HOLD.faced
