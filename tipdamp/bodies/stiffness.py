"""Stiffness, friction and initial gaps of matched pairs: the study's own values, or from half-space
theory."""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.balance import Balance
from tipdamp.bodies.loads import damper_hold, pull_vector
from tipdamp.bodies.pair import side_nodes
from tipdamp.fields.pressure import patches
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.modal.mesh import Mesh
from tipdamp.results.static_results import SideStiffness, StiffnessWay
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair
from tipdamp.static_contact.stiffness.nodal_stiffness import (
    NodalStiffness,
    StiffnessModel,
    given_stiffness,
    nodal_stiffness,
)
from tipdamp.static_contact.stiffness.rough_surfaces import Roughness
from tipdamp.static_contact.stiffness.side_stiffness import ContactSide
from tipdamp.study.schema import ContactSection, MaterialSection, OtherMaterial, SideSection
from tipdamp.study.view import Study

# names in a study file that differ from those of `nodal_stiffness.MODELS`
MODELS = {"halfspace": "halfspace_3d"}
SOFTER = {
    "plane_depth": "plane strain with depth",
    "rough_series": "half-spaces and a rough interface in series",
}
Moduli = tuple[float, float, float, float]  # E, nu of the blade, E, nu of the damper


def with_values(
    study: Study,
    pairs: ContactTable,
    materials: dict[str, Moduli],
    balance: Balance | None = None,
    fitted: float = 1.0,
) -> ContactTable:
    """The pairs with stiffness, friction and initial gap of the study; a user-supplied pair table
    brings its own, of which the study may replace mu, kn and kt.

    balance - of the damper, by default under Fc; fitted - factor found by a fit, on what a model
    gives
    """
    return with_sides(study, pairs, side_stiffness(study, pairs, materials, balance, fitted))


def with_sides(study: Study, pairs: ContactTable, sides: dict[str, NodalStiffness]) -> ContactTable:
    """As `with_values`, by the stiffness of each side."""
    if study.contact.pairs:
        return _in_place_of_table(study, pairs)
    kn, kt = node_stiffness(study, pairs, sides)
    along = pairs.position @ np.array(study.driver.axis)
    gap = pairs.gap.copy()
    for name, side in study.sides.items():
        if side.gap:
            mine = pairs.side == name
            gap[mine] += np.interp(along[mine], *np.array(side.gap).T)
    return pairs.replace(kn=kn, kt=kt, gap=gap, mu=np.full(len(pairs), study.contact.mu))


def _in_place_of_table(study: Study, pairs: ContactTable) -> ContactTable:
    """The table with what the study gives in the place of its values: mu of all pairs but the stops
    beside the damper, kn and kt of each side that has a section."""
    if study.contact.mu is not None:
        pairs = pairs.replace(mu=np.where(pairs.stops, pairs.mu, study.contact.mu))
    for name, side in study.sides.items():
        mine = pairs.side == name
        for column, value in {"kn": side.kn, "kt": side.kt}.items():
            if value is not None:
                changed = np.where(mine, value, vars(pairs)[column])
                pairs = pairs.replace(**{column: changed})
    return pairs


def side_stiffness(
    study: Study,
    pairs: ContactTable,
    materials: dict[str, Moduli],
    balance: Balance | None = None,
    fitted: float = 1.0,
) -> dict[str, NodalStiffness]:
    """{side: NodalStiffness} under its part of the load, with all that it was made from; {} with an
    own table.

    materials {side: Moduli} as `side_materials` finds them; only theory needs them.
    """
    contact, found = study.contact, {}
    if contact.pairs:
        return {}
    balance = balance or Balance(pull_vector(study), damper_hold(study))
    forces = balance.of_sides(pairs)
    for name, side in study.sides.items():
        mine = pairs.select(pairs.side == name)
        length = float(np.ptp(mine.position @ np.array(study.driver.axis)))
        if side.given:
            found[name] = given_stiffness(
                _per_node(side, name, mine), len(mine), forces.get(name, 0.0), length
            )
        elif name in forces:
            one, model = contact_side(side, length, materials[name]), _model(contact, side, fitted)
            found[name] = nodal_stiffness(one, forces[name], len(mine), model)
        else:
            raise InputError(
                f"{study.path}: [contact.{name}]: elasticity decides how its force is shared with "
                "sides of the same normal, and the stiffness of [contact] stiffness = "
                f"'{contact.stiffness}' depends on it; give it: kn_per_area and kt_per_area, "
                "kn_total and kt_total, or kn and kt"
            )
    return found


