"""Reduction: statics exact, frequencies from above and converging, rigid motions kept, one answer
by both solvers."""

import itertools

import numpy as np
import pytest
import scipy.linalg as sl

from tests.modal.blocks import block
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.eigen import Factor, SingularStiffness
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import checked
from tipdamp.modal.solvers import petsc

pytest.importorskip("dolfinx")
STEEL = Material(E=207e9, nu=0.3, density=7850.0)


@pytest.fixture(scope="module")
def body(bar):
    return elastic_body(bar, STEEL, "bar", clamp="clamp")


@pytest.fixture(scope="module")
def free_body(bar):
    return elastic_body(bar, STEEL, "bar", free=True)


def test_statics_of_the_masters_is_exact(body, bar):
    """Forces on masters and, condensed, on interior nodes: same master displacements as the full
    model."""
    reduction = craig_bampton(body, bar.group("tip"), 0)
    inner = int(bar.node[np.argmin(np.abs(bar.position - [0.05, 0.01, 0.005]).sum(axis=1))])
    nodes = [bar.group("tip")[3], inner]
    forces = np.array([[10.0, -5.0, 3.0], [0.0, 7.0, -20.0]])
    full = np.zeros(body.dofs)
    for n, f in zip(nodes, forces, strict=True):
        full[body.node_dofs([n])] = f
    exact = np.linalg.solve(body.K.toarray(), full)[reduction.boundary]
    reduced = np.linalg.solve(reduction.model.K, reduction.condense(nodes, forces))[: len(exact)]
    assert reduced == pytest.approx(exact, rel=1e-8, abs=1e-8 * np.abs(exact).max())


def test_statics_alone_looks_for_no_mode(body, bar, monkeypatch):
    """One factorisation and the static shapes: the same matrices as with the bound, which fewer
    modes would need."""
    masters = bar.group("tip")
    whole, counted = craig_bampton(body, masters, 0), []
    monkeypatch.setattr(Factor, "modes", lambda *_: counted.append(1))
    statics = craig_bampton(body, masters, 0, bound=False)
    assert np.array_equal(statics.model.K, whole.model.K) and np.array_equal(
        statics.model.M, whole.model.M
    )
    assert statics.truncation is None and not counted
    with pytest.raises(InputError, match="bound = True"):
        statics.fewer(0)


def test_frequencies_fall_towards_the_full_model(body, bar):
    full = sl.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True, subset_by_index=(0, 4))
    previous = np.full(5, np.inf)
    for modes in (2, 6, 20):
        model = craig_bampton(body, bar.group("tip"), modes).model
        lam = sl.eigh(model.K, model.M, eigvals_only=True, subset_by_index=(0, 4))
        assert (lam >= full * (1 - 1e-9)).all() and (lam <= previous * (1 + 1e-9)).all()
        previous = lam
    assert previous == pytest.approx(full, rel=1e-3)


