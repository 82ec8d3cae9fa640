"""Stiffness, friction and initial gaps of matched pairs: the study's own values, or from half-space theory."""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError
from modal.mesh import Mesh
from static_contact.equilibrium import side_forces, side_normals
from static_contact.stiffness.contact_side import ContactSide
from static_contact.stiffness.elastic_constants import MaterialPair
from static_contact.stiffness.nodal_stiffness import NodalStiffness, StiffnessModel, given_stiffness, nodal_stiffness
from static_contact.stiffness.nodal_weights import nodal_values, tributary_weights
from static_contact.stiffness.rough_surfaces import Roughness
from tipdamp.bodies import BLADES, DAMPER
from tipdamp.loads import pull_vector
from tipdamp.stages.results import SideStiffness
from tipdamp.study.schema import Material, OtherMaterial, Side
from tipdamp.study.view import Study

MODELS = {"halfspace": "halfspace_3d"}      # names in a study file that differ from those of `nodal_stiffness.MODELS`
Moduli = tuple[float, float, float, float]   # E, nu of the blade, E, nu of the damper


def with_values(study: Study, pairs: ContactTable, materials: dict[str, Moduli],
                pull: np.ndarray | None = None) -> ContactTable:
    """The pairs with stiffness, friction and initial gap of the study; a user-supplied pair table brings its own.

    pull (3,) N: load on the damper, by default Fc.
    """
    if study.contact.pairs:
        return pairs
    kn, kt = node_stiffness(study, pairs, side_stiffness(study, pairs, materials, pull))
    along = pairs.position @ np.array(study.driver.axis)
    gap = pairs.gap.copy()
    for name, side in study.sides.items():
        if side.gap:
            mine = pairs.side == name
            gap[mine] += np.interp(along[mine], *np.array(side.gap).T)
    return pairs.replace(kn=kn, kt=kt, gap=gap, mu=np.full(len(pairs), study.contact.mu))


def side_stiffness(study: Study, pairs: ContactTable, materials: dict[str, Moduli],
                   pull: np.ndarray | None = None) -> dict[str, NodalStiffness]:
    """{side: NodalStiffness} under its part of the pull, with all that it was made from; {} with an own table.

    materials {side: Moduli} as `side_materials` finds them; only theory needs them.
    """
    contact, found = study.contact, {}
    if contact.pairs:
        return {}
    forces = side_forces(side_normals(pairs), pull_vector(study) if pull is None else pull)
    for name, side in study.sides.items():
        mine = pairs.side == name
        count, length = int(mine.sum()), float(np.ptp(pairs.position[mine] @ np.array(study.driver.axis)))
        if side.kn is not None and side.kt is not None:
            found[name] = given_stiffness((side.kn, side.kt), count, forces[name], length)
            continue
        depth = (side.depth[0], side.depth[1]) if side.depth else None
        roughness = None if side.h_rms is None or side.gamma is None else Roughness(side.h_rms, side.gamma)
        model = StiffnessModel(MODELS.get(contact.stiffness, contact.stiffness), contact.kind, depth, roughness,
                               contact.scale)
        found[name] = nodal_stiffness(contact_side(side, length, materials[name]), forces[name], count, model)
    return found


def contact_side(side: Side, length: float, moduli: Moduli, width: float | None = None) -> ContactSide:
    """A side for half-space theory, with the sizes that its shape has; width - in place of one that is not stated."""
    return ContactSide(side.shape, length, MaterialPair(*moduli), radius=None if side.shape == "flat" else side.radius,
                       width=None if side.shape == "cylinder" else side.width or width)


def node_stiffness(study: Study, pairs: ContactTable,
                   sides: dict[str, NodalStiffness]) -> tuple[np.ndarray, np.ndarray]:
    """kn, kt (P,) N/m of the nodes from the NodalStiffness of their sides: equal shares, or by tributary area."""
    kn, kt = np.empty(len(pairs)), np.empty(len(pairs))
    for name, one in sides.items():
        mine = pairs.side == name
        kn[mine], kt[mine] = one.kn, one.kt
        if study.contact.shares == "tributary" and one.model != "given":
            across = pairs.frame[mine][:, 1].mean(axis=0)
            try:
                weights = tributary_weights(pairs.position[mine] @ np.array(study.driver.axis),
                                            pairs.position[mine] @ across)
            except InputError as error:
                raise InputError(f"{study.path}: [contact.{name}], shares = 'tributary': {error}") from None
            kn[mine], kt[mine] = (nodal_values(one.n_nodes * k, weights) for k in (one.kn, one.kt))
    return kn, kt


def facts(study: Study, sides: dict[str, NodalStiffness]) -> dict[str, SideStiffness]:
    """{side: what its stiffness was made from} for the result of the stage."""
    found = {}
    for name, one in sides.items():
        theory = one.model != "given"
        found[name] = SideStiffness(
            model=one.model, kn_N_per_m=one.kn, kt_N_per_m=one.kt, kt_along_N_per_m=one.kt_along,
            kt_across_N_per_m=one.kt_across, nodes=one.n_nodes, load_N=one.load, length_m=one.length,
            kind=one.kind if theory else None, half_width_m=one.size, depth_m=one.depth,
            h_rms_m=one.roughness.h_rms if one.roughness else None,
            gamma=one.roughness.gamma if one.roughness else None, scale=one.scale,
            shares=study.contact.shares if theory else "equal", E_star_Pa=one.pair.E_star if one.pair else None)
    return found


def side_materials(study: Study, meshes: dict[str, Mesh], pairs: ContactTable,
                   every: bool = False) -> dict[str, Moduli]:
    """{side: Moduli} of the cells in contact, where a model makes the stiffness.

    every: on given sides too, left out where the cells are of several materials.
    """
    found: dict[str, Moduli] = {}
    for name, side in study.sides.items() if not study.contact.pairs else ():
        if side.given and not every:
            continue
        mine = pairs.side == name
        try:
            one, two = (material_at(study, meshes[body], nodes[mine], f"[contact.{name}]")
                        for body, nodes in ((BLADES, pairs.blade_node), (DAMPER, pairs.damper_node)))
        except InputError:
            if every:
                continue
            raise
        found[name] = (one.E, one.nu, two.E, two.nu)
    return found


def material_at(study: Study, mesh: Mesh, nodes: np.ndarray, where: str) -> Material | OtherMaterial:
    """The material section of the cells that hold the nodes; InputError when they are of several."""
    numbers = np.concatenate([mesh.number[kind][np.isin(cells, mesh.index(nodes)).any(axis=1)]
                              for kind, cells in mesh.cells.items()])
    own = [m for m in study.materials.values() if np.isin(numbers, mesh.cell_groups.get(m.group, ())).any()]
    whole = own and np.isin(numbers, mesh.cell_groups[own[0].group]).all()
    if len(own) > 1 or (own and not whole):
        raise InputError(f"{study.path}: {where}: its cells are of several materials; one is needed for the half-space")
    return own[0] if own else study.material
