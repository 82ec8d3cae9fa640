"""Wall time and memory of the whole way, mesh to report: median of several runs in fresh processes, on an idle machine.

    python -m tests.benchmarks.demo [--runs 5] [--study docs/studies/two_blade_rig/asymmetric.toml]

Not a test: times depend on the machine, which is named beside them. The figures go to build/benchmarks/demo.json.
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

from tests.benchmarks.record import ROOT, one_thread, processor, record


def main():
    one_thread()
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
    middle = {name: statistics.median(s[name] for s in stages) for name in stages[0]}
    record("demo", {"study": Path(arguments.study).name, "load": os.getloadavg()[0], "runs_s": seconds,
                    "median_s": statistics.median(seconds), "stages_s": middle, "peak_GiB": peak})
    print(f"{processor()}, {os.cpu_count()} cores, OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'unset')}")
    print(f"median {statistics.median(seconds):.1f} s of {arguments.runs} runs, largest process {peak:.2f} GiB")
    for name, took in middle.items():
        print(f"  {name:10s} {took:7.2f} s")


if __name__ == "__main__":
    main()
