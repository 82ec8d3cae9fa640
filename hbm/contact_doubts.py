"""What makes a contact table doubtful beside the model that it is for: sentences, empty where
nothing does.

Reduced models may have few nodes, far from the contact that they stand for: lengths are held
against the distance of neighbouring nodes and of partners. Places of nodes are (P, 3) m, nan where
they are not known.
"""

from collections.abc import Iterator, Mapping
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
    # of a distance between places, and of the entries of frames: pairs that differ by less are one
    same: float = 1e-6
    mu: float = 2.0  # more than any dry metals have
    # of the size of a cell: more is no small motion, and other nodes would face each other
    closure: float = 0.05
    # kt over kn: 0.66 to 1 of half-spaces, some tenths of rough surfaces; 1000 is a unit
    tangential: tuple[float, float] = (1e-2, 1e2)
    uneven: float = 100.0  # times the median of its side: more than shapes of faces make


LIMITS = DoubtLimits()


def contact_doubts(model: ReducedModel, pairs: ContactTable) -> list[str]:
    """Every sentence on a table beside its model; places that are all zero are taken as not
    given."""
    blade, damper = node_places(model, pairs)
    placed = pairs.position.any()
    size = np.ptp(pairs.position, axis=0).max(initial=0.0)
    said = [
        repeated(pairs),
        mixed_partners(pairs, blade, damper),
        misplaced(pairs, blade, damper, LIMITS.same * size) if placed else "",
        opposed_normals(pairs),
        high_friction(pairs),
        *(closure_doubts(pairs) if placed else ()),
        *tangential_doubts(pairs),
        *uneven_doubts(pairs),
    ]
    return [sentence for sentence in said if sentence]


def repeated(pairs: ContactTable) -> str:
    """Where two pairs of a side have the same nodes, frame and gap: their contact counts twice."""
    known: dict[tuple, int] = {}
    for i in range(len(pairs)):
        key = (
            pairs.side[i],
            pairs.blade_body[i],
            pairs.blade_node[i],
            pairs.damper_body[i],
            pairs.damper_node[i],
            pairs.gap[i],
            *np.round(pairs.frame[i].ravel() / LIMITS.same).tolist(),
        )
        if key in known:
            return (
                f"{_named(pairs, i)} has the nodes, the frame and the gap of pair "
                f"{known[key] + 1}: their contact counts twice"
            )
        known[key] = i
    return ""


def high_friction(pairs: ContactTable) -> str:
    """Where mu is above that of any dry metals."""
    high = np.flatnonzero(pairs.mu > LIMITS.mu)
    if not len(high):
        return ""
    i = high[np.argmax(pairs.mu[high])]
    return (
        f"{len(high)} of {len(pairs)} pairs have a friction coefficient above {LIMITS.mu:g}, pair "
        f"{i + 1} (side '{pairs.side[i]}') {pairs.mu[i]:g}: is it mu, or in percent?"
    )


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

    def of(bodies: np.ndarray, numbers: np.ndarray) -> np.ndarray:
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


def closure_doubts(pairs: ContactTable, smooth: Mapping[str, float] | None = None) -> Iterator[str]:
    """Sides whose springs close under the preload of the pairs by more than a small part of a cell;
    smooth {side: N/m} of two smooth half-spaces, where it is known."""
    smooth = smooth or {}
    for name in pairs.sides:
        mine = pairs.select(
            (pairs.side == name) & pairs.carrying & (pairs.kn > 0) & np.isfinite(pairs.kn)
        )
        size = _cell_sizes(mine)
        closure = np.maximum(mine.preload, 0) / np.where(mine.kn > 0, mine.kn * mine.weight, 1.0)
        far = closure > LIMITS.closure * size
        if far.any():
            i = int((closure / size).argmax())
            kn = mine.kn[i] * mine.weight[i]
            force = float(np.maximum(mine.preload, 0).sum())
            estimate = (
                "; two smooth half-spaces of its size and material would by "
                f"{1e3 * force / smooth[name]:.2g} mm"
                if name in smooth
                else ""
            )
            yield (
                f"side '{name}': the springs of {int(far.sum())} of {len(mine)} pairs close under "
                f"the preload by more than {LIMITS.closure:g} of the size of a cell, most at "
                f"damper node {mine.damper_node[i]}: {mine.preload[i]:.3g} N on kn = {kn:.3g} N/m "
                f"is {1e3 * closure[i]:.2g} mm, and cells are {1e3 * size[i]:.2g} mm{estimate}: is "
                "kn too small by a factor of 1000 or more (N/mm for N/m)?"
            )


