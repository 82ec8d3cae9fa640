"""Unilateral contact as a linear complementarity problem on the normal motion of the pairs: which
of them are closed.

    0 <= N  complementary to  g + c N - u >= 0

u : normal motion, N : contact force, g : gap, c = 1/kn : compliance of a pair (0: hard contact).
How u and N of a set follow from the load is the problem's affair (`normal_contact`,
`full.closed_sets`). A position in which no pair overlaps needs no force (`unstressed`).
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.optimize import linprog

from tipdamp.hbm.errors import InputError


@dataclass(frozen=True)
class ComplementaritySettings:
    """Of the pivoting and of the proximal point method."""

    steps: int = 2000  # sets that pivoting tries
    patience: int = 10  # full steps that may fail to reduce the number of wrong pairs
    rounding: float = 1e-13  # of the largest force: below it the sign of a force is rounding
    rounds: int = 60  # of the proximal point method
    anchor: float = 1e-2  # share of k0 that anchors the pairs at first
    weakest: float = 1e-8  # share of k0 that anchors them at last
    # of the largest force, in any anchor of an answer that is accepted at once
    anchor_force: float = 1e-10
    # of all forces, in all anchors of the best answer where they fade no further
    anchor_forces: float = 5e-9


SETTINGS = ComplementaritySettings()


class NoEquilibrium(InputError):
    """The closed pairs do not hold the bodies; drift - (P,) motion of the pairs that goes on, None
    where not known."""

    def __init__(self, message: str, drift: np.ndarray | None = None) -> None:
        super().__init__(message)
        self.drift = drift


class Cycling(RuntimeError):
    """The sets of closed pairs repeat."""


class SetSolution(NamedTuple):
    """u, N : (P,) motion and force of the pairs of one set; amount : (h,) of the loose motions of
    the bodies"""

    u: np.ndarray
    N: np.ndarray
    amount: np.ndarray


class ContactSolution(NamedTuple):
    """u, N, amount - as of its set; closed : (P,) bool; sets - how many were tried
    method - 'newton', 'pivoting' where full steps failed, or 'proximal'"""

    u: np.ndarray
    N: np.ndarray
    amount: np.ndarray
    closed: np.ndarray
    sets: int
    method: str


class ComplementarityProblem(Protocol):
    """What `solve_complementarity` asks of a problem; k0 : (P,) N/m reference springs, free : (P,)
    bool - may close; rounding - of the largest force: below it the sign of a force is rounding."""

    @property
    def rounding(self) -> float:
        """Of the largest force."""

    @property
    def k0(self) -> np.ndarray:
        """(P,) N/m."""

    @property
    def free(self) -> np.ndarray:
        """(P,) bool."""

    def solve_set(
        self,
        closed: np.ndarray,
        u0: Any,
        gap: np.ndarray,
        anchor: float = 0.0,
        at: np.ndarray | float = 0.0,
    ) -> SetSolution:
        """With the pairs `closed` (P,) bool closed and all others open, under a load u0 in the
        problem's own terms."""


def wrong_pairs(
    problem: ComplementarityProblem, closed: np.ndarray, found: SetSolution, gap: np.ndarray
) -> np.ndarray:
    """(P,) bool - closed pairs that pull and open pairs that overlap, by more than rounding."""
    push = np.where(closed, -found.N, problem.k0 * (found.u - gap))
    most = np.abs(np.where(closed, found.N, push)).max(initial=0.0)
    return problem.free & (push > problem.rounding * most)


def no_equilibrium(closed: np.ndarray, drift: np.ndarray | None = None) -> NoEquilibrium:
    """The error that says that the closed pairs leave a motion of the damper free."""
    return NoEquilibrium(
        f"the {int(closed.sum())} pairs that stay closed do not hold the damper", drift
    )


def solve_complementarity(
    problem: ComplementarityProblem, u0: Any, gap: np.ndarray, start: np.ndarray | None = None
) -> ContactSolution:
    """The solution under a load u0 in the problem's own terms, with the gaps (P,) m.

    Semismooth Newton (all wrong pairs change at once) from the pairs `start` (P,) bool, or all
    closed; where that does not reduce their number, one pair at a time until it does, which cannot
    cycle in exact arithmetic [Judice and Pires 1994: block principal pivoting]. Where a set on the
    way does not hold the bodies, or rounding makes the sets cycle because some pairs are only just
    closed, `_proximal` goes on. Raises NoEquilibrium where nothing holds the bodies."""
    try:
        return _pivot(problem, u0, gap, start=start)
    except (NoEquilibrium, Cycling) as error:
        found = _proximal(problem, u0, gap)
        if found is None:
            raise error
        return found


