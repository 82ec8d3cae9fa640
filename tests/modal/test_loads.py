"""Loads: resultants and moments in closed form, patch tests, and a spinning bar."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from tests.boxes import block  # noqa: E402
from tipdamp.hbm.errors import InputError  # noqa: E402
from tipdamp.modal.craig_bampton import craig_bampton  # noqa: E402
from tipdamp.modal.eigen import Factor  # noqa: E402
from tipdamp.modal.elasticity import Material, elastic_body  # noqa: E402
from tipdamp.modal.loads import Rotation, centrifugal, gravity, point_force, pressure, traction  # noqa: E402

STEEL = Material(207e9, 0.3, 7850.0)
L, B, H = 0.10, 0.02, 0.01


def nodal(body, force):
    out = np.zeros((len(body.node), 3))
    out[body.dof_node, body.dof_direction] = force
    return out


@pytest.fixture(scope="module", params=[1, 2], ids=["hex8", "hex27"])
def bar(request):
    mesh = block(np.linspace(0, L, 9), np.linspace(0, B, 5), np.linspace(0, H, 3), request.param)
    return (
        mesh,
        elastic_body(mesh, STEEL, "bar", clamp="x0"),
        elastic_body(mesh, STEEL, "bar", free=True),
    )


def test_resultants(bar):
    """Pressure p on an end face: p b h inwards at its centre; traction t b h; weight rho V g; point
    force as given."""
    mesh, _, free = bar
    f = nodal(free, pressure(free, mesh, "x1", 2e6))
    assert f.sum(axis=0) == pytest.approx([-2e6 * B * H, 0, 0], abs=1e-9)
    assert np.cross(mesh.position, f).sum(axis=0) == pytest.approx(
        np.cross([L, B / 2, H / 2], [-2e6 * B * H, 0, 0]), abs=1e-9
    )
    assert nodal(free, traction(free, mesh, "z1", [3e4, 0, 1e4])).sum(axis=0) == pytest.approx(
        np.array([3e4, 0, 1e4]) * L * B, rel=1e-12
    )
    assert nodal(free, gravity(free, [0, 0, -9.81])).sum(axis=0) == pytest.approx(
        [0, 0, -9.81 * 7850 * L * B * H], abs=1e-12
    )
    assert nodal(free, point_force(free, "y1", [1, 2, 3])).sum(axis=0) == pytest.approx([1, 2, 3])


def test_uniform_tension_is_reproduced(bar):
    """A uniaxial stress state is in the element: u_x = t x / E to rounding, on every node (patch
    test)."""
    mesh, _, free = bar
    load = traction(free, mesh, "x1", [1e6, 0, 0]) + traction(free, mesh, "x0", [-1e6, 0, 0])
    corner = {(0, 0), (0, 1), (0, 2)}  # hold six dofs that the state leaves at rest or free to turn
    ends = {tuple(p): i for i, p in enumerate(np.round(mesh.position, 9).tolist())}
    corner |= {(ends[0.0, B, 0.0], 0), (ends[0.0, B, 0.0], 2), (ends[0.0, 0.0, H], 0)}
    kept = np.array(
        [(n, d) not in corner for n, d in zip(free.dof_node, free.dof_direction, strict=True)]
    )
    u = np.zeros(free.dofs)
    u[kept] = Factor(free.K[kept][:, kept]).solve(load[kept])
    assert nodal(free, u)[:, 0] == pytest.approx(1e6 * mesh.position[:, 0] / STEEL.E, abs=1e-13)


def test_triangles_carry_their_share():
    """One quadratic tetrahedron: uniform pressure goes to the mid-edges, a third each; corners
    carry nothing."""
    from tipdamp.modal.mesh import Mesh

    corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    middle = [
        (corner[a] + corner[b]) / 2 for a, b in ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
    ]
    mesh = Mesh(
        np.arange(1, 11),
        np.vstack([corner, middle]),
        {"tetra10": np.arange(10)[None]},
        {"floor": np.array([1, 2, 3, 5, 6, 7])},
        source="one",
    )
    body = elastic_body(mesh, STEEL, "one", free=True)
    # area 1/2: 3 N upwards, 1 N on each mid-edge
    f = nodal(body, pressure(body, mesh, "floor", 6.0))
    assert f[:, 2] == pytest.approx([0, 0, 0, 0, 1, 1, 1, 0, 0, 0], abs=1e-12)
    assert f[:, :2] == pytest.approx(0, abs=1e-12)


def test_faces_need_a_surface(bar):
    mesh, body, _ = bar
    mesh.groups["line"] = mesh.node[:3]
    with pytest.raises(InputError, match="'line' make up no face"):
        pressure(body, mesh, "line", 1.0)


def test_spinning_bar(bar):
    """Clamped at r = 0, nu = 0: tip stretch rho speed^2 L^3 / 3E (bar theory), and the clamp
    carries the whole force.

    The load at nodes next to the clamp needs the coupling to the clamped ones: it is that of the
    same free bar."""
    mesh, _, free = bar
    body = elastic_body(mesh, Material(207e9, 0.0, 7850.0), "bar", clamp="x0")
    rotation = Rotation(1000.0, (0, 0, 1), (0, B / 2, H / 2))
    arm_free = centrifugal(body, rotation)
    away = mesh.position[:, 0] > 0
    assert nodal(body, arm_free)[away] == pytest.approx(
        nodal(free, centrifugal(free, rotation))[away], abs=1e-9
    )
    u = nodal(body, Factor(body.K).solve(arm_free))
    tip = mesh.position[:, 0] == L
    assert u[tip, 0].mean() == pytest.approx(7850 * 1000**2 * L**3 / (3 * 207e9), rel=2e-3)
    reduction = craig_bampton(body, mesh.group("x1"), 0)
    q = np.linalg.solve(reduction.model.K, reduction.condense_dofs(arm_free))
    assert reduction.recover(q)[tip] == pytest.approx(u[tip], rel=1e-8, abs=1e-16)


def test_centrifugal_force_of_a_free_bar(bar):
    """m speed^2 r at the centre of mass, in the plane of rotation, whatever the axis."""
    _, _, free = bar
    rotation = Rotation(300.0, (0, 1, 1), (0.2, 0, 0))
    k = np.array([0, 1, 1]) / np.sqrt(2)
    r = np.array([L / 2 - 0.2, B / 2, H / 2])
    expected = 7850 * L * B * H * 300.0**2 * (r - k * (k @ r))
    assert nodal(free, centrifugal(free, rotation)).sum(axis=0) == pytest.approx(
        expected, rel=1e-10
    )


def test_rotation_is_checked():
    with pytest.raises(InputError, match="axis must not be zero"):
        Rotation(10.0, (0, 0, 0))


@pytest.mark.parametrize("value", [np.nan, np.inf, [1.0, 2.0]])
def test_values_that_are_no_load(bar, value):
    """Refused where they come in: beyond it nan would be a load case of nan."""
    mesh, _, free = bar
    for name, load in (
        ("pressure", lambda: pressure(free, mesh, "x1", value)),
        ("traction", lambda: traction(free, mesh, "x1", value)),
        ("force", lambda: point_force(free, "x1", value)),
        ("acceleration", lambda: gravity(free, value)),
        ("acceleration", lambda: gravity(free, [0.0, np.nan, 0.0])),
    ):
        with pytest.raises(
            InputError, match=f"^{name} = .* must be (three finite numbers|a finite number)$"
        ):
            load()
