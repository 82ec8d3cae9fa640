"""Every benchmark whose figures stand in docs/validation, one after another, then the pages. One to two hours.

    python -m tests.benchmarks [NAME ...]

Without names all of RUNS. A benchmark that fails is named at the end; the others go on. Needs ccx (Debian:
calculix-ccx), mpirun and the package index (for the peer, into a venv of its own).
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
STUDY = "docs/studies/two_blade_rig/asymmetric.toml"
RUNS = {
    "hbm_speed": [], "hbm_rig": [], "hbm_robustness": [], "hbm_truth_rig": ["--fresh"],
    "hbm_truth_robustness": ["--fresh"], "random_bodies": [], "preload_random_beams": [], "hertz": [],
    "calculix": ["--cells", "4"], "calculix_modes": [], "cost_floor": [], "growth": [], "mpi_ranks": [],
    "stuck_bound": ["RIG"],
}


def run(*command) -> bool:
    """Run `python ...` at the root of the project with the tree on its path; whether it succeeded."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return subprocess.run([sys.executable, *command], cwd=ROOT, env=os.environ | {"PYTHONPATH": path}).returncode == 0


def rig_results(folder) -> bool:
    """Meshes and the study of the rig, for what reads its results."""
    made = run("-m", "meshes.two_blade_rig", "--damper", "asymmetric", "--out", str((ROOT / STUDY).parent / "meshes"))
    return made and run("-m", "tipdamp", "run", STUDY, "--out", folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(RUNS))
    names = parser.parse_args().names or list(RUNS)
    if unknown := set(names) - set(RUNS):
        parser.error(f"no benchmark '{unknown.pop()}'; there are: {', '.join(RUNS)}")
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            print(f"== {name}, {time.strftime('%H:%M')}", flush=True)
            arguments = [folder if a == "RIG" else a for a in RUNS[name]]
            ready = folder not in arguments or rig_results(folder)
            if not ready or not run("-m", f"tests.benchmarks.{name}", *arguments):
                failed.append(name)
    run("-m", "tests.validation", "--front")
    sys.exit(f"failed: {', '.join(failed)}" if failed else None)


if __name__ == "__main__":
    main()
