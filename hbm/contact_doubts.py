"""What makes a contact table doubtful beside the model that it is for: sentences, empty where
nothing does.

Reduced models may have few nodes, far from the contact that they stand for: lengths are held
against the distance of neighbouring nodes and of partners. Places of nodes are (P, 3) m, nan where
they are not known.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.model import ReducedModel


@dataclass(frozen=True)
class DoubtLimits:
    """What is doubted."""

    nearer: float = 0.5  # of the distance to the next node: by that much a better partner is nearer
    # of the distance to the next node: a place that is off by more belongs to no pair
    place: float = 0.1
    # of the partners' distance: contact of nodes that lie apart is somewhere between
    between: float = 0.5
    # degrees between the normals of neighbours, which no edge of a damper has
    opposed: float = 135.0


LIMITS = DoubtLimits()


def node_places(model: ReducedModel, pairs: ContactTable) -> tuple[np.ndarray, np.ndarray]:
    """(blade, damper): (P, 3) m of the nodes or contact points of each pair; nan of the ground, and
    where the model does not know it."""
    at = {
        (str(body), int(node)): place
        for body, node, place, moves in zip(
            model.body, model.node, model.position, model.moves, strict=True
        )
        if moves
    }
    for body, points in model.points.items():
        at |= {
            (body, int(number)): place
            for number, place in zip(points.number, points.position, strict=True)
        }
    unknown = np.full(3, np.nan)

    def of(bodies, numbers):
        keys = zip(bodies.tolist(), numbers.tolist(), strict=True)
        return np.array(
            [unknown if key[0] == GROUND else at.get(key, unknown) for key in keys]
        ).reshape(-1, 3)

    return of(pairs.blade_body, pairs.blade_node), of(pairs.damper_body, pairs.damper_node)


def mixed_partners(
    pairs: ContactTable, blade: np.ndarray, damper: np.ndarray, tolerance: float = 0.0
) -> str:
    """Where both nodes of a pair have a clearly nearer one on the other body, beyond a tolerance
    (m)."""
    known = np.flatnonzero(np.isfinite(blade + damper).all(axis=1))
    if len(known) < 2:
        return ""
    apart = np.linalg.norm(blade[known] - damper[known], axis=1)
    to_blade, its = cKDTree(blade[known]).query(damper[known])
    to_damper, _ = cKDTree(damper[known]).query(blade[known])
    better = np.maximum(
        to_blade + LIMITS.nearer * _spacing(blade[known]),
        to_damper + LIMITS.nearer * _spacing(damper[known]),
    )
    wrong = (apart > better) & (apart > tolerance)
    if not wrong.any():
        return ""
    k = int(np.where(wrong, apart, 0).argmax())
    i, nearer = known[k], pairs.blade_node[known[its[k]]]
    return (
        f"{_named(pairs, i)}: blade node {pairs.blade_node[i]} lies {apart[k]:.3g} m from its "
        f"partner, damper node {pairs.damper_node[i]}, blade node {nearer} {to_blade[k]:.3g} m "
        f"({wrong.sum()} such pairs): are the partners mixed up?"
    )


def misplaced(
    pairs: ContactTable, blade: np.ndarray, damper: np.ndarray, tolerance: float = 0.0
) -> str:
    """Where x, y, z of a pair are not those of its nodes, or between them, beyond a tolerance
    (m)."""
    one = np.where(np.isfinite(damper), damper, blade)
    other = np.where(np.isfinite(blade), blade, damper)
    known = np.flatnonzero(np.isfinite(one + other).all(axis=1))
    if not len(known):
        return ""
    one, other, place = one[known], other[known], pairs.position[known]
    near = np.minimum(
        np.minimum(_spacing(one), _spacing(other)),
        np.ptp(np.concatenate([one, other]), axis=0).max(),
    )
    allowed = np.maximum(
        tolerance,
        np.maximum(LIMITS.place * near, LIMITS.between * np.linalg.norm(other - one, axis=1)),
    )
    off = _off_line(place, one, other)
    wrong = off > allowed
    if not wrong.any():
        return ""
    k = int((off - allowed).argmax())
    unit = (
        " (given in mm? they must be in m)"
        if (_off_line(1e-3 * place, one, other) <= allowed).all()
        else ""
    )
    return (
        f"{_named(pairs, known[k])}: x, y, z = {_vector(place[k])} m lies {off[k]:.3g} m off its "
        f"nodes, one of which is at {_vector(one[k])} m ({wrong.sum()} such pairs){unit}"
    )


def opposed_normals(pairs: ContactTable) -> str:
    """Where the normal of a pair points against that of its neighbour on the side."""
    for side in pairs.sides:
        mine = np.flatnonzero(pairs.side == side)
        n, other = pairs.normal[mine], _neighbours(pairs.position[mine])
        against = np.einsum("pd,pd->p", n, n[other]) < np.cos(np.radians(LIMITS.opposed))
        if against.any():
            k = int(np.where(against, n @ n.sum(axis=0), np.inf).argmin())
            return (
                f"{_named(pairs, mine[k])}: n = {_vector(n[k])} points against that of its "
                f"neighbour, pair {mine[other[k]] + 1}: n must point out of the damper into the "
                "blade, with t1 x t2 = n"
            )
    return ""


def _named(pairs, i):
    return f"pair {i + 1} (side '{pairs.side[i]}', station {pairs.station[i]}, row {pairs.row[i]})"


def _vector(v):
    return ", ".join(f"{x:.4g}" for x in v)


def _neighbours(places):
    """(P,) index of the nearest that lies elsewhere; its own where all lie at one place."""
    first = np.unique(places, axis=0, return_index=True, return_inverse=True)
    distinct, of = first[1], first[2].ravel()
    if len(distinct) < 2:
        return np.arange(len(places))
    return distinct[cKDTree(places[distinct]).query(places[distinct], 2)[1][of, 1]]


def _spacing(places):
    """(P,) m to the nearest place that is another one; inf where there is none."""
    size = np.ptp(places, axis=0).max(initial=0.0)
    distinct = np.unique(
        np.round(places / (1e-9 * size)) if size > 0 else places[:1], axis=0, return_index=True
    )[1]
    if len(distinct) < 2:
        return np.full(len(places), np.inf)
    return cKDTree(places[distinct]).query(places, 2)[0][:, 1]


def _off_line(place, one, other):
    """(P,) m from the places to the straight lines between two points each."""
    way = other - one
    length = np.einsum("pd,pd->p", way, way)
    along = np.einsum("pd,pd->p", place - one, way) / np.where(length > 0, length, 1.0)
    return np.linalg.norm(place - one - np.clip(along, 0.0, 1.0)[:, None] * way, axis=1)
