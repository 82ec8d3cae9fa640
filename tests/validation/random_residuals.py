"""Stored points of random contact systems by the plain equation of motion, the laws written once
more and stepped through 16384 samples.

    OMP_NUM_THREADS=1 python -m tests.validation.random_residuals [--count 500] [--first 0]

kn and kt over five decades. A curve is complete or says why not; of each, five points at random. A
line a system; all 500 from the first leave their counts for docs/reliability.md.
"""

import argparse
import time
import traceback
from typing import NamedTuple

import numpy as np

from tests.robustness import counts
from tests.validation import Row, Subject, plain_stepping
from tests.validation.random_systems import System, contact_systems
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.result import ForcedResponse

SAMPLES = 16384
DECADES = (-2, 3)
SEED = 3
LIMIT = 1e-3
COUNT = 500
STUCK = {"t1": "kt", "t2": "kt", "n": "kn"}


class Found(NamedTuple):
    """One system: its curve, and the largest residual of some points; NaN where none was solved."""

    system: System
    curve: ForcedResponse
    residual: float

    @property
    def explained(self) -> bool:
        """Complete, or ended with a reason."""
        return bool(self.curve.complete or self.curve.ended)


def residual(problem, force, w, q) -> float:
    """Of the equation of motion at q (r, H+1), over the external force or that of the contacts, the
    larger one."""
    k, B, settings = w * np.arange(q.shape[1]), np.asarray(problem.B), problem.contacts
    u = (B @ q).reshape(len(settings), -1, q.shape[1])
    contact = B.T @ plain_stepping.harmonics(problem.law.name, settings, u, SAMPLES).reshape(
        -1, q.shape[1]
    )
    springs = np.stack([vars(settings)[STUCK[c]] for c in problem.law.components], axis=1).ravel()
    C = plain_stepping.modal_damping(
        problem.M, problem.K + (B.T * springs) @ B, problem.damping_ratio
    )
    applied = np.zeros_like(q)
    applied[:, 1] = force
    r = problem.K @ q - k**2 * (problem.M @ q) + 1j * k * (C @ q) + contact - applied
    return float(np.linalg.norm(r) / max(np.linalg.norm(applied), np.linalg.norm(contact)))


def checked(system: System, rng, points: int = 5) -> Found:
    """The curve of a system, and the largest residual of some of its points."""
    outputs = {f"q{i}": row for i, row in enumerate(np.eye(len(system.force)))}
    given = dict(harmonics=system.H, outputs=outputs, truncation=False)
    curve = follow_band(system.problem, system.force, tuple(system.band), **given)
    solved = np.flatnonzero(curve.converged)
    drawn = rng.choice(solved, min(points, len(solved)), replace=False)
    found = [
        residual(system.problem, system.force, 2 * np.pi * curve.frequency[i], curve.harmonics[i])
        for i in drawn
    ]
    return Found(system, curve, max(found, default=np.nan))


def systems(count: int, first: int = 0):
    """(number, system, its generator for the points)."""
    for i, system in enumerate(contact_systems(first + count, SEED, DECADES)):
        if i >= first:
            yield i, system, np.random.default_rng([SEED, i, 1])


def rows(count: int = 20):
    """The first of them."""
    found = [checked(system, rng) for _, system, rng in systems(count)]
    name = f"{count} systems (seed {SEED})"
    silent = sum(not one.explained for one in found)
    yield Row(
        f"{name}: incomplete without a reason", silent, 0, silent, "reason of an incomplete curve"
    )
    incomplete = sum(not one.curve.complete for one in found)
    yield Row(f"{name}: incomplete", incomplete, 0, incomplete, "complete curve")
    worst = max(found, key=lambda one: np.inf if np.isnan(one.residual) else one.residual)
    yield Row(
        f"{name}: {worst.system.name}, H = {worst.system.H}",
        "",
        "",
        worst.residual,
        "equation of motion",
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--first", type=int, default=0)
    asked, found, crashes = parser.parse_args(), [], 0
    for i, system, rng in systems(asked.count, asked.first):
        begin = time.process_time()
        try:
            found.append(one := checked(system, rng))
        except Exception:  # counted, and the others go on
            crashes += 1
            print(f"{i}: {system.name}: CRASH {traceback.format_exc()}", flush=True)
            continue
        print(
            f"{i}: {system.name}, H = {system.H}, {len(one.curve.frequency)} points, residual "
            f"{one.residual:.1e}, {time.process_time() - begin:.1f} s: {one.curve.ended}",
            flush=True,
        )
    figures = dict(
        systems=len(found) + crashes,
        complete=sum(bool(one.curve.complete) for one in found),
        ended_with_a_reason=sum(one.explained and not one.curve.complete for one in found),
        ended_without_one=sum(not one.explained for one in found),
        crashes=crashes,
        points_of_each=5,
        without_a_point=int(np.isnan([one.residual for one in found]).sum()),
        above_a_residual_of_0_001=sum(bool(one.residual > LIMIT) for one in found),
        largest_residual=float(f"{max(r for one in found if not np.isnan(r := one.residual)):.2g}"),
    )
    if asked.count >= COUNT and not asked.first:
        counts.keep("random contact systems", **figures)
    else:
        print(figures)


SUBJECT = Subject(
    "Random systems by the plain equation of motion",
    "2 to 6 dofs, 1 to 4 contacts of any law, gaps, kn and kt over five decades, H = 1 to 9. "
    "Five points of each curve at random, of the equation of motion with the laws written once "
    "more, plainly, at 16384 samples; relative to the external force, or to that of the "
    "contacts.",
    rows,
    {"reason of an incomplete curve": 0.0, "equation of motion": LIMIT},
    long=lambda: rows(COUNT),
    quick=lambda: rows(8),
)

if __name__ == "__main__":
    main()