def _model(contact: ContactSection, side: SideSection, fitted: float) -> StiffnessModel:
    """How half-space theory makes the stiffness of a side."""
    return StiffnessModel(
        MODELS.get(contact.stiffness, contact.stiffness),
        contact.kind,
        (side.depth[0], side.depth[1]) if side.depth else None,
        None if side.h_rms is None or side.gamma is None else Roughness(side.h_rms, side.gamma),
        contact.scale * fitted,
    )


def _per_node(side: SideSection, name: str, mine: ContactTable) -> tuple[float, float]:
    """kn, kt of a side as a mean over its nodes, given per node, per area or in total."""
    if side.kn is not None and side.kt is not None:
        return side.kn, side.kt
    if side.kn_total is not None and side.kt_total is not None:
        return side.kn_total / len(mine), side.kt_total / len(mine)
    area = _tributary(side, name, mine, need_area=True).sum() / len(mine)
    return side.kn_per_area * area, side.kt_per_area * area


def _tributary(
    side: SideSection, name: str, mine: ContactTable, need_area: bool = False
) -> np.ndarray:
    """(n,) m2, or m where the pairs of the side form a line and no area is needed."""
    if mine.on_surface.all():
        return mine.area
    if not (found := patches(mine)):
        raise InputError(
            f"[contact.{name}]: its pairs lie at one place, which has no tributary areas"
        )
    patch = found[0]
    if patch.is_area or not need_area:
        return patch.tributary
    if not side.width:
        raise InputError(
            f"[contact.{name}] kn_per_area: the pairs form a line, which has no area; state its "
            "width, or give kn_total and kt_total"
        )
    return patch.tributary * side.width


def radii(study: Study) -> dict[str, float | None]:
    """{side: m} of the cylinders, None where it is not stated."""
    return {name: side.radius for name, side in study.sides.items() if side.shape == "cylinder"}


def contact_side(
    side: SideSection, length: float, moduli: Moduli, width: float | None = None
) -> ContactSide:
    """A side for half-space theory, with the sizes that its shape has; width - in place of one that
    is not stated."""
    return ContactSide(
        side.shape,
        length,
        MaterialPair(*moduli),
        radius=None if side.shape == "flat" else side.radius,
        width=None if side.shape == "cylinder" else side.width or width,
    )


def node_stiffness(
    study: Study, pairs: ContactTable, sides: dict[str, NodalStiffness]
) -> tuple[np.ndarray, np.ndarray]:
    """kn, kt (P,) N/m of the nodes from the NodalStiffness of their sides: equal shares, or by
    tributary area. What is given or found for a whole side is shared by those of its nodes that can
    touch; the others have the same per area."""
    kn, kt = np.empty(len(pairs)), np.empty(len(pairs))
    for name, one in sides.items():
        mine, side, weights = pairs.side == name, study.sides[name], np.ones(one.n_nodes)
        own = pairs.select(mine)
        if shares(study.contact, side, own) == "tributary":
            weights = _tributary(side, name, own)
            of = can_touch(side, own, weights, one)
            weights = weights * one.n_nodes / weights[of].sum()
        kn[mine], kt[mine] = one.kn * weights, one.kt * weights
    return kn, kt


def can_touch(
    side: SideSection, pairs: ContactTable, weights: np.ndarray, one: NodalStiffness
) -> np.ndarray:
    """(n,) bool: contact points of a round side between which and the blade there is less than the
    side's force presses them together by, load / kn beyond their mean distance, each beside the
    nearest of its station; all of a flat, and where the stiffness is per area."""
    if side.shape == "flat" or side.kn_per_area or not pairs.on_surface.all():
        return np.ones(len(pairs), dtype=bool)
    nearest = np.full(pairs.station.max() + 1, np.inf)
    np.minimum.at(nearest, pairs.station, pairs.gap)
    apart = pairs.gap - nearest[pairs.station]
    found, before = apart <= 0, None
    while before is None or (found != before).any():
        before = found
        approach = one.load / (one.kn * one.n_nodes) + np.average(
            apart[found], weights=weights[found]
        )
        found = found | (apart < approach)
    return found


def shares(contact: ContactSection, side: SideSection, mine: ContactTable) -> str:
    """How the nodes of a side share its stiffness; per area, and on surfaces, it is by area."""
    by_area = side.kn_per_area is not None or mine.on_surface.any()
    return "equal" if contact.shares == "equal" and not by_area else "tributary"


