"""Redistribution of the preload after detachment: the kept pairs carry the whole pull."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS


@dataclass(frozen=True)
class MomentSettings:
    """Of the moment that the kept pairs leave, as a share of the load times the length of the
    contact."""

    # more is no small error of the whole map, but another damper: its load stands elsewhere
    refused: float = 0.05
    # more moves the forces of pairs by percents: what they would be is said beside them
    compared: float = 0.01


MOMENT = MomentSettings()


@dataclass(frozen=True)
class Redistribution:
    """pairs - the kept pairs with the preload that they carry; scale : {side: factor on their part
    of the whole map}
    moment : (3,) N m on the damper about x, y, z by which what is kept differs from the whole map,
    since each station's force moves to its kept row or a part is detached (in the reference state,
    taken up there and reported)."""

    pairs: ContactTable
    scale: dict[str, float]
    moment: np.ndarray

    def with_friction(
        self, whole: ContactTable, tangential: np.ndarray, kept: np.ndarray
    ) -> np.ndarray:
        """(3,) N m: `moment` with the friction forces (P, 2) N of the whole map, and those of the
        kept pairs."""
        middle = whole.position.mean(axis=0)
        return (
            self.moment
            + _moment(whole, _drag(whole, tangential), middle)
            - _moment(self.pairs, _drag(self.pairs, kept), middle)
        )


def redistribute(
    whole: ContactTable, kept: ContactTable, forces: dict[str, float]
) -> Redistribution:
    """The part of the whole map on the kept stations, scaled to the side forces of the equilibrium.

    whole - solved preload of all rows, of weight 0 where it leaves without its force being moved;
    kept - carrying pairs only; forces {side: N}. Each kept pair has its own part of the map, and
    where fewer rows are kept than were solved, the forces of the others of its station go to the
    kept ones in equal parts, to the closed ones where there are any. Pairs that carry nothing keep
    their opening. Raises InputError where no kept station of a side is closed."""
    preload = np.empty(len(kept))
    scale, before, whole = {}, whole, whole.select(whole.carrying)
    for side in kept.sides:
        mine = np.flatnonzero(kept.side == side)
        full = whole.select(whole.side == side)
        part = carried(full, kept.select(mine))
        total = part[part > 0].sum()
        scale[side] = float(forces[side] / total) if total > 0 else 1.0
        # a stop may carry nothing
        if total <= 0 and forces[side] > SETTINGS.rounding * max(forces.values()):
            raise InputError(f"side '{side}': none of the kept stations is closed under the pull")
        preload[mine] = np.where(part > 0, part * scale[side], part)
    middle = before.position.mean(axis=0)
    moment = _moment(before, _push(before, before.preload), middle) - _moment(
        kept, _push(kept, preload), middle
    )
    return Redistribution(kept.replace(preload=preload), scale, moment)


def contact_length(pairs: ContactTable, axis: ArrayLike) -> float:
    """m: of the damper's contact along the axis; across it where that is more, as with a single
    station."""
    place = pairs.position[pairs.damper_body != GROUND]
    along = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    arm = place - place.mean(axis=0)
    beside = np.linalg.norm(arm - np.outer(arm @ along, along), axis=1)
    return float(max(np.ptp(place @ along), 2 * beside.max()))


def carried(whole: ContactTable, kept: ContactTable) -> np.ndarray:
    """(P,) N: what of the whole map falls to each pair of `kept` by its place and weight; 0 where
    it is detached.

    Its own force and its part of those of the rows of its station that are not kept. Where nothing
    falls to the pair its own (negative) preload stays: it does not touch. A row that stands for
    others is open only with all of them."""
    force = np.zeros(len(kept))
    whole = whole.select(whole.carrying)
    for i in np.flatnonzero(kept.carrying):
        beside = (kept.side == kept.side[i]) & (kept.station == kept.station[i]) & kept.carrying
        station = whole.select((whole.side == kept.side[i]) & (whole.station == kept.station[i]))
        force[i] = _weight_left(station, kept, i) * _own_part(
            station, kept.row[i], kept.row[beside]
        )
    return force


def _weight_left(station: ContactTable, kept: ContactTable, i: int) -> float:
    """Part of its former weight that a kept pair still has: below 1 where its station is graded."""
    own = station.weight[station.row == kept.row[i]]
    return kept.weight[i] / (own.max() if len(own) else 1.0)


def _own_part(station: ContactTable, row: int, rows: np.ndarray) -> float:
    """What falls to the pair in `row` of all pairs of a station, of which `rows` are kept."""
    closed = np.maximum(station.preload, 0.0)
    own = station.row == row
    takers = np.intersect1d(rows, station.row[closed > 0])
    takers = takers if len(takers) else rows
    if not closed.any() or row not in takers:
        return (
            station.preload[own].max(initial=-np.inf)
            if own.any()
            else station.preload.max(initial=0.0)
        )
    return closed[own].sum() + closed[~np.isin(station.row, rows)].sum() / len(takers)


def redistribute_friction(
    whole: ContactTable, tangential: np.ndarray, normal: Redistribution
) -> np.ndarray:
    """(kept pairs, 2) N: friction forces (P, 2) of the whole map, moved and scaled as
    `redistribute` did with the normal ones, so that |T| <= mu N holds on as it did. Open stations
    carry none."""
    kept, out = normal.pairs, np.zeros((len(normal.pairs), 2))
    for i in np.flatnonzero(kept.preload > 0):
        station = (whole.side == kept.side[i]) & (whole.station == kept.station[i]) & whole.carrying
        beside = (kept.side == kept.side[i]) & (kept.station == kept.station[i])
        left = station & ~np.isin(whole.row, kept.row[beside])
        moved = tangential[left].sum(axis=0) / (beside & (kept.preload > 0)).sum()
        own = tangential[station & (whole.row == kept.row[i])].sum(axis=0)
        part = _weight_left(whole.select(station), kept, i)
        out[i] = normal.scale[str(kept.side[i])] * part * (own + moved)
    return out


def balancing_forces(
    whole: ContactTable,
    kept: ContactTable,
    tangential: np.ndarray,
    load: np.ndarray,
    axis: np.ndarray,
) -> dict[str, float]:
    """{side: N} to which the whole map's part on the kept stations must be scaled, friction forces
    with the normal ones, so that together they balance the load (3,) N across the axis.

    Where some stations slip and others do not, the kept ones have another part of the friction than
    of the normal forces, and the side sums of the whole map would leave a part of the load
    unbalanced. Raises InputError where a side would have to pull.
    """
    unit = redistribute(whole, kept, dict.fromkeys(kept.sides, 1.0))
    T = redistribute_friction(whole, tangential, unit)
    on_blades = _push(kept, unit.pairs.preload) + _drag(kept, T)
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    across = np.eye(3) - np.outer(axis, axis)
    sides = np.column_stack(
        [across @ on_blades[kept.side == side].sum(axis=0) for side in kept.sides]
    )
    forces = np.linalg.lstsq(sides, across @ load, rcond=None)[0]
    if not (forces > 0).all():
        raise InputError(
            f"the kept stations cannot carry the pull with the friction of the whole map: "
            f"{', '.join(f'{s} {f:.3g} N' for s, f in zip(kept.sides, forces, strict=True))}; set "
            '[tune] preload = "resolved"'
        )
    return dict(zip(kept.sides, forces.tolist(), strict=True))


def _push(pairs: ContactTable, normal: np.ndarray) -> np.ndarray:
    """(P, 3) N on the blades, of normal forces (P,) N; open pairs carry none."""
    return np.maximum(normal, 0.0)[:, None] * pairs.normal


def _drag(pairs: ContactTable, tangential: np.ndarray) -> np.ndarray:
    """(P, 3) N on the blades, of friction forces (P, 2) N."""
    return np.einsum("pd,pdx->px", tangential, pairs.frame[:, :2])


def _moment(pairs: ContactTable, on_blades: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """(3,) N m about `middle`: moment on the damper of the contact forces (P, 3) N."""
    mine = pairs.damper_body != GROUND
    return np.cross(pairs.position[mine] - middle, -on_blades[mine]).sum(axis=0)
