"""Which pairs are closed: unilateral contact as a complementarity problem on the normal motion of the pairs.

    u = u0 - G (N - k0 u),      0 <= N  complementary to  g + c N - u >= 0

u : normal motion, N : contact force, g : gap, c = 1/kn : compliance of a pair (0: hard contact). G is the compliance
of the bodies with a reference spring k0 at every pair; k0 drops out of the answer, it only keeps free bodies definite.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgecon, dgetrf, dgetrs

from hbm.errors import InputError

_STEPS = 2000
_PATIENCE = 10                     # full steps that may fail to reduce the number of wrong pairs
_ANCHOR = 1e-2                     # share of k0 that anchors the pairs at first
_ROUNDS = 60
_CARRIED = 1e-10                   # of the largest force, by any anchor of an answer that is accepted at once
_LEFT = 1e-8                       # of all forces, by all anchors of the best answer where they fade no further
_HOLDS = 1e-11                     # inverse condition: a set below it does not hold the bodies, whatever it leaves
_ROUNDING = 1e-13                  # of the largest force: below it the sign of a force is rounding


class NotHeld(InputError):
    """The closed pairs do not hold the bodies; drift - (P,) motion of the pairs that goes on, None where not known."""

    def __init__(self, message, drift=None):
        super().__init__(message)
        self.drift = drift


class Undecided(RuntimeError):
    """The sets of closed pairs cycle."""


@dataclass(frozen=True)
class Normal:
    """The bodies and pairs of one problem: G (P, P) m/N, k0 (P,) N/m, c (P,) m/N, free (P,) bool - may close."""

    G: np.ndarray
    k0: np.ndarray
    c: np.ndarray
    free: np.ndarray

    def on_set(self, closed, u0, gap, anchor=0.0, at=0.0):
        """u, N (P,) with the pairs `closed` closed and all others open.

        anchor : share of k0 that really acts, as a spring between each pair and its motion `at` (proximal term)
        """
        k = (1 - anchor) * self.k0
        own = np.where(closed, self.c * self.k0, 1.0)          # u = gap + own v, N = k0 v;  open: u = v, N = 0
        share = np.where(closed, self.k0 - k * own, -k)
        held = np.where(closed, gap, 0.0)
        A = np.diag(own) + self.G * share
        right = u0 - held + self.G @ (k * held + anchor * self.k0 * at)
        factor, pivots, _ = dgetrf(A)
        v = dgetrs(factor, pivots, right)[0]
        size = np.linalg.norm(right) + 1e-300
        if not np.isfinite(v).all() or np.linalg.norm(A @ v - right) > 1e-8 * size \
                or dgecon(factor, np.abs(A).sum(axis=0).max())[0] < _HOLDS:
            raise NotHeld(f"the {int(closed.sum())} pairs that stay closed do not hold the damper")
        return held + own * v, np.where(closed, self.k0 * v, 0.0)

    def wrong(self, closed, u, N, gap):
        """(P,) bool - closed pairs that pull, open pairs that overlap."""
        push = np.where(closed, -N, self.k0 * (u - gap))
        return self.free & (push > _ROUNDING * np.abs(np.where(closed, N, push)).max(initial=0.0))


def closed_pairs(problem: Normal, u0, gap):
    """(u, N, closed, steps, method) of the solution.

    Semismooth Newton (all wrong pairs change at once) from all pairs closed; where that does not reduce their number,
    one pair at a time until it does, which cannot cycle in exact arithmetic [Judice and Pires 1994: block principal
    pivoting]. Where a set on the way does not hold the bodies, or rounding makes the sets cycle because some pairs are
    only just closed, `_proximal` goes on. Raises NotHeld where nothing holds the bodies.
    """
    try:
        return _pivot(problem, u0, gap)
    except (NotHeld, Undecided) as error:
        found = _proximal(problem, u0, gap)
        if found is None:
            raise error
        return found


def _proximal(problem, u0, gap):
    """As `closed_pairs`, by the proximal point method: every pair is anchored weakly to its last position, which holds
    the bodies whatever the set, until the anchors carry nothing: 1e-10 of the largest force at once, or the least that
    was met in many rounds, up to 1e-8 of the forces. Raises NotHeld where they still carry more; None where no set was
    found even with anchors.

    It converges whenever there is a solution [Rockafellar 1976], also where several positions of the bodies are
    solutions, as under a load that balances on a single line of pairs.
    """
    at, total, anchor, least = gap, 0, _ANCHOR, 1e-8
    best, fewest, drift = None, _LEFT, None
    for _ in range(_ROUNDS):
        try:
            u, N, closed, steps, _ = _pivot(problem, u0, gap, anchor, at)
        except (NotHeld, Undecided):
            anchor = least = min(100 * anchor, _ANCHOR)
            continue
        total += steps
        exact = _without_anchors(problem, closed, u0, gap)
        if exact is not None:
            return *exact, closed, total, "proximal"
        drift = u - at
        carried = anchor * problem.k0 * drift
        if np.abs(carried).max() <= _CARRIED * np.abs(N).max():
            return u, N, closed, total, "proximal"
        if np.linalg.norm(carried) <= fewest * np.linalg.norm(N):
            best, fewest = (u, N, closed, total, "proximal"), 0.5 * np.linalg.norm(carried) / np.linalg.norm(N)
        at, anchor = u, max(anchor / 100, least)
    if best is None and drift is not None:
        raise NotHeld(f"the {int(closed.sum())} pairs that stay closed do not hold the damper", drift)
    return best


def _without_anchors(problem, closed, u0, gap):
    """(u, N) where the set solves the true problem, else None."""
    try:
        u, N = problem.on_set(closed, u0, gap)
    except NotHeld:
        return None
    return None if problem.wrong(closed, u, N, gap).any() else (u, N)


def _pivot(problem, u0, gap, anchor=0.0, at=0.0):
    closed = problem.free.copy()
    fewest, patience, method = np.inf, _PATIENCE, "newton"
    for step in range(1, _STEPS + 1):
        u, N = problem.on_set(closed, u0, gap, anchor, at)
        wrong = problem.wrong(closed, u, N, gap)
        count = int(wrong.sum())
        if not count:
            return u, N, closed, step, method
        if count < fewest:
            fewest, patience = count, _PATIENCE
        else:
            patience -= 1
        if patience < 0:
            method = "pivoting"
            wrong[:np.flatnonzero(wrong)[-1]] = False
        closed = closed ^ wrong
    raise Undecided("the set of closed pairs was not found: this should not happen, please report the case")
