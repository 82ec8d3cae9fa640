"""Assembled meshes of every cell type and of mixtures: exact strain, mass, rigid motions, wave
frequency, dolfinx."""

import numpy as np
import pytest
import scipy.linalg as sl

from tipdamp.hbm.errors import InputError
from tipdamp.modal import elasticity
from tipdamp.modal.body import rigid_modes
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.elements import dolfinx_compat
from tipdamp.modal.elements.isoparametric import stiffness_and_mass

from .blocks import CORNERS, HEIGHT, LENGTH, WIDTH, block, mixture, volume

STEEL = Material(E=207e9, nu=0.3, density=7850.0)
BOX = LENGTH * WIDTH * HEIGHT
MESHES = {
    **{kind: (lambda kind=kind: block(kind, distort=0.2), BOX) for kind in CORNERS},
    "mixture, linear": (lambda: mixture(1), 0.75 * BOX),
    "mixture, quadratic": (lambda: mixture(2), 0.75 * BOX),
}
each_mesh = pytest.mark.parametrize("make, size", MESHES.values(), ids=MESHES)


@pytest.fixture
def own(monkeypatch):
    """Our assembler for all cells, as where dolfinx is not installed."""
    monkeypatch.setattr(dolfinx_compat, "available", lambda: False)


@each_mesh
def test_uniform_strain_is_exact(own, make, size):
    """Patch test: a linear displacement leaves no force on inner nodes and has the energy of its
    strain."""
    mesh = make()
    body = elastic_body(mesh, STEEL, "block", free=True)
    strain = np.array([[1e-3, 2e-4, -3e-4], [2e-4, -5e-4, 1e-4], [-3e-4, 1e-4, 7e-4]])
    u = (mesh.position @ strain).ravel()
    energy = 0.5 * STEEL.lame * np.trace(strain) ** 2 + STEEL.shear * np.sum(strain**2)
    assert 0.5 * u @ body.K @ u == pytest.approx(energy * size, rel=1e-10)
    force = np.abs((body.K @ u).reshape(-1, 3)).max(axis=1)
    from tipdamp.modal.faces import boundary_faces

    outside = np.unique(np.concatenate([f.ravel() for f in boundary_faces(mesh)]))
    inner = np.setdiff1d(np.arange(len(mesh.node)), outside)
    assert force[outside].max() > 0 and force[inner].max(initial=0) < 1e-10 * force.max()


@each_mesh
def test_mass_and_six_rigid_modes(own, make, size):
    body = elastic_body(make(), STEEL, "block", free=True)
    assert body.mass() == pytest.approx(np.full(3, 7850 * size), rel=1e-10)
    assert rigid_modes(body) == 6
    values = np.linalg.eigvalsh(body.K.toarray())
    assert (np.abs(values) < 1e-10 * values[-1]).sum() == 6  # and no other motion without stiffness


@pytest.mark.parametrize("kind", CORNERS)
def test_lengthwise_wave_of_a_clamped_bar(own, kind):
    """Without Poisson's ratio f = c / 4L exactly [Timoshenko]. Linear cells with consistent mass
    lie (kh)^2 / 24 above it (or less, where more nodes lie along the bar), kh = pi / 2n for n cells
    along the bar; quadratic ones (kh)^4 / 1440 or less (dispersion of bar elements)."""
    n = 8
    mesh = block(kind, (n, 1, 1))
    body = elastic_body(mesh, Material(E=207e9, nu=0.0, density=7850.0), "bar", clamp="clamp")
    values, shapes = sl.eigh(body.K.toarray(), body.M.toarray())
    along = (body.M @ (body.dof_direction == 0).astype(float)) @ shapes
    best = int(np.abs(along).argmax())
    exact = (np.pi / 2 / LENGTH) ** 2 * 207e9 / 7850
    kh = np.pi / 2 / n
    error = np.sqrt(values[best] / exact) - 1
    linear = kind == CORNERS[kind]
    allowed = kh**2 / 24 * 1.05 if linear else 2 * kh**4 / 1440
    assert -1e-9 < error < allowed
    assert kind != "hexahedron" or error == pytest.approx(kh**2 / 24, rel=0.02)


