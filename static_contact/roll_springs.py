"""Roll stiffness of a flat that a single row of pairs cannot represent: declared springs at each kept station."""

from dataclasses import dataclass

import numpy as np

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel


@dataclass(frozen=True)
class RollSpring:
    """k : N m/rad on theta = (u_n[high] - u_n[low]) / distance, the relative roll of two faces at one station.

    low, high - rows of the contact table; distance : m between them."""

    k: float
    low: int
    high: int
    distance: float


def roll_springs(pairs: ContactTable, side: str, width: float, stiffness: float | None) -> list[RollSpring]:
    """Roll stiffness of a flat of this width, which one row of pairs in its place does not have.

    pairs - the full patch, with weight 0 on what is detached; width : m. One spring at each station that carries:
    kn w^2 / 12 with the kn of its carrying pairs (stiffness=None), or the given total (N m/rad) in equal parts.
    """
    mine = np.flatnonzero(pairs.side == side)
    stations = np.unique(pairs.station[mine][pairs.carrying[mine]])
    springs = []
    for s in stations:
        members = mine[pairs.station[mine] == s]
        if len(members) < 2:
            raise InputError(f"side '{side}': a roll stiffness needs at least two rows of nodes across the flat; "
                             "set roll_stiffness = 0 or mesh the flat with more rows")
        low, high = members[pairs.row[members].argmin()], members[pairs.row[members].argmax()]
        kn = (pairs.kn * pairs.weight)[members].sum()
        k = kn * width**2 / 12 if stiffness is None else stiffness / len(stations)
        springs.append(RollSpring(float(k), int(low), int(high),
                                  float(np.linalg.norm(pairs.position[high] - pairs.position[low]))))
    return springs


def spring_rows(model: ReducedModel, pairs: ContactTable, springs: list[RollSpring]) -> np.ndarray:
    """(m, r) rows e of the springs: e'e sums to their stiffness in the reduced dofs."""
    if not springs:
        return np.zeros((0, model.size))
    B = relative_motion(model, pairs)[2::3].toarray()
    return np.array([np.sqrt(s.k) / s.distance * (B[s.high] - B[s.low]) for s in springs])


def with_springs(model: ReducedModel, pairs: ContactTable, springs: list[RollSpring]) -> ReducedModel:
    """The model with the declared roll springs in its stiffness."""
    e = spring_rows(model, pairs, springs)
    return model.with_stiffness(model.K + e.T @ e)
