"""The benchmarks of docs/validation.md, one after another; some hours, by hand.

A figure there that an ordinary test holds names the test.

    python -m tests.benchmarks [NAME ...]

Figures go to build/benchmarks/NAME.json. A benchmark that fails is named at the end; the others go
on. Needs ccx (Debian: calculix-ccx) and the package index (for the peer, into a venv of its own).
"""

import argparse
import os
import subprocess
import sys
import time

from tests.benchmarks.record import ROOT

RUNS = (
    "speed",
    "curves",
    "kills",
    "point_floor",
    "following",
    "force_residuals",
    "rig",
    "robustness",
    "robustness_integration",
    "calculix",
    "calculix_surfaces",
    "calculix_modes",
    "cost_floor",
    "growth",
    "hundreds",
    "interface",
    "many_points",
    "jobs",
    "sweeps",
    "trust",
)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(RUNS))
    names = parser.parse_args().names or RUNS
    if unknown := set(names) - set(RUNS):
        parser.error(f"no benchmark '{unknown.pop()}'; there are: {', '.join(RUNS)}")
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    failed = []
    for name in names:
        print(f"== {name}, {time.strftime('%H:%M')}", flush=True)
        if subprocess.run(
            [sys.executable, "-m", f"tests.benchmarks.{name}"],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": path},
        ).returncode:
            failed.append(name)
    sys.exit(f"failed: {', '.join(failed)}" if failed else None)


if __name__ == "__main__":
    main()
