"""Contact stiffness of one side of the damper from half-space theory: force -> contact size -> nodal kn, kt.

    nodal_stiffness(side, force, n_nodes)                                      smooth bodies in three dimensions
    nodal_stiffness(side, force, n_nodes, model="plane_depth", depth=(d1, d2))  plane strain, explicit depths
    nodal_stiffness(side, force, n_nodes, model="rough_series", roughness=...)  smooth and rough in series
    nodal_stiffness(side, force, n_nodes, given=(kn, kt))                       known values win over every model

As in Zucca, Berruti & Cosi (2016), section 7.1: the static normal force sets the size of a round contact, a flat is
in contact all over, and the total is shared evenly between the nodes of the full patch; a node keeps its share when
others are detached. docs/theory/contact_stiffness.md has the formulas and what these values are worth.
"""

from dataclasses import dataclass
from numbers import Integral

import numpy as np

from hbm.errors import InputError, nearest
from static_contact.stiffness.approach import secant
from static_contact.stiffness.moduli import MaterialPair, Stiffness, require
from static_contact.stiffness.plane import plane_stiffness
from static_contact.stiffness.punch import punch_half_width
from static_contact.stiffness.rectangle import rectangle_stiffness
from static_contact.stiffness.rough import Roughness, rough_stiffness

SHAPES = ("cylinder", "flat", "rounded")
MODELS = ("halfspace_3d", "plane_depth", "rough_series", "given")
KINDS = ("tangent", "secant")


