"""Points of the random oscillators of `hbm_robustness.py`, drawn at random, against time integration from their orbits.

    python -m tests.benchmarks.hbm_truth_robustness [--minutes 10] [--fresh]

5 % of the points of every curve. Each is solved at H = 1, 2, 3, ... up to the smallest H whose doubling changes the
amplitude of y2 by less than 0.25 %, and that solution is compared with the integration started from its orbit. A
solution counts as that of the point only where solving from it at the curve's H comes back to the point. Where the
difference exceeds 0.5 %, the next H that the same rule passes are tried too, to tell a number of harmonics that only
looked sufficient from a wrong solution.

results/truth_robustness.jsonl beside this file: a line on the run (day, versions, code), then a line an oscillator. A
run that was cut off, or stopped after --minutes, goes on where it stopped as long as the code of hbm is the same; with
other code it refuses, and --fresh begins anew. --summary only reads the file.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from hbm import fourier
from hbm.balance.residual import HarmonicBalance
from hbm.continuation.corrector import solve_fixed
from hbm.response import follow_band
from hbm.time.comparison import compare_point
from tests.benchmarks.hbm_robustness import BAND, SEED, draw
from tests.benchmarks.record import fingerprint, made, one_thread
from tests.hbm.oscillator import FORCE, Y2, oscillator

COUNT, SHARE, SETTLED, AGREES = 200, 0.05, 2.5e-3, 5e-3
HARMONICS = (*range(1, 10), 12, 16, 24, 32)
FAILURES = 3             # so many numbers of harmonics without a solution, above that of the curve, are enough
MOST_PERIODS, MORE_TRIES, SAME = 200, 3, 1e-3
COLUMNS = ("hz", "H", "state", "difference", "periods", "change", "multiplier", "H_again", "difference_again")
STATES = {"stable": "periodic, stable", "unstable": "periodic, unstable: found by Newton on the period map",
          "left": "left for another orbit", "not periodic": f"not periodic within {MOST_PERIODS} periods",
          "unsettled": f"doubling changes y2 by more than 0.25 %, up to H = {HARMONICS[-1]} or as far as there are "
                       "solutions",
          "no solution": "no H has a solution, and one at the doubled H, that belong to the point"}
STORE = Path(__file__).parent / "results" / "truth_robustness.jsonl"


def solve(problem, force, w, motion, H):
    """(balance, point, q) at H from the harmonics of the relative motion (nc, any); None where it does not converge."""
    balance = HarmonicBalance(problem, {1: force}, H, "zero_force")
    x = np.zeros((len(motion), H + 1), complex)
    n = min(H + 1, motion.shape[1])
    x[:, :n] = motion[:, :n]
    point = solve_fixed(balance.evaluate, fourier.to_real(x).ravel(), w, balance.weights)
    return (balance, point, balance.receptance.shapes @ point.detail.modal) if point.converged else None


def returns(problem, force, w, X, q):
    """Whether the solution q (r, any) leads back to X (r, H+1) when it is solved at its H."""
    back = solve(problem, force, w, np.array(problem.B @ q), X.shape[1] - 1)
    return back is not None and np.abs(back[2] - X)[:, 1].max() <= SAME * np.abs(X[:, 1]).max()


def settled(problem, force, w, X, tried):
    """The solutions, smallest H first, whose doubling changes y2 little; their doubled ones start from them.

    tried : list that takes the relative change at every H that could be compared
    """
    motion, failures = np.array(problem.B @ X), 0
    for H in HARMONICS:
        if failures == FAILURES:
            break
        coarse = solve(problem, force, w, motion, H)
        good = coarse is not None and returns(problem, force, w, X, coarse[2])
        fine = solve(problem, force, w, np.array(problem.B @ coarse[2]), 2 * H) if good else None
        if fine is None:
            failures += H >= X.shape[1] - 1
            continue
        if H >= motion.shape[1]:
            motion = np.array(problem.B @ fine[2])
        y, finer = abs(coarse[2][3, 1]), abs(fine[2][3, 1])
        tried.append(abs(finer - y) / finer)
        if tried[-1] <= SETTLED:
            yield coarse[:2]


def check(hz, problem, force, X):
    """One point in the order of COLUMNS."""
    row, tried = dict.fromkeys(COLUMNS) | {"hz": round(hz, 6)}, []
    for n, (balance, point) in enumerate(settled(problem, force, 2 * np.pi * hz, X, tried)):
        c = compare_point(balance, point, [Y2["y2"]], tolerance=1e-5, most_periods=MOST_PERIODS)
        if n == 0:
            row |= {"H": balance.H, "state": state(c), "difference": figure(c.difference), "periods": c.steady.periods,
                    "change": figure(c.steady.period_change), "multiplier": figure(c.steady.multiplier)}
        elif c.agrees and c.difference <= AGREES:
            row |= {"H_again": balance.H, "difference_again": figure(c.difference)}
        if not c.agrees or c.difference <= AGREES or n == MORE_TRIES:
            break
    else:
        if row["state"] is None:
            row["state"] = "unsettled" if tried else "no solution"
    return [row[name] for name in COLUMNS]


def figure(value):
    return float(f"{value:.3e}") if np.isfinite(value) else None


def state(c):
    if not c.steady.periodic:
        return "not periodic"
    if c.left:
        return "left"
    return "unstable" if c.steady.multiplier > 1 + 1e-6 else "stable"


def one(i, settings) -> dict:
    """The line of an oscillator: its points drawn, and how many the curve has."""
    began = time.process_time()
    mu, kn, kt, level, H = settings
    problem, force = oscillator(mu, kn, kt), level * FORCE
    curve = follow_band(problem, force, BAND, harmonics=H, outputs={f"q{j}": r for j, r in enumerate(np.eye(6))})
    good = np.flatnonzero(curve.converged)
    drawn = np.random.default_rng([SEED + 1, i]).choice(good, max(1, round(SHARE * len(good))), replace=False)
    points = [check(curve.frequency[j], problem, force, curve.harmonics[j]) for j in np.sort(drawn)]
    return {"oscillator": i, "H_curve": H, "of": len(curve.frequency), "points": points,
            "seconds": round(time.process_time() - began, 2)}


def stored(path=STORE):
    """(header, rows {column: value} with their oscillator) of a store; (None, []) where there is none."""
    lines = [json.loads(x) for x in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []
    if not lines:
        return None, []
    return lines[0], [{"oscillator": x["oscillator"], **dict(zip(COLUMNS, point, strict=True))} for x in lines[1:]
                      for point in x["points"]]


def summary(rows) -> dict:
    """How many points are in which state, and how many of those that can be compared agree."""
    compared = {kind: [r for r in rows if r["state"] == kind] for kind in ("stable", "unstable")}
    return {"oscillators": len({r["oscillator"] for r in rows}), "points": len(rows),
            "states": {s: sum(r["state"] == s for r in rows) for s in STATES},
            "agree": {k: sum(r["difference"] <= AGREES for r in found) for k, found in compared.items()},
            "agree_with_more": {k: sum(r["difference"] > AGREES and r["H_again"] is not None for r in found)
                                for k, found in compared.items()},
            "worst": {k: max((r["difference"] for r in found), default=None) for k, found in compared.items()}}


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so many, to go on in another call")
    parser.add_argument("--fresh", action="store_true", help="begin anew")
    parser.add_argument("--store", type=Path, default=STORE)
    parser.add_argument("--summary", action="store_true")
    arguments = parser.parse_args()
    path, began = arguments.store, time.monotonic()
    if not arguments.summary:
        if arguments.fresh or not path.is_file():
            path.write_text(json.dumps(made("truth_robustness")) + "\n", encoding="utf-8")
        lines = [json.loads(x) for x in path.read_text(encoding="utf-8").splitlines()]
        if lines[0].get("code") != fingerprint("hbm"):
            parser.error(f"{path.name} is of other code of hbm; --fresh begins anew")
        done = {x["oscillator"] for x in lines[1:]}
        for i, settings in enumerate(draw(arguments.count)):
            if i in done:
                continue
            if time.monotonic() - began > 60 * arguments.minutes:
                print(f"stopped before oscillator {i}; the next call goes on")
                break
            line = one(i, settings)
            with open(path, "a", encoding="utf-8") as f:
                f.write(json.dumps(line) + "\n")
            bad = [p for p in line["points"] if p[2] not in ("stable", "unstable") or p[3] > AGREES]
            print(i, f"{len(line['points'])} points, {len(bad)} not in agreement, {line['seconds']:.1f} s", flush=True)
    print(json.dumps(summary(stored(path)[1]), indent=1))


if __name__ == "__main__":
    main()
