"""Symmetries of a harmonic balance: changes of the motion that turn solutions into solutions.

Alike contacts may change places, as those of a ring of equal blades under equal forces; where every
force is odd, a solution half a period later and with the other sign is one as well; and where two
equal stops face each other, they change places half a period later.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np

from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import size

Kept = Callable[[np.ndarray], np.ndarray]
SAME = 1e-9  # of the size of a matrix or a residual: what is equal
MOST = 48  # symmetries of places: those of a cube; more are not used


class Symmetry:
    """One of them; order (P,), signs (nh,) : contact p moves as contact order[p] did, times these,
    which turn it round or move it by half a period."""

    def __init__(self, balance: HarmonicBalance, order: np.ndarray, signs: np.ndarray) -> None:
        self.order = order
        self.signs = signs
        self.shape = (len(order), balance.nd, balance.nh)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(n,) motion from x (n,)."""
        return (x.reshape(self.shape)[self.order] * self.signs).ravel()


def symmetries(balance: HarmonicBalance, w: float) -> list[Symmetry]:
    """Those of a balance at w rad/s, without the one that changes nothing; none where there are
    more than `MOST`. Each is held against the residual of a motion at random."""
    linear = balance.linear(w).reshape(len(balance.problem.contacts), balance.nd, balance.nh)
    x = np.random.default_rng(0).normal(size=linear.shape) * max(size(linear.ravel()), 1e-300)
    residual = balance.evaluate(x.ravel(), w).residual
    later = (-1.0) ** np.r_[0, np.repeat(np.arange(1, balance.H + 1), 2)]  # by half a period
    receptance = _between_contacts(balance, w)
    found = list[Symmetry]()
    tried = 0
    for half, sign in product((False, True), (1.0, -1.0)):
        signs = sign * (later if half else np.ones(balance.nh))
        for order in _places(linear, signs, receptance):
            tried += 1
            if tried > MOST:
                return []
            if (signs == 1).all() and np.array_equal(order, np.arange(len(order))):
                continue
            one = Symmetry(balance, order, signs)
            error = size(balance.evaluate(one(x.ravel()), w).residual - one(residual))
            if error <= SAME * size(residual):
                found.append(one)
    return found


def kept_by_symmetry(balance: HarmonicBalance, w: float, x: np.ndarray, near: float) -> Kept | None:
    """Of any motion (n,), the part that has the symmetries that the motion x has at w rad/s, up to
    a share `near` of it; None where it has none."""
    if balance.problem.reducible:
        return None
    allowed = near * size(x)
    own = [one for one in symmetries(balance, w) if size(one(x) - x) <= allowed]
    if not own:
        return None
    return lambda moved: sum((image(moved) for image in own), moved) / (1 + len(own))


def _between_contacts(balance: HarmonicBalance, w: float) -> np.ndarray:
    """(P, P, 2, nd, nd) receptance between the contacts at rest and at w rad/s."""
    P = len(balance.problem.contacts)
    nd = balance.nd
    shapes = balance.shapes
    factors = balance.receptance.factors(np.array([0.0, w]))[0]
    G = np.array([(shapes * factors[:, k]) @ balance.into.T for k in range(2)])
    return G.reshape(2, P, nd, P, nd).transpose(1, 3, 0, 2, 4)


def _places(linear: np.ndarray, signs: np.ndarray, G: np.ndarray) -> Iterator[np.ndarray]:
    """Orders (P,) of the contacts that, with the signs, leave the response of the stuck system and
    the receptance G between the contacts as they are, one place after the other."""
    P = len(linear)
    image = linear * signs
    near, alike = SAME * np.abs(G).max(), SAME * np.abs(linear).max()

    def extended(order: Sequence[int]) -> Iterator[np.ndarray]:
        p = len(order)
        if p == P:
            yield np.array(order)
            return
        for q in set(range(P)).difference(order):
            same = (
                np.abs(linear[p] - image[q]).max() <= alike
                and np.abs(G[p, p] - G[q, q]).max() <= near
                and all(np.abs(G[p, k] - G[q, order[k]]).max() <= near for k in range(p))
            )
            if same:
                yield from extended([*order, q])

    yield from extended([])
