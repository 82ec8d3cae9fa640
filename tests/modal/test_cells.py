"""The data sheets of the cells: shape functions, gradients, integration, faces, and the orders of
other programs."""

from math import factorial

import numpy as np
import pytest

from tests.modal.blocks import block
from tipdamp.hbm.errors import InputError
from tipdamp.modal.elements.cells import CELLS, smallest_jacobians
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import checked
from tipdamp.readers.content import HEX20, HEX20_NASTRAN, TET10, WEDGE15, WEDGE15_NASTRAN

each = pytest.mark.parametrize("cell", CELLS.values(), ids=CELLS)
VOLUME = {"tetra": 1 / 6, "hexahedron": 8.0, "wedge": 1.0}  # of the reference cells


@each
def test_shape_functions_are_a_partition_of_unity(cell):
    assert cell.shape(cell.reference) == pytest.approx(np.eye(cell.nodes), abs=1e-12)
    assert cell.shape(cell.points).sum(axis=1) == pytest.approx(1.0, abs=1e-12)


@each
def test_gradients_are_the_differences(cell):
    step = 1e-6
    for k in range(3):
        ahead = cell.points + step * np.eye(3)[k]
        behind = cell.points - step * np.eye(3)[k]
        difference = (cell.shape(ahead) - cell.shape(behind)) / (2 * step)
        assert cell.gradient(cell.points)[:, k] == pytest.approx(difference, abs=1e-8)


@each
def test_weights_add_to_the_volume(cell):
    assert cell.weights.sum() == pytest.approx(VOLUME[cell.name.rstrip("0123456789")], rel=1e-12)
    assert (cell.weights > 0).all()


@pytest.mark.parametrize("name, degree", [("tetra", 2), ("tetra10", 5)])
def test_tetrahedral_rule_is_exact_to_its_degree(name, degree):
    """Integral of x^i y^j z^k over the tetrahedron: i! j! k! / (i + j + k + 3)! (Dirichlet)."""
    x, y, z = CELLS[name].points.T
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            for k in range(degree + 1 - i - j):
                exact = factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3)
                assert CELLS[name].weights @ (x**i * y**j * z**k) == pytest.approx(exact, rel=1e-12)


@each
def test_faces_look_outward_and_close_the_cell(cell):
    """Area vectors of the flat faces point away from the middle and add to zero."""
    total, middle = np.zeros(3), cell.reference.mean(axis=0)
    for face in cell.faces:
        corners = cell.reference[list(face[: 3 if len(face) in (3, 6) else 4])]
        arms = corners[1:] - corners[0]
        area = np.cross(arms[:-1], arms[1:]).sum(axis=0) / 2
        assert area @ (corners.mean(axis=0) - middle) > 0
        total += area
    assert total == pytest.approx(np.zeros(3), abs=1e-12)


@each
def test_mirrored_turns_an_inside_out_cell_around(cell):
    position = cell.reference * [-1.0, 1.0, 1.0]
    cells = np.arange(cell.nodes)[None]
    assert smallest_jacobians(cell.name, position, cells)[0, 1] < 0
    assert smallest_jacobians(cell.name, position, cells[:, cell.mirrored()])[0, 0] > 0


@pytest.mark.parametrize(
    "name, edges, expected",
    [
        # first and last middle node of the other program, between which of its corners (manuals of
        # the programs) Abaqus C3D20, Ansys SOLID186
        ("hexahedron20", HEX20, {8: (0, 1), 15: (4, 7), 16: (0, 4), 19: (3, 7)}),
        # Nastran CHEXA
        ("hexahedron20", HEX20_NASTRAN, {8: (0, 1), 12: (0, 4), 16: (4, 5), 19: (4, 7)}),
        ("wedge15", WEDGE15, {6: (0, 1), 9: (3, 4), 12: (0, 3), 14: (2, 5)}),  # Abaqus C3D15
        (
            "wedge15",
            WEDGE15_NASTRAN,
            {6: (0, 1), 9: (0, 3), 12: (3, 4), 14: (3, 5)},
        ),  # Nastran CPENTA
        ("tetra10", TET10, {4: (0, 1), 6: (0, 2), 7: (0, 3), 9: (2, 3)}),  # all three
    ],
)
def test_orders_of_other_programs(name, edges, expected):
    cell = CELLS[name]
    theirs = np.empty_like(cell.reference)
    theirs[cell.columns(edges)] = cell.reference
    for place, (a, b) in expected.items():
        assert theirs[place] == pytest.approx((cell.reference[a] + cell.reference[b]) / 2)


@pytest.mark.parametrize("kind", [name for name in CELLS if CELLS[name].middles])
def test_middles_lie_between_their_corners(kind):
    cell = CELLS[kind]
    edges = {"tetra": 6, "hexahedron": 12, "wedge": 9}
    assert len(cell.middles) == next(n for name, n in edges.items() if kind.startswith(name))
    for node, (a, b) in cell.middles:
        assert np.array_equal(cell.reference[node], cell.reference[[a, b]].mean(axis=0))


def test_a_node_in_the_middle_of_two_edges():
    """Two blocks of tetrahedra whose common face is cut alike, and along both diagonals, merged by
    places: the solver's mesh would end in a crash."""
    mesh = block("tetra10", (1, 1, 1), size=(1.0, 1.0, 1.0))
    alike = mesh.position + [0, 0, 1]
    crossed = mesh.position[:, [1, 0, 2]] * [-1, 1, 1] + [1, 0, 1]  # turned by a right angle
    assert len(_merged(mesh, alike).node) == 45
    with pytest.raises(InputError, match=r"lies in the middle of two edges, 3 to 43 and 13 to 33"):
        _merged(mesh, crossed)


def _merged(mesh, places):
    """The mesh and itself at other places, nodes that coincide made one."""
    both = np.round(np.concatenate([mesh.position, places]), 9)
    unique, of = np.unique(both, axis=0, return_inverse=True)
    cells = np.concatenate([mesh.cells["tetra10"], mesh.cells["tetra10"] + len(mesh.position)])
    return checked(Mesh(np.arange(1, len(unique) + 1), unique, {"tetra10": of.ravel()[cells]}))
