"""Roll stiffness of a flat that a single row of pairs cannot represent: declared springs at each
kept station."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel


@dataclass(frozen=True)
class RollSpring:
    """k : N m/rad on theta = (u_n[high] - u_n[low]) / distance, the relative roll of two faces at
    one station.

    low, high - rows of the contact table; distance : m between them."""

    k: float
    low: int
    high: int
    distance: float


def roll_springs(
    pairs: ContactTable, side: str, width: float, stiffness: float | None
) -> list[RollSpring]:
    """Roll stiffness of a flat of this width, which one row of pairs in its place does not have.

    pairs - the full patch, with weight 0 on what is detached; width : m. One spring at each station
    that carries: kn w^2 / 12 with the kn of its carrying pairs (stiffness=None), or the given total
    (N m/rad) by their weight."""
    mine = np.flatnonzero(pairs.side == side)
    order = mine[np.lexsort((pairs.row[mine], pairs.station[mine]))]
    station, first, count = np.unique(pairs.station[order], return_index=True, return_counts=True)
    kn, weight = (
        np.bincount(pairs.station[mine], c[mine])[station]
        for c in (pairs.kn * pairs.weight, pairs.weight)
    )
    low, high = order[first], order[first + count - 1]
    on = weight > 0
    if (count[on] < 2).any():
        raise InputError(
            f"side '{side}': a roll stiffness needs at least two rows of nodes across the flat; "
            "set roll_stiffness = 0 or mesh the flat with more rows"
        )
    k = kn * width**2 / 12 if stiffness is None else stiffness * weight / weight.sum()
    distance = np.linalg.norm(pairs.position[high] - pairs.position[low], axis=1)
    return [
        RollSpring(float(k[i]), int(low[i]), int(high[i]), float(distance[i]))
        for i in np.flatnonzero(on)
    ]


def spring_directions(B: np.ndarray, springs: Sequence[RollSpring]) -> np.ndarray:
    """(m, r) rows of unit stiffness; B (3P, r): relative motion at the pairs, rows t1, t2, n of
    each."""
    return np.array(rolls(B, springs)).reshape(-1, B.shape[1])


def rolls(
    B: sp.spmatrix | np.ndarray, springs: Sequence[RollSpring]
) -> list[sp.spmatrix | np.ndarray]:
    """Of relative motion B (3P, ...) t1, t2, n of the pairs: the roll at each spring."""
    return [(B[3 * s.high + 2] - B[3 * s.low + 2]) / s.distance for s in springs]


def spring_rows(
    model: ReducedModel, pairs: ContactTable, springs: Sequence[RollSpring]
) -> np.ndarray:
    """(m, r) rows e of the springs: e'e sums to their stiffness in the reduced dofs."""
    if not springs:
        return np.zeros((0, model.size))
    B = relative_motion(model, pairs).toarray()
    return np.sqrt([s.k for s in springs])[:, None] * spring_directions(B, springs)


def with_springs(
    model: ReducedModel, pairs: ContactTable, springs: list[RollSpring]
) -> ReducedModel:
    """The model with the declared roll springs in its stiffness."""
    e = spring_rows(model, pairs, springs)
    return model.with_stiffness(model.K + e.T @ e)
