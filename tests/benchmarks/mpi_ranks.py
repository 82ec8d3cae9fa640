"""Preload and stuck frequencies of the small two-blade rig on the full model: 1, 2 and 4 ranks under mpirun.

    python -m tests.benchmarks.mpi_ranks

29 000 dofs, crowned by 60 um so that pairs open; on springs, and with every other pair hard. The largest differences
from one rank go to results/mpi_ranks.json.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from meshes.two_blade_rig import main as make_meshes
from tests.benchmarks.record import one_thread, record
from tests.conftest import STUDY

ROUTE = Path(__file__).parents[1] / "static_contact" / "full" / "on_ranks.py"
RANKS = (1, 2, 4)


def solved(study, ranks, out):
    """Arrays of one run; Open MPI asks root for leave."""
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, "-m", "mpi4py", str(ROUTE),
                           str(study), str(out)], env={**os.environ, **root, "OMP_NUM_THREADS": "1"},
                          capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{ranks} ranks: {done.stderr[-800:]}")
    with np.load(out) as z:
        if int(z["ranks"]) != ranks:
            raise SystemExit(f"{ranks} ranks were asked for, {int(z['ranks'])} came")
        return {k: z[k] for k in z.files}


def main():
    one_thread()
    with tempfile.TemporaryDirectory() as folder:
        make_meshes(["--damper", "asymmetric", "--size", "0.5", "--out", folder])
        study = Path(folder, "rig.toml")
        study.write_text(STUDY)
        found = {n: solved(study, n, Path(folder, f"{n}.npz")) for n in RANKS}
    one = found[1]
    rows = [{"ranks": n, **{name: float(np.abs(z[name] - one[name]).max() / np.abs(one[name]).max())
                            for name in ("preload", "hard", "hz")}} for n, z in found.items()]
    print(*rows, sep="\n")
    record("mpi_ranks", {"pairs": len(one["preload"]), "open": int((one["preload"] < 0).sum()), "rows": rows})


if __name__ == "__main__":
    main()
