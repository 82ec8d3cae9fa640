"""Random planar blade-damper-blade oscillators, followed over 60..300 Hz with default settings: how
many are complete.

    python -m tests.benchmarks.robustness [--count 200]

mu 0.1..0.8; kn and kt 1e5..1e8 N/m and excitation 0.05..5 log-uniform; H 1..9; seeded. What is not
complete, or not one branch, is listed with its reason.
"""

import argparse

import numpy as np

from tests.benchmarks.record import one_thread, record
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm.response import follow_band

SEED = 2016
BAND = (60, 300)


def draw(count):
    """Settings (mu, kn, kt, excitation, H) of the oscillators."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        mu = rng.uniform(0.1, 0.8)
        kn = 10 ** rng.uniform(5, 8)
        kt = 10 ** rng.uniform(5, 8)
        yield mu, kn, kt, 10 ** rng.uniform(np.log10(0.05), np.log10(5)), int(rng.integers(1, 10))


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    curves, listed = [], []
    for i, (mu, kn, kt, level, H) in enumerate(draw(parser.parse_args().count)):
        curve = follow_band(
            oscillator(mu, kn, kt), level * FORCE, BAND, harmonics=H, outputs=Y2, start="zero_force"
        )
        curves.append(curve)
        if not curve.complete or len(curve.restarts):
            listed.append(
                f"{i}: mu {mu:.2f}, kn {kn:.2g}, kt {kt:.2g}, excitation {level:.2g}, H {H}, "
                f"{len(curve.frequency)} points: {curve.ended}"
            )
            print(listed[-1], flush=True)
    points = sum(len(c.frequency) for c in curves)
    found = {
        "count": len(curves),
        "complete": sum(bool(c.complete) for c in curves),
        "points": points,
        "one_branch": sum(bool(c.complete) and not len(c.restarts) for c in curves),
        "residual_calls_per_point": sum(c.residual_calls for c in curves) / points,
        "widest_gap_hz": max(c.widest_gap for c in curves),
    }
    print(found)
    record("robustness", found | {"listed": listed})


if __name__ == "__main__":
    main()
