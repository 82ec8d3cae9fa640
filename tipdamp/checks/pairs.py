"""Checks of contact pairs before anything is computed: normals, distances, nodes without a
partner."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.contact_doubts import high_friction, node_places
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import SideCheck
from tipdamp.static_contact.contact.equilibrium import side_forces, side_normals


@dataclass(frozen=True)
class PairLimits:
    """What is warned of."""

    longer: float = 1.5  # times as wide as long: no damper between blades is
    one_row: float = 0.9  # of the closed area in one row of contact points
    # degrees between a pair's normal and the surfaces; as much as matching itself allows
    odd_angle: float = 20.0
    higher: float = 0.1  # of the height of a side: the row that counts as its lower edge


LIMITS = PairLimits()


def one_row_warnings(pairs: ContactTable, meets: bool = False) -> Iterator[str]:
    """A sentence on the sides of contact points that are closed along one row of them alone; pairs
    with preload. meets - whether the area that is kept meets a measured frequency, which is what
    the sentence asks for."""
    if meets:
        return
    found = []
    for side in pairs.sides:
        mine = pairs.select((pairs.side == side) & pairs.on_surface)
        closed = np.bincount(mine.row, np.where(mine.preload > 0, mine.area, 0.0))
        if len(np.unique(mine.row)) > 1 and closed.max() > LIMITS.one_row * closed.sum() > 0:
            found.append(f"'{side}'")
    if found:
        yield (
            f"side {' and '.join(found)}: the closed part is one row of contact points, as wide as "
            "the faces there are; with them its area and its stiffness per area change, and the "
            "stuck frequency may by percents: refine the damper across the side, or let by = "
            "'area' in [tune] meet a measured frequency, target_hz"
        )


@dataclass(frozen=True)
class Slide:
    """Farthest slide on a side, half peak to peak, beside the length that it is to be small to: m
    both; the half-width of contact, or the distance of neighbouring pairs where none is known."""

    side: str
    reach: float
    length: float
    of: str

    @property
    def share(self) -> float:
        """Of the length."""
        return self.reach / self.length

    @property
    def said(self) -> str:
        """As part of a sentence."""
        return (
            f"the contact points of side '{self.side}' slide by up to {1e6 * self.reach:.3g} um "
            f"(half peak to peak), more than {self.of}, {1e6 * self.length:.3g} um"
        )


def slides(
    pairs: ContactTable,
    motion: np.ndarray,
    components: Sequence[str],
    half_widths: Mapping[str, float | None],
) -> Iterator[Slide]:
    """One of each side whose length is known. motion (n, P, nd) m, relative, its components among
    't1', 't2', 'n'; half_widths {side: m}, None or no entry where the contact has none."""
    along = [k for k, name in enumerate(components) if name in ("t1", "t2")]
    reach = 0.5 * np.ptp(motion[:, :, along], axis=0).max(axis=1, initial=0.0)
    for side in pairs.sides:
        mine = np.flatnonzero(pairs.side == side)
        half_width = half_widths.get(side)
        length = half_width or spacing(pairs.position[mine])
        of = "the half-width of the contact" if half_width else "the distance of its pairs"
        if 0 < length < np.inf:
            yield Slide(side, float(reach[mine].max(initial=0.0)), length, of)


def spacing(place: np.ndarray) -> float:
    """m, median distance of the nearest neighbours; infinite where there is none, or a place is
    unknown."""
    if len(place) < 2 or not np.isfinite(place).all():
        return np.inf
    return float(np.median(cKDTree(place).query(place, k=2)[0][:, 1]))


def places_in(model: ReducedModel | None, pairs: ContactTable) -> dict:
    """{"blades", "damper": (P, 3) m} of the two nodes of each pair; the table's place for what the
    model lacks."""
    if model is None:
        return {BLADES: pairs.position, DAMPER: pairs.position}
    found = dict(zip((BLADES, DAMPER), node_places(model, pairs), strict=True))
    return {
        name: np.where(np.isfinite(place), place, pairs.position) for name, place in found.items()
    }


def forces_per_pull(
    pairs: ContactTable, pull_direction: np.ndarray | tuple[float, ...], held: ArrayLike = ()
) -> tuple[dict, str | None]:
    """{side: N} for 1 N of pull without friction, held along directions (m, 3), or what stands
    against it."""
    try:
        return side_forces(side_normals(pairs), pull_direction, held=held), None
    except InputError as error:
        return {}, str(error)


def pull_warnings(
    pairs: ContactTable, pull_direction: np.ndarray | tuple[float, ...], held: ArrayLike = ()
) -> list[str]:
    """One sentence when the pull does not press the damper against its sides."""
    _, trouble = forces_per_pull(pairs, pull_direction, held)
    return (
        [f"pull_direction = {np.round(pull_direction, 4).tolist()}: {trouble}"] if trouble else []
    )


def axis_warnings(pairs: ContactTable, axis: np.ndarray | tuple[float, ...]) -> list[str]:
    """What speaks against the axis: normals that lie along it, or a contact that is longer across
    it."""
    stated = f"axis = {np.round(axis, 4).tolist()}"
    along = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    angle = 90 - np.degrees(np.arccos(np.clip(np.abs(pairs.normal @ along), 0, 1)))
    if (angle > LIMITS.odd_angle).any():
        i = int(angle.argmax())
        return [
            f"{stated}: {(angle > LIMITS.odd_angle).sum()} of {len(pairs)} contact normals are "
            f"more than {LIMITS.odd_angle:g} degrees off being perpendicular to it, side "
            f"'{pairs.side[i]}' {angle[i]:.0f}: the axis runs along all contact sides"
        ]
    length = np.ptp(pairs.position @ along)
    wide = {
        s: np.ptp(pairs.position[pairs.side == s] @ pairs.frame[pairs.side == s, 1].mean(axis=0))
        for s in pairs.sides
    }
    side = max(wide, key=lambda s: wide[s])
    if wide[side] <= LIMITS.longer * length:
        return []
    return [
        f"{stated}: side '{side}' is {1e3 * wide[side]:.3g} mm wide across it, all contact "
        f"{1e3 * length:.3g} mm long along it: is it the long direction of the damper's contact?"
    ]


def row_warnings(
    pairs: ContactTable, pull_direction: np.ndarray | tuple[float, ...], sides: list[str]
) -> Iterator[str]:
    """A sentence for each of the sides that keep row 0, the lower edge, where it is not the
    lowest."""
    height = pairs.position @ np.asarray(pull_direction, dtype=float)
    for side in sides:
        mine = pairs.side == side
        rows = np.unique(pairs.row[mine])
        mean = [height[mine & (pairs.row == row)].mean() for row in rows]
        lowest = int(np.argmin(mean))
        if mean[0] - mean[lowest] > LIMITS.higher * np.ptp(height[mine]):
            yield (
                f"[contact.{side}] rows = 'edge' keeps row {rows[0]}, but row {rows[lowest]} lies "
                "farthest against the pull: rows are counted from the lower edge"
            )


def side_checks(
    pairs: ContactTable,
    places: dict[str, np.ndarray],
    pull_direction: np.ndarray | tuple[float, ...],
    angles: np.ndarray | None = None,
    held: ArrayLike = (),
) -> dict[str, SideCheck]:
    """{side: geometry of its pairs}; places {body: (P, 3) m} of their nodes; angles (P,) of
    `surface_angles`."""
    forces, trouble = forces_per_pull(pairs, pull_direction, held)
    apart = np.einsum("pij,pj->pi", pairs.frame, places[BLADES] - places[DAMPER])
    return {
        side: SideCheck(
            **_shape(pairs.select(mine)),
            off_surface_deg=None if angles is None else angles[mine].max(),
            apart_along_n_m=(apart[mine, 2].min(), apart[mine, 2].max()),
            apart_across_m=np.hypot(apart[mine, 0], apart[mine, 1]).max(),
            force_per_pull=forces.get(side),
            trouble=trouble,
            kn_N_per_m=_total(pairs.kn[mine] * pairs.weight[mine]),
        )
        for side in pairs.sides
        for mine in [pairs.side == side]
    }


def _shape(side: ContactTable) -> dict[str, Any]:
    """Fields of SideCheck that the pairs of one side give: numbers, extent and normals."""
    mean = side.normal.mean(axis=0)
    size = np.linalg.norm(mean)
    turn = np.degrees(np.arccos(np.clip(side.normal @ mean / size, -1, 1)))
    length, across = (np.ptp(side.position @ side.frame[:, k].mean(axis=0)) for k in (0, 1))
    return {
        "pairs": len(side),
        "stations": len(np.unique(side.station)),
        "rows": len(np.unique(side.row)),
        "length_m": length,
        "across_m": across,
        "mean_normal": mean / size,
        "normals_within_deg": turn.max(),
    }


def _total(kn: np.ndarray) -> float | None:
    """None where it is not known yet, or hard."""
    return float(kn.sum()) if np.isfinite(kn).all() and kn.any() else None


def warnings(pairs: ContactTable, angles: np.ndarray | None = None) -> list[str]:
    """One sentence on friction above that of any dry metals, one on normals that are not normal to
    the surfaces."""
    found = [doubt] if (doubt := high_friction(pairs)) else []
    if angles is None or not (angles > LIMITS.odd_angle).any():
        return found
    i = int(angles.argmax())
    return [
        *found,
        f"{(angles > LIMITS.odd_angle).sum()} of {len(pairs)} contact normals are not normal to "
        f"the surfaces; the worst, side '{pairs.side[i]}' station {pairs.station[i]} row "
        f"{pairs.row[i]} (damper node {pairs.damper_node[i]}), is {angles[i]:.0f} degrees off: n "
        "must point out of the damper into the blade",
    ]


def jamming(pairs: ContactTable, pull: np.ndarray) -> list[str]:
    """One sentence for each side on which the damper can jam: its friction angle atan(mu) exceeds
    the angle between the face and the pull (3,), so that friction alone can hold it against the
    pull."""
    found = []
    for side in pairs.sides:
        mine = pairs.side == side
        normal, mu = pairs.normal[mine].mean(axis=0), float(pairs.mu[mine].max())
        face = np.degrees(
            np.arcsin(min(abs(normal @ pull) / np.linalg.norm(normal) / np.linalg.norm(pull), 1.0))
        )
        friction = np.degrees(np.arctan(mu))
        if friction > face:
            found.append(
                f"side '{side}' can jam: its friction angle atan(mu) = {friction:.1f} degrees "
                f"exceeds the angle between its face and the pull, {face:.1f} degrees; the "
                "preload may then be less than the frictionless one, and not come back after a "
                "large vibration"
            )
    return found


def without_partner(blade: np.ndarray, damper: np.ndarray, tolerance: float) -> tuple[list, ...]:
    """(blade, damper): [(index, index of the nearest of the others, distance m)] of the nodes (n,
    3) m that have no other within the tolerance."""
    found = []
    for mine, others in ((blade, damper), (damper, blade)):
        distance, nearest = cKDTree(others).query(mine)
        found.append(
            [
                (int(i), int(nearest[i]), float(distance[i]))
                for i in np.flatnonzero(distance > tolerance)
            ]
        )
    return tuple(found)


def pair_names(pairs: ContactTable, chosen: np.ndarray | list[int] | slice) -> list[str]:
    """Names of some pairs (indices or mask): 'left 4', and on sides with several rows 'left 4/1',
    station and row."""
    several = {side for side in pairs.sides if len(np.unique(pairs.row[pairs.side == side])) > 1}
    return [
        f"{side} {station}/{row}" if side in several else f"{side} {station}"
        for side, station, row in zip(
            pairs.side[chosen].tolist(),
            pairs.station[chosen].tolist(),
            pairs.row[chosen].tolist(),
            strict=True,
        )
    ]
