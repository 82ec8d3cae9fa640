"""What is wrong with two surfaces that are said to be in contact: one line with set, count, distance and remedy."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from hbm.errors import InputError
from static_contact.pairing import Side
from static_contact.surfaces.facets import Surface, facets
from static_contact.surfaces.overlap import reach_of
from static_contact.surfaces.settings import SurfaceSettings
from static_contact.surfaces.weights import Overlap

UNITS = (1e3, 1e-3, 25.4, 1 / 25.4, 1e2, 1e-2, 0.3048, 1 / 0.3048)     # between units of length in use


def check_overlap(side: Side, met: Overlap, blade: Surface, damper: Surface, closed: bool,
                  shown: Callable[[float], str], settings: SurfaceSettings) -> None:
    """InputError where the surfaces do not overlap, do not oppose each other, penetrate, or two blade faces lie
    opposite to one damper face. closed - wherever they lie they count as touching."""
    counts = (f"side '{side.name}': {sum(map(len, damper.faces))} damper faces of '{side.damper}' and "
              f"{sum(map(len, blade.faces))} blade faces of '{side.blade}'")
    factor = None if met.covered >= settings.seen else _unit_factor(
        blade.mesh.position, damper.mesh.position, settings)
    if factor:
        its, theirs = (shown(np.ptp(one.mesh.position, axis=0).max()) for one in (damper, blade))
        raise InputError(f"{counts} do not meet: the damper is {its} in size, the blades {theirs}; {factor:g} times "
                         "its coordinates would lie at the blades: the two files are in different units of length; "
                         "export both in that of [units]")
    if not len(met.vertex):
        raise InputError(f"{counts} {_why_apart(blade, damper, shown, settings)}")
    if len(met.doubled):
        raise InputError(f"{counts}: {len(met.doubled)} pieces of the damper's lie opposite to two blade faces at "
                         f"once, the first at {_place(met.doubled[0], shown)}; name one of the two surfaces")
    if met.opposed.min() > settings.opposed:
        raise InputError(f"{counts} are {met.opposed.min():.0f} degrees off being parallel where they face each other; "
                         f"{settings.opposed:.0f} allowed: are these the faces that touch, and the meshes in place?")
    size = np.sqrt(met.area)
    deep = met.least < -settings.penetration * size
    if deep.any() and not closed:
        i = int(np.where(deep, met.least, 0).argmin())
        place = _place(damper.mesh.position[met.vertex[i]], shown)
        raise InputError(f"{counts} penetrate by more than {settings.penetration:g} of a face's size around "
                         f"{int(deep.sum())} of {len(deep)} points, most by {shown(-met.least[i])} at "
                         f"{place}; move the meshes apart, or let them count "
                         "as touching: [contact] distance = \"closed\"")


def _why_apart(blade, damper, shown, settings) -> str:
    """The reason why no face lies opposite to another, and what to do."""
    mine, theirs = (max(facets(surface, settings), key=lambda one: len(one.area)) for surface in (damper, blade))
    reach = reach_of(damper.mesh, settings)
    distance, nearest = cKDTree(theirs.centre).query(mine.centre)
    i = int(distance.argmin())
    if distance[i] > reach + mine.radius[i] + theirs.radius[nearest[i]]:
        return (f"do not touch: their centres are {shown(distance[i])} apart at the nearest, and gaps up to "
                f"{shown(reach)} (a tenth of the damper) count; are the groups swapped, or the meshes out of place?")
    facing = -np.einsum("tx,tx->t", mine.normal, theirs.normal[nearest])
    if facing.max() < np.cos(np.radians(settings.facing)):
        angle = np.degrees(np.arccos(np.clip(facing.max(), -1, 1)))
        return (f"do not face each other: their normals are {angle:.0f} degrees off opposition at least, "
                f"{settings.facing:.0f} allowed; name the faces that touch")
    return (f"do not overlap: seen along the normal they lie beside each other, {shown(distance[i])} from centre to "
            "centre at the nearest; name the faces that lie opposite to each other")


def _unit_factor(blade: np.ndarray, damper: np.ndarray, settings: SurfaceSettings) -> float | None:
    """The factor between two units by which the damper would lie at the blades, where it does not as it is."""
    low, high = blade.min(axis=0), blade.max(axis=0)
    margin = settings.apart * (high - low).max()

    def apart(place):
        return np.maximum(np.maximum(low - place.max(axis=0), place.min(axis=0) - high), 0.0).max()

    size = np.ptp(damper, axis=0).max() / (high - low).max()
    if settings.smallest <= size <= 1 and apart(damper) <= margin:
        return None
    fits = [f for f in UNITS if settings.smallest <= f * size <= 1 and apart(f * damper) <= margin]
    return fits[0] if fits else None


def _place(point, shown) -> str:
    return "(" + ", ".join(shown(float(x)) for x in point) + ")"
