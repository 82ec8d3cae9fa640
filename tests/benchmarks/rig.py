"""Every curve of the two-blade rig's tuned 18 pairs, with and without roll stiffness, and of the
frictional beam.

    python -m tests.benchmarks.rig

CPU time a point (one run each, after a first one that loads the kernels), residual calls, points,
peak, and why a curve ended early; at 20 N and H = 5 also with the damping as a matrix: the modal
one, and one that couples the modes. The figures go to build/benchmarks/rig.json.
"""

import time
from dataclasses import replace

import numpy as np

from tests.benchmarks.record import one_thread, record
from tests.hbm.cases import beam, rig
from tipdamp.hbm.response import follow_band

BAND = (2300, 3300)
LEVELS, HARMONICS = (1, 6, 10, 12, 20, 40), (1, 3, 5, 9)


BEAMS = {"B8": (1, 20, 80), "C8": (1, 40, 200)}
BEAM_BAND = (700, 1200)
BEAM_HARMONICS = (1, 3, 7)


def run(case, Fe, H, band=BAND) -> dict:
    problem, force, outputs = case
    began = time.process_time()
    curve = follow_band(problem, Fe * force, band, harmonics=H, outputs=outputs)
    ms = 1e3 * (time.process_time() - began) / len(curve.frequency)
    return {
        "Fe": Fe,
        "H": H,
        "ms": ms,
        "calls": curve.residual_calls / len(curve.frequency),
        "points": len(curve.frequency),
        "complete": bool(curve.complete),
        "restarts": len(curve.restarts),
        "peak": curve.peak(next(iter(outputs))),
        "ended": curve.ended,
    }


def damped(case):
    """(label, case) with modal damping, the same as a matrix, and with one that acts along the
    force too."""
    problem, force, outputs = case
    # of the stuck system, where K is 1
    modal = np.diag(2 * problem.damping_ratio * np.sqrt(np.diag(problem.M)))
    where = force / np.linalg.norm(force)
    coupled = modal + np.trace(modal) / len(modal) * np.outer(where, where)
    yield "modal damping", case
    yield (
        "the same damping as a matrix",
        (replace(problem, C=modal, damping_ratio=None), force, outputs),
    )
    yield (
        "a matrix that couples the modes",
        (replace(problem, C=coupled, damping_ratio=None), force, outputs),
    )


def main():
    one_thread()
    rows = []
    run(rig(), 1, 1), run(beam("B8"), 1, 1, BEAM_BAND)
    for roll in (True, False):
        case = rig(roll)
        for Fe in LEVELS:
            for H in HARMONICS:
                rows.append({"roll": roll} | run(case, Fe, H))
                print(rows[-1], flush=True)
    beams = [
        {"case": name} | run(beam(name), Fe, H, BEAM_BAND)
        for name, levels in BEAMS.items()
        for Fe in levels
        for H in BEAM_HARMONICS
    ]
    damping = []
    for label, case in damped(rig()):
        damping.append({"case": label} | run(case, 20, 5))
        print(damping[-1], flush=True)
    mean = sum(r["ms"] for r in rows if r["roll"] and r["H"] == 5 and r["Fe"] <= 20) / 5
    print(f"mean at H = 5 over 1 to 20 N: {mean:.2f} ms a point")
    record("rig", {"mean_ms_H5": mean, "rows": rows, "beam": beams, "damping": damping})


if __name__ == "__main__":
    main()
