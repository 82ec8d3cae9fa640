"""One side of the damper against its blade: size of the contact and stiffness of the whole side
under a normal force.

The static normal force sets the width of a rounded contact, a flat touches all over [Zucca, Berruti
& Cosi 2016, sec. 7.1]; the stiffness is that of a flat punch of this size, which is the tangent
stiffness of the growing contact."""

from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.static_contact.stiffness.elastic_constants import (
    MaterialPair,
    Stiffness,
    Values,
    positive,
)
from tipdamp.static_contact.stiffness.flat_punch import rectangle_stiffness
from tipdamp.static_contact.stiffness.plane_strain import plane_stiffness
from tipdamp.static_contact.stiffness.rounded_punch import punch_half_width

# and what each needs
SHAPES = {"cylinder": ("radius",), "flat": ("width",), "rounded": ("width", "radius")}


@dataclass(frozen=True)
class ContactSide:
    """Shape and materials of one side.

    shape : 'cylinder' (radius), 'flat' (width) or 'rounded' (width of the flat part, radius of its
    edges)
    length : m, along the axis of the damper
    pair : materials of the two bodies
    radius : m, relative radius of curvature, 1/R = 1/R1 + 1/R2 (the cylinder's own against a plane)
    width : m, full width of the flat part
    """

    shape: str
    length: float
    pair: MaterialPair
    radius: float | None = None
    width: float | None = None

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f"shape = {self.shape!r}: {nearest(self.shape, tuple(SHAPES))}")
        if not isinstance(self.pair, MaterialPair):
            raise InputError(f"pair = {self.pair!r}: allowed is MaterialPair(E1, nu1, E2, nu2)")
        positive("length", self.length, "m")
        needed = SHAPES[self.shape]
        for name, value in (("radius", self.radius), ("width", self.width)):
            if name in needed and value is None:
                raise InputError(
                    f"{name} is missing: shape = '{self.shape}' needs {' and '.join(needed)} (m, "
                    "> 0)"
                )
            if name not in needed and value is not None:
                raise InputError(
                    f"{name} = {value!r} has no meaning for shape = '{self.shape}': leave it out"
                )
            if value is not None:
                positive(name, value, "m")


def half_width(side: ContactSide, force: Values) -> np.ndarray:
    """Half-width of contact (m) under the normal force (N, scalar or array) spread evenly over the
    length.

    Raises InputError where the contact grows into an edge by more than its radius.
    """
    flat, radius = (side.width or 0.0) / 2, side.radius or 0.0
    size = punch_half_width(np.asarray(force) / side.length, flat, radius, side.pair.E_star)
    if radius and np.any(size - flat > radius):
        raise InputError(
            f"force = {force!r} N opens the contact {np.max(size - flat):.3g} m into an edge of "
            f"radius {radius:g} m: half-space theory needs much less than the radius"
        )
    return size


def side_stiffness(
    side: ContactSide, force: Values, depth: tuple[float, float] | None = None
) -> Stiffness:
    """Tangent stiffness (N/m) of the whole smooth side under `force` (N, scalar or array).

    Half-spaces in three dimensions; with depth = (d1, d2) m plane strain, against a point that deep
    in each body."""
    size = half_width(side, force)
    if depth is not None:
        return plane_stiffness(side.pair, size, *depth).scaled(side.length)
    return rectangle_stiffness(side.pair, side.length, 2 * size)


def side_compliance(
    side: ContactSide, forces: Values, depth: tuple[float, float] | None = None
) -> np.ndarray:
    """Tangent compliances normal, along, across (3, n), m/N, at `forces` (n,) N: what `approach`,
    `secant_stiffness` and partial_slip integrate, e.g. loop_energy(lambda p: side_compliance(side,
    p)[2], force, mu, amplitude)."""
    stiffness = side_stiffness(side, np.asarray(forces, dtype=float), depth)
    return np.array([1 / np.broadcast_to(k, np.shape(forces)) for k in stiffness])