def test_all_modes_give_the_full_model_back(body, bar):
    masters = bar.group("tip")
    interior = body.dofs - len(body.node_dofs(masters))
    model = craig_bampton(body, masters, interior).model
    lam = sl.eigh(model.K, model.M, eigvals_only=True)
    full = sl.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)
    assert lam[:50] == pytest.approx(full[:50], rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("with_petsc", [True, False])
def test_all_nodes_as_masters_is_the_body_itself(body, bar, monkeypatch, with_petsc):
    """Nothing is left to condense: K and M come back entry by entry, statics and recovery hold."""
    if not with_petsc:
        monkeypatch.setattr(petsc, "start", lambda: None)
    masters = body.node[np.unique(body.dof_node)]
    f = np.random.default_rng(0).standard_normal(body.dofs)
    for asked in ({"modes": 0}, {"modes": 0, "bound": False}, {"below_hz": 1e4, "loads": [f]}):
        reduction = craig_bampton(body, masters, **asked)
        K, M = (A[reduction.boundary][:, reduction.boundary].toarray() for A in (body.K, body.M))
        for found, exact in ((reduction.model.K, K), (reduction.model.M, M)):
            np.testing.assert_allclose(found, exact, rtol=1e-14, atol=1e-15 * np.abs(exact).max())
        assert (
            reduction.Psi.shape == (0, body.dofs)
            and reduction.Phi.shape == (0, 0)
            and not len(reduction.omega)
        )
        q = np.linalg.solve(reduction.model.K, reduction.condense_dofs(f))
        exact = np.linalg.solve(body.K.toarray(), f)
        assert reduction.recover(q)[body.dof_node, body.dof_direction] == pytest.approx(
            exact, rel=1e-8, abs=1e-8 * np.abs(exact).max()
        )
    with pytest.raises(InputError, match="3 modes asked for: must be between 0 and the 0 dofs"):
        craig_bampton(body, masters, 3)


def test_free_body_keeps_rigid_motions_and_mass(free_body, bar):
    reduction = craig_bampton(free_body, bar.group("tip"), 10)
    b = len(reduction.boundary)
    R = free_body.rigid_motions()[reduction.boundary]
    K, M = reduction.model.K[:b, :b], reduction.model.M[:b, :b]
    assert np.abs(K @ R).max() < 1e-9 * np.abs(K).max() * np.abs(R).max()
    mass = 7850 * 0.1 * 0.02 * 0.01  # rho times the volume of the bar
    assert np.diag(R[:, :3].T @ M @ R[:, :3]) == pytest.approx(np.full(3, mass), rel=1e-8)


@pytest.mark.slow
def test_two_of_three_masters_are_an_axis(free_body):
    """Two masters held are an axis: a dof of the third that turns the body about it meets no
    stiffness, but rounding. Any three of the eight corners keep the six rigid motions."""
    low, high = free_body.position.min(axis=0), free_body.position.max(axis=0)
    corners = [
        free_body.node[np.linalg.norm(free_body.position - place, axis=1).argmin()]
        for place in itertools.product(*zip(low, high, strict=True))
    ]
    for masters in itertools.combinations(corners, 3):
        model = craig_bampton(free_body, masters, 0).model
        lam = sl.eigh(model.K, model.M, eigvals_only=True)
        assert (np.abs(lam[:6]) < 1e-9 * lam[-1]).all() and lam[6] > 1e-6 * lam[-1], masters


@pytest.mark.filterwarnings("error")
def test_three_masters_in_a_plane_have_no_sign():
    """Across their plane they move rigidly alone, with no stiffness but rounding: no warning of a
    negative one."""
    mesh = block("hexahedron", (8, 8, 4), size=(0.07, 0.05, 0.007))
    body = elastic_body(mesh, Material(E=207e9, nu=0.3, density=7850.0), "plate", free=True)
    corners = [
        mesh.node[np.linalg.norm(mesh.position - corner, axis=1).argmin()]
        for corner in ([0, 0, 0], [0.07, 0, 0], [0, 0.05, 0])
    ]
    model = craig_bampton(body, corners, 4, bound=False).model
    assert np.abs(model.K[2]).max() < 1e-12 * model.K.max()
    pushed = model.K.copy()
    pushed[0, 0] *= -1
    with pytest.warns(UserWarning, match="K is indefinite"):
        ReducedModel.from_matrices(model.M, pushed, body=model.body)


def test_recovery_moves_every_node_of_a_rigid_body(free_body, bar):
    reduction = craig_bampton(free_body, bar.group("tip"), 3)
    q = np.concatenate([free_body.rigid_motions()[reduction.boundary, 5], np.zeros(3)])
    arm = bar.position - bar.position.mean(axis=0)
    assert reduction.recover(q) == pytest.approx(np.cross([0, 0, 1], arm), abs=1e-9)


def test_scipy_gives_the_same_as_petsc(body, bar, monkeypatch):
    first = craig_bampton(body, bar.group("tip"), 8)
    monkeypatch.setattr(petsc, "start", lambda: None)
    second = craig_bampton(body, bar.group("tip"), 8)
    assert second.omega == pytest.approx(first.omega, rel=1e-9)
    assert np.abs(second.model.K - first.model.K).max() < 1e-10 * np.abs(first.model.K).max()


def test_singular_stiffness_is_not_taken_for_solved(free_body):
    with pytest.raises(SingularStiffness):
        Factor(free_body.K).solve(np.ones(free_body.dofs))


def test_masters_must_exist_and_hold_a_free_body(body, free_body, bar):
    for wrong in (999999, bar.group("clamp")[0]):
        with pytest.raises(InputError, match=f"master node {wrong} does not exist or is clamped"):
            craig_bampton(body, [wrong], 3)
    with pytest.raises(InputError, match="its master nodes do not hold it"):
        craig_bampton(free_body, bar.group("tip")[:2], 3)


def test_bodies_with_the_same_name_are_refused(body, bar):
    model = craig_bampton(body, bar.group("tip"), 2).model
    with pytest.raises(InputError, match="different names"):
        assemble(model, model)


def two_equal_bars(bar, order):
    """Two bars apart from each other as one body, its nodes numbered in some order."""
    n = len(bar.node)
    place = np.vstack([bar.position, bar.position + [0, 0.1, 0]])[order]
    turn = np.argsort(order)
    cells = {kind: turn[np.vstack([c, c + n])] for kind, c in bar.cells.items()}
    groups = {
        name: np.arange(1, 2 * n + 1)[turn[np.concatenate([at, at + n])]]
        for name, at in ((g, bar.index(bar.group(g))) for g in ("clamp", "tip"))
    }
    number = {kind: np.arange(len(c)) for kind, c in cells.items()}
    return checked(
        Mesh(
            np.arange(1, 2 * n + 1),
            place,
            cells,
            groups,
            source="bars",
            number=number,
            cell_groups={},
        )
    )


def test_equal_modes_are_not_parted(bar, caplog):
    """Two equal blades: of an odd number of modes the last one has a twin, which is kept, so that
    the model does not depend on the numbering; and the bound is that of the next pair."""
    caplog.set_level("INFO", "modal")
    found, n = [], len(bar.node)
    for order in (np.arange(2 * n), np.random.default_rng(4).permutation(2 * n)):
        mesh = two_equal_bars(bar, order)
        body = elastic_body(mesh, STEEL, "bars", clamp="clamp")
        part = craig_bampton(body, mesh.group("tip"), 5)
        found.append(sl.eigh(part.model.K, part.model.M, eigvals_only=True))
        assert len(part.mode_omega) == 6 and part.truncation.omega[0] > 1.001 * part.mode_omega[-1]
        assert [part.whole_cluster(k) for k in range(7)] == [0, 2, 2, 4, 4, 6, 6]
    assert found[1] == pytest.approx(found[0], rel=1e-7)
    assert "6 modes in place of 5" in caplog.text
