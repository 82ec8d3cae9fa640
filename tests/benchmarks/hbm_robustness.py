"""Random planar blade-damper-blade oscillators, followed over 60..300 Hz with default settings: how many are complete.

    python -m tests.benchmarks.hbm_robustness [--count 200]

mu 0.1..0.8; kn and kt 1e5..1e8 N/m and excitation 0.05..5 log-uniform; H 1..9; seeded. What is not complete, or not one
branch, is listed with its reason. The figures go to results/robustness.json beside this file, from which the validation
pages are filled; a run that was cut off goes on where it stopped, as long as the code of hbm is the same.
"""

import argparse
import time

import numpy as np

from hbm.response import follow_band
from tests.benchmarks.record import fingerprint, one_thread, record, recorded
from tests.hbm.oscillator import FORCE, Y2, oscillator

SEED = 2016
BAND = (60, 300)


def draw(count):
    """Settings (mu, kn, kt, excitation, H) of the oscillators."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        mu, kn, kt = rng.uniform(0.1, 0.8), 10 ** rng.uniform(5, 8), 10 ** rng.uniform(5, 8)
        yield mu, kn, kt, 10 ** rng.uniform(np.log10(0.05), np.log10(5)), int(rng.integers(1, 10))


def follow(i, mu, kn, kt, level, H) -> dict:
    """One oscillator: what there is to say about its curve."""
    began = time.process_time()
    curve = follow_band(oscillator(mu, kn, kt), level * FORCE, BAND, harmonics=H, outputs=Y2)
    label = f"{i}: mu {mu:.2f}, kn {kn:.2g}, kt {kt:.2g}, excitation {level:.2g}, H {H}"
    return {"label": label, "points": len(curve.frequency), "calls": curve.residual_calls,
            "complete": bool(curve.complete), "leaps": curve.restarts.tolist(), "gap_hz": curve.widest_gap,
            "ended": curve.ended, "seconds": time.process_time() - began}


def summary(curves) -> dict:
    """The figures of the validation page."""
    points = sum(c["points"] for c in curves)
    one = [c for c in curves if c["complete"] and not c["leaps"]]
    rest = [(c, f"{c['label']}, {c['points']} points: {c['ended']}") for c in curves if c not in one]
    return {"count": len(curves), "complete": sum(c["complete"] for c in curves), "one_branch": len(one),
            "points": points, "residual_calls_per_point": sum(c["calls"] for c in curves) / points,
            "widest_gap_hz": max(c["gap_hz"] for c in curves), "cpu_seconds": sum(c["seconds"] for c in curves),
            "incomplete": [text for c, text in rest if not c["complete"]],
            "leaps": [text for c, text in rest if c["complete"]]}


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    count = parser.parse_args().count
    before = recorded("robustness") or {}
    curves = before.get("curves", []) if before.get("code") == fingerprint("hbm") else []
    for i, drawn in enumerate(draw(count)):
        if i < len(curves):
            continue
        curves.append(follow(i, *drawn))
        if not curves[-1]["complete"] or curves[-1]["leaps"]:
            print(curves[-1]["label"], curves[-1]["ended"], flush=True)
        record("robustness", summary(curves) | {"curves": curves})
    print({k: v for k, v in summary(curves).items() if k not in ("incomplete", "leaps")})


if __name__ == "__main__":
    main()
