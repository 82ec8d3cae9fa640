"""Displacement and stress of whole bodies under the preload, from the motion of their masters: [preload] stress."""

import numpy as np

from hbm.model import ReducedModel
from modal.body import Body
from modal.mesh import Mesh
from tipdamp import loads
from tipdamp.bodies import DAMPER
from tipdamp.bodies.assemble import assemble_bodies, materials
from tipdamp.bodies.read import read_meshes
from tipdamp.progress import Tick
from tipdamp.store import Store
from tipdamp.study.view import Study
from tipdamp.visualization import write_shapes


def keep_stress(study: Study, store: Store, model: ReducedModel, q: np.ndarray, tick: Tick) -> list[str]:
    """stress_blades.vtu and stress_damper.vtu of the displacement q (r,) m at rest; the names of what was written.

    The bodies are assembled again: beyond the masters the reduced model knows the static shape only as Psi, which costs
    a back-solve for each of them, and one back-solve with q given on the masters is exact for loads inside as well.
    """
    from modal.stress import nodal_stress, von_mises

    meshes, files = read_meshes(study), []
    for i, body in enumerate(assemble_bodies(study, meshes, lambda *_: None)):
        tick(0.4 + 0.3 * i, f"stresses of the {body.name}")
        mesh = meshes[body.name]
        shape = static_shape(body, model, q, body_load(study, body, mesh))
        own, others = materials(study, mesh)
        what = loads.rest_name(study).removeprefix("the ")
        fields = {f"displacement (m), {what}": shape,
                  f"von Mises stress (Pa), {what}": von_mises(nodal_stress(mesh, own, shape, others))}
        files += write_shapes(store, f"stress_{body.name}.vtu", mesh, fields)
    return files


def body_load(study: Study, body: Body, mesh: Mesh) -> np.ndarray:
    """(d,) N on the free dofs: what acts on a body at rest, the pull or the case that [preload] names."""
    case = study.preload.case
    force = loads.case_forces(study, case, body, mesh) if case else np.zeros(body.dofs)
    if body.name != DAMPER:
        return force
    return force + loads.case_pull(study, case) * loads.unit_pull(study, body, mesh).force


def static_shape(body: Body, model: ReducedModel, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(n, 3) m: K_II u_I = f_I - K_IB u_B, with the masters' displacement u_B from q."""
    from modal.eigen import Factor

    place = {(int(body.node[n]), "xyz"[k]): i for i, (n, k) in
             enumerate(zip(body.dof_node, body.dof_direction, strict=True))}
    own = np.flatnonzero((model.body == body.name) & (model.direction != "mode"))
    boundary = np.array([place[int(model.node[i]), model.direction[i]] for i in own])
    u = np.zeros(body.dofs)
    u[boundary] = q[own]
    inner = np.setdiff1d(np.arange(body.dofs), boundary)
    u[inner] = Factor(body.K[inner][:, inner]).solve((force - body.K @ u)[inner])
    out = np.zeros((len(body.node), 3))
    out[body.dof_node, body.dof_direction] = u
    return out
