"""The two-blade rig with its tuned 18 pairs: every level and number of harmonics, with and without roll stiffness.

    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/benchmarks/hbm_rig.py

CPU time a point (one run each, after a first one that loads the kernels), residual calls, points, peak, and why a curve
ended early. The figures go to results/rig.json beside this file.
"""

import json
import time
from pathlib import Path

from hbm.response import follow_band
from tests.benchmarks.hbm_speed import processor, versions
from tests.hbm.cases import rig

BAND = (2300, 3300)
RESULTS = Path(__file__).parent / "results" / "rig.json"


def run(case, Fe, H) -> dict:
    problem, force, outputs = case
    began = time.process_time()
    curve = follow_band(problem, Fe * force, BAND, harmonics=H, outputs=outputs)
    ms = 1e3 * (time.process_time() - began) / len(curve.frequency)
    return {"Fe": Fe, "H": H, "ms": ms, "calls": curve.residual_calls / len(curve.frequency),
            "points": len(curve.frequency), "complete": bool(curve.complete), "leaps": len(curve.leaps),
            "peak": curve.peak(next(iter(outputs))), "ended": curve.ended}


def main():
    rows = []
    run(rig(), 1, 1)
    for roll in (True, False):
        case = rig(roll)
        for Fe in (1, 6, 10, 12, 20, 40):
            for H in (1, 3, 5, 9):
                rows.append({"roll": roll} | run(case, Fe, H))
                print(rows[-1], flush=True)
    mean = sum(r["ms"] for r in rows if r["roll"] and r["H"] == 5 and r["Fe"] <= 20) / 5
    print(f"mean at H = 5 over 1 to 20 N: {mean:.2f} ms a point")
    RESULTS.write_text(json.dumps({"processor": processor(), "versions": versions(), "mean_ms_H5": mean,
                                   "date": time.strftime("%Y-%m-%d"), "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
