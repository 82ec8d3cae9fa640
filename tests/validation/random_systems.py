"""Random systems, seeded: smooth ones with cubic springs and ones with one to four contacts of any
law that is shipped.

Nondimensional: a chain of masses of 0.5..2 on springs of 0.3..3, ends on the ground. Force, band
and harmonics are part of the draw, so that a number and a seed name a curve.
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.laws import (
    Contacts,
    CubicSpring,
    DryFriction1T,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    UnilateralSpring,
)

LAWS = (Jenkins1D, DryFriction1T, DryFriction2T, UnilateralSpring, IsotropicFriction)


class System(NamedTuple):
    """name : what was drawn; problem, force (r,), band (from, to) Hz, H: arguments of
    `follow_band`."""

    name: str
    problem: ContactProblem
    force: np.ndarray
    band: np.ndarray
    H: int

    @property
    def outputs(self) -> dict:
        """The first mass."""
        return {"x": np.eye(len(self.force))[0]}


def smooth_systems(count, seed=1):
    """1 to 6 dofs, 1 to 4 cubic springs between masses or to the ground, H = 1, 3, 5 or 7."""
    for rng in _generators(count, seed):
        r, P = int(rng.integers(1, 7)), int(rng.integers(1, 5))
        M, K = _chain(rng, r)
        B = np.array([_between(rng, r) for _ in range(P)])
        law, nothing = CubicSpring(cubic=10 ** rng.uniform(-1, 1, P)), np.zeros(P)
        problem = ContactProblem(
            M, None, K, B, law, Contacts(*[nothing] * 4), damping_ratio=10 ** rng.uniform(-2.3, -1)
        )
        w, motion = _resonance(problem, rng.normal(size=r))
        # a multiple of the force at which the springs are as stiff as the chain, in the linear
        # resonance
        force = motion.force * 10 ** rng.uniform(-1, 0.5) / motion.largest
        yield System(
            f"{r} dofs, {P} cubic springs",
            problem,
            force,
            np.array([0.4, 2.5]) * w / (2 * np.pi),
            int(rng.choice([1, 3, 5, 7])),
        )


def contact_systems(count, seed=2, decades=(-1, 1)):
    """2 to 6 dofs, 1 to 4 contacts of one law, some of them with a gap, H = 1 to 9; decades of kn
    and kt."""
    for rng in _generators(count, seed):
        r, P = int(rng.integers(2, 7)), int(rng.integers(1, 5))
        law = LAWS[rng.integers(len(LAWS))]()
        M, K = _chain(rng, r)
        nd = len(law.components)
        B = np.array([_between(rng, r) for _ in range(P * nd)])
        preload = rng.uniform(0.3, 1.5, P)
        if "n" in law.components:
            preload = np.where(rng.random(P) < 0.25, -rng.uniform(0.05, 0.3, P), preload)
            preload[0] = abs(preload[0])  # one of them at least is closed at rest
        pairs = Contacts(*10 ** rng.uniform(*decades, (2, P)), rng.uniform(0.1, 0.8, P), preload)
        problem = ContactProblem(
            M, None, K, B, law, pairs, damping_ratio=10 ** rng.uniform(-2.3, -1.3)
        )
        w, motion = _resonance(problem, rng.normal(size=r))
        force = motion.force * 10 ** rng.uniform(-0.5, 1) / motion.largest
        # rad/s, without contact
        gaps, free = int((preload < 0).sum()), np.sqrt(la.eigvalsh(K, M)[0])
        yield System(
            f"{r} dofs, {P} x {law.name}, {gaps} with a gap",
            problem,
            force,
            np.array([0.7 * free, 1.4 * w]) / (2 * np.pi),
            int(rng.integers(1, 10)),
        )


def _generators(count, seed):
    """One generator a system: a system does not depend on those before it."""
    return (np.random.default_rng([seed, i]) for i in range(count))


def _chain(rng, r):
    """(M, K): r masses in a row, springs between them and from both ends to the ground."""
    k = 10 ** rng.uniform(-0.5, 0.5, r + 1)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    return np.diag(rng.uniform(0.5, 2, r)), K


def _between(rng, r):
    """Row of the motion of a mass, against the ground or against another mass."""
    row, ends = np.zeros(r), rng.permutation(r)[:2]
    row[ends[0]] = 1.0
    if len(ends) > 1 and rng.random() < 0.5:
        row[ends[1]] = -1.0
    return row


class _Motion(NamedTuple):
    force: np.ndarray
    largest: float


def _resonance(problem, force):
    """(rad/s, force and the largest motion at the contacts under it) of the lowest stuck mode."""
    R = problem.receptance()
    w = np.sqrt(R.stiffness / R.mass).min()
    factors = R.factors(np.array([w]))[0][:, 0]
    u = np.abs(problem.B @ (R.shapes @ (factors * (R.shapes.T @ force))))
    return w, _Motion(force, u.max())
