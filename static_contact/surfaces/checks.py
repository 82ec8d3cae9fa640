"""What is wrong with two surfaces that are said to be in contact: one line with set, count,
distance and remedy."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.ties import SAME, first_largest
from tipdamp.static_contact.surfaces.facets import Surface, facets
from tipdamp.static_contact.surfaces.lines import BesideLine, beside_line
from tipdamp.static_contact.surfaces.overlap import overlap, reach_of
from tipdamp.static_contact.surfaces.pairing import Side
from tipdamp.static_contact.surfaces.records import Overlap
from tipdamp.static_contact.surfaces.settings import DEFAULT

# between units in use
UNITS = (1e3, 1e-3, 25.4, 1 / 25.4, 0.0254, 1 / 0.0254, 1e2, 1e-2, 0.3048, 1 / 0.3048)


def check_overlap(
    side: Side,
    met: Overlap,
    blade: Surface,
    damper: Surface,
    closed: bool,
    shown: Callable[[float], str],
) -> None:
    """InputError where the surfaces do not overlap, do not oppose each other, penetrate, or two
    blade faces lie opposite to one damper face. closed - wherever they lie they count as
    touching."""
    counts = (
        f"side '{side.name}': {sum(map(len, damper.faces))} damper faces of '{side.damper}' and "
        f"{sum(map(len, blade.faces))} blade faces of '{side.blade}'"
    )
    factor = None if met.covered >= DEFAULT.seen else _unit_factor(blade, damper)
    if factor:
        its, theirs = (shown(np.ptp(one.mesh.position, axis=0).max()) for one in (damper, blade))
        raise InputError(
            f"{counts} do not meet: the damper is {its} in size, the blades {theirs}; "
            f"{factor:.4g} times its coordinates would lie at the blades: the two files are in "
            "different units of length; export both in that of [units]"
        )
    if not len(met.vertex):
        raise InputError(f"{counts} {_why_apart(blade, damper, shown)}")
    if len(met.doubled):
        nearest, farthest = (shown(abs(round(float(gap), 9))) for gap in met.layers[0])
        raise InputError(
            f"{counts}: the damper's faces lie opposite to two layers of blade faces at "
            f"{len(met.doubled)} places, at {_place(met.doubled[0], shown)} {nearest} and "
            f"{farthest} away; name the faces of one layer for blade"
        )
    if met.opposed.min() > DEFAULT.opposed:
        raise InputError(
            f"{counts} are {met.opposed.min():.0f} degrees off being parallel where they face "
            f"each other; {DEFAULT.opposed:.0f} allowed: are these the faces that touch, and the "
            "meshes in place?"
        )
    size = np.sqrt(met.area)
    deep = met.least < -DEFAULT.penetration * size
    if deep.any() and not closed:
        i = int(np.where(deep, met.least, 0).argmin())
        place = _place(damper.mesh.position[met.vertex[i]], shown)
        raise InputError(
            f"{counts} penetrate by more than {DEFAULT.penetration:g} of a face's size around "
            f"{int(deep.sum())} of {len(deep)} points, most by {shown(-met.least[i])} at "
            f"{place}; move the meshes apart, or let them count "
            'as touching: [contact] distance = "closed"'
        )


def line_doubt(
    side: Side, met: Overlap, damper: Surface, shown: Callable[[float], str]
) -> str | None:
    """A sentence where a round side has no contact point on the line in which it touches."""
    off = beside_line(met.damper @ damper.mesh.position, met.normal, met.turned)
    if off is None or off.angle <= DEFAULT.beside * (1 + SAME):
        return None
    return (
        f"side '{side.name}': the nearest contact points lie {shown(off.distance)} beside the "
        f"line in which the surfaces touch, {off.angle:.2g} degrees around the damper: it rests "
        "on these, and the directions of its forces are off by as much; mesh the damper with a "
        f"row of nodes along that line, or with faces of {shown(_narrow_enough(off))} across it"
    )


def _narrow_enough(off: BesideLine) -> float:
    """m: faces among which one corner lies as near to the line as is allowed."""
    return 2 * off.distance * DEFAULT.beside / off.angle


def _why_apart(blade: Surface, damper: Surface, shown: Callable) -> str:
    """The reason why no face lies opposite to another, and what to do."""
    mine, theirs = (
        max(facets(surface), key=lambda one: len(one.area)) for surface in (damper, blade)
    )
    reach = reach_of(damper.mesh)
    wide = overlap(damper, blade, DEFAULT.farthest)
    if wide.covered > DEFAULT.seen:
        i = int(np.abs(wide.gap).argmin())
        how = (
            "penetrate each other by"
            if wide.gap[i] < 0
            else "lie opposite to each other with a gap of"
        )
        return (
            f"{how} {shown(abs(wide.gap[i]))} or more; up to {shown(reach)} (a tenth of the "
            "damper) counts as contact: move the meshes into place, or name the faces that touch"
        )
    distance, nearest = cKDTree(theirs.centre).query(mine.centre)
    i = int(distance.argmin())
    if distance[i] > reach + mine.radius[i] + theirs.radius[nearest[i]]:
        return (
            f"do not touch: their centres are {shown(distance[i])} apart at the nearest, and gaps "
            f"up to {shown(reach)} (a tenth of the damper) count; are the groups swapped, or the "
            "meshes out of place?"
        )
    facing = -np.einsum("tx,tx->t", mine.normal, theirs.normal[nearest])
    if facing.max() < np.cos(np.radians(DEFAULT.facing)):
        angle = np.degrees(np.arccos(np.clip(facing.max(), -1, 1)))
        return (
            f"do not face each other: their normals are {angle:.0f} degrees off opposition at "
            f"least, {DEFAULT.facing:.0f} allowed; name the faces that touch (are the groups of "
            "two sides swapped?)"
        )
    return (
        f"do not overlap: seen along the normal they lie beside each other, {shown(distance[i])} "
        "from centre to centre at the nearest; name the faces that lie opposite to each other"
    )


def _unit_factor(blade: Surface, damper: Surface) -> float | None:
    """The factor between two units by which most of the damper's faces would lie at those of the
    blade; of those that bring all of them there the largest, as the blade is covered best."""
    mesh = damper.mesh
    size = float(np.ptp(mesh.position, axis=0).max() / np.ptp(blade.mesh.position, axis=0).max())
    scaled = {
        f: overlap(Surface(replace(mesh, position=f * mesh.position), damper.faces), blade)
        for f in sorted(UNITS, reverse=True)
        if DEFAULT.smallest <= f * size <= 1 + SAME
    }
    if not scaled:
        return None
    best = list(scaled)[first_largest([met.covered for met in scaled.values()])]
    return best if scaled[best].covered > DEFAULT.most else None


def _place(point: np.ndarray, shown: Callable) -> str:
    return "(" + ", ".join(shown(float(x)) for x in point) + ")"
