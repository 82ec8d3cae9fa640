"""Random planar blade-damper-blade oscillators, followed over 60..300 Hz with default settings: how many are complete.

    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/benchmarks/hbm_robustness.py [--count 200] [--check 0.05]

mu 0.1..0.8; kn and kt 1e5..1e8 N/m and excitation 0.05..5 log-uniform; H 1..9; seeded. What is not complete, or not one
branch, is listed with its reason. --check: this share of the points, drawn at random, is compared with time integration
started from the orbit, at the smallest number of harmonics whose doubling changes the first harmonic by less than
0.25 %; points where the integration leaves for another orbit are listed. The figures go to results/robustness.json
beside this file, from which docs/validation.md is filled.
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
from tests.hbm.oscillator import FORCE, Y2, oscillator

SEED = 2016
BAND = (60, 300)
SETTLED, MOST_HARMONICS = 2.5e-3, 40
AGREES, LEFT = 5e-3, 3e-2      # relative difference that passes, and from which on it is another orbit
RESULTS = Path(__file__).parent / "results" / "robustness.json"


def draw(count):
    """Settings (mu, kn, kt, excitation, H) of the oscillators."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        mu, kn, kt = rng.uniform(0.1, 0.8), 10 ** rng.uniform(5, 8), 10 ** rng.uniform(5, 8)
        yield mu, kn, kt, 10 ** rng.uniform(np.log10(0.05), np.log10(5)), int(rng.integers(1, 10))


def settled_point(problem, force, w, X, H):
    """(balance, point) at the smallest H whose doubling changes the first harmonic of y2 little; None where none is.

    The search starts from the harmonics X (r, H+1) of the point of the curve.
    """
    x0, before = np.array(problem.B @ X), X[3, 1]
    while H <= MOST_HARMONICS:
        finer = HarmonicBalance(problem, {1: force}, 2 * H, "zero_force")
        x = np.zeros((len(x0), 2 * H + 1), complex)
        x[:, :x0.shape[1]] = x0
        point = continuation.solve_at(finer.evaluate, fourier.to_real(x).ravel(), w, finer.weights)
        if not point.converged:
            return None
        X = finer.receptance.shapes @ point.detail.modal
        if abs(X[3, 1] - before) <= SETTLED * abs(X[3, 1]):
            return finer, point
        x0, before, H = np.array(problem.B @ X), X[3, 1], 2 * H
    return None


def check(problem, force, curve, full, share, rng):
    """[(Hz, H, relative difference or None, periodic)] of a share of the points of a curve."""
    good = np.flatnonzero(curve.converged)
    found = []
    for i in rng.choice(good, max(1, round(share * len(good))), replace=False):
        w = 2 * np.pi * curve.frequency[i]
        settled = settled_point(problem, force, w, full[i], curve.H)
        if settled is None:
            found.append((curve.frequency[i], None, None, False))
            continue
        balance, point = settled
        compared = compare(balance, point, [Y2["y2"]], tolerance=1e-5, most_periods=200)
        steady, difference = compared.steady, compared.difference
        found.append((curve.frequency[i], balance.H, difference, steady.periodic))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--check", type=float, default=0.0, help="share of the points to compare with integration")
    arguments = parser.parse_args()
    rng, began = np.random.default_rng(SEED + 1), time.perf_counter()
    incomplete, leaps, checked, points, calls = [], [], [], 0, 0
    outputs = {f"q{i}": row for i, row in enumerate(np.eye(6))}
    for i, (mu, kn, kt, level, H) in enumerate(draw(arguments.count)):
        problem, force = oscillator(mu, kn, kt), level * FORCE
        curve = follow_band(problem, force, BAND, harmonics=H, outputs=outputs if arguments.check else Y2)
        points, calls = points + len(curve.frequency), calls + curve.residual_calls
        label = f"{i}: mu {mu:.2f}, kn {kn:.2g}, kt {kt:.2g}, excitation {level:.2g}, H {H}"
        if not curve.complete or len(curve.leaps):
            kind = leaps if curve.complete else incomplete
            kind.append(f"{label}, {len(curve.frequency)} points: {curve.ended}")
            print("complete, not one branch" if curve.complete else "INCOMPLETE", label, curve.ended, flush=True)
        if arguments.check:
            for hz, used, difference, periodic in check(problem, force, curve, curve.harmonics, arguments.check, rng):
                checked.append([i, hz, used, difference, periodic])
                if used is None or not periodic or difference > AGREES:
                    print(f"    {i}: {hz:.2f} Hz, H {used}: difference {difference}, periodic {periodic}", flush=True)
        done = i + 1 - len(incomplete)
        figures = {"count": i + 1, "complete": done, "one_branch": done - len(leaps), "points": points,
                   "residual_calls_per_point": calls / points, "incomplete": incomplete, "leaps": leaps,
                   "checked": checked}
        RESULTS.parent.mkdir(exist_ok=True)
        RESULTS.write_text(json.dumps(figures, indent=1) + "\n")
    print(f"{done} of {arguments.count} complete, {done - len(leaps)} as one branch, {points} points, "
          f"{calls / points:.2f} residual calls a point, {time.perf_counter() - began:.0f} s")
    _summary(checked)


def _summary(checked):
    if not checked:
        return
    settled = [c for c in checked if c[2] is not None]
    stayed = [c for c in settled if c[3] < LEFT]
    agree = [c for c in stayed if c[3] <= AGREES]
    print(f"{len(checked)} points drawn; {len(settled)} settled in harmonics; {len(stayed)} where the integration "
          f"stayed on the orbit; {len(agree)} of these agree to 0.5 %")


if __name__ == "__main__":
    main()