def _proximal(problem: ComplementarityProblem, u0: Any, gap: np.ndarray) -> ContactSolution | None:
    """As `solve_complementarity`, by the proximal point method: every pair is anchored weakly to
    its last position, which holds the bodies whatever the set, until the anchor forces vanish:
    1e-10 of the largest force at once, or the least that was met in many rounds, up to 5e-9 of the
    forces. Raises NoEquilibrium where they do not vanish; None where no set was found even with
    anchors.

    It converges whenever there is a solution [Rockafellar 1976], also where several positions of
    the bodies are solutions, as under a load that balances on a single line of pairs.
    """
    at, total = gap, 0
    anchor, weakest = SETTINGS.anchor, SETTINGS.weakest
    best, least, drift = None, SETTINGS.anchor_forces, None
    for _ in range(SETTINGS.rounds):
        try:
            found = _pivot(problem, u0, gap, anchor, at)
        except (NoEquilibrium, Cycling):
            anchor = weakest = min(100 * anchor, SETTINGS.anchor)
            continue
        total += found.sets
        found = found._replace(sets=total, method="proximal")
        exact = _without_anchors(problem, found.closed, u0, gap)
        if exact is not None:
            return ContactSolution(*exact, found.closed, total, "proximal")
        drift = found.u - at
        anchored, force = np.abs(anchor * problem.k0 * drift), np.abs(found.N)
        if anchored.max() <= SETTINGS.anchor_force * force.max():
            return found
        if anchored.sum() <= least * force.sum():
            best, least = found, 0.5 * anchored.sum() / force.sum()
        at, anchor = found.u, max(anchor / 100, weakest)
    if best is None and drift is not None:
        raise no_equilibrium(found.closed, drift)
    return best


def _without_anchors(
    problem: ComplementarityProblem, closed: np.ndarray, u0: Any, gap: np.ndarray
) -> SetSolution | None:
    """What the set gives where that solves the true problem, else None."""
    try:
        found = problem.solve_set(closed, u0, gap)
    except NoEquilibrium:
        return None
    return None if wrong_pairs(problem, closed, found, gap).any() else found


def _pivot(
    problem: ComplementarityProblem,
    u0: Any,
    gap: np.ndarray,
    anchor: float = 0.0,
    at: float | np.ndarray = 0.0,
    start: np.ndarray | None = None,
) -> ContactSolution:
    closed = problem.free.copy() if start is None else problem.free & start
    fewest, patience, method = np.inf, SETTINGS.patience, "newton"
    for step in range(1, SETTINGS.steps + 1):
        found = problem.solve_set(closed, u0, gap, anchor, at)
        wrong = wrong_pairs(problem, closed, found, gap)
        count = int(wrong.sum())
        if not count:
            return ContactSolution(*found, closed, step, method)
        if count < fewest:
            fewest, patience = count, SETTINGS.patience
        else:
            patience -= 1
        if patience < 0:
            method = "pivoting"
            wrong[: np.flatnonzero(wrong)[-1]] = False
        closed = closed ^ wrong
    raise Cycling(
        "the set of closed pairs was not found: this should not happen, please report the case"
    )


FITS = 1e-7  # of the largest gap: overlaps that linear programming takes for none


def unstressed(loose: np.ndarray, B: Any, gap: np.ndarray) -> np.ndarray | None:
    """(r,) m: combination of the motions `loose` (r, m) of the bodies that float with which no pair
    overlaps,
    B q <= gap (P,), and the one that leaves most room, up to the largest gap; None where the bodies
    do not fit.

    B (P, r) normal motion of the pairs. A linear programme in the coefficients of the motions.
    """
    size = np.abs(gap).max()
    if not loose.shape[1] or size == 0:
        return np.zeros(len(loose)) if (gap >= 0).all() else None
    motion = B @ loose
    reach = np.abs(motion).max(axis=0)
    reach[reach == 0] = 1.0
    scaled = np.column_stack([motion / reach, np.ones(len(gap))])  # in units of the largest gap
    answer = linprog(
        np.r_[np.zeros(loose.shape[1]), -1.0],
        A_ub=scaled,
        b_ub=gap / size,
        bounds=[(None, None)] * loose.shape[1] + [(None, 1.0)],
        method="highs",
    )
    if answer.status != 0 or answer.x[-1] < -FITS:
        return None
    return loose @ (size * answer.x[:-1] / reach)
