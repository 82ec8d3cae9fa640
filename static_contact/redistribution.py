"""After tuning, the kept pairs carry the whole pull; and what a line of pairs cannot resist is declared, not hidden."""

from dataclasses import dataclass

import numpy as np

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel


@dataclass(frozen=True)
class Carried:
    """pairs - the kept pairs with the preload that they carry; scale : {side: factor on the whole map's part}
    moment : N m about the damper axis that moving each station's force to its kept row leaves (in the reference
    state, taken up there and reported)."""

    pairs: ContactTable
    scale: dict
    moment: float


def carry_scaled(whole: ContactTable, kept: ContactTable, forces: dict, axis) -> Carried:
    """Scale the whole map's part on the kept stations to the side forces of the equilibrium.

    whole - solved preload of all rows; kept - carrying pairs only; forces {side: N}. Each kept pair has its own part of
    the map, and where fewer rows are kept than were solved, the forces of the others of its station go to the kept
    ones in equal parts, to the closed ones where there are any. Pairs that carry nothing keep their opening.
    """
    preload = np.empty(len(kept))
    scale, moment = {}, 0.0
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    whole = whole.select(whole.carrying)
    for side in kept.sides:
        mine = np.flatnonzero(kept.side == side)
        full = whole.select(whole.side == side)
        part = np.array([_share(full, kept, i) for i in mine])
        carried = part[part > 0].sum()
        if carried <= 0:
            raise InputError(f"side '{side}': none of the kept stations is closed under the pull")
        scale[side] = float(forces[side] / carried)
        preload[mine] = np.where(part > 0, part * scale[side], part)
        moment += _moment(full, axis) - _moment(kept.replace(preload=preload).select(mine), axis)
    return Carried(kept.replace(preload=preload), scale, float(moment))


def _share(full, kept, i):
    """A kept pair's own force and its part of those of the rows of its station that are not kept.

    Where nothing falls to the pair its own (negative) preload stays.
    """
    station = full.select(full.station == kept.station[i])
    closed = np.maximum(station.preload, 0.0)
    own = station.row == kept.row[i]
    rows = kept.row[(kept.side == kept.side[i]) & (kept.station == kept.station[i])]
    takers = np.intersect1d(rows, station.row[closed > 0])
    takers = takers if len(takers) else rows
    if not closed.any() or kept.row[i] not in takers:
        return station.preload[own].max(initial=-np.inf) if own.any() else station.preload.max(initial=0.0)
    return closed[own].sum() + closed[~np.isin(station.row, rows)].sum() / len(takers)


def carry_tangential(whole: ContactTable, tangential, carried: Carried) -> np.ndarray:
    """(kept pairs, 2) N: friction forces (P, 2) of the whole map, moved and scaled as `carry_scaled` did with the
    normal ones, so that |T| <= mu N holds on as it did. Open stations carry none."""
    kept, out = carried.pairs, np.zeros((len(carried.pairs), 2))
    for i in np.flatnonzero(kept.preload > 0):
        station = (whole.side == kept.side[i]) & (whole.station == kept.station[i]) & whole.carrying
        beside = (kept.side == kept.side[i]) & (kept.station == kept.station[i])
        left = station & ~np.isin(whole.row, kept.row[beside])
        moved = tangential[left].sum(axis=0) / (beside & (kept.preload > 0)).sum()
        own = tangential[station & (whole.row == kept.row[i])].sum(axis=0)
        out[i] = carried.scale[str(kept.side[i])] * (own + moved)
    return out


def balancing_forces(whole: ContactTable, kept: ContactTable, tangential, load, axis) -> dict:
    """{side: N} to which the whole map's part on the kept stations must be scaled, friction forces with the normal
    ones, so that together they balance the load (3,) N across the axis.

    Where some stations slip and others do not, the kept ones have another share of the friction than of the pressing,
    and the side sums of the whole map would leave a part of the load unbalanced.
    """
    unit = carry_scaled(whole, kept, dict.fromkeys(kept.sides, 1.0), axis)
    T = carry_tangential(whole, tangential, unit)
    on_blades = (np.maximum(unit.pairs.preload, 0.0)[:, None] * kept.normal
                 + np.einsum("pd,pdx->px", T, kept.frame[:, :2]))
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    across = np.eye(3) - np.outer(axis, axis)
    sides = np.column_stack([across @ on_blades[kept.side == side].sum(axis=0) for side in kept.sides])
    forces = np.linalg.lstsq(sides, across @ load, rcond=None)[0]
    if not (forces > 0).all():
        raise InputError(f"the kept stations cannot carry the pull with the friction of the whole map: "
                         f"{', '.join(f'{s} {f:.3g} N' for s, f in zip(kept.sides, forces, strict=True))}; set "
                         "[tune] preload = \"resolved\"")
    return dict(zip(kept.sides, forces.tolist(), strict=True))


def _moment(pairs, axis):
    """Moment of the contact forces on the damper about the axis direction (through the origin), N m."""
    force = -np.maximum(pairs.preload, 0.0)[:, None] * pairs.normal
    return float((np.cross(pairs.position, force) @ axis).sum())


@dataclass(frozen=True)
class RollSpring:
    """k : N m/rad on theta = (u_n[high] - u_n[low]) / distance, the relative roll of two faces at one station.

    low, high - rows of the contact table; distance : m between them."""

    k: float
    low: int
    high: int
    distance: float


def roll_springs(pairs: ContactTable, side: str, width: float, stiffness: float | None) -> list[RollSpring]:
    """The resistance to roll that a flat of this width has and one row of pairs that stands for it lacks.

    pairs - the full patch, with weight 0 on what is detached. One spring at each station that carries: kn w^2 / 12
    with the kn of its carrying pairs (stiffness=None), or the given total (N m/rad) shared equally.
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
