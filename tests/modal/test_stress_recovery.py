"""Stresses at the nodes: exact where theory is linear in space, on every cell type, and from a
reduced model."""

from dataclasses import replace

import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.modal.craig_bampton import craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.stress_recovery import alternating_stress, half_range, nodal_stress, von_mises
from tipdamp.readers.dispatch import read_mesh

from .blocks import block
from .conftest import HEIGHT, LENGTH, WIDTH, make_bar

pytest.importorskip("gmsh")
STEEL = Material(E=207e9, nu=0.3, density=7850.0)


@pytest.mark.parametrize("kind", list(CELLS))
def test_uniform_stress_is_exact(kind):
    """sigma = lame tr(eps) + 2 G eps for a linear displacement field, whatever the mesh."""
    mesh = block(kind, distort=0.2)
    strain = np.array([[1e-3, 2e-4, -3e-4], [2e-4, -5e-4, 1e-4], [-3e-4, 1e-4, 7e-4]])
    spin = np.array([[0, 4e-4, 0], [-4e-4, 0, 1e-4], [0, -1e-4, 0]])
    # 2 G = E / (1 + nu), nu = 0.3
    full = STEEL.E / 1.3 * (strain + 0.3 / 0.4 * np.trace(strain) * np.eye(3))
    expected = full[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    found = nodal_stress(mesh, STEEL, mesh.position @ (strain + spin).T)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("hexahedra", [True, False])
def test_pure_bending_is_exact_at_second_order(tmp_path, hexahedra):
    """sigma_xx = -E c z, all else 0, for u = (-c x z, c nu y z, c (x^2 + nu (z^2 - y^2)) / 2)
    [Timoshenko]."""
    mesh = read_mesh(make_bar(tmp_path / "b.msh", 2, hexahedra))
    x, y, z = mesh.position.T
    c, nu = 0.1, STEEL.nu
    u = np.column_stack([-c * x * z, c * nu * y * z, c / 2 * (x**2 + nu * (z**2 - y**2))])
    stress = nodal_stress(mesh, STEEL, 1j * u).imag
    largest = STEEL.E * c * HEIGHT
    assert np.abs(stress[:, 0] + STEEL.E * c * z).max() < 1e-9 * largest
    assert np.abs(stress[:, 1:]).max() < 1e-9 * largest
    assert von_mises(stress) == pytest.approx(STEEL.E * c * z, abs=1e-6 * largest)


@pytest.mark.parametrize("kind", ["hexahedron", "tetra10", "wedge15"])
def test_two_materials_in_a_row_carry_one_stress(kind):
    """nu = 0: sigma_xx is the same on both sides of the joint, where the strain jumps as 1 / E."""
    mesh = block(kind)
    soft, stiff = Material(1e9, 0.0, 1.0), Material(4e9, 0.0, 1.0)
    x, middle = mesh.position[:, 0], mesh.position[:, 0].max() / 2
    right = {k: mesh.position[c][..., 0].mean(axis=1) > middle for k, c in mesh.cells.items()}
    mesh = replace(
        mesh, cell_groups={"right": np.concatenate([mesh.number[k][m] for k, m in right.items()])}
    )
    u = np.zeros((len(x), 3))
    u[:, 0] = 1e6 * (np.minimum(x, middle) / soft.E + np.maximum(x - middle, 0) / stiff.E)
    found = nodal_stress(mesh, soft, u, {"right": stiff})
    assert found == pytest.approx(np.outer(np.ones(len(x)), [1e6, 0, 0, 0, 0, 0]), abs=1e-3)


def test_von_mises_of_pure_shear():
    """sqrt(3) tau."""
    assert von_mises(np.array([[0, 0, 0, 2.0, 0, 0]])) == pytest.approx([2 * np.sqrt(3)])


def test_tension_recovered_from_a_reduced_model(bar):
    """End loads on the tip nodes of a held bar, 1 MPa on average: away from both ends sigma_xx = F
    / A [Saint-Venant], whether the loaded nodes are masters or interior nodes with a load mode."""
    body = elastic_body(bar, STEEL, "bar", clamp="clamp")
    tip = bar.group("tip")
    on = bar.position[bar.index(tip)]
    quarter = np.array(
        [
            np.prod(
                [{0: 1, 1: 4, 2: 2, 3: 4, 4: 1}[int(round(t * 4))] for t in (y / WIDTH, z / HEIGHT)]
            )
            for y, z in on[:, 1:]
        ]
    )  # Simpson over two quadratic faces each way
    force = np.zeros((len(tip), 3))
    force[:, 0] = 1e6 * WIDTH * HEIGHT * quarter / quarter.sum()
    middle = np.abs(bar.position[:, 0] - LENGTH / 2) < 0.1 * LENGTH
    assert middle.sum() > 20
    found = {}
    for name, masters, loads in (
        ("masters", tip, ()),
        ("interior", bar.node[middle][:4], [(tip, force)]),
    ):
        reduction = craig_bampton(body, masters, 4, loads=loads)
        q = np.linalg.solve(reduction.model.K, reduction.condense(tip, force))
        found[name] = reduction.stress(q, bar, STEEL)
        assert np.array_equal(found[name], nodal_stress(bar, STEEL, reduction.recover(q)))
        assert found[name][middle, 0] == pytest.approx(np.full(middle.sum(), 1e6), rel=2e-3)
    assert np.abs(found["interior"] - found["masters"]).max() < 1e-6 * 1e6
    with pytest.raises(InputError, match="is not the one that it was made of"):
        reduction.stress(q, block("hexahedron"), STEEL)


def test_half_range_of_paths():
    """Random paths of up to seven orders against all pairs of 600 instants; an ellipse has its
    major half axis."""
    rng, tau = np.random.default_rng(3), 2 * np.pi * np.arange(600) / 600
    for H in (1, 2, 3, 7):
        X = rng.standard_normal((5, 4, H + 1)) + 1j * rng.standard_normal((5, 4, H + 1))
        path = np.einsum("ndk,kt->ntd", X, np.exp(1j * np.outer(np.arange(H + 1), tau))).real
        brute = [max(np.linalg.norm(p - p[i], axis=1).max() for i in range(600)) / 2 for p in path]
        found = half_range(X)
        assert (
            np.allclose(found, brute, rtol=1e-3) and (found >= (1 - 1e-6) * np.array(brute)).all()
        )
    ellipse = np.array([[[5, 3.0], [5, 1j]], [[0, 1.0], [1, 4 - 4j]]])
    assert np.allclose(half_range(ellipse), [3, np.sqrt((33 + np.sqrt(31**2 + 64)) / 2)], rtol=1e-6)


def test_alternating_stress_counts_sign_and_axes():
    """Of one phase the von Mises stress of the amplitudes, whatever the mean; of a stress whose
    axes turn, with a constant equivalent stress, that same value; of the second order alone the
    same as of the first."""
    rng = np.random.default_rng(4)
    mean, amplitude = rng.standard_normal((2, 10, 6))
    for turn in (1, 1j, np.exp(1j)):
        assert np.allclose(
            alternating_stress(np.stack([mean, turn * amplitude], axis=2)), von_mises(amplitude)
        )
    rotating = np.zeros((1, 6, 2), dtype=complex)
    rotating[0, [0, 1, 3], 1] = 1, -1, 1j  # cos, -cos and sin of pure shear
    assert np.allclose(alternating_stress(rotating), np.sqrt(3))
    twice = np.stack([mean, 0 * mean, amplitude], axis=2)
    assert np.allclose(alternating_stress(twice), von_mises(amplitude))
