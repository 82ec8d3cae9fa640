"""CPU time per continuation point on the beam, and beside it pyHarm-os on the same matrices. One
thread.

    python -m tests.benchmarks.speed [--without-peer]

The peer is installed from the package index into a venv of its own in the temporary folder. It
samples (128 per period), this package locates the transitions; the run stops where their amplitudes
differ by more than sampling explains. For the growth exactly 8 pairs slip at every point of every
size, or the run stops. Not a test: times depend on the machine, which is named beside them. The
figures go to build/benchmarks/speed.json.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.benchmarks import contact_beam
from tests.benchmarks.record import ROOT, one_thread, record
from tests.hbm.cases import beam
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.response import follow_band

PEER = Path(__file__).parent / "peer_pyharm.py"
PEER_PACKAGE, PEER_SAMPLES = "pyHarm-os==1.2.2", 128
SAMPLING = 1e-3  # of the amplitude: with 128 samples up to 4e-4 is expected (frictional-beam.md)
BAND = (700, 1200)
# a share of their preload so small that these slip in all the band
SIZES, HELD, SHARE = (8, 32, 128, 256), 8, 0.005


def held_slipping(n):
    """(case, number of pairs that are to slip): n contacts in 1-D, 8 of them slip."""
    slides = np.zeros(n, bool)
    slides[np.round(np.linspace(0, n - 1, HELD)).astype(int)] = True
    return contact_beam.plane(n, contact_beam.preloads(n, slides, SHARE)), HELD


def one_in_eight(n):
    """(case, number of pairs that are to slip or lift): n contacts in 3-D, one in eight does."""
    slides = np.arange(n) % 8 == 4
    return contact_beam.in_modes(
        contact_beam.space(n, contact_beam.preloads(n, slides, SHARE))
    ), int(slides.sum())


def moving(curve):
    """(n,) how many pairs slip or open at some time of the cycle, at every point."""
    return ((curve.share_slip + curve.share_open) > 0).sum(axis=1)


def measured(case, label, H, level, moves=None, repeats=3):
    """One row of the table: medians of the repeats, warm. `moves` : so many pairs must slip or open
    at every point."""
    problem, force, outputs = case
    times = []
    for _ in range(repeats + 1):
        began = time.process_time()
        curve = follow_band(problem, level * force, BAND, harmonics=H, outputs=outputs)
        times.append(time.process_time() - began)
    n, count = len(curve.frequency), moving(curve)
    if moves is not None and (count != moves).any():
        raise SystemExit(f"{label}: {count.min()} to {count.max()} pairs slip or open, not {moves}")
    hz, top = curve.peak(next(iter(outputs)))
    at_top = int(count[np.abs(curve.frequency - hz).argmin()])
    row = {
        "case": label,
        "H": H,
        "contacts": len(problem.contacts),
        "dofs": len(problem.K),
        "ms": 1e3 * float(np.median(times[1:])) / n,
        "calls": curve.residual_calls / n,
        "points": n,
        "complete": bool(curve.complete),
        "moving": at_top,
        "peak": [hz, top],
    }
    print(row, flush=True)
    return row


def peer_python(folder):
    """Python of a venv with the peer, made where it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", PEER_PACKAGE], check=True)
    return python


def with_peer(python, case, label, H, level):
    """A row of ours and the peer's figures in it; both solve the same matrices and must find the
    same amplitude."""
    problem, force, outputs = case
    tip = outputs["tip"]
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
            out=tip,
        )
        done = subprocess.run(
            [python, PEER, path, str(H), str(level), str(PEER_SAMPLES)],
            capture_output=True,
            text=True,
            cwd=folder,
            env=os.environ | {"OMP_NUM_THREADS": "1", "HOME": folder},
        )
    if done.returncode:
        raise SystemExit(f"{label}: the peer failed: {done.stderr[-800:]}")
    theirs = json.loads(done.stdout.splitlines()[-1])
    curve = follow_band(
        problem, level * force, BAND, harmonics=H, outputs=outputs, at=[theirs["top_hz"]]
    )
    ours = float(np.abs(solutions_at(curve, problem, theirs["top_hz"])[:, 0, 1]).max())
    apart = abs(ours / theirs["top"] - 1)
    if apart > SAMPLING:
        raise SystemExit(
            f"{label}: {ours:.6g} m here, {theirs['top']:.6g} m in the peer at "
            f"{theirs['top_hz']:.2f} Hz"
        )
    row = measured(case, label, H, level)
    row |= {
        "peer": theirs["version"],
        "peer_ms": 1e3 * theirs["seconds"] / theirs["points"],
        "peer_points": theirs["points"],
        "peer_hz": theirs["hz"],
        "apart": apart,
        "apart_hz": theirs["top_hz"],
    }
    print({k: v for k, v in row.items() if k.startswith(("peer", "apart"))}, flush=True)
    return row


