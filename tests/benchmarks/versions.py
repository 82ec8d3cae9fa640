"""Two checkouts side by side: CPU time a point of the beam and of the rig, run alternately in two
processes.

    python -m tests.benchmarks.versions OLD_ROOT [--repeats 7]

Each checkout runs its own tests/hbm/cases.py. Prints the ratio of the medians, new / old, and how
far the peaks are apart. `./dev speed COMMIT` makes the old checkout."""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

from tests.benchmarks.record import ROOT, one_thread

CASES = {
    "B8, 20 N, H = 7": ("beam('B8')", 20, 7, (700, 1200)),
    "C8, 40 N, H = 7": ("beam('C8')", 40, 7, (700, 1200)),
    "C8, 200 N, H = 7": ("beam('C8')", 200, 7, (700, 1200)),
    "rig, 12 N, H = 5": ("rig()", 12, 5, (2300, 3300)),
    "rig, 20 N, H = 5": ("rig()", 20, 5, (2300, 3300)),
}

WORKER = """
import json, sys, time
from tipdamp.hbm.response import follow_band
from tests.hbm.cases import beam, rig
built = {}
for line in sys.stdin:
    case, level, H, band = json.loads(line)
    problem, force, outputs = built.setdefault(case, eval(case))
    began = time.process_time()
    curve = follow_band(problem, level * force, band, harmonics=H, outputs=outputs)
    seconds = time.process_time() - began
    print(json.dumps({"ms": 1e3 * seconds / len(curve.frequency), "points": len(curve.frequency),
                      "peak": list(curve.peak(next(iter(outputs))))}), flush=True)
"""


def start(root):
    """A process of a checkout that runs the cases it reads from its input."""
    return subprocess.Popen(
        [sys.executable, "-c", WORKER],
        cwd=root,
        env=os.environ | {"PYTHONPATH": str(root)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def run(worker, case):
    worker.stdin.write(json.dumps(case) + "\n")
    worker.stdin.flush()
    return json.loads(worker.stdout.readline())


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path, help="root of the other checkout")
    parser.add_argument("--repeats", type=int, default=7)
    arguments = parser.parse_args()
    old, new = start(arguments.old.resolve()), start(ROOT)
    for name, case in CASES.items():
        run(old, case), run(new, case)  # compiles, loads
        found = [(run(old, case), run(new, case)) for _ in range(arguments.repeats)]
        before, after = (statistics.median(pair[i]["ms"] for pair in found) for i in (0, 1))
        a, b = found[0]
        apart = max(abs(x / y - 1) for x, y in zip(a["peak"], b["peak"], strict=True))
        print(
            f"{name}: {after / before:.3f} of the time a point; points {a['points']} -> "
            f"{b['points']}; peaks apart by {apart:.1e}",
            flush=True,
        )
    for worker in (old, new):
        worker.stdin.close()
        worker.wait()


if __name__ == "__main__":
    main()
