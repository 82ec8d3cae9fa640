"""Multipliers of random systems beside those of their own orbits (`own_orbits`).

Nondimensional: 3 to 6 masses with one or two contacts, or a contact and a cubic spring.
"""

from typing import NamedTuple

import numpy as np

from tests.hbm.stability import own_orbits
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.laws import (
    Contacts,
    CubicSpring,
    DryFriction1T,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    MixedLaw,
    UnilateralSpring,
)
from tipdamp.hbm.stability.multipliers import Stability

LAWS = {
    "Jenkins": (Jenkins1D(),),
    "cubic": (CubicSpring(0.5),),
    "unilateral": (UnilateralSpring(),),
    "lift-off": (DryFriction1T(),),
    "two tangents": (DryFriction2T(),),
    "two tangents, coupled": (IsotropicFriction(),),
    "cubic and friction": (Jenkins1D(), CubicSpring(0.5)),
}
HARMONICS = (3, 11, 41, 81)
DISTURBED = 1e-6  # of the motion, in the differences of the period map
NEAR = 1e-5  # of the motion: a point is marked where that much makes other events
OTHER = 0.05  # change of the period map by which other events are told
STUCK = 0.9  # of the cycle: a system whose contacts do little more is not compared


class Compared(NamedTuple):
    """ours, own : multipliers, the largest first; marked : near grazing, or a slider that touches
    its limit without slip, where the period map has a kink."""

    ours: np.ndarray
    own: np.ndarray
    marked: bool

    @property
    def error(self) -> float:
        """Of the leading one, by its conjugate or itself."""
        lead = self.own[0] if len(self.own) else 0.0
        return min(abs(self.ours[0] - lead), abs(self.ours[0] - np.conj(lead)))

    @property
    def clear(self) -> bool:
        """Whether the leading one is 1e-3 off the unit circle."""
        return abs(abs(self.own[0]) - 1) > 1e-3

    @property
    def agrees(self) -> bool:
        """In the verdict, and in the way by which a motion loses stability."""
        return _way(self.ours[0]) == _way(self.own[0])


def _way(leading) -> str:
    if abs(leading) <= 1:
        return "stable"
    if abs(leading.imag) > 1e-3:
        return "Neimark-Sacker"
    return "fold" if leading.real > 0 else "period doubling"


def drawn(kind, seed):
    """(problem, force, w) of a system."""
    random, laws = np.random.default_rng([seed, len(kind)]), LAWS[kind]
    r, P = int(random.integers(3, 7)), max(len(laws), int(random.integers(1, 3)))
    law = laws[0] if len(laws) == 1 else MixedLaw(laws, of_pair=(0, 1))
    P = P if len(laws) == 1 else 2
    nd = len(law.components)
    A, G = random.standard_normal((2, r, r))
    M = np.eye(r) + 0.2 * A @ A.T / r
    K = np.diag(random.uniform(0.5, 4, r)) + 0.3 * G @ G.T / r
    B = 0.7 * random.standard_normal((P * nd, r))
    ranges = ((0.5, 5), (0.3, 2), (0.2, 0.7), (0.1, 0.6))
    contacts = Contacts(*(random.uniform(*ends, P) for ends in ranges))
    problem = ContactProblem(M, 0.02 * K + 0.01 * M, K, B, law, contacts)
    force = random.uniform(0.2, 1.5) * random.standard_normal(r)
    return problem, force, random.uniform(0.5, 2.5)


def own_system(problem, force, w):
    """The same equations for `own_orbits`."""
    law, c, r = problem.law, problem.contacts, len(force)
    laws = law.laws if isinstance(law, MixedLaw) else (law,) * len(c)
    B, rows = np.zeros((len(c), 3, r)), problem.B.reshape(len(c), -1, r)
    for p, own in enumerate(laws):
        for name in own.components:
            B[p, ("t1", "t2", "n").index(name)] = rows[p, law.components.index(name)]
    cubic = [one.cubic if isinstance(one, CubicSpring) else 0.0 for one in laws]
    return own_orbits.Own(
        *(problem.M, problem.C, problem.K, force.astype(complex), w, B),
        np.array([one.sliders for one in laws]),
        np.array([isinstance(one, IsotropicFriction) for one in laws]),
        np.array(["n" in one.components and not cubic[p] for p, one in enumerate(laws)]),
        np.stack([c.kt, c.kn, c.mu, c.preload, np.array(cubic)], axis=1),
    )


def solved(problem, force, w, harmonics=HARMONICS):
    """With ever more of them; None where Newton's method finds nothing from the stuck motion."""
    point = None
    for H in harmonics:
        balance = HarmonicBalance(problem, {1: force}, H)
        x = np.zeros((balance.n_components, balance.nh))
        if point is None:
            x[:] = balance.linear(w).reshape(x.shape)
        else:
            x[:, : point.x.size // len(x)] = point.x.reshape(len(x), -1)
        point = solve_fixed(balance.evaluate, x.ravel(), w, balance.weights)
        if not point.converged:
            return None
    return point


def compared(kind, seed):
    """None where the motion is not found by both, or its contacts stick."""
    problem, force, w = drawn(kind, seed)
    point = solved(problem, force, w)
    if point is None or (kind != "cubic" and (point.detail.forces.shares[:, 0] > STUCK).all()):
        return None
    own = own_system(problem, force, w)
    X = point.detail.outputs(np.eye(len(force)))
    begin = own_orbits.on_motion(own, X)
    y = own_orbits.orbit(own, begin)
    size = np.abs(begin[: 2 * len(force)]).max()
    if y is None or np.abs(y - begin)[: 2 * len(force)].max() > 1e-3 * size:
        return None  # of another motion, or of one that so many harmonics do not hold
    n = 2000
    if own.coupled.any() and point.detail.forces.shares[:, 2].any():
        n = 16000  # there the direction of slip follows step by step
        y = own_orbits.orbit(own, y, n)
    J, wide = (own_orbits.derivatives(own, y, h * size, n) for h in (DISTURBED, NEAR))
    kink = max(np.abs(np.subtract(*both)).max() for both in (J, wide))
    ours = Stability().multipliers(point.detail, w)
    return Compared(ours, own_orbits.multipliers(J.mean(axis=0)), bool(kink > OTHER))


def several(kind, count):
    """So many that are compared, seed after seed."""
    found, seed = 0, 0
    while found < count:
        one = compared(kind, seed)
        seed += 1
        if one is not None:
            found += 1
            yield one
