"""Points of the random oscillators of `robustness.py`, drawn at random, against time integration
from their orbits.

    python -m tests.benchmarks.robustness_integration [--count 200]

5 % of the points of every curve. Each is solved at H = 1, 2, 3, ... up to the smallest H that 2H
and 2H + 1 change the amplitude of y2 by less than 0.25 %, and that solution is compared with the
integration started from its orbit. Both, because one of them is odd: even harmonics may add nothing
where odd ones do. A
solution counts as that of the point only where solving from it at the curve's H comes back to the
point. Where the difference exceeds 0.5 %, the next H that the same rule passes are tried too, to
tell a number of harmonics that only looked sufficient from a wrong solution. Hours.
"""

import argparse

import numpy as np

from tests.benchmarks.record import one_thread, record
from tests.benchmarks.robustness import BAND, SEED, draw
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.comparison import compare_point
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.time.settings import IntegrationSettings

SHARE, SETTLED, AGREES = 0.05, 2.5e-3, 5e-3
HARMONICS = (*range(1, 10), 12, 16, 24, 32)
FAILURES = 3  # so many numbers of harmonics without a solution, above that of the curve, are enough
MAX_PERIODS, MORE_TRIES, SAME = 200, 3, 1e-3
STATES = {
    "stable": "periodic, stable",
    "unstable": "periodic, unstable: found by Newton on the period map",
    "left": "left for another orbit",
    "not periodic": f"not periodic within {MAX_PERIODS} periods",
    "unsettled": (
        f"2H or 2H + 1 changes y2 by more than 0.25 %, up to H = {HARMONICS[-1]} or as far as "
        "there are solutions"
    ),
    "no solution": "no H has a solution, and one at the doubled H, that belong to the point",
}


def solve(problem, force, w, motion, H):
    """(balance, point, q) at H from the harmonics of the relative motion (nc, any); None where it
    does not converge."""
    balance = HarmonicBalance(problem, {1: force}, H, "zero_force")
    x = np.zeros((len(motion), H + 1), complex)
    n = min(H + 1, motion.shape[1])
    x[:, :n] = motion[:, :n]
    point = solve_fixed(balance.evaluate, fourier.to_real(x).ravel(), w, balance.weights)
    return (
        (balance, point, balance.receptance.shapes @ point.detail.modal)
        if point.converged
        else None
    )


def returns(problem, force, w, X, q):
    """Whether the solution q (r, any) leads back to X (r, H+1) when it is solved at its H."""
    back = solve(problem, force, w, np.array(problem.B @ q), X.shape[1] - 1)
    return back is not None and np.abs(back[2] - X)[:, 1].max() <= SAME * np.abs(X[:, 1]).max()


def settled(problem, force, w, X, tried):
    """The solutions, smallest H first, that 2H and 2H + 1 change little in y2; these start from
    them.

    tried : list that takes the relative change at every H that could be compared
    """
    motion, failures = np.array(problem.B @ X), 0
    for H in HARMONICS:
        if failures == FAILURES:
            break
        coarse = solve(problem, force, w, motion, H)
        good = coarse is not None and returns(problem, force, w, X, coarse[2])
        guess = np.array(problem.B @ coarse[2]) if good else None
        more = [solve(problem, force, w, guess, n) for n in (2 * H, 2 * H + 1)] if good else [None]
        if None in more:
            failures += H >= X.shape[1] - 1
            continue
        if H >= motion.shape[1]:
            motion = np.array(problem.B @ more[-1][2])
        y, finer = abs(coarse[2][3, 1]), np.abs([q[3, 1] for _, _, q in more])
        tried.append(np.max(np.abs(finer - y) / finer))
        if tried[-1] <= SETTLED:
            yield coarse[:2]


def check(hz, problem, force, X) -> dict:
    """One point: its H, the state of the integration, the difference, and the H at which a miss is
    none."""
    row, tried = {"hz": round(hz, 6), "state": None, "H_again": None}, []
    for n, (balance, point) in enumerate(settled(problem, force, 2 * np.pi * hz, X, tried)):
        c = compare_point(balance, point, [Y2["y2"]], IntegrationSettings(max_periods=MAX_PERIODS))
        if n == 0:
            row |= {"H": balance.H, "state": state(c), "difference": float(c.difference)}
        elif c.agrees and c.difference <= AGREES:
            row["H_again"] = balance.H
        if not c.agrees or c.difference <= AGREES or n == MORE_TRIES:
            break
    else:
        row["state"] = row["state"] or ("unsettled" if tried else "no solution")
    return row


def state(c):
    if not c.steady.periodic:
        return "not periodic"
    if c.left:
        return "left"
    return "stable" if c.stable else "unstable"


def one(i, settings) -> list:
    """The drawn points of an oscillator."""
    mu, kn, kt, level, H = settings
    problem, force = oscillator(mu, kn, kt), level * FORCE
    curve = follow_band(
        problem,
        force,
        BAND,
        harmonics=H,
        start="zero_force",
        outputs={f"q{j}": r for j, r in enumerate(np.eye(6))},
    )
    good = np.flatnonzero(curve.converged)
    drawn = np.random.default_rng([SEED + 1, i]).choice(
        good, max(1, round(SHARE * len(good))), replace=False
    )
    return [
        {"oscillator": i} | check(curve.frequency[j], problem, force, curve.harmonics[j])
        for j in np.sort(drawn)
    ]


def summary(rows) -> dict:
    """How many points are in which state, and how many of those that can be compared agree."""
    compared = {kind: [r for r in rows if r["state"] == kind] for kind in ("stable", "unstable")}
    return {
        "points": len(rows),
        "states": {s: sum(r["state"] == s for r in rows) for s in STATES},
        "agree": {
            k: sum(r["difference"] <= AGREES for r in found) for k, found in compared.items()
        },
        "agree_with_more": {
            k: sum(r["difference"] > AGREES and r["H_again"] is not None for r in found)
            for k, found in compared.items()
        },
        "worst": {
            k: max((r["difference"] for r in found), default=None) for k, found in compared.items()
        },
    }


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    rows = []
    for i, settings in enumerate(draw(parser.parse_args().count)):
        rows += one(i, settings)
        record("robustness_integration", summary(rows) | {"rows": rows})
    print(summary(rows))


if __name__ == "__main__":
    main()
