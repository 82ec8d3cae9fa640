"""Rotating cantilever: published frequencies of a uniform beam, and the same from one-dimensional
theory."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from tests.boxes import block  # noqa: E402
from tests.modal import blocks  # noqa: E402
from tipdamp.hbm.errors import InputError  # noqa: E402
from tipdamp.modal.craig_bampton import craig_bampton  # noqa: E402
from tipdamp.modal.eigen import Factor  # noqa: E402
from tipdamp.modal.elasticity import Material, elastic_body  # noqa: E402
from tipdamp.modal.elements.isoparametric import stress_stiffness  # noqa: E402
from tipdamp.modal.loads import Rotation  # noqa: E402
from tipdamp.modal.stiffening import geometric_stiffness, rotating_body, spin_softening  # noqa: E402

# Flapping of a uniform cantilever with hub radius 0: omega sqrt(m L^4/EI) of the first two modes by
# the speed eta = Omega sqrt(m L^4/EI).   Wright, Smith, Thresher, Wang: Vibration modes of
# centrifugally stiffened beams, J. Applied Mechanics 49 (1982) 197-202; Hodges and Rutkowski, AIAA
# J. 19 (1981) 1459. Each value is confirmed below.
FLAP = {
    0: (3.5160, 22.0345),
    1: (3.6816, 22.1810),
    2: (4.1373, 22.6149),
    3: (4.7973, 23.3203),
    4: (5.5850, 24.2734),
    5: (6.4495, 25.4461),
    6: (7.3604, 26.8091),
    8: (9.2568, 29.9954),
    10: (11.2023, 33.6404),
    12: (13.1702, 37.6031),
}

L, SIDE = 1.0, 0.01
# nu = 0: a bar in the sense of beam theory, the clamp does not pinch
BEAM = Material(200e9, 0.0, 8000.0)
UNIT = np.sqrt(BEAM.density * SIDE**2 * L**4 / (BEAM.E * SIDE**4 / 12))


def by_polynomials(eta, count=2, terms=14):
    """Ritz with x^2 times Legendre polynomials: integral of w''^2 + eta^2 (1 - x^2)/2 w'^2 over
    that of w^2."""
    from scipy.linalg import eigh

    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = (x + 1) / 2, weight / 2
    shapes = [
        np.polynomial.Polynomial([0, 0, 1])
        * np.polynomial.Legendre.basis(k, [0, 1]).convert(kind=np.polynomial.Polynomial)
        for k in range(terms)
    ]
    w, slope, bend = (np.array([s.deriv(d)(x) if d else s(x) for s in shapes]) for d in range(3))
    K = bend * weight @ bend.T + eta**2 * (slope * weight * (1 - x**2) / 2) @ slope.T
    return np.sqrt(eigh(K, w * weight @ w.T, eigvals_only=True)[:count])


def beam_body():
    mesh = block(
        np.linspace(0, L, 81),
        np.linspace(-SIDE / 2, SIDE / 2, 3),
        np.linspace(-SIDE / 2, SIDE / 2, 3),
        2,
    )
    return mesh, elastic_body(mesh, BEAM, "beam", clamp="x0")


@pytest.fixture(scope="module")
def beam():
    return beam_body()


# beams of quadratic cells; mixture: an upper half of other cells is tied on by shared nodes
QUADRATIC = {
    kind: blocks.block(kind, (60, 2, 2), size=(L, SIDE, SIDE))
    for kind in ("hexahedron20", "wedge15")
}


@pytest.fixture(scope="module", params=QUADRATIC)
def other_beam(request):
    """The same beam of cells that dolfinx 0.5.2 cannot take."""
    mesh = QUADRATIC[request.param]
    return mesh, elastic_body(mesh, BEAM, "beam", clamp="clamp")


def flap_and_lag(beam, eta):
    """First two frequencies out of the plane of rotation (z) and in it (y), times UNIT."""
    mesh, body = beam
    turning = rotating_body(body, mesh, BEAM, Rotation(eta / UNIT, (0, 0, 1), (0, 0, 0)))
    omega, shape = Factor(turning.K).lowest_modes(turning.M, 5)
    part = np.array(
        [np.linalg.norm(shape[body.dof_direction == d], axis=0) for d in range(3)]
    ).argmax(axis=0)
    return omega[part == 2][:2] * UNIT, omega[part == 1][:2] * UNIT


@pytest.mark.parametrize("eta", sorted(FLAP))
def test_one_dimensional_theory_confirms_the_table(eta):
    assert by_polynomials(eta) == pytest.approx(FLAP[eta], abs=1.01e-4)


@pytest.mark.parametrize("eta", [1, 4, 12])
def test_rotating_cantilever(beam, eta):
    """Within 0.1 % of the table (a length of 100 sides leaves 0.02 % to shear and rotary inertia);
    in the plane of rotation omega^2 is lower by eta^2, the softening of a thin beam."""
    flap, lag = flap_and_lag(beam, eta)
    assert flap == pytest.approx(FLAP[eta], rel=1e-3)
    assert lag == pytest.approx(np.sqrt(np.array(FLAP[eta]) ** 2 - eta**2), rel=1e-3)


def test_rotating_cantilever_of_other_cells(other_beam):
    """20-node hexahedra and 15-node wedges against the same table; wedges bend a little stiffer in
    the first digits."""
    for eta in (2, 12):
        flap, lag = flap_and_lag(other_beam, eta)
        assert flap == pytest.approx(FLAP[eta], rel=1e-3)
        assert lag == pytest.approx(np.sqrt(np.array(FLAP[eta]) ** 2 - eta**2), rel=1e-3)


def test_southwell_of_linear_wedges():
    """6-node wedges lock in bending, which leaves the shape and so the stiffening of the first mode
    what it is: 1 %."""
    mesh = blocks.block("wedge", (100, 2, 2), size=(L, SIDE, SIDE))
    beam = mesh, elastic_body(mesh, BEAM, "beam", clamp="clamp")
    still, turning = (flap_and_lag(beam, eta)[0][0] for eta in (1e-6, 4))
    table = FLAP[4][0] ** 2 - FLAP[0][0] ** 2
    assert turning**2 - still**2 == pytest.approx(table, rel=1e-2)


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron", "hexahedron27"])
def test_both_assemblers_agree(kind):
    """On distorted cells under a displacement without symmetry, with a material that contracts."""
    mesh = blocks.block(kind, distort=0.2)
    move = 1e-4 * np.random.default_rng(3).normal(size=mesh.position.shape)
    steel = Material(207e9, 0.3, 7850.0)
    ours = stress_stiffness(mesh.position, kind, mesh.cells[kind], steel.lame, steel.shear, move)
    assert abs(ours - geometric_stiffness(mesh, steel, move)).max() < 1e-11 * abs(ours).max()


@pytest.mark.parametrize("order", [1, 2])
def test_tension_of_a_mixture(order):
    """Hexahedra, wedges and tetrahedra in one mesh under uniform tension: a turn meets tension
    times volume."""
    mesh = blocks.mixture(order, distort=0.2)
    stretch, turn = np.zeros(mesh.position.shape), np.zeros(mesh.position.shape)
    stretch[:, 0], turn[:, 2] = 1e-3 * mesh.position[:, 0], mesh.position[:, 0]
    Kg = geometric_stiffness(mesh, BEAM, stretch)
    assert turn.ravel() @ Kg @ turn.ravel() == pytest.approx(
        BEAM.E * 1e-3 * blocks.volume((4, 2, 2)), rel=1e-10
    )


def test_southwell(beam):
    """omega^2 = omega_0^2 + S Omega^2 with S = 1.193 for the first flapping mode at low speed
    (Southwell and Gough, ARC R&M 766, 1921: 1.19)."""
    flap0, _ = flap_and_lag(beam, 1e-6)
    flap, _ = flap_and_lag(beam, 0.5)
    assert (flap[0] ** 2 - flap0[0] ** 2) / 0.25 == pytest.approx(1.193, abs=2e-3)


def test_tension_of_a_prism_is_the_string_stiffness(beam):
    """Uniform tension sigma: u' K_g u = sigma A L for u_z = x (a rotation meets the string's own
    stiffness)."""
    mesh, _ = beam
    stretch = np.zeros((len(mesh.node), 3))
    stretch[:, 0] = mesh.position[:, 0] * 1e-3
    turn = np.zeros((len(mesh.node), 3))
    turn[:, 2] = mesh.position[:, 0]
    Kg = geometric_stiffness(mesh, BEAM, stretch)
    assert turn.ravel() @ Kg @ turn.ravel() == pytest.approx(BEAM.E * 1e-3 * SIDE**2 * L, rel=1e-10)


def test_softening_is_the_mass_in_the_plane(beam):
    _, body = beam
    S = spin_softening(body, Rotation(10.0, (0, 0, 1)))
    x, z = (body.dof_direction == d for d in (0, 2))
    assert (
        abs(S[x][:, x] - 100 * body.M[x][:, x]).max() < 1e-12 * body.M.max()
        and not S[z].count_nonzero()
    )
    assert abs(S - S.T).max() < 1e-12 * abs(S).max()


def test_free_body_is_refused(beam):
    mesh, _ = beam
    free = elastic_body(mesh, BEAM, "pin", free=True)
    with pytest.raises(InputError, match="'pin' is free"):
        rotating_body(free, mesh, BEAM, Rotation(1.0))


def test_above_the_critical_speed():
    """A short thick block that turns about an axis through its tip: the tip is pressed inwards and
    softens. Up to where that is more than the elastic stiffness it is reduced; beyond, refused by
    name and not as badly held."""
    mesh = blocks.block("hexahedron", (12, 4, 4))
    steel = Material(207e9, 0.3, 7850.0)
    body = elastic_body(mesh, steel, "blade", clamp="clamp")
    for speed, stable in ((3e3, True), (1e4, False), (1e5, False)):
        turning = rotating_body(body, mesh, steel, Rotation(speed, (0, 1, 0), (0.05, 0.05, 0)))
        assert stable == (np.linalg.eigvalsh(turning.K.toarray())[0] > 0)
        if stable:
            assert craig_bampton(turning, mesh.group("tip"), 3).omega.min() > 0
        else:
            with pytest.raises(
                InputError,
                match=f"negative stiffness, .* unstable at this speed \\({speed:g} rad/s",
            ):
                craig_bampton(turning, mesh.group("tip"), 3)
