"""The pressure between two bodies from their displacements alone: kn (u_n - g) all over the
damper's faces, whatever points or pairs carried the forces. By it meshes and kinds of contact are
compared that have no point in common."""

import numpy as np
import scipy.sparse as sp

from tipdamp.bodies import BLADES, DAMPER, loads
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.surfaces import SurfaceContact, named_side
from tipdamp.fields.pressure import patches
from tipdamp.modal.faces import face_shapes
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies, SparseCompliance
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.surfaces.facets import Surface, facets
from tipdamp.static_contact.surfaces.overlap import overlap
from tipdamp.static_contact.surfaces.pick import faces_of

CORNERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
MIDDLES = ((0, 1), (1, 2), (2, 0))


def per_station(
    study, meshes, contact: SurfaceContact, kn: dict[str, float], count: int
) -> np.ndarray:
    """(sides, count) N of the pull alone: each place shares its force between the two nearest of
    `count` stations from end to end. kn - {side: N/m3}; of pairs of nodes by tributary area."""
    stiffness = np.empty(len(contact.pairs))
    for patch in patches(contact.pairs):
        stiffness[patch.rows] = kn[patch.side] * patch.tributary
    pairs = contact.pairs.replace(kn=stiffness, kt=stiffness)
    bodies = assemble_bodies(study, meshes, lambda *_: None, points=contact.points)
    force = [
        np.zeros(bodies[0].dofs),
        study.damper.pull * loads.unit_pull(study, bodies[1], meshes[DAMPER]).force,
    ]
    statics = StaticContact(SparseBodies.of(bodies), pairs, compliance=SparseCompliance)
    q = statics.solve(np.concatenate(force)).displacement
    moved = {}
    for body, own in zip(bodies, np.split(q, [bodies[0].dofs]), strict=True):
        moved[body.name] = np.zeros((len(meshes[body.name].node), 3))
        moved[body.name][meshes[body.name].index(body.node)[body.dof_node], body.dof_direction] = (
            own
        )
    return np.array([_of_side(study, meshes, moved, name, kn[name], count) for name in study.sides])


def _of_side(study, meshes, moved, name, kn, count):
    side = named_side(study, name)
    surfaces = {
        body: Surface(meshes[body], faces_of(meshes[body], group))
        for body, group in ((BLADES, side.blade), (DAMPER, side.damper))
    }
    at = _spread(surfaces[DAMPER])
    mesh = Mesh(np.arange(at.shape[0]), at @ meshes[DAMPER].position, {})
    met = overlap(Surface(mesh, [np.arange(at.shape[0]).reshape(-1, 3)]), surfaces[BLADES])
    closed = np.einsum(
        "nx,nx->n", met.damper @ (at @ moved[DAMPER]) - met.blade @ moved[BLADES], met.normal
    )
    place = met.damper @ mesh.position @ np.array(study.driver.axis)
    ends = mesh.position @ np.array(study.driver.axis)
    station = (place - ends.min()) / np.ptp(ends) * (count - 1)
    share = np.maximum(1 - np.abs(station[:, None] - np.arange(count)), 0)
    return (kn * np.maximum(closed - met.gap, 0) * met.area) @ share


def _spread(surface, times=2):
    """(3 t, nodes) CSR: shape functions of the corners of t small triangles that the faces are cut
    into."""
    found = []
    for kind in facets(surface):
        face, reference, nodes = kind.face, kind.reference, kind.faces.shape[1]
        for _ in range(times):
            six = np.concatenate(
                [reference, np.stack([reference[:, ends].mean(axis=1) for ends in MIDDLES], 1)], 1
            )
            face, reference = np.repeat(face, 4), six[:, CORNERS].reshape(-1, 3, 2)
        shape = face_shapes(nodes, reference.reshape(-1, 2))[0]
        node = np.repeat(kind.faces[face], 3, axis=0)
        rows = np.arange(0, shape.size + 1, nodes)
        found.append(
            sp.csr_matrix((shape.ravel(), node.ravel(), rows), (len(shape), len(surface.mesh.node)))
        )
    return sp.vstack(found).tocsr()
