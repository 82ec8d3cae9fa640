"""Random planar blade-damper-blade oscillators, followed over 60..300 Hz with default settings: how many are complete.

    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/benchmarks/hbm_robustness.py [--count 200]

mu 0.1..0.8; kn and kt 1e5..1e8 N/m and excitation 0.05..5 log-uniform; H 1..9; seeded. What is not complete is listed
with its reason.
"""

import argparse
import time

import numpy as np

from hbm.response import follow_band
from tests.hbm.oscillator import FORCE, Y2, oscillator

SEED = 2016
BAND = (60, 300)


def draw(count):
    """Settings (mu, kn, kt, excitation, H) of the oscillators."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        mu, kn, kt = rng.uniform(0.1, 0.8), 10 ** rng.uniform(5, 8), 10 ** rng.uniform(5, 8)
        yield mu, kn, kt, 10 ** rng.uniform(np.log10(0.05), np.log10(5)), int(rng.integers(1, 10))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    complete, began = 0, time.perf_counter()
    count = parser.parse_args().count
    for i, (mu, kn, kt, level, H) in enumerate(draw(count)):
        curve = follow_band(oscillator(mu, kn, kt), level * FORCE, BAND, harmonics=H, outputs=Y2)
        complete += curve.complete
        if not curve.complete:
            print(f"{i}: mu {mu:.2f}, kn {kn:.2g}, kt {kt:.2g}, excitation {level:.2g}, H {H}, "
                  f"{len(curve.frequency)} points: {curve.ended}", flush=True)
    print(f"{complete} of {count} complete, {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
