"""Time, fill and memory of one body's assembly and reduction, from 10 000 to 300 000 dofs, a
process for each size.

    python -m tests.benchmarks.growth [--last 6]

A clamped block of 8-node hexahedra is reduced onto 62 nodes of its top and 20 fixed-interface
modes. To build/benchmarks/growth.json go CPU seconds of each part, entries of the Cholesky factor,
largest resident memory, and what `tipdamp.modal.memory` predicts.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time

import numpy as np

from tests.benchmarks.calculix_modes import STEEL, block
from tests.benchmarks.record import one_thread, record
from tipdamp.modal import craig_bampton, eigen
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import elastic_body
from tipdamp.modal.memory import predicted_bytes
from tipdamp.modal.solvers.cholesky import Cholmod

# 10 to 298 thousand
CELLS = ((7, 14, 28), (10, 20, 40), (13, 26, 50), (16, 32, 64), (20, 40, 80), (22, 46, 92))
MASTERS, MODES = 62, 20


def timed(owner, name, spent):
    """Let owner.name add its CPU seconds to spent[name]."""
    inner = getattr(owner, name)

    def outer(*arguments, **named):
        began = time.process_time()
        try:
            return inner(*arguments, **named)
        finally:
            spent[name] = spent.get(name, 0.0) + time.process_time() - began

    setattr(owner, name, outer)


def run(cells):
    # forms are compiled before the clock runs
    elastic_body(block((2, 2, 2)), STEEL, "block", clamp="z0")
    mesh = block(np.array(cells))
    began = time.process_time()
    body = elastic_body(mesh, STEEL, "block", clamp="z0")
    assembled = time.process_time()
    spent, fill = {}, []
    for owner, name in (
        (Cholmod, "__init__"),
        (Factor, "_lowest"),
        (Cholmod, "solve"),
        (eigen, "modes_below"),
        (craig_bampton, "_left_out"),
    ):
        timed(owner, name, spent)
    init = Cholmod.__init__

    def counted(self, *arguments):
        init(self, *arguments)
        fill.append(self.pc.getFactorMatrix().getInfo()["nz_used"])

    Cholmod.__init__ = counted
    top = mesh.node[np.abs(mesh.position[:, 2] - mesh.position[:, 2].max()) < 1e-9]
    part = craig_bampton.craig_bampton(body, np.sort(top)[:MASTERS], MODES)
    reduced = time.process_time()
    return {
        "dofs": body.dofs,
        "interior": len(part.interior),
        "assembly": assembled - began,
        "factor": spent["__init__"],
        "count": spent["modes_below"],
        "modes": spent["_lowest"],
        "error_bound": spent["_left_out"],
        "reduction": reduced - assembled,
        "fill": fill[0],
        "peak_GiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "predicted_GiB": predicted_bytes(len(mesh.node)) / 2**30,
    }


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--last", type=int, default=len(CELLS), help="how many sizes")
    parser.add_argument("--one", type=int, nargs=3, help="one size in this process, as JSON")
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(run(arguments.one)))
        return
    rows = []
    for cells in CELLS[: arguments.last]:
        command = [sys.executable, "-m", "tests.benchmarks.growth", "--one", *map(str, cells)]
        rows.append(
            json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        )
        print("  ".join(f"{k} {v:.4g}" for k, v in rows[-1].items()), flush=True)
        record("growth", {"load": os.getloadavg()[0], "rows": rows})
    x = np.log([r["interior"] for r in rows])
    for key in ("assembly", "factor", "count", "modes", "fill", "peak_GiB"):
        print(f"{key} ~ dofs^{np.polyfit(x[-3:], np.log([r[key] for r in rows[-3:]]), 1)[0]:.2f}")


if __name__ == "__main__":
    main()
