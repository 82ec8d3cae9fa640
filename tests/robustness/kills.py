"""SIGKILL at random moments of a whole run, which is then resumed: the same numbers, no finished curve made again.

    python -m tests.robustness.kills [--count 100]

The processes of its pool end with it. A resumed run is killed again with the chance of a half.
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

from hbm.result import ForcedResponse
from tests.robustness import counts
from tests.robustness.rows import chain
from tests.validation.__main__ import ROOT

LONG = (("levels = [5]", "levels = [5, 8, 11]"), ("harmonics = [1]", "harmonics = [3]"))


def start(study, jobs):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen([sys.executable, "-m", "tipdamp", "run", study.name, "--quiet", "--jobs", str(jobs)],
                            cwd=study.parent, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            env=environment, start_new_session=True)


def curves(study):
    folder = study.parent / "results" / study.stem
    recorded = {p.stem for p in (folder / ".stages").glob("Fe_*.json")}
    return {p.name: p for p in (folder / "responses").glob("[!.]*.npz") if p.stem in recorded}


def difference(one, two):
    """Largest relative difference of the numbers of two runs."""
    assert one.keys() == two.keys() and one
    worst = 0.0
    for name, path in one.items():
        a, b = ForcedResponse.load(path), ForcedResponse.load(two[name])
        assert a.harmonics.shape == b.harmonics.shape, name
        worst = max(worst, float(np.abs(a.harmonics - b.harmonics).max() / np.abs(a.harmonics).max()))
    return worst


def killed_and_resumed(study, seconds, rng, jobs):
    """(kills, curves repeated, words of what went wrong)"""
    kills, repeated, process = 0, 0, start(study, jobs)
    while True:
        try:
            again = kills == 0 or rng.random() < 0.5
            out = process.communicate(timeout=rng.uniform(0.2, seconds) if again else None)[0]
            break
        except subprocess.TimeoutExpired:
            os.kill(process.pid, signal.SIGKILL)
            process.communicate()
            kills += 1
        before = {name: path.stat().st_mtime_ns for name, path in curves(study).items()}
        time.sleep(0.5)                                    # the pool sees that nobody listens any more
        process = start(study, jobs)
    now = curves(study)
    if kills:
        repeated = sum(now[name].stat().st_mtime_ns != at for name, at in before.items() if name in now)
    assert process.returncode == 0, out
    return kills, repeated


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    count, kills, repeated, worst, i = parser.parse_args().count, 0, 0, 0.0, 0
    with tempfile.TemporaryDirectory() as place:
        whole = chain(_made(Path(place) / "whole"), *LONG)
        began = time.monotonic()
        assert start(whole, 1).wait() == 0
        seconds = time.monotonic() - began
        while kills < count:
            rng, i = np.random.default_rng([11, i]), i + 1
            study = chain(_made(Path(place) / str(i)), *LONG)
            more, again = killed_and_resumed(study, seconds, rng, 1 + i % 2)
            kills, repeated = kills + more, repeated + again
            worst = max(worst, difference(curves(whole), curves(study)))
            assert not list(study.parent.rglob(".tmp-*")), "litter"
    counts.keep("SIGKILL over tipdamp run", kills=kills, studies=i, not_resumed=0, largest_difference=worst,
                finished_curves_made_again=repeated)


def _made(folder):
    folder.mkdir()
    return folder


if __name__ == "__main__":
    main()
