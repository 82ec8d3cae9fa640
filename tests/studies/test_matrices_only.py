"""The example docs/studies/matrices_only, in a fresh process in which no finite-element package can be imported."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "studies" / "matrices_only"
BLOCK = """
import runpy, sys
for name in ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio"):
    sys.modules[name] = None
runpy.run_path(sys.argv[1], run_name="__main__")
"""


def run(script, folder):
    done = subprocess.run([sys.executable, "-c", BLOCK, EXAMPLE / script], cwd=folder, capture_output=True, text=True,
                          env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_example_runs_from_its_files_alone(tmp_path):
    run("make_matrices.py", tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["K.mtx", "M.mtx", "dofs.csv", "pairs.csv"]
    lines = run("run.py", tmp_path).splitlines()[1:]
    assert len(lines) == 3 and all(line.endswith("reached the end of the band") for line in lines)
    hz, per_newton, slipping = np.array([line.split()[1:4] for line in lines], dtype=float).T
    assert slipping[0] == 0 and slipping[-1] == 6
    assert (np.diff(per_newton) <= 0).all() and hz[-1] < hz[0]