@dataclass(frozen=True)
class ContactSide:
    """One side of the damper against its blade.

    shape : 'cylinder' (radius), 'flat' (width) or 'rounded' (width of the flat part, radius of its edges)
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

    def __post_init__(self):
        if self.shape not in SHAPES:
            raise InputError(f"shape = {self.shape!r}: {nearest(self.shape, SHAPES)}")
        if not isinstance(self.pair, MaterialPair):
            raise InputError(f"pair = {self.pair!r}: allowed is MaterialPair(E1, nu1, E2, nu2)")
        require("length", self.length, 0, open_low=True, unit="m")
        needed = {"cylinder": ("radius",), "flat": ("width",), "rounded": ("width", "radius")}[self.shape]
        for name in ("radius", "width"):
            value = getattr(self, name)
            if name in needed and value is None:
                raise InputError(f"{name} is missing: shape = '{self.shape}' needs {' and '.join(needed)} (m, > 0)")
            if name not in needed and value is not None:
                raise InputError(f"{name} = {value!r} has no meaning for shape = '{self.shape}': leave it out")
            if value is not None:
                require(name, value, 0, open_low=True, unit="m")


@dataclass(frozen=True)
class NodalStiffness:
    """Stiffness of one node of the full patch, with all that it was made from.

    kn, kt : N/m; kt is the mean of kt_along and kt_across (laws with one tangential stiffness)
    kt_along, kt_across : N/m, along the axis of the damper (t1) and across it (t2)
    n_nodes : nodes of the full patch; the side's total is n_nodes times the nodal value
    model : one of MODELS; kind : 'tangent' or 'secant' at `load`
    load : N, normal force on the side; size : m, half-width of contact under it, None where given; length : m
    depth : (d1, d2) m for 'plane_depth', else None; roughness : for 'rough_series', else None
    scale : factor already contained in the stiffness, 1 where given; pair : materials, may be None where given
    """

    kn: float
    kt: float
    kt_along: float
    kt_across: float
    n_nodes: int
    model: str
    kind: str
    load: float
    size: float | None
    length: float
    depth: tuple[float, float] | None
    roughness: Roughness | None
    scale: float
    pair: MaterialPair | None

    @property
    def total(self) -> Stiffness:
        """Stiffness of the whole side, N/m."""
        return Stiffness(self.kn, self.kt_along, self.kt_across).scaled(self.n_nodes)


def nodal_stiffness(side: ContactSide, force, n_nodes, *, model="halfspace_3d", kind="tangent", depth=None,
                    roughness=None, given=None, scale=1.0) -> NodalStiffness:
    """kn and kt (N/m) of one node of a side pressed by `force` (N) and carried by `n_nodes` nodes in equal shares.

    model : 'halfspace_3d' (finite line or rectangle), 'plane_depth' (needs depth = (d1, d2) m in the two bodies),
        'rough_series' (halfspace_3d in series with `roughness`), 'given'
    kind : 'tangent' (for small motions about the static state) or 'secant' (from zero load); a flat has both equal
    given : (kn, kt) or (kn, kt_along, kt_across) per node, N/m; wins over every model, none of which is computed
    scale : one factor on everything that a model gives, e.g. from `calibrate_scale`; given values are final, and
        another scale than 1 beside them is refused
    """
    _check_choice("model", model, MODELS)
    _check_choice("kind", kind, KINDS)
    require("scale", scale, 0, open_low=True)
    if given is not None or model == "given":
        if scale != 1:
            raise InputError(f"scale = {scale!r} with given values: they are taken as they are; give scaled ones")
        return given_stiffness(given, n_nodes, force, side.length, side.pair)
    _check_count(n_nodes)
    require("force", force, 0, open_low=True, unit="N")
    for name, value, its in (("depth", depth, "plane_depth"), ("roughness", roughness, "rough_series")):
        if value is not None and model != its:
            raise InputError(f"{name} = {value!r} has no meaning for model = '{model}': leave it out, or set "
                             f"model = '{its}'")
    total = _total(side, force, model, kind, depth, roughness)
    per_node = Stiffness(*(float(k) * scale / n_nodes for k in total))
    return NodalStiffness(
        kn=per_node.normal, kt=(per_node.along + per_node.across) / 2, kt_along=per_node.along,
        kt_across=per_node.across, n_nodes=int(n_nodes), model=model, kind=kind, load=float(force),
        size=float(half_width(side, force)), length=float(side.length), pair=side.pair, scale=float(scale),
        depth=tuple(map(float, depth)) if model == "plane_depth" else None,
        roughness=roughness if model == "rough_series" else None)


def given_stiffness(given, n_nodes, force, length, pair=None) -> NodalStiffness:
    """The record of known values, (kn, kt) or (kn, kt_along, kt_across) per node, N/m, for which no theory is needed.

    force : N on the side (0 where it is not known); length : m
    """
    _check_count(n_nodes)
    require("force", force, 0, unit="N")
    kn, along, across = _given(given)
    return NodalStiffness(kn=kn, kt=(along + across) / 2, kt_along=along, kt_across=across, n_nodes=int(n_nodes),
                          model="given", kind="tangent", load=float(force), size=None, length=float(length), depth=None,
                          roughness=None, scale=1.0, pair=pair)


def half_width(side: ContactSide, force):
    """Half-width of contact (m) under the normal force (N, scalar or array) spread evenly over the length."""
    flat, radius = (side.width or 0.0) / 2, side.radius or 0.0
    size = punch_half_width(np.asarray(force) / side.length, flat, radius, side.pair.E_star)
    if radius and np.any(size - flat > radius):
        raise InputError(f"force = {force!r} N opens the contact {np.max(size - flat):.3g} m into an edge of radius "
                         f"{radius:g} m: half-space theory needs much less than the radius")
    return size


def side_stiffness(side: ContactSide, force, model="halfspace_3d", depth=None) -> Stiffness:
    """Tangent stiffness (N/m) of the whole smooth side under `force` (N, scalar or array)."""
    size = half_width(side, force)
    if model == "plane_depth":
        return plane_stiffness(side.pair, size, *_check_depth(depth)).scaled(side.length)
    return rectangle_stiffness(side.pair, side.length, 2 * size)


def side_compliance(side: ContactSide, forces, model="halfspace_3d", depth=None):
    """Tangent compliances normal, along, across (3, n), m/N, at `forces` (n,) N: what `approach`, `secant` and
    partial_slip integrate, e.g. loop_energy(lambda p: side_compliance(side, p)[2], force, mu, amplitude)."""
    stiffness = side_stiffness(side, np.asarray(forces, dtype=float), model, depth)
    return np.array([1 / np.broadcast_to(k, np.shape(forces)) for k in stiffness])


def _total(side, force, model, kind, depth, roughness):
    """Stiffness of the whole side, tangent or secant, with the roughness where there is one."""
    smooth = "plane_depth" if model == "plane_depth" else "halfspace_3d"
    if kind == "tangent":
        total = side_stiffness(side, force, smooth, depth)
    else:
        total = Stiffness(*secant(lambda loads: side_compliance(side, loads, smooth, depth), force))
    if model != "rough_series":
        return total
    if kind == "secant":
        raise InputError("kind = 'secant' with model = 'rough_series': rough surfaces approach without a first touch, "
                         "so only 'tangent' is defined")
    if not isinstance(roughness, Roughness):
        raise InputError(f"roughness = {roughness!r}: model = 'rough_series' needs Roughness(h_rms, gamma)")
    return total.in_series_with(rough_stiffness(side.pair, force, roughness))


def _given(given):
    values = tuple(np.atleast_1d(given)) if given is not None else ()
    if len(values) not in (2, 3):
        raise InputError(f"given = {given!r}: allowed are (kn, kt) or (kn, kt_along, kt_across), N/m per node")
    for name, value in zip(("given kn", "given kt", "given kt"), values, strict=False):
        require(name, value, 0, open_low=True, unit="N/m")
    return Stiffness(float(values[0]), float(values[1]), float(values[-1]))


def _check_depth(depth):
    if depth is None or np.shape(depth) != (2,):
        raise InputError(f"depth = {depth!r}: model = 'plane_depth' needs depth = (d1, d2), m > 0, one for each body; "
                         "a line on a half-plane has no stiffness without it")
    return depth


def _check_count(n_nodes):
    if isinstance(n_nodes, bool) or not isinstance(n_nodes, Integral) or n_nodes < 1:
        raise InputError(f"n_nodes = {n_nodes!r}: allowed are whole numbers from 1")


def _check_choice(name, value, allowed):
    if value not in allowed:
        raise InputError(f"{name} = {value!r}: {nearest(value, allowed)}")
