"""`tipdamp run` killed ten times at random moments: the same numbers, nothing made twice, little
lost.

    python -m tests.benchmarks.kills [--kills 10] [--jobs 2]

Prints for each kill what was there, and the work lost: the seconds since the last block of a
running curve, or since the last finished curve or stage. What the run gives in the end is held to
an undisturbed run.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.benchmarks.record import record
from tests.tipdamp.rig_study import CHAIN, write_chain
from tipdamp.hbm.result import ForcedResponse

STUDY = CHAIN.replace("levels = [5]", "levels = [5, 8, 12, 16, 20, 25, 30, 40]").replace(
    "harmonics = [1]", "harmonics = [9, 7, 5]"
)


def command(study, jobs):
    """`tipdamp run` as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "tipdamp", "run", str(study), "--quiet", "--jobs", str(jobs)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def kept(folder):
    """{name: time of its last change} of finished curves, blocks of running ones, and finished
    stages."""
    found = [
        *folder.glob("responses/Fe_*.npz"),
        *folder.glob(".stages/*.npz"),
        *folder.glob(".stages/*.json"),
    ]
    times = {}
    for path in found:
        try:
            times[str(path.relative_to(folder))] = path.stat().st_mtime
        except FileNotFoundError:  # a journal whose curve is finished
            pass
    return times


def finished(folder):
    """{curve: time of its last change} of those with a record."""
    return {
        name: when
        for name, when in kept(folder).items()
        if name.startswith("responses/")
        and (folder / ".stages" / f"{Path(name).stem}.json").is_file()
    }


def difference(one, other):
    """Largest relative difference of the curves of two results folders."""
    worst = 0.0
    for path in sorted(one.glob("responses/Fe_*.npz")):
        a = ForcedResponse.load(path)
        b = ForcedResponse.load(other / "responses" / path.name)
        for x, y in (
            (a.frequency, b.frequency),
            (a.harmonics, b.harmonics),
            (a.dissipated, b.dissipated),
        ):
            largest = np.nanmax(np.abs(x)) or 1.0  # nothing is dissipated where no pair slips
            worst = (
                max(worst, float(np.nanmax(np.abs(x - y)) / largest))
                if x.shape == y.shape
                else np.inf
            )
    return worst


def killed(study, jobs, kills):
    """Rows of the kills; the run is started again after each, and at last left alone."""
    folder = study.parent / "results" / study.stem
    random = np.random.default_rng(11)
    rows = []
    before: dict[str, float] = {}
    while len(rows) < kills:
        process, began = command(study, jobs), time.time()
        wait = random.uniform(2.0, 14.0)
        while process.poll() is None and time.time() - began < wait:
            time.sleep(0.02)
        if process.poll() is not None:
            raise SystemExit(
                f"the run ended before its kill number {len(rows) + 1}: take a longer study"
            )
        process.send_signal(signal.SIGKILL)
        process.wait()
        now, done = time.time(), finished(folder)
        repeated = [name for name, when in before.items() if done.get(name) != when]
        rows.append(
            {
                "after_s": wait,
                "curves": len(done),
                "repeated": len(repeated),
                "lost_s": now - max([*kept(folder).values(), began]),
            }
        )
        print(rows[-1], flush=True)
        before = done
    ended = command(study, jobs).wait()
    again = [name for name, when in before.items() if finished(folder).get(name) != when]
    return rows, len(again), ended


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        studies = []
        for name in ("killed", "whole"):
            (Path(place) / name).mkdir()
            studies.append(write_chain(Path(place) / name))
            studies[-1].write_text(STUDY)
        os.environ["PYTHONPATH"] = str(Path(__file__).parents[2])
        rows, again, ended = killed(studies[0], arguments.jobs, arguments.kills)
        whole = command(studies[1], arguments.jobs).wait()
        off = difference(*(study.parent / "results" / study.stem for study in studies))
    found = {
        "kills": rows,
        "repeated": again + sum(row["repeated"] for row in rows),
        "difference": off,
        "most_lost_s": max(row["lost_s"] for row in rows),
    }
    print({name: found[name] for name in ("repeated", "difference", "most_lost_s")})
    record("kills", found)
    assert found["repeated"] == 0 and off <= 1e-12 and ended == whole, (ended, whole)


if __name__ == "__main__":
    main()
