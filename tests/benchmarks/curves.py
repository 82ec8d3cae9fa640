"""CPU time of a whole curve beside pyHarm-os at equal error of the drawn curve. One thread.

    python -m tests.benchmarks.curves [--repeats 5]

Drawn by PCHIP through the points of each tool over 700..1200 Hz; its error is the largest distance,
of the peak, to a curve of many points made here. The peer runs at several step sizes: where its
error falls with every one of them, its time at our error lies on the straight line through its
figures, logarithmic, that enclose it. An error that rises in between has no such line: the ratio is
then to the most costly run that is still off by more, and is "at least". The peer samples (128 a
period), which alone is up to 4e-4 of the peak. The figures go to build/benchmarks/curves.json.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from tests.benchmarks import contact_beam
from tests.benchmarks.record import one_thread, record
from tests.benchmarks.speed import BAND, PEER, PEER_SAMPLES, peer_python
from tests.hbm.cases import beam
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.response import follow_band

H, LEVEL = 7, 20
FINE = Settings(largest_step=0.04, aim=1e-4, drawn_error=5e-5, drawn_passes=10)
STEPS = {"B8": (0.2, 0.1, 0.05), "B32": (0.2, 0.1)}  # of the peer, arc lengths


def ours(case, settings=None):
    """(Hz, m of harmonic 1, CPU seconds)."""
    problem, force, outputs = case
    began = time.process_time()
    curve = follow_band(
        problem, LEVEL * force, BAND, harmonics=H, outputs=outputs, settings=settings
    )
    return curve.frequency, np.abs(curve.harmonics[:, 0, 1]), time.process_time() - began


def theirs(python, case, step):
    """The same of the peer at a step size."""
    problem, force, outputs = case
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.npz")
        np.savez(
            path,
            M=problem.M,
            C=problem.C,
            K=problem.K,
            Q=problem.B,
            N0=problem.contacts.preload,
            mu=problem.contacts.mu[0],
            kt=problem.contacts.kt[0],
            fdir=force,
            out=outputs["tip"],
        )
        alone = {"OMP_NUM_THREADS": "1", "HOME": folder, "PYHARM_DS": str(step)}
        done = subprocess.run(
            [python, PEER, path, str(H), str(LEVEL), str(PEER_SAMPLES)],
            capture_output=True,
            text=True,
            cwd=folder,
            env=os.environ | alone,
            check=True,
        )
    found = json.loads(done.stdout.splitlines()[-1])
    return *np.array(found["curve"]), found["seconds"]


def error(hz, amplitude, fine):
    """Largest distance of the drawn curves, of the peak; fine : (Hz, m)."""
    grid = np.linspace(*BAND, 20001)
    drawn = []
    for x, y in ((hz, amplitude), fine):
        x, first = np.unique(x[np.isfinite(y)], return_index=True)
        drawn.append(PchipInterpolator(x, y[np.isfinite(y)][first])(grid))
    return float(np.abs(drawn[0] - drawn[1]).max() / drawn[1].max())


def peer_seconds(runs: list[tuple], off: float) -> tuple[float, bool]:
    """(CPU seconds of the peer at an error, whether it is only a lower bound) of its runs (error,
    seconds, points)."""
    errors, seconds = np.array(sorted(runs, key=lambda run: run[1]))[:, :2].T
    if (np.diff(errors) < 0).all() and errors[-1] <= off <= errors[0]:
        return float(np.exp(np.interp(np.log(off), *np.log([errors[::-1], seconds[::-1]])))), False
    too_far = seconds[errors > off]
    return float(too_far.max() if len(too_far) else seconds.min()), True


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument(
        "--venv", type=Path, default=Path(tempfile.gettempdir()) / "tipdamp-peer-pyharm"
    )
    arguments = parser.parse_args()
    python, rows = peer_python(arguments.venv), {}
    for name, case in {"B8": beam("B8"), "B32": contact_beam.plane(32)}.items():
        here = contact_beam.in_modes(case)  # the same system, its K evenly scaled
        fine, runs, table = ours(here, FINE)[:2], [], []
        for step in STEPS[name]:
            runs += [ours(here) for _ in range(arguments.repeats)]
            hz, amplitude, seconds = theirs(python, case, step)
            table.append((error(hz, amplitude, fine), seconds, len(hz)))
            print(name, "peer", step, table[-1], flush=True)
        off = error(*runs[-1][:2], fine)
        seconds = float(np.median([run[2] for run in runs]))
        at_equal, at_least = peer_seconds(table, off)
        rows[name] = {
            "error": off,
            "s": seconds,
            "points": len(runs[-1][0]),
            "peer_s": at_equal,
            "times_faster": at_equal / seconds,
            "at_least": at_least,
            "peer": table,
        }
        print(name, {k: v for k, v in rows[name].items() if k != "peer"}, flush=True)
    record("curves", {"rows": rows})


if __name__ == "__main__":
    main()
