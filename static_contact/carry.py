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

    whole - solved preload of all rows; kept - carrying pairs only; forces {side: N}. Where fewer rows are kept than
    were solved, the forces of each station go to the kept rows in equal parts. Open stations stay open.
    """
    preload = np.empty(len(kept))
    scale, moment = {}, 0.0
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    for side in kept.sides:
        mine = np.flatnonzero(kept.side == side)
        station_sum = np.array([_station_force(whole, side, kept.station[i]) for i in mine])
        rows = np.bincount(kept.station[mine])[kept.station[mine]]
        share = station_sum / rows
        carried = share[share > 0].sum()
        if carried <= 0:
            raise InputError(f"side '{side}': none of the kept stations is closed under the pull")
        scale[side] = float(forces[side] / carried)
        preload[mine] = np.where(share > 0, share * scale[side], share)
        moment += _moment(whole.select(whole.side == side), axis)
        moment -= _moment(kept.replace(preload=preload).select(mine), axis)
    return Carried(kept.replace(preload=preload), scale, float(moment))


def _station_force(whole, side, station):
    """Contact force of a station; where all its rows are open, the mildest of their (negative) preloads."""
    preload = whole.preload[(whole.side == side) & (whole.station == station)]
    return preload[preload > 0].sum() if (preload > 0).any() else preload.max()


def _moment(pairs, axis):
    """Moment of the contact forces on the damper about the axis direction (through the origin), N m."""
    force = -np.maximum(pairs.preload, 0.0)[:, None] * pairs.normal
    return float((np.cross(pairs.position, force) @ axis).sum())


def roll_springs(model: ReducedModel, whole: ContactTable, kept: ContactTable, side: str, width: float,
                 stiffness: float | None) -> np.ndarray:
    """Rows e (stations, r), springs e'e: the resistance to roll that a flat of this width has and one row lacks.

    At each kept station k_roll theta with theta = (u_n,top - u_n,bottom) / distance the relative roll of the two
    faces, and k_roll = kn w^2 / 12 with the kn of the kept pair (stiffness=None), or the given total (N m/rad)
    shared equally.
    """
    mine = whole.select(whole.side == side)
    stations = np.unique(kept.station[kept.side == side])
    rows = []
    B = relative_motion(model, mine)[2::3]
    for s in stations:
        members = np.flatnonzero(mine.station == s)
        if len(members) < 2:
            raise InputError(f"side '{side}': a roll stiffness needs at least two rows of nodes across the flat")
        low, high = members[mine.row[members].argmin()], members[mine.row[members].argmax()]
        distance = np.linalg.norm(mine.position[high] - mine.position[low])
        kn = kept.kn[(kept.side == side) & (kept.station == s)].sum()
        k_roll = kn * width**2 / 12 if stiffness is None else stiffness / len(stations)
        rows.append(np.sqrt(k_roll) / distance * (B[high] - B[low]).toarray().ravel())
    return np.array(rows)
