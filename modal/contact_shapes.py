"""Contact shapes: static shapes of unit forces on contact points, which make the relative motion
exact in statics.

With the masters fixed and the modes Phi kept, the shapes of the forces W' (rows of W: motions of
the contact points)

    Z = K^-1 W' - Phi Lambda^-1 Phi' W'        [residual attachment modes: MacNeal 1971, Rubin 1975]

are K-orthogonal to the modes. K^-1 W' lies in the basis, so that W K^-1 f is exact for any load f.
What is left out, x, is K-orthogonal to all shapes and moves no contact point: W x = (K^-1 W')' K x
= 0. Springs on contact points do not reach it, and the bound of `tipdamp.modal.truncation` holds as
for springs on masters.

Of thousands of points the forces are tractions, uniform over a cell of the contact each: T' W in
the place of W, T the shares of the points. What is left out then has no mean motion in a cell, yet
it moves points: stuck frequencies come out too high by a little, and the bound does not hold.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.ties import first_largest, in_order
from tipdamp.modal.body import Body, pieces


@dataclass(frozen=True)
class ShapeSettings:
    """Of the static shapes."""

    # of the largest: a force of less follows from the others, to the rounding of weights
    weight: float = 1e-12
    energy: float = 1e-12  # of a force's own: less is a shape that the modes have
    # of the asymmetry of these energies, which are symmetric but for rounding: as little
    rounding: float = 10.0
    mass: float = 1e-15  # of the largest: less is rounding, and counts as much
    columns: int = 256  # forces that are dense at once, which bounds the memory
    square: float = 1e-6  # of the larger moment of a cell: nearer ones are those of a square


SETTINGS = ShapeSettings()


def contact_shapes(
    solve: Callable, M: sp.csr_matrix, W: sp.csr_matrix, omega: np.ndarray, Phi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(c,) rad/s and (d, c): shapes of unit forces on the rows of W (n, d) beside the modes omega
    (m,), Phi (d, m).

    solve : K^-1 of (d, k). The shapes are orthogonal to the modes and to each other in K and M, and
    mass-normalised. Forces that follow from others, as many on a coarse face do, are dropped by
    their weights: energies, which go with the square of these, would tell dependence to 1e-6 at
    best.
    """
    W = independent(W)
    Z = np.empty((W.shape[1], W.shape[0]), order="F")
    for first in range(0, W.shape[0], SETTINGS.columns):
        part = slice(first, first + SETTINGS.columns)
        Z[:, part] = solve(W[part].T.toarray())
    size = np.sqrt((W @ Z).diagonal())
    Z -= Phi @ ((W @ Phi) / omega**2).T
    energy = (W @ Z) / np.outer(size, size)
    value, U = np.linalg.eigh((energy + energy.T) / 2)
    good = value > max(SETTINGS.energy, SETTINGS.rounding * np.linalg.norm(energy - energy.T))
    Z = Z @ (U[:, good] / np.sqrt(value[good]) / size[:, None])
    # of the shapes as they are: none is negative, whatever they lost by cancellation
    mass = Z.T @ (M @ Z)
    compliance, V = np.linalg.eigh((mass + mass.T) / 2)
    compliance = np.maximum(compliance, SETTINGS.mass * compliance.max(initial=0.0))
    return 1 / np.sqrt(compliance), Z @ (V / np.sqrt(compliance))


def independent(W: sp.csr_matrix) -> sp.csr_matrix:
    """(c, d) forces at right angles to one another that span the rows of W (n, d), c its rank.

    One row after the other, less what those before it have of it: as local as the rows are.
    Singular vectors would push all of a side at once, of which a slender body's displacement is
    large and its residual too.
    """
    used = np.unique(W.indices)
    forces, left, _ = sl.qr(
        W[:, used].T.toarray(), mode="economic", pivoting=True, check_finite=False
    )
    weight = np.abs(left.diagonal())
    rank = int((weight > SETTINGS.weight * weight.max(initial=0.0)).sum())
    place = sp.csr_matrix(
        (np.ones(len(used)), (np.arange(len(used)), used)), (len(used), W.shape[1])
    )
    return sp.csr_matrix(forces[:, :rank].T) @ place


def spread(motion: sp.csr_matrix, tractions: sp.csr_matrix | None) -> sp.csr_matrix:
    """(3c, d) mean motion of the cells of contact points that move by (3n, d), for tractions (n,
    c); None: of each point."""
    return motion if tractions is None else (sp.kron(tractions.T, sp.identity(3)) @ motion).tocsr()


def traction_cells(
    position: np.ndarray, weight: np.ndarray, side: np.ndarray, most: int
) -> sp.csr_matrix:
    """(n, c) share of each point in a unit force that is spread over its cell, c <= `most`, one for
    each side at least.

    position (n, 3) m; weight (n,) > 0 - area of a point; side (n,) - points of a cell have the
    same. The cell of the largest weight is halved across its longest principal axis until there are
    enough.
    """
    cells = [np.flatnonzero(side == one) for one in np.unique(side)]
    size = [_divisible(weight, own) for own in cells]
    while len(cells) < most and max(size) > 0:
        k = first_largest(size)
        halves = _halves(position, weight, cells[k])
        cells[k], size[k] = halves[0], _divisible(weight, halves[0])
        cells.append(halves[1])
        size.append(_divisible(weight, halves[1]))
    cell = np.empty(len(weight), dtype=int)
    for k, own in enumerate(cells):
        cell[own] = k
    share = weight / np.bincount(cell, weight)[cell]
    return sp.csr_matrix((share, (np.arange(len(weight)), cell)))


def _divisible(weight: np.ndarray, own: np.ndarray) -> float:
    """Weight of a cell, 0 of one that is a single point."""
    return weight[own].sum() if len(own) > 1 else 0.0


def _halves(
    position: np.ndarray, weight: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The points of a cell in two cells of the same weight, as nearly as can be."""
    x, w = position[own], weight[own]
    apart = x - w @ x / w.sum()
    along = apart @ _longest((w[:, None] * apart).T @ apart)
    order = in_order(along)
    before = np.cumsum(w[order])[:-1]
    middle = first_largest(-np.abs(before / w.sum() - 0.5)) + 1
    return own[order[:middle]], own[order[middle:]]


def _longest(moment: np.ndarray) -> np.ndarray:
    """(3,) principal axis of the largest of the moments (3, 3); where they are equal, as of a
    square, the one that is nearest to a coordinate axis."""
    moments, axes = np.linalg.eigh(moment)
    equal = axes[:, moments > moments[-1] * (1 - SETTINGS.square)]
    along = equal @ equal.T
    return along[:, first_largest(along.diagonal())]


def holding_nodes(body: Body) -> np.ndarray:
    """(3 p,) node numbers that hold the p pieces of a free body, three far apart from each other of
    each: masters of a body that else has none."""
    return np.concatenate([_holding_nodes(one) for one in (pieces(body) if body.free else [body])])


def _holding_nodes(body: Body) -> np.ndarray:
    whole = np.flatnonzero(np.bincount(body.dof_node, minlength=len(body.node)) == 3)
    x = body.position[whole]
    first = np.linalg.norm(x - x.mean(axis=0), axis=1).argmax()
    second = np.linalg.norm(x - x[first], axis=1).argmax()
    third = np.linalg.norm(np.cross(x - x[first], x[second] - x[first]), axis=1).argmax()
    return body.node[whole[[first, second, third]]]