def tangential_doubts(pairs: ContactTable) -> Iterator[str]:
    """Sides whose kt is far from their kn; without friction, kt = 0, or hard along the normal there
    is nothing to compare."""
    for name in pairs.sides:
        mine = pairs.select((pairs.side == name) & pairs.carrying & (pairs.kn > 0) & (pairs.kt > 0))
        mine = mine.select(np.isfinite(mine.kn) & np.isfinite(mine.kt))
        ratio = mine.kt / np.where(mine.kn > 0, mine.kn, 1.0)
        low, high = LIMITS.tangential
        if len(mine) and not low <= np.median(ratio) <= high:
            yield (
                f"side '{name}': kt is {np.median(ratio):.2g} of kn; elastic half-spaces have 0.66 "
                "to 1, and rough surfaces some tenths: are both in the same unit (N/mm for N/m?)"
            )


def uneven_doubts(pairs: ContactTable) -> Iterator[str]:
    """Pairs whose kn or kt is far above that of the others of their side."""
    for name in pairs.sides:
        mine = np.flatnonzero((pairs.side == name) & pairs.carrying)
        for key in ("kn", "kt"):
            values = vars(pairs)[key][mine]
            values = np.where(np.isfinite(values), values, 0.0)
            usual = float(np.median(values[values > 0])) if (values > 0).any() else 0.0
            if usual and values.max() > LIMITS.uneven * usual:
                i = mine[values.argmax()]
                yield (
                    f"{_named(pairs, i)}: {key} = {values.max():.3g} N/m is "
                    f"{values.max() / usual:.2g} times the median of its side"
                )


def _cell_sizes(mine: ContactTable) -> np.ndarray:
    """(n,) m: of the faces around contact points, and the distance of neighbouring pairs of
    nodes."""
    places = np.unique(mine.position, axis=0)  # one may be there twice
    if len(places) < 2:
        return np.full(len(mine), np.inf)
    apart = cKDTree(places).query(places, 2)[0][:, 1]
    return np.where(
        mine.on_surface, np.sqrt(np.where(mine.on_surface, mine.area, 0.0)), np.median(apart)
    )


def _named(pairs: ContactTable, i: int) -> str:
    return f"pair {i + 1} (side '{pairs.side[i]}', station {pairs.station[i]}, row {pairs.row[i]})"


def _vector(v: np.ndarray) -> str:
    return ", ".join(f"{x:.4g}" for x in v)


def _neighbours(places: np.ndarray) -> np.ndarray:
    """(P,) index of the nearest that lies elsewhere; its own where all lie at one place."""
    first = np.unique(places, axis=0, return_index=True, return_inverse=True)
    distinct, of = first[1], first[2].ravel()
    if len(distinct) < 2:
        return np.arange(len(places))
    return distinct[cKDTree(places[distinct]).query(places[distinct], 2)[1][of, 1]]


def _spacing(places: np.ndarray) -> np.ndarray:
    """(P,) m to the nearest place that is another one; inf where there is none."""
    size = np.ptp(places, axis=0).max(initial=0.0)
    distinct = np.unique(
        np.round(places / (1e-9 * size)) if size > 0 else places[:1], axis=0, return_index=True
    )[1]
    if len(distinct) < 2:
        return np.full(len(places), np.inf)
    return cKDTree(places[distinct]).query(places, 2)[0][:, 1]


def _off_line(place: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(P,) m from the places to the straight lines between two points each."""
    way = other - one
    length = np.einsum("pd,pd->p", way, way)
    along = np.einsum("pd,pd->p", place - one, way) / np.where(length > 0, length, 1.0)
    return np.linalg.norm(place - one - np.clip(along, 0.0, 1.0)[:, None] * way, axis=1)
