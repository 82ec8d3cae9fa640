"""Assembled bodies against closed forms: tension, mass, rigid motions, beam frequency, one answer
on all cell types."""

import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import rigid_modes
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.readers.dispatch import read_mesh

from .conftest import HEIGHT, LENGTH, WIDTH, make_bar

pytest.importorskip("dolfinx")
STEEL = Material(E=207e9, nu=0.3, density=7850.0)


def test_uniform_strain_is_exact(bar):
    """Patch test: a linear displacement field has the strain energy of uniform strain, whatever the
    mesh."""
    body = elastic_body(bar, STEEL, "bar", free=True)
    strain = np.array([[1e-3, 2e-4, -3e-4], [2e-4, -5e-4, 1e-4], [-3e-4, 1e-4, 7e-4]])
    u = (bar.position @ strain).ravel()
    lame, shear = STEEL.E * 0.3 / (1.3 * 0.4), STEEL.E / 2.6  # textbook moduli for nu = 0.3
    density = 0.5 * lame * np.trace(strain) ** 2 + shear * np.sum(strain**2)
    assert 0.5 * u @ body.K @ u == pytest.approx(density * LENGTH * WIDTH * HEIGHT, rel=1e-10)


def test_free_body_has_mass_and_rigid_modes(bar):
    body = elastic_body(bar, STEEL, "bar", free=True)
    assert body.mass() == pytest.approx(np.full(3, 7850 * LENGTH * WIDTH * HEIGHT), rel=1e-10)
    assert rigid_modes(body) == 6


def test_first_bending_mode_of_a_slender_bar(tmp_path):
    """Cantilever: f = 1.8751^2 / (2 pi L^2) sqrt(EI / rho A) = 838.4 Hz for a thin beam; a solid
    one is 0.1-1 % off (shear, clamped section)."""
    body = elastic_body(
        read_mesh(make_bar(tmp_path / "b.msh", cells=12)), STEEL, "bar", clamp="clamp"
    )
    from tipdamp.modal.eigen import Factor

    omega, _ = Factor(body.K).lowest_modes(body.M, 1)
    beam = 1.8751041**2 / LENGTH**2 * np.sqrt(STEEL.E * HEIGHT**2 / 12 / STEEL.density)
    assert omega[0] == pytest.approx(beam, rel=0.01)


@pytest.mark.parametrize("order, hexahedra, tolerance", [(2, False, 0.01), (2, True, 0.006)])
def test_cell_types_agree(tmp_path, bar, order, hexahedra, tolerance):
    """Tetrahedra and hexahedra of second order have the same first frequency up to the error of the
    coarser mesh (0.4 % measured between 6 and 10 hexahedra along the bar)."""
    from tipdamp.modal.eigen import Factor

    other = read_mesh(make_bar(tmp_path / "b.msh", order, hexahedra, cells=10))
    hz = [
        Factor(b.K).lowest_modes(b.M, 1)[0][0]
        for b in (elastic_body(m, STEEL, "bar", clamp="clamp") for m in (bar, other))
    ]
    assert hz[1] == pytest.approx(hz[0], rel=tolerance)


@pytest.mark.parametrize(
    "values, name",
    [
        (dict(E=-1.0, nu=0.3, density=1.0), "E"),
        (dict(E=1.0, nu=0.5, density=1.0), "nu"),
        (dict(E=1.0, nu=0.3, density=0.0), "density"),
    ],
)
def test_material_out_of_range(values, name):
    with pytest.raises(InputError, match=f"material: {name} = "):
        Material(**values)
