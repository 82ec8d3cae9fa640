"""Curves side by side: time of a study of 40 curves of the rig by number of processes.

    python -m tests.benchmarks.jobs

Prints for each number of jobs the wall time, and what it would be on a machine without other work:
the CPU time of the process that feeds the others, and of the longest of these.
"""

import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.benchmarks.record import one_thread, record
from tests.hbm.cases import rig
from tipdamp.engine.curves import CurveCase, Curves, compile_kernels
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Workers
from tipdamp.stages.respond import make_curve

CASES = [
    CurveCase(float(Fe), H, band)
    for H in (5, 3, 1)
    for Fe in np.linspace(20, 2, 7)
    for band in ((2300.0, 3300.0), (3300.0, 2300.0))
][:40]


def timed(curves, case, report):
    """A curve, and the CPU time of this process so far."""
    make_curve(curves, case, report)
    (curves.store.folder / f"{os.getpid()}.cpu").write_text(str(time.process_time()))


def measured(jobs):
    """(wall, ideal) s."""
    problem, force, rows = rig()
    with tempfile.TemporaryDirectory() as folder, Workers(jobs) as workers:
        # a function in a function is not handed to a process
        problem = replace(problem, describe=None)
        curves = Curves(problem, force, rows, None, Store(Path(folder)))
        wall, cpu = time.perf_counter(), time.process_time()
        problem.receptance()
        assert len(list(workers.spread(timed, curves, CASES, lambda *_: None))) == len(CASES)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        theirs = sorted(float(f.read_text()) for f in Path(folder).glob("*.cpu"))
        print(
            f"{jobs} jobs: {cpu:.1f} s here" + f", {theirs} s in the others" * (jobs > 1),
            flush=True,
        )
        return wall, cpu if jobs == 1 else cpu + theirs[-1]


def main():
    from tests.benchmarks.jobs import measured  # a process finds `timed` by the name of its module

    one_thread()
    compile_kernels(None, rig()[0].law, None)
    found = {jobs: measured(jobs) for jobs in (1, 2)}
    rows = [
        {"jobs": jobs, "wall_s": wall, "alone_s": ideal, "times": found[1][1] / ideal}
        for jobs, (wall, ideal) in found.items()
    ]
    print(*rows, sep="\n")
    record("jobs", {"curves": len(CASES), "rows": rows})


if __name__ == "__main__":
    main()
