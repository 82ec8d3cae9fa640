"""Hundreds of pairs in three directions, 8 of which slip: set-up, one iteration, and memory. One
thread.

    python -m tests.benchmarks.hundreds [--sizes 64 256 512] [--cases beam faces]

`beam`: the beam of `contact_beam` on n contacts to ground, 3n dofs, its damping a matrix that
couples the stuck modes. `faces`: a blade and a free damper that meet at n nodes each, 6n dofs, with
damping ratios; the nodal stiffness of an elastic half-space, node positions from a seed. Set-up is
all between the arrays (matrices or ReducedModel and ContactTable) and the first Newton iteration;
an iteration is all that a curve takes after that over its residual calls, continuation, peaks and
output included. The run stops where not exactly 8 pairs slip at every point. Each size is measured
in a process of its own. The figures go to build/benchmarks/hundreds.json.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time

import numpy as np
from scipy.linalg import block_diag

from tests.benchmarks import contact_beam
from tests.benchmarks.record import ROOT, one_thread, record
from tests.benchmarks.speed import moving
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, forced_response

H, SLIP, SIZES = 5, 8, (64, 256, 512)
# steel, nodes a millimetre apart
PITCH, MODULUS, BLADE_HZ, BLADE_KG, DAMPER_KG = 1e-3, 1.2e11, 900.0, 0.15, 0.01
FACES_BAND = 1700, 2200
# N/m of a pair; N in all, if all were to slip or to stick
KN, KT, SLIDES, STICKS = 5e6, 4e6, 2.0, 3e3


def sliding(n):
    """(n,) bool: 8 pairs at equal distances."""
    slides = np.zeros(n, bool)
    slides[np.round(np.linspace(0, n - 1, SLIP + 2)[1:-1]).astype(int)] = True
    return slides


def beam(n):
    """The function that takes everything from arrays to the curve; it passes its keywords on."""
    problem, force, outputs = contact_beam.in_modes(
        contact_beam.space(n, contact_beam.preloads(n, sliding(n), 0.005))
    )
    arrays = {name: vars(problem)[name] for name in ("M", "C", "K", "B", "law", "contacts")}
    return lambda **options: follow_band(
        ContactProblem(**arrays), 40 * force, (700, 1200), outputs=outputs, **options
    )


def face(n, rng):
    """(positions (n, 3) m, stiffness (3n, 3n) N/m of an elastic face whose motion as a whole is
    held by nothing)."""
    wide = max(int(np.sqrt(n / 2)), 1)
    x = np.stack([np.arange(n) // wide, np.arange(n) % wide, np.zeros(n)], axis=1) * PITCH
    x[:, :2] += PITCH * rng.uniform(-0.2, 0.2, (n, 2))
    apart = np.linalg.norm(x[:, None] - x[None], axis=2)
    stiffness = np.linalg.inv(1 / (np.pi * MODULUS * np.sqrt(apart**2 + (0.5 * PITCH) ** 2)))
    K = np.zeros((n, 3, n, 3))
    for d, share in enumerate((0.8, 0.8, 1.0)):
        K[:, d, :, d] = share * stiffness
    return x, K.reshape(3 * n, 3 * n)


def rigid(x):
    """(3n, 6) translations and rotations of nodes."""
    R = np.zeros((len(x), 3, 6))
    R[:, :, :3] = np.eye(3)
    for k in range(3):
        R[:, :, 3 + k] = np.cross(np.eye(3)[k], x - x.mean(axis=0))
    return np.linalg.qr(R.reshape(-1, 6))[0]


def face_to_face(n):
    """(arrays of a ReducedModel, pairs, push): a blade that sways along y under a push (6n,) of 1
    N, and a damper that softer springs hold against ground."""
    rng = np.random.default_rng(n)
    x, K = face(n, rng)
    R = rigid(x)
    free = np.eye(3 * n) - R @ R.T
    elastic, sway = free @ K @ free, (2 * np.pi * BLADE_HZ) ** 2 * BLADE_KG
    blade, damper = (
        elastic + (R * held / n) @ R.T
        for held in (sway * np.r_[9, 1, 9, 9, 9, 9], np.full(6, 4 * sway))
    )
    arrays = dict(
        M=np.diag(np.repeat([BLADE_KG / n, DAMPER_KG / n], 3 * n)),
        K=block_diag(blade, damper),
        body=np.repeat(["blade", "damper"], 3 * n),
        node=np.tile(np.repeat(np.arange(1, n + 1), 3), 2),
        direction=["x", "y", "z"] * (2 * n),
        position=np.tile(np.repeat(x, 3, axis=0), (2, 1)),
    )
    node, every = np.arange(1, n + 1), np.ones(n)
    pairs = ContactTable(
        side=np.full(n, "face"),
        station=node - 1,
        row=0 * node,
        blade_body=np.full(n, "blade"),
        blade_node=node,
        damper_body=np.full(n, "damper"),
        damper_node=node,
        position=x,
        frame=np.tile(np.eye(3), (n, 1, 1)),
        gap=0 * every,
        kn=KN * rng.uniform(0.8, 1.2, n),
        kt=KT * rng.uniform(0.8, 1.2, n),
        mu=0.5 * every,
        preload=rng.uniform(0.8, 1.2, n) * np.where(sliding(n), SLIDES, STICKS) / n,
        weight=every,
    )
    push = np.zeros((2, n, 3))
    push[0, :, 1] = 1 / n
    return arrays, pairs, push.ravel()


def loosened(K, n):
    """K with a damper that nothing but its contacts holds along y."""
    along = np.zeros(6 * n)
    along[3 * n + 1 :: 3] = 1.0
    return K - np.outer(K @ along, K @ along) / (along @ K @ along)


def faces(n):
    """As `beam`, under 5 N."""
    arrays, pairs, push = face_to_face(n)
    return lambda **options: forced_response(
        ReducedModel.from_matrices(**arrays),
        pairs,
        DryFriction2T(),
        5 * push,
        FACES_BAND,
        damping_ratio=0.01,
        outputs={"blade": push},
        **options,
    )


CASES = {"beam": beam, "faces": faces}


def measured(name, n) -> dict:
    """Seconds of set-up, milliseconds an iteration, calls, points and largest resident memory of
    one curve."""
    follow = CASES[name](n)
    before, called = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, []
    solve = Linearisation.solve

    def first(*arguments):
        called.append(time.process_time())
        return solve(*arguments)

    Linearisation.solve = first
    began = time.process_time()
    curve = follow(harmonics=H)
    ended = time.process_time()
    Linearisation.solve = solve
    moves = moving(curve)
    if not curve.complete or (moves != SLIP).any():
        raise SystemExit(
            f"{name}, {n} pairs: {moves.min()} to {moves.max()} slip, not {SLIP}; {curve.ended}"
        )
    row = {
        "case": name,
        "pairs": n,
        "setup_s": called[0] - began,
        "iteration_ms": 1e3 * (ended - called[0]) / curve.residual_calls,
        "calls": curve.residual_calls,
        "points": len(curve.frequency),
        "peak": curve.peak(curve.output_names[0]),
        "before_GiB": before / 2**20,
        "largest_GiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }
    return row


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, help="pairs")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument(
        "--one", action="store_true", help="one case of one size in this process, as JSON"
    )
    arguments = parser.parse_args()
    if arguments.one:
        measured(arguments.cases[0], 16)  # the kernels are loaded before the clock runs
        print(json.dumps(measured(arguments.cases[0], arguments.sizes[0])))
        return
    rows = []
    for name in arguments.cases:
        for n in arguments.sizes:
            command = [
                sys.executable,
                "-m",
                "tests.benchmarks.hundreds",
                "--one",
                "--cases",
                name,
                "--sizes",
                str(n),
            ]
            said = subprocess.run(
                command,
                check=True,
                stdout=subprocess.PIPE,
                text=True,
                cwd=ROOT,
                env=os.environ | {"PYTHONPATH": str(ROOT)},
            ).stdout
            rows.append(json.loads(said.splitlines()[-1]))
            print(rows[-1], flush=True)
            record("hundreds", {"rows": rows})


if __name__ == "__main__":
    main()