@pytest.mark.parametrize(
    "kind, distort", [("hexahedron", 0.2), ("hexahedron27", 0.2), ("tetra10", 0.2), ("tetra", 0.2)]
)
def test_two_assemblers_agree(kind, distort):
    """Ours and dolfinx with the same integration: to 1e-10 of the largest entry."""
    pytest.importorskip("dolfinx")
    mesh = block(kind, distort=distort)
    arguments = mesh.position, kind, mesh.cells[kind], STEEL.lame, STEEL.shear, STEEL.density
    for ours, theirs in zip(
        stiffness_and_mass(*arguments), elasticity._dolfinx(*arguments), strict=True
    ):
        assert abs(ours - theirs).max() < 1e-10 * abs(theirs).max()


@pytest.mark.parametrize("order, only, tolerance", [(2, "tetra10", 0.02)])
def test_mixture_against_one_type(order, only, tolerance):
    """Lowest three frequencies of the clamped L: hexahedra, wedges and tetrahedra against
    tetrahedra alone. Both lie above the limit of fine meshes; between 4 and 8 cells along the bar
    they move by less than the tolerance."""
    hz = []
    for mesh in (mixture(order, (6, 2, 2)), mixture(order, (6, 2, 2), only=only)):
        body = elastic_body(mesh, STEEL, "L", clamp="clamp")
        hz.append(
            np.sqrt(
                sl.eigh(
                    body.K.toarray(), body.M.toarray(), eigvals_only=True, subset_by_index=(0, 2)
                )
            )
        )
    assert hz[0] == pytest.approx(hz[1], rel=tolerance)


def test_two_materials_are_the_sum_of_their_blocks():
    """Mass of each part with its own density; stiffness of a bar in series: E1 and E2 over half the
    length each."""
    mesh = block("hexahedron20", (8, 1, 1))
    far = mesh.position[mesh.cells["hexahedron20"]].mean(axis=1)[:, 0] > LENGTH / 2
    mesh.cell_groups["far half"] = mesh.number["hexahedron20"][far]
    soft, hard = Material(100e9, 0.0, 4500.0), Material(200e9, 0.0, 7800.0)
    free = elastic_body(mesh, soft, "bar", free=True, other_materials={"far half": hard})
    assert free.mass() == pytest.approx(np.full(3, (4500 + 7800) / 2 * BOX), rel=1e-10)
    body = elastic_body(mesh, soft, "bar", clamp="clamp", other_materials={"far half": hard})
    tip = body.node_dofs(mesh.group("tip"))[::3]
    # prescribe 1 um at the tip: the force is A / (L / 2 E1 + L / 2 E2)
    rest = np.setdiff1d(np.arange(body.dofs), tip)
    K = body.K.toarray()
    u = np.linalg.solve(K[np.ix_(rest, rest)], -K[np.ix_(rest, tip)].sum(axis=1) * 1e-6)
    force = K[tip][:, rest] @ u + K[np.ix_(tip, tip)].sum(axis=1) * 1e-6
    assert force.sum() == pytest.approx(
        1e-6 * WIDTH * HEIGHT / (LENGTH / 2 / 100e9 + LENGTH / 2 / 200e9), rel=1e-9
    )


def test_materials_that_claim_the_same_cell():
    mesh = block("hexahedron", (2, 1, 1))
    mesh.cell_groups.update(one=np.array([1, 2]), two=np.array([2]))
    with pytest.raises(
        InputError, match="1 hexahedron cells are in the groups 'two' and 'one'.*first: element 2"
    ):
        elastic_body(
            mesh, STEEL, "bar", clamp="clamp", other_materials={"one": STEEL, "two": STEEL}
        )
    with pytest.raises(InputError, match="no group of cells 'tw'; did you mean 'two'"):
        elastic_body(mesh, STEEL, "bar", clamp="clamp", other_materials={"tw": STEEL})


def test_several_clamps_hold_what_each_names():
    mesh = block("hexahedron", (3, 1, 1))
    both = elastic_body(mesh, STEEL, "bar", clamp=("clamp", "tip"))
    held = np.union1d(mesh.group("clamp"), mesh.group("tip"))
    assert np.array_equal(mesh.node[np.unique(both.dof_node)], np.setdiff1d(mesh.node, held))


def test_volume_of_the_l():
    assert volume((4, 2, 2)) == pytest.approx(0.75 * BOX)
