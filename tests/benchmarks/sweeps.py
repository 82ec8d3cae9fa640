"""A sweep of a small model with one job, with two, and on two processes of a local dask cluster.

    python -m tests.benchmarks.sweeps [--cases 60]

Prints for each the wall time of `tipdamp sweep` beside that of one job, the efficiency of its
processes, the share of their time that steps take, and at 25, 50 and 75 % of the cases the time
left as it was told beside what it was; then the time of the cluster beside that of two jobs, and
the seconds in which an index of 10 000 cases is opened. The machine should have nothing else to do.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.record import record
from tests.tipdamp.rig_study import CHAIN, write_chain
from tests.tipdamp.sweep import large_index
from tipdamp.engine.workers import Workers
from tipdamp.hbm.errors import InputError
from tipdamp.sweep.index import Index
from tipdamp.sweep.run import _Running
from tipdamp.sweep.summary import status
from tipdamp.sweep.work import SweepWork

STUDY = CHAIN.replace("harmonics = [1]", "harmonics = [7]")
OVER = """
[sweep.over]
model.pull = [60, 30]
respond.levels = {{ start = 5, stop = 40, count = {count} }}
"""
WAYS = {
    "one job": (1, ("--jobs", "1")),
    "two jobs": (2, ("--jobs", "2")),
    "local cluster of two": (2, ("--jobs", "2", "--scheduler", "local")),
}
CASES = 10_000  # of the index
SHARES = (0.25, 0.5, 0.75)
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


def told(folder):
    """(cases done, s since 1970 at which the time left was told, s left), as of now; None before
    anything was told."""
    try:
        with Index(folder) as index:
            facts = index.facts()
            done = index.counts().get("done", 0)
    except (InputError, OSError):  # it is not there yet
        return None
    return (done, facts["told"], facts["left"]) if facts.get("left") else None


def measured(study, out, jobs, options):
    """A row of figures of one sweep."""
    command = [sys.executable, "-m", "tipdamp", "sweep", str(study), "--quiet", "--out", str(out)]
    began, said = time.time(), []
    with subprocess.Popen(
        [*command, *options], stdout=subprocess.DEVNULL, env=os.environ | ONE_THREAD
    ) as process:
        while process.poll() is None:
            said += filter(None, [told(out / "sweep")])
            time.sleep(0.2)
    ended = time.time()
    with Index(out / "sweep") as index:
        cases = sum(index.counts().values())
        work = sum(count * seconds for count, seconds, _ in index.costs().values())
    row = {"wall_s": ended - began, "steps_s": work, "at_work": work / jobs / (ended - began)}
    for share in SHARES:
        at = [(when, left) for done, when, left in said if done >= share * cases]
        for when, left in at[:1]:
            row[f"at {share:.0%}"] = {"told_s": left, "was_s": ended - when}
    return row


def of_large_index(folder, count):
    """{operation: s} on the index of so many finished cases."""
    whole, found = large_index.write(folder, count), {}

    def taking(name, operation):
        began = time.perf_counter()
        operation()
        found[name] = time.perf_counter() - began

    taking("status", lambda: status(folder))
    with Index(folder, write=True) as index, Workers(1) as workers:
        sweep = _Running(SweepWork(folder, {}, folder), whole, index, workers)
        taking("a sweep that goes on", lambda: sweep.take_stock(False))
        taking("all rows", index.curves)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, default=60)
    cases = parser.parse_args().cases
    rows = {}
    with tempfile.TemporaryDirectory() as place:
        study = write_chain(Path(place))
        study.write_text(STUDY + OVER.format(count=cases // 2))
        for name, (jobs, options) in WAYS.items():
            row = measured(study, Path(place) / name.replace(" ", "_"), jobs, options)
            times = rows.get("one job", row)["wall_s"] / row["wall_s"]
            rows[name] = row | {"times": times, "efficiency": times / jobs}
            print(name, rows[name], flush=True)
        (folder := Path(place) / "index").mkdir()
        opened = of_large_index(folder, CASES)
    by_jobs, by_cluster = (rows[name]["wall_s"] for name in list(WAYS)[1:])
    print(f"the cluster takes {by_cluster / by_jobs:.3f} of the time of two jobs")
    print(f"index of {CASES} cases, s", opened)
    record("sweeps", {"cases": cases, "rows": rows, "index_s": opened})


if __name__ == "__main__":
    main()
