"""Frictionless balance of the free damper: the normal force on each side.     [Zucca 2016, sec.
7.1, figure 6]"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS, RigidMotionSettings

TURNS = 0.02  # of the normals of a side, rad: with less it is flat
NEAR = 0.2  # of the largest gap, over which the weight of a point falls by e


def side_normals(pairs: ContactTable) -> dict[str, np.ndarray]:
    """Unit normal of each side of the damper where it touches first, (3,), from the damper into the
    blade or the ground: the mean one, of an arc beside gaps that of the line of contact."""
    normals, pairs = {}, pairs.select(pairs.damper_body != GROUND)
    for side in pairs.sides:
        normals[side] = _where_it_touches(pairs.select(pairs.side == side))
    return normals


class Touch(NamedTuple):
    """The parabola of the gaps of a round side: gap = least gap + curved (turned - least)^2.

    way : (3,) - unit vector along which the normals turn; turned : (n,) - their components along it
    least : where the gap is least, of `turned`; curved : m
    """

    way: np.ndarray
    turned: np.ndarray
    least: float
    curved: float


def touch(mine: ContactTable) -> Touch | None:
    """Of the pairs of one side, nearer ones counting more, since an arc is no parabola far off;
    None where its normals do not turn, or its gaps do not open to both sides."""
    mean = _mean_normal(mine)
    way = np.linalg.svd(mine.normal - mean, full_matrices=False)[2][0]
    turned, gap = mine.normal @ way, mine.gap - mine.gap.min()
    if np.ptp(turned) < TURNS or not gap.any():
        return None
    # along the side, where gaps may differ as well
    place = mine.position @ np.cross(mean, way)
    place = (place - place.mean()) / (np.ptp(place) or 1.0)
    near = np.exp(-gap / (NEAR * gap.max()))
    terms = np.column_stack([np.ones_like(turned), turned, turned**2, place, place**2])
    _, slope, curved, *_ = np.linalg.lstsq(near[:, None] * terms, near * gap, rcond=None)[0]
    return Touch(way, turned, -slope / (2 * curved), curved) if curved > 0 else None


def _mean_normal(mine: ContactTable) -> np.ndarray:
    mean = mine.normal.mean(axis=0)
    return mean / np.linalg.norm(mean)


def _where_it_touches(mine: ContactTable) -> np.ndarray:
    """The normal where the gap is least, the mean one where it is so nowhere."""
    mean, found = _mean_normal(mine), touch(mine)
    if found is None:
        return mean
    least = np.clip(found.least, found.turned.min(), found.turned.max())
    beside = mean - (mean @ found.way) * found.way
    return least * found.way + np.sqrt(1 - least**2) * beside / np.linalg.norm(beside)


def beside(held: ArrayLike, forces: np.ndarray) -> np.ndarray:
    """The part of forces (3,) or (3, n) across the directions `held` (m, 3) along which the damper
    is held."""
    ways = np.reshape(held, (-1, 3)).astype(float)
    return forces - np.linalg.pinv(ways) @ (ways @ forces) if len(ways) else forces


def side_forces(
    normals: dict[str, np.ndarray],
    pull: ArrayLike,
    settings: RigidMotionSettings = SETTINGS,
    held: ArrayLike = (),
) -> dict[str, float]:
    """Force N on each side from sum_s N_s n_s = pull, with the pull (3,) N on the damper.

    Sides that share their force with others, as two lands with one normal do, are left out: there
    elasticity decides. The blade pushes the damper by -N n, and what holds the damper along the
    directions `held` (m, 3) takes the load there. Raises InputError when the sides leave more than
    1e-3 of the pull, or one would have to pull the damper."""
    pull = beside(held, np.asarray(pull, dtype=float))
    A = beside(held, np.column_stack(list(normals.values())))
    force, *_ = np.linalg.lstsq(A, pull, rcond=None)
    left, size = pull - A @ force, np.linalg.norm(pull)
    remains = np.linalg.norm(left)
    if remains > settings.taken_up * size:
        along = (np.round(left / remains, 3) + 0.0).tolist()  # no -0.0
        raise InputError(
            f"sides {', '.join(normals)} cannot balance the pull {pull.tolist()} N without "
            f"friction: a residual of {remains:.3g} N along {along} remains; take it "
            "off, or hold the damper there (hold, in [damper] or [model] of a study)"
        )
    _, amount, way = np.linalg.svd(A)
    # of forces: what changes nothing on the damper
    shared = way[(amount > settings.parallel).sum() :]
    alone = np.abs(shared).max(axis=0, initial=0.0) < settings.parallel
    found = {n: f for n, f, known in zip(normals, force.tolist(), alone, strict=True) if known}
    for name, value in found.items():
        if value < -settings.rounding * size:
            raise InputError(
                f"side '{name}' would have to pull the damper ({value:.3g} N): check the pull "
                "direction and the normals"
            )
    return found
