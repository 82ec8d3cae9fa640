"""kn and kt of the nodes of one side from half-space theory: force -> contact size -> stiffness of
the side -> nodes.

    nodal_stiffness(side, force, n_nodes)                                                smooth
    half-spaces nodal_stiffness(side, force, n_nodes, StiffnessModel("plane_depth", depth=(d1, d2)))
    plane strain, explicit depths nodal_stiffness(side, force, n_nodes,
    StiffnessModel("rough_series", roughness=...))  smooth and rough in series given_stiffness((kn,
    kt), n_nodes, force, length)                                    known values, no theory

The total is shared evenly between the nodes of the full patch; a node keeps its part when others
are detached [Zucca, Berruti & Cosi 2016, sec. 7.1]. docs/theory/contact_stiffness.md has the
formulas and what the values are worth."""

from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.static_contact.stiffness.elastic_constants import (
    MaterialPair,
    Stiffness,
    positive,
    require,
)
from tipdamp.static_contact.stiffness.load_displacement import secant_stiffness
from tipdamp.static_contact.stiffness.rough_surfaces import Roughness, rough_stiffness
from tipdamp.static_contact.stiffness.side_stiffness import (
    ContactSide,
    half_width,
    side_compliance,
    side_stiffness,
)

MODELS = ("halfspace_3d", "plane_depth", "rough_series")
KINDS = ("tangent", "secant")


@dataclass(frozen=True)
class StiffnessModel:
    """How the stiffness of a side is computed.

    name : 'halfspace_3d' (finite line or rectangle), 'plane_depth' (needs depth), 'rough_series'
        (halfspace_3d in series with `roughness`)
    kind : 'tangent' (for small motions about the static state) or 'secant' (from zero load); a flat
    has both equal
    depth : (d1, d2) m in the two bodies
    scale : one factor on all of it, e.g. from `calibrate_scale`
    """

    name: str = "halfspace_3d"
    kind: str = "tangent"
    depth: tuple[float, float] | None = None
    roughness: Roughness | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        for name, value, allowed in (("model", self.name, MODELS), ("kind", self.kind, KINDS)):
            if value not in allowed:
                raise InputError(f"{name} = {value!r}: {nearest(value, allowed)}")
        positive("scale", self.scale)
        of_one_model: tuple[tuple[str, Any, str], ...] = (
            ("depth", self.depth, "plane_depth"),
            ("roughness", self.roughness, "rough_series"),
        )
        for name, given, its in of_one_model:
            if given is not None and self.name != its:
                raise InputError(
                    f"{name} = {given!r} has no meaning for model = '{self.name}': leave it out, "
                    f"or set model = '{its}'"
                )
        if self.name == "plane_depth" and np.shape(np.array(self.depth)) != (2,):
            raise InputError(
                f"depth = {self.depth!r}: model = 'plane_depth' needs depth = (d1, d2), m > 0, "
                "one for each body; a line on a half-plane has no stiffness without it"
            )
        if self.name == "rough_series" and not isinstance(self.roughness, Roughness):
            raise InputError(
                f"roughness = {self.roughness!r}: model = 'rough_series' needs Roughness(h_rms, "
                "gamma)"
            )
        if self.name == "rough_series" and self.kind == "secant":
            raise InputError(
                "kind = 'secant' with model = 'rough_series': rough surfaces have no defined "
                "onset of contact, so a secant stiffness does not exist"
            )


HALFSPACE = StiffnessModel()


@dataclass(frozen=True)
class NodalStiffness:
    """Stiffness of one node of the full patch, with all that it was made from.

    kn, kt : N/m; kt is the mean of kt_along and kt_across (laws with one tangential stiffness)
    kt_along, kt_across : N/m, along the axis of the damper (t1) and across it (t2)
    n_nodes : nodes of the full patch; the side's total is n_nodes times the nodal value
    model : one of MODELS, or 'given'; kind : 'tangent' or 'secant' at `load`
    load : N, normal force on the side; size : m, half-width of contact under it, None where given;
    length : m
    depth : (d1, d2) m for 'plane_depth', else None; roughness : for 'rough_series', else None
    scale : factor already contained in the stiffness, 1 where given; pair : materials, may be None
    where given"""

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
    depth: tuple[float, float] | None = None
    roughness: Roughness | None = None
    scale: float = 1.0
    pair: MaterialPair | None = None

    @property
    def total(self) -> Stiffness:
        """Stiffness of the whole side, N/m."""
        return Stiffness(self.kn, self.kt_along, self.kt_across).scaled(self.n_nodes)


def nodal_stiffness(
    side: ContactSide, force: float, n_nodes: int, model: StiffnessModel = HALFSPACE
) -> NodalStiffness:
    """kn and kt (N/m) of one node of a side pressed by `force` (N), which `n_nodes` nodes carry in
    equal parts."""
    _check_count(n_nodes)
    positive("force", force, "N")
    if model.kind == "tangent":
        total = side_stiffness(side, force, model.depth)
    else:
        total = Stiffness(
            *secant_stiffness(lambda loads: side_compliance(side, loads, model.depth), force)
        )
    if model.roughness is not None:
        total = total.in_series_with(rough_stiffness(side.pair, force, model.roughness))
    kn, along, across = (float(k) * model.scale / n_nodes for k in total)
    depth = None if model.depth is None else (float(model.depth[0]), float(model.depth[1]))
    return NodalStiffness(
        kn=kn,
        kt=(along + across) / 2,
        kt_along=along,
        kt_across=across,
        n_nodes=int(n_nodes),
        model=model.name,
        kind=model.kind,
        load=float(force),
        size=float(half_width(side, force)),
        length=float(side.length),
        depth=depth,
        roughness=model.roughness,
        scale=float(model.scale),
        pair=side.pair,
    )


def given_stiffness(
    given: ArrayLike, n_nodes: int, force: float, length: float, pair: MaterialPair | None = None
) -> NodalStiffness:
    """The record of known values, (kn, kt) or (kn, kt_along, kt_across) per node, N/m, for which no
    theory is needed.

    force : N on the side (0 where it is not known); length : m
    """
    _check_count(n_nodes)
    require("force", force, 0, unit="N")
    values = tuple(np.atleast_1d(given)) if given is not None else ()
    if len(values) not in (2, 3):
        raise InputError(
            f"given = {given!r}: allowed are (kn, kt) or (kn, kt_along, kt_across), N/m per node"
        )
    for name, value in zip(("given kn", "given kt", "given kt"), values, strict=False):
        positive(name, value, "N/m")
    kn, along, across = float(values[0]), float(values[1]), float(values[-1])
    return NodalStiffness(
        kn=kn,
        kt=(along + across) / 2,
        kt_along=along,
        kt_across=across,
        n_nodes=int(n_nodes),
        model="given",
        kind="tangent",
        load=float(force),
        size=None,
        length=float(length),
        pair=pair,
    )


def _check_count(n_nodes: int) -> None:
    if isinstance(n_nodes, bool) or not isinstance(n_nodes, Integral) or n_nodes < 1:
        raise InputError(f"n_nodes = {n_nodes!r}: allowed are whole numbers from 1")