def facts(
    study: Study,
    pairs: ContactTable,
    sides: dict[str, NodalStiffness],
    materials: dict[str, Moduli],
    fitted: float = 1.0,
) -> dict[str, SideStiffness]:
    """{side: what its stiffness was made from} for the result of the stage."""
    contact, found = study.contact, {}
    for name, one in sides.items():
        side, theory = study.sides[name], one.model != "given"
        found[name] = SideStiffness(
            model=one.model,
            kn_N_per_m=one.kn,
            kt_N_per_m=one.kt,
            kt_along_N_per_m=one.kt_along,
            kt_across_N_per_m=one.kt_across,
            nodes=one.n_nodes,
            load_N=one.load,
            length_m=one.length,
            kind=one.kind if theory else None,
            half_width_m=one.size,
            depth_m=one.depth,
            h_rms_m=one.roughness.h_rms if one.roughness else None,
            gamma=one.roughness.gamma if one.roughness else None,
            scale=one.scale,
            shares=shares(contact, side, pairs.select(pairs.side == name)),
            E_star_Pa=one.pair.E_star if one.pair else None,
            ways=tuple(_ways(contact, side, one, materials.get(name), fitted)),
        )
    return found


def _ways(
    contact: ContactSection,
    side: SideSection,
    one: NodalStiffness,
    moduli: Moduli | None,
    fitted: float,
) -> Iterator[StiffnessWay]:
    """The way in use, the smooth bodies that it starts from where their sizes are known, and the
    reference."""
    before = []
    if moduli:
        # a given side may have no radius, or one far too small for the load
        with suppress(InputError):
            smooth = nodal_stiffness(
                contact_side(side, one.length, moduli),
                one.load,
                one.n_nodes,
                StiffnessModel(kind=contact.kind),
            )
            before.append(("smooth half-spaces", smooth.kn, smooth.kt))
    if one.model in SOFTER:
        before.append((SOFTER[one.model], one.kn / one.scale, one.kt / one.scale))
    if last := _last_way(contact, side, one, fitted):
        before.append((last, one.kn, one.kt))
    for i, (way, kn, kt) in enumerate(before, start=1):
        yield StiffnessWay(way=way, kn_N_per_m=kn, kt_N_per_m=kt, in_use=i == len(before))
    if side.reference_kn is not None and side.reference_kt is not None:
        yield StiffnessWay(
            way="reference", kn_N_per_m=side.reference_kn, kt_N_per_m=side.reference_kt
        )


def _last_way(
    contact: ContactSection, side: SideSection, one: NodalStiffness, fitted: float
) -> str:
    """What is done to a model, or how the stiffness is given; '' where neither."""
    if one.model == "given":
        if side.kn_per_area:
            return "given per area"
        return "given in total" if side.kn_total else "given per node"
    if contact.fit_hz is not None:
        return f"fitted to {contact.fit_hz:g} Hz, factor {fitted:.4g}"
    return f"declared factor {one.scale:g}" if one.scale != 1 else ""


def side_materials(study: Study, meshes: dict[str, Mesh], pairs: ContactTable) -> dict[str, Moduli]:
    """{side: Moduli} of the cells in contact. Sides with a stiffness of their own, which need none,
    are left out where the cells are of several materials."""
    found: dict[str, Moduli] = {}
    nodes = side_nodes(study, meshes, pairs)
    for name, blade, damper in zip(pairs.sides, nodes[BLADES], nodes[DAMPER], strict=True):
        try:
            one, two = (
                material_at(study, meshes[body], mine, f"[contact.{name}]")
                for body, mine in ((BLADES, blade), (DAMPER, damper))
            )
        except InputError:
            if study.contact.pairs or study.sides[name].given:
                continue
            raise
        found[name] = (one.E, one.nu, two.E, two.nu)
    return found


def material_at(
    study: Study, mesh: Mesh, nodes: np.ndarray, where: str
) -> MaterialSection | OtherMaterial:
    """The material section of the cells that hold the nodes; InputError when they are of
    several."""
    numbers = np.concatenate(
        [
            mesh.number[kind][np.isin(cells, mesh.index(nodes)).any(axis=1)]
            for kind, cells in mesh.cells.items()
        ]
    )
    own = [
        m
        for m in study.materials.values()
        if np.isin(numbers, mesh.cell_groups.get(m.group, ())).any()
    ]
    whole = own and np.isin(numbers, mesh.cell_groups[own[0].group]).all()
    if len(own) > 1 or (own and not whole):
        raise InputError(
            f"{study.path}: {where}: its cells are of several materials; one is needed for the "
            "half-space"
        )
    return own[0] if own else study.material
