"""Wall time and memory of the whole way, mesh to report: median of several runs in fresh processes, on an idle machine.

    .venv/bin/python tests/benchmarks/demo.py [--runs 5] [--study docs/studies/two_blade_rig/asymmetric.toml]

Not a test: times depend on the machine, which is named beside them.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--study", default=str(ROOT / "docs/studies/two_blade_rig/asymmetric.toml"))
    arguments = parser.parse_args()
    seconds, stages = [], []
    for run in range(arguments.runs):
        with tempfile.TemporaryDirectory() as folder:
            began = time.perf_counter()
            subprocess.run([sys.executable, "-m", "meshes.two_blade_rig", "--damper", "asymmetric", "--out",
                            f"{folder}/meshes"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
            subprocess.run([sys.executable, "-m", "tipdamp", "run", arguments.study, "--out", f"{folder}/results",
                            "--quiet"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
            seconds.append(time.perf_counter() - began)
            stages.append(json.loads(Path(folder, "results", "summary.json").read_text())["seconds"])
        print(f"run {run + 1}: {seconds[-1]:.1f} s")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    print(f"{processor()}, {os.cpu_count()} cores, OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'unset')}")
    print(f"median {statistics.median(seconds):.1f} s of {arguments.runs} runs, largest process {peak:.2f} GiB")
    for name in stages[0]:
        print(f"  {name:10s} {statistics.median(s[name] for s in stages):7.2f} s")


def processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown processor"


if __name__ == "__main__":
    main()
