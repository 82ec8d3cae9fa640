"""Mass and support by the mesh alone, against the matrices of the body."""

import numpy as np
import pytest

from tests.modal.blocks import block
from tipdamp.modal.body import check_support
from tipdamp.modal.elasticity import Material, elastic_body, fixed_nodes
from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.mesh_support import all_held, moving_mass

STEEL = Material(E=207e9, nu=0.3, density=7850.0)


@pytest.mark.parametrize("kind", CELLS)
@pytest.mark.parametrize("clamp", ["clamp", None])
def test_mass_as_the_matrix_has_it(kind, clamp):
    mesh = block(kind, (4, 2, 1))
    body = elastic_body(mesh, STEEL, "bar", clamp=clamp, free=clamp is None)
    mass = moving_mass(mesh, fixed_nodes(mesh, clamp), STEEL, {})
    assert body.mass() == pytest.approx(3 * [mass], rel=1e-12)
    assert check_support(body) == (0 if clamp else 6)


@pytest.mark.parametrize(
    "nodes, held", [(0, False), (1, False), (2, False), (3, False), ("plane", True)]
)
def test_held_by_three_nodes_that_are_not_on_one_line(nodes, held):
    """The first nodes lie on one edge of the block."""
    mesh = block("hexahedron", (4, 2, 1))
    fixed = np.zeros(len(mesh.node), dtype=bool)
    edge = np.flatnonzero((mesh.position[:, 1:] == mesh.position[0, 1:]).all(axis=1))
    if nodes == "plane":
        fixed[edge[:2]] = True
        fixed[np.flatnonzero(mesh.position[:, 1] != mesh.position[0, 1])[0]] = True
    else:
        fixed[edge[:nodes]] = True
    assert all_held(mesh, fixed) is held
