"""Points of the random oscillators of `hbm_robustness.py`, drawn at random, against time integration from their orbits.

    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/benchmarks/hbm_truth_robustness.py [--count 200] [--leave 8]

Of every curve a share of 5 % of its points. Each is solved at H, 2H, 4H ... from the H of the curve on, up to the
smallest H whose doubling changes the amplitude of y2 by less than 0.25 %, and that solution is compared with the
integration started from its orbit. One JSON line a point goes to results/truth_robustness.jsonl beside this file; what
is there is not computed again. --summary only reads the file.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from hbm import continuation, fourier
from hbm.comparison import compare
from hbm.residual import HarmonicBalance
from hbm.response import follow_band
from tests.benchmarks.hbm_robustness import BAND, SEED, draw
from tests.hbm.oscillator import FORCE, Y2, oscillator

SHARE, SETTLED, MOST_HARMONICS = 0.05, 2.5e-3, 48
AGREES = 5e-3
STORE = Path(__file__).parent / "results" / "truth_robustness.jsonl"


def solve(problem, force, w, motion, H):
    """(balance, point, q) at H from the harmonics of the relative motion (nc, any)."""
    balance = HarmonicBalance(problem, {1: force}, H, "zero_force")
    x = np.zeros((len(motion), H + 1), complex)
    n = min(H + 1, motion.shape[1])
    x[:, :n] = motion[:, :n]
    point = continuation.solve_at(balance.evaluate, fourier.to_real(x).ravel(), w, balance.weights)
    q = balance.receptance.shapes @ point.detail.modal if point.converged else None
    return balance, point, q


def settled(problem, force, w, X, H):
    """(balance, point) at the smallest H = H, 2H, 4H ... whose doubling changes y2 little; None where none is."""
    balance, point, q = solve(problem, force, w, np.array(problem.B @ X), H)
    while q is not None and H <= MOST_HARMONICS:
        finer = solve(problem, force, w, np.array(problem.B @ q), 2 * H)
        if finer[2] is None:
            return None
        if abs(abs(finer[2][3, 1]) - abs(q[3, 1])) <= SETTLED * abs(finer[2][3, 1]):
            return balance, point
        (balance, point, q), H = finer, 2 * H
    return None


def check(i, hz, problem, force, X, H):
    began = time.process_time()
    row = {"oscillator": i, "hz": hz, "H_curve": H}
    found = settled(problem, force, 2 * np.pi * hz, X, H)
    if found is None:
        return row | {"H": None, "seconds": time.process_time() - began}
    balance, point = found
    c = compare(balance, point, [Y2["y2"]], tolerance=1e-5, most_periods=200)
    return row | {"H": balance.H, "difference": c.difference, "periodic": c.steady.periodic, "left": c.left,
                  "periods": c.steady.periods, "multiplier": c.steady.multiplier, "change": c.steady.period_change,
                  "said": c.said, "seconds": time.process_time() - began}


def one(i, settings):
    """Rows of an oscillator; one without a frequency where nothing was drawn."""
    mu, kn, kt, level, H = settings
    problem, force = oscillator(mu, kn, kt), level * FORCE
    curve = follow_band(problem, force, BAND, harmonics=H, outputs={f"q{j}": r for j, r in enumerate(np.eye(6))})
    good = np.flatnonzero(curve.converged)
    rng = np.random.default_rng([SEED + 1, i])
    drawn = rng.choice(good, max(1, round(SHARE * len(good))), replace=False)
    return [check(i, curve.frequency[j], problem, force, curve.harmonics[j], H) for j in np.sort(drawn)]


def summary(rows):
    """Figures of the rows of the store."""
    solved = [r for r in rows if r["H"]]
    stayed = [r for r in solved if r["periodic"] and not r["left"]]
    agree = [r for r in stayed if r["difference"] <= AGREES]
    return {"oscillators": len({r["oscillator"] for r in rows}), "points": len(rows), "settled": len(solved),
            "stayed": len(stayed), "agree": len(agree),
            "unstable": sum(r["multiplier"] > 1 + 1e-6 for r in stayed),
            "left": sum(r["left"] and r["periodic"] for r in solved),
            "not_periodic": sum(not r["periodic"] for r in solved),
            "median_difference": float(np.median([r["difference"] for r in stayed])) if stayed else None,
            "worst": sorted(stayed, key=lambda r: -r["difference"])[:10]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--leave", type=int, nargs="*", default=[], help="oscillators to leave for a later call")
    parser.add_argument("--store", type=Path, default=STORE)
    parser.add_argument("--summary", action="store_true")
    arguments = parser.parse_args()
    lines = arguments.store.read_text().splitlines() if arguments.store.is_file() else []
    rows = [json.loads(line) for line in lines]
    done = {r["oscillator"] for r in rows}
    for i, settings in enumerate(draw(arguments.count) if not arguments.summary else ()):
        if i in arguments.leave or i in done:
            continue
        began = time.process_time()
        new = one(i, settings)
        with open(arguments.store, "a", encoding="utf-8") as f:
            f.writelines(json.dumps(r) + "\n" for r in new)
        bad = [f"{r['hz']:.2f} Hz: {r.get('said', 'not settled')}" for r in new
               if not (r["H"] and r["periodic"] and not r["left"] and r["difference"] <= AGREES)]
        print(i, f"{len(new)} points, {time.process_time() - began:.1f} s", *bad, sep="; ", flush=True)
        rows += new
    print(json.dumps(summary(rows), indent=1))


if __name__ == "__main__":
    main()
