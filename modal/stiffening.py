"""A rotating body: centrifugal stress stiffens it, the turning frame softens it.

    K + K_g - speed^2 M_perp

K_g is the geometric stiffness of the stress that the centrifugal load causes in linear statics,
M_perp the mass for motion in the plane of rotation. Coriolis forces are neglected. A free body has
no static state at speed and is refused."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material, blocks, stress
from tipdamp.modal.elements import dolfinx_compat
from tipdamp.modal.elements.isoparametric import stress_stiffness
from tipdamp.modal.loads import Rotation, centrifugal
from tipdamp.modal.mesh import Mesh


def rotating_body(
    body: Body,
    mesh: Mesh,
    material: Material,
    rotation: Rotation,
    other_materials: dict[str, Material] | None = None,
) -> Body:
    """The body as it vibrates at speed. Raises InputError for a free body."""
    if body.free:
        raise InputError(
            f"body '{body.name}' is free: without contact it has no static state at speed"
        )
    displacement = np.zeros((len(body.node), 3))
    displacement[body.dof_node, body.dof_direction] = Factor(body.K).solve(
        centrifugal(body, rotation)
    )
    keep = 3 * body.dof_node + body.dof_direction
    Kg = geometric_stiffness(mesh, material, displacement, other_materials)[keep][:, keep]
    return replace(
        body,
        K=(body.K + Kg - spin_softening(body, rotation)).tocsr(),
        provenance={
            **body.provenance,
            "speed": f"{rotation.speed:g} rad/s about {tuple(rotation.axis)}",
        },
    )


def spin_softening(body: Body, rotation: Rotation) -> sp.csr_matrix:
    """speed^2 M_perp (d, d) N/m."""
    d = np.arange(body.dofs)
    pick = [
        sp.csr_matrix(
            (np.ones(m.sum()), (d[m], body.dof_node[m])), shape=(body.dofs, len(body.node))
        )
        for m in (body.dof_direction == k for k in range(3))
    ]
    across = sum(rotation.across[a, b] * (pick[a] @ pick[b].T) for a in range(3) for b in range(3))
    # M couples equal directions only, by the same number in each, so the product stays symmetric
    return (rotation.speed**2 * (body.M @ across)).tocsr()


def geometric_stiffness(
    mesh: Mesh,
    material: Material,
    displacement: np.ndarray,
    other_materials: dict[str, Material] | None = None,
) -> sp.csr_matrix:
    """K_g (3n, 3n): integral of stress : grad(u)' grad(v), with the linear stress of a displacement
    (n, 3) m."""
    K = sp.csr_matrix((3 * len(mesh.node),) * 2)
    for kind, cells, of in blocks(mesh, material, other_materials or {}):
        assemble = _dolfinx if dolfinx_compat.takes(kind) else stress_stiffness
        K = K + assemble(mesh.position, kind, cells, of.lame, of.shear, displacement)
    return K.tocsr()


def _dolfinx(
    position: np.ndarray,
    kind: str,
    cells: np.ndarray,
    lame: float,
    shear: float,
    displacement: np.ndarray,
) -> sp.spmatrix:
    block = dolfinx_compat.CellBlock.of(position, kind, cells)
    import ufl

    static = stress(block.function(displacement), *block.constants(lame, shear))
    block = block.one_direction()
    u, v = ufl.TrialFunction(block.V), ufl.TestFunction(block.V)
    return block.matrix(ufl.inner(ufl.dot(static, ufl.grad(u)), ufl.grad(v)) * block.dx)