def fresh(code, **environment):
    """What a fresh process prints, run from the root of the project, and its CPU seconds."""
    began = os.times()
    done = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
    )
    ended = os.times()
    return (
        done.stdout,
        ended.children_user + ended.children_system - began.children_user - began.children_system,
    )


def peak_memory(n, H, level):
    """GiB of a fresh process that follows n contacts in 3-D; an incomplete curve is an error."""
    said, _ = fresh(
        "import resource; from tests.benchmarks.speed import *; "
        f"p, f, o = one_in_eight({n})[0]; "
        f"c = follow_band(p, {level} * f, BAND, harmonics={H}, outputs=o); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, c.complete)"
    )
    used, complete = said.split()[-2:]
    if complete != "True":
        raise SystemExit(f"{n} contacts in 3-D: the curve is not complete")
    return float(used)


def start_up(cache):
    """CPU seconds from nothing to the first curve (C8, 20 N, H = 7) in a fresh process with this
    folder of kernels."""
    return fresh(
        "from tests.benchmarks.speed import *; p, f, o = beam('C8'); "
        "follow_band(p, 20 * f, BAND, harmonics=7, outputs=o)",
        NUMBA_CACHE_DIR=str(cache),
    )[1]


def exponent(rows):
    """Of the time per point over the number of contacts."""
    return float(
        np.polyfit(np.log([r["contacts"] for r in rows]), np.log([r["ms"] for r in rows]), 1)[0]
    )


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--without-peer", action="store_true")
    parser.add_argument(
        "--venv", type=Path, default=Path(tempfile.gettempdir()) / "tipdamp-peer-pyharm"
    )
    parser.add_argument(
        "--sizes", type=int, nargs="+", default=SIZES, help="contacts, of the growth"
    )
    arguments = parser.parse_args()
    python = None if arguments.without_peer else peer_python(arguments.venv)

    def row(case, label, H, level):
        return (
            with_peer(python, case, label, H, level) if python else measured(case, label, H, level)
        )

    rows = [row(beam("B8"), "B8, 20 N", H, 20) for H in (1, 7)]
    rows.append(row(contact_beam.plane(32), "B8 with 32 contacts, 20 N", 7, 20))
    rows += [
        measured(beam("C8"), f"C8, {level} N", H, level) for level in (40, 200) for H in (1, 7)
    ]
    held, eighth = [], []
    for n in arguments.sizes:
        case, moves = held_slipping(n)
        held.append(measured(case, f"{n} contacts in 1-D, 8 slip, 20 N", 7, 20, moves))
    for n in arguments.sizes:
        case, moves = one_in_eight(n)
        eighth.append(
            measured(case, f"{n} contacts in 3-D, one in eight slips, 40 N", 7, 40, moves)
        )
    with tempfile.TemporaryDirectory() as cache:
        cold, warm = start_up(cache), start_up(cache)
    largest = arguments.sizes[-1]
    figures = {
        "rows": rows + held + eighth,
        "growth_held": exponent(held),
        "growth_held_sizes": [r["contacts"] for r in held],
        "growth_eighth": exponent(eighth),
        "growth_eighth_sizes": [r["contacts"] for r in eighth],
        "first_curve_cold_s": cold,
        "first_curve_warm_s": warm,
    }
    record("speed", figures)  # the memory takes long: what is measured is kept before
    record(
        "speed", figures | {"memory_contacts": largest, "memory_GiB": peak_memory(largest, 7, 40)}
    )


if __name__ == "__main__":
    main()
