"""CPU time per continuation point on the beam, beside pyHarm-os where a venv with it is named. One thread.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/hbm_speed.py [--peer /tmp/peer/bin/python]

The peer: python3 -m venv /tmp/peer && /tmp/peer/bin/pip install pyHarm-os==1.2.2. Not a test: times depend on the
machine, which is named beside them. pyHarm-os samples (128 per period), this package locates the transitions.
The figures go to results/speed.json beside this file, from which docs/validation.md is filled.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
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
RESULTS = HERE / "results" / "speed.json"


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


def all_around(n, one_in=8):
    """C8 with n contacts in three directions; one in eight gets its share of friction, the others never slip."""
    problem, force, outputs = beam("C8")
    place = np.linspace(0, 7, n)
    share = np.maximum(0, 1 - np.abs(place[:, None] - np.arange(8)))
    B = np.einsum("ij,jkr->ikr", share, problem.B.reshape(8, 3, -1)).reshape(3 * n, -1)
    weight = 0.2 + 1.8 * (2 * (place + 3) / 10 - 1) ** 2
    slips = np.arange(n) % one_in == 0
    pairs = PairSettings(np.full(n, 1.2e6 / n), np.full(n, 1e6 / n), np.where(slips, 0.5, 50.0),
                         np.where(slips, 1.0, 20.0) * 100 * weight / weight.sum())
    return replace(problem, B=B, pairs=pairs), force, outputs


def peak_memory(n, H, level):
    """(GiB of a fresh process that follows `all_around(n)`, complete)."""
    script = (f"import resource; from tests.benchmarks.hbm_speed import *; c = follow_band(*scaled(all_around({n}), "
              f"{level}), BAND, harmonics={H}, outputs=all_around(8)[2]); "
              "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, c.complete)")
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=HERE.parents[1],
                          env=os.environ | {"PYTHONPATH": str(HERE.parents[1])})
    used, complete = done.stdout.split()
    return float(used), complete == "True"


def scaled(case, level):
    return case[0], level * case[1]


def start_up(cache):
    """CPU seconds from nothing to the first curve (C8, 20 N, H = 7) in a fresh process with this folder of kernels."""
    script = ("from tests.benchmarks.hbm_speed import *; p, f, o = beam('C8'); "
              "follow_band(p, 20 * f, BAND, harmonics=7, outputs=o)")
    began = os.times()
    subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, cwd=HERE.parents[1],
                   env=os.environ | {"PYTHONPATH": str(HERE.parents[1]), "NUMBA_CACHE_DIR": str(cache)})
    ended = os.times()
    return ended.children_user + ended.children_system - began.children_user - began.children_system


def versions():
    import numba
    import scipy
    return (f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}, "
            f"numba {numba.__version__}")


def processor():
    names = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown processor"


def measured(case, label, H, level, python=None):
    """One row of the table: our figures, and the peer's where it is asked for."""
    ms, calls, points, complete = measure(case, H, level)
    row = {"case": label, "H": H, "ms": ms, "calls": calls, "points": points, "complete": bool(complete)}
    other = peer(python, case, H, level) if python else None
    if other:
        row |= {"peer_ms": other[0], "peer_points": other[1]}
    print(row, flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--peer", help="Python of a venv with pyHarm-os")
    python = parser.parse_args().peer
    rows, sizes = [], (8, 32, 128, 256)
    for H in (1, 7):
        rows.append(measured(beam("B8"), "B8, 20 N", H, 20, python))
    rows.append(measured(many_contacts(32), "B8 with 32 contacts, all free to slip, 20 N", 7, 20, python))
    for level in (40, 200):
        for H in (1, 7):
            rows.append(measured(beam("C8"), f"C8, {level} N", H, level))
    held = [measured(many_contacts(n, 8), f"{n} contacts in 1-D, 8 slip, 20 N", 7, 20) for n in sizes]
    eighth = [measured(all_around(n), f"{n} contacts in 3-D, one in eight slips, 40 N", 7, 40) for n in sizes[:3]]

    def growth(found):
        return np.polyfit(np.log(sizes[:len(found)]), np.log([r["ms"] for r in found]), 1)[0]

    used, complete = peak_memory(256, 7, 40)
    with tempfile.TemporaryDirectory() as cache:
        cold, warm = start_up(cache), start_up(cache)
    notes = [f"growth of the time per point with the contacts, 8 held slipping, 1-D: exponent {growth(held):.2f}",
             f"the same with one in eight slipping, 3-D, up to 128: exponent {growth(eighth):.2f}",
             f"256 contacts in 3-D, one in eight free to slip, H = 7: {used:.2f} GiB at most, complete {complete}",
             f"first curve in a fresh process: {warm:.1f} s with compiled kernels, {cold:.1f} s without"]
    print(*notes, sep="\n")
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps({"processor": processor(), "versions": versions(),
                                   "date": time.strftime("%Y-%m-%d"), "rows": rows + held + eighth, "notes": notes},
                                  indent=1) + "\n")


if __name__ == "__main__":
    main()
