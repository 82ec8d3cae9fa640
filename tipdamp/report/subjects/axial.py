"""What the preload figures share: forces along the axis of the damper, side by side."""

import numpy as np

from tipdamp.bodies.stiffness import radii
from tipdamp.fields.line_contact import LineContact, narrow_lines
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.results import Results
from tipdamp.report.text import MM

AXIAL = "axial coordinate (mm)"
PRESSURE = "contact pressure (N/mm²)"
PER_LENGTH = "force per length (N/mm)"
ACROSS = "across the side (mm)"
LINE = 0.05  # of the way between stations: how far points of one line across the axis are apart


def lines_of(results: Results) -> list[LineContact]:
    """Of the round sides whose radius and elastic constants are known, where the strip in contact
    is narrower than a row of pairs."""
    if results.whole is None or results.preload is None:
        return []
    return narrow_lines(
        results.whole,
        np.asarray(results.axis),
        radii(results.study),
        {name: one.E_star_Pa for name, one in results.preload.stiffness.items()},
    )


def by_station(pairs: ContactTable, values: np.ndarray) -> list[np.ndarray]:
    """The values (P,) of the pairs of each station, in the order of their numbers."""
    return [values[pairs.station == s] for s in np.unique(pairs.station)]


def sums(pairs: ContactTable, values: np.ndarray) -> np.ndarray:
    """(s,) of the values (P,) over each station."""
    return np.array([mine.sum() for mine in by_station(pairs, values)])


def middles(results: Results, pairs: ContactTable) -> np.ndarray:
    """(s,) mm along the axis of the stations."""
    return np.array([mine.mean() for mine in by_station(pairs, results.along(pairs))])


def station_sums(results: Results, pairs: ContactTable) -> tuple[np.ndarray, np.ndarray]:
    """(axial coordinate in mm, force of the closed rows together in N) of the stations, in the
    order of the axis."""
    x, total = middles(results, pairs), sums(pairs, np.maximum(pairs.preload, 0))
    order = np.argsort(x)
    return x[order], total[order]


def in_lines(results: Results, pairs: ContactTable) -> bool:
    """Whether the pairs of each station of a side lie on a line across the axis. On unlike meshes
    a station is an interval of the axis, and a sum over its points follows the mesh."""
    each = by_station(pairs, results.along(pairs))
    if len(each) < 2:
        return True
    apart = float(np.diff(np.sort(middles(results, pairs))).mean())
    return max(map(np.ptp, each)) <= LINE * apart


def by_point(results: Results, pairs: ContactTable) -> bool:
    """Whether each pair counts alone, with its work over its area, as sums over the stations of one
    of the sides follow the mesh: of all sides alike, which stand side by side."""
    sides = (of_side(pairs, side) for side in pairs.sides)
    return (
        len(pairs) > 0
        and bool((pairs.area > 0).all())
        and not all(in_lines(results, mine) for mine in sides)
    )


def across(results: Results, pairs: ContactTable) -> np.ndarray:
    """(P,) mm of the pairs of a side across it, seen along the normal; up is to where the pull
    is."""
    t2 = pairs.frame[:, 1].mean(axis=0)
    t2 *= 1 if t2 @ np.array(results.study.driver.pull_direction) >= 0 else -1
    middle = pairs.position.mean(axis=0)
    return np.round(MM * (pairs.position - middle) @ (t2 / np.linalg.norm(t2)), 6)  # a nanometre


def with_room(heights: np.ndarray) -> tuple[float, float]:
    """Ends of an axis of heights (n,), with some room beside them."""
    room = 0.15 * (float(np.ptp(heights)) or 1.0)
    return float(heights.min()) - room, float(heights.max()) + room


def parted(stations: np.ndarray, *values: np.ndarray) -> list[np.ndarray]:
    """Each of the values (s,) of stations, in the order of the axis as the first of them says, with
    nan where detached stations lie between: a line through them is parted there."""
    order = np.argsort(values[0])
    apart = 1 + np.flatnonzero(np.abs(np.diff(stations[order])) > 1)
    return [np.insert(one[order], apart, np.nan) for one in values]


def load_of(pairs: ContactTable) -> tuple[np.ndarray, str]:
    """(P,) preload in N and its name; of contact points, which stand for unlike areas, the pressure
    in N/mm2."""
    if not pairs.on_surface.all():
        return pairs.preload, nodal(pairs)
    return pairs.preload / pairs.area / 1e6, PRESSURE


def nodal(pairs: ContactTable) -> str:
    """Label of an axis of forces."""
    return f"normal preload of each {'contact point' if pairs.on_surface.all() else 'node'} (N)"


def of_side(pairs: ContactTable, side: str) -> ContactTable:
    """The rows of one side."""
    return pairs.select(pairs.side == side)


def named_side(pairs: ContactTable, side: str) -> str:
    """With a word where its counterpart is fixed: a stop is no side of the damper between the
    blades."""
    return f"side '{side}'" + " to ground" * bool(of_side(pairs, side).to_ground.all())


def side_title(results: Results, side: str) -> str:
    """Name and shape of a side."""
    pairs = results.whole if results.whole is not None else results.kept
    name = f"side '{side}'" if pairs is None else named_side(pairs, side)
    shape = results.study.sides[side].shape if side in results.study.sides else ""
    return name + (f", {shape}" if shape else "")
