"""CPU time per continuation point on the beam, beside pyHarm-os where a venv with it is named. One thread.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/hbm_speed.py [--peer /tmp/peer/bin/python]

The peer: python3 -m venv /tmp/peer && /tmp/peer/bin/pip install pyHarm-os==1.2.2. Not a test: times depend on the
machine, which is named beside them. pyHarm-os samples (128 per period), this package locates the transitions.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hbm.laws import PairSettings
from hbm.response import follow_band
from tests.hbm.cases import beam

HERE = Path(__file__).parent
BAND = (700, 1200)


def many_contacts(n, slipping=None):
    """B8 with n contacts at points between its eight, the same totals and the preload formula of its README.

    `slipping` : so many contacts get their share of friction, the others a hundred times more and never slip.
    """
    problem, force, outputs = beam("B8")
    place = np.linspace(0, 7, n)
    B = np.maximum(0, 1 - np.abs(place[:, None] - np.arange(8))) @ problem.B
    xi = (place + 3) / 10
    weight = 0.2 + 1.8 * (2 * xi - 1) ** 2
    preload = 100 * weight / weight.sum()
    if slipping:
        slips = np.zeros(n, bool)
        slips[np.linspace(0, n - 1, slipping).astype(int)] = True
        preload = np.where(slips, preload * n / slipping, 100 * preload * n)
    pairs = PairSettings(np.zeros(n), np.full(n, 1e6 / n), np.full(n, 0.5), preload)
    return replace(problem, B=B, pairs=pairs), force, outputs


def measure(case, H, level, repeats=3):
    """(milliseconds of CPU per point, residual calls per point, points, complete): median of the repeats, warm."""
    problem, force, outputs = case
    times = []
    for _ in range(repeats + 1):
        began = time.process_time()
        curve = follow_band(problem, level * force, BAND, harmonics=H, outputs=outputs)
        times.append(time.process_time() - began)
    n = len(curve.frequency)
    return 1e3 * float(np.median(times[1:])) / n, curve.residual_calls / n, n, curve.complete


def peer(python, case, H, level):
    """Milliseconds of CPU per point of pyHarm-os on the same matrices, or None."""
    problem, force, _ = case
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.npz")
        np.savez(path, M=problem.M, C=problem.C, K=problem.K, Q=problem.B, N0=problem.pairs.preload,
                 mu=problem.pairs.mu[0], kt=problem.pairs.kt[0], fdir=force)
        done = subprocess.run([python, HERE / "hbm_peer_pyharm.py", path, str(H), str(level), "128"],
                              capture_output=True, text=True, cwd=folder, env=os.environ | {"OMP_NUM_THREADS": "1"})
    if done.returncode:
        return None
    figures = json.loads(done.stdout.splitlines()[-1])
    return 1e3 * figures["seconds"] / figures["points"], figures["points"], figures["hz"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--peer", help="Python of a venv with pyHarm-os")
    arguments = parser.parse_args()
    name = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")][:1]
    print(f"{name[0] if name else 'unknown processor'}, OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'unset')}")
    for label, case, level in (("B8", beam("B8"), 20), ("C8", beam("C8"), 40), ("C8", beam("C8"), 200)):
        for H in (1, 7):
            ms, calls, n, complete = measure(case, H, level)
            print(f"{label} {level:3d} N H={H}: {ms:6.2f} ms a point, {calls:.2f} residuals a point, {n} points, "
                  f"complete {complete}", flush=True)
            if arguments.peer and label == "B8":
                other = peer(arguments.peer, case, H, level)
                print("   pyHarm-os:", "failed" if other is None else
                      f"{other[0]:.1f} ms a point, {other[1]} points; ratio {other[0] / ms:.0f}", flush=True)
    sizes, times = (8, 32, 128, 256), []
    for n in sizes:
        ms, _, points, complete = measure(many_contacts(n, 8), 7, 20, repeats=1)
        times.append(ms)
        print(f"{n} contacts, 8 slip, H=7: {ms:.2f} ms a point, {points} points, complete {complete}", flush=True)
    print(f"growth exponent {np.polyfit(np.log(sizes), np.log(times), 1)[0]:.2f}")
    ms, _, points, complete = measure(many_contacts(32), 7, 20)
    print(f"32 contacts, all free to slip, H=7: {ms:.2f} ms a point, {points} points, complete {complete}")


if __name__ == "__main__":
    main()
