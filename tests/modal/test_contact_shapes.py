"""Contact points without masters: statics exact, frequencies within their bound, dependent weights,
fewer modes."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from tests.boxes import block
from tipdamp.hbm.points import ContactPoints
from tipdamp.modal.contact_shapes import traction_cells
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.truncation import error_bound, join, rounding

pytest.importorskip("dolfinx")
STEEL = Material(E=207e9, nu=0.3, density=7850.0)
FIRST = 10**6
POINTS = 7
SPRING = 3e8
# of the points: shares of a unit force
CELLS = sp.csr_matrix(np.repeat(np.eye(3) / [3, 2, 2], [3, 2, 2], axis=0))


def with_points(body, face, seed):
    """Points that move as random means of the nodes of a face; the last one follows from the two
    before it."""
    nodes, rng = body.group(face), np.random.default_rng(seed)
    share = rng.uniform(0, 1, (POINTS, len(nodes))) * (rng.uniform(size=(POINTS, len(nodes))) < 0.5)
    share /= share.sum(axis=1)[:, None]
    share[-1] = 0.25 * share[-2] + 0.75 * share[-3]
    motion = sp.kron(share, np.eye(3), format="csr") @ body.motion_of(body.name, nodes)
    return replace(
        body, points=ContactPoints(FIRST + np.arange(POINTS), np.zeros((POINTS, 3)), motion)
    )


@pytest.fixture(scope="module")
def bodies():
    x, y, z = np.linspace(0, 0.08, 7), np.linspace(0, 0.02, 5), np.linspace(0, 0.01, 3)
    blade = elastic_body(block(x, y, z), STEEL, "blade", clamp="x0")
    damper = elastic_body(block(0.5 * x, y, z), STEEL, "damper", free=True)
    return with_points(blade, "z1", 1), with_points(damper, "z0", 2)


@pytest.fixture(scope="module")
def full(bodies):
    """(K, M, B) of both bodies side by side, B the relative motion of the points."""
    K, M = (sl.block_diag(*(vars(b)[name].toarray() for b in bodies)) for name in "KM")
    return K, M, np.hstack([-bodies[0].points.motion.toarray(), bodies[1].points.motion.toarray()])


def reduced(bodies, modes):
    parts = [craig_bampton(body, [], n) for body, n in zip(bodies, modes, strict=True)]
    model = assemble(*(p.model for p in parts))
    B = model.motion_of("damper", FIRST + np.arange(POINTS)) - model.motion_of(
        "blade", FIRST + np.arange(POINTS)
    )
    return parts, model, B.toarray()


def condensed(parts, bodies, f):
    first = bodies[0].dofs
    return np.r_[parts[0].condense_dofs(f[:first]), parts[1].condense_dofs(f[first:])]


@pytest.mark.parametrize("modes", [(0, 0), (12, 9)])
def test_relative_motion_is_exact_in_statics(bodies, full, modes):
    """Under loads anywhere, with the damper held by the contact alone, and under forces on the
    points."""
    K, _, B = full
    parts, model, B_r = reduced(bodies, modes)
    rng = np.random.default_rng(5)
    spring = SPRING * rng.uniform(0.1, 1, len(B))
    for f in (rng.standard_normal(len(K)), B.T @ rng.standard_normal(len(B))):
        exact = B @ np.linalg.solve(K + B.T * spring @ B, f)
        found = B_r @ np.linalg.solve(model.K + B_r.T * spring @ B_r, condensed(parts, bodies, f))
        assert found == pytest.approx(exact, rel=0, abs=1e-9 * np.abs(exact).max())
    # a force that the dependent point takes is that of the other two
    compliance = [
        B @ np.linalg.solve(K + B.T * spring @ B, B.T),
        B_r @ np.linalg.solve(model.K + B_r.T * spring @ B_r, B_r.T),
    ]
    assert compliance[1] == pytest.approx(
        compliance[0], rel=0, abs=1e-9 * np.abs(compliance[0]).max()
    )


def test_dependent_points_bring_no_shape(bodies):
    """Three forces of the last point follow from those before: as many shapes as the weights have
    rank."""
    for body in bodies:
        part = craig_bampton(body, [], 3)
        inside = body.points.motion[:, part.interior].toarray()
        assert part.contact_shapes == np.linalg.matrix_rank(inside) == 3 * (POINTS - 1)


@pytest.mark.parametrize("nearly", [1e-3, 1e-5, 1e-6, 1e-8])
def test_points_that_nearly_follow_from_others(bodies, full, nearly):
    """The last point differs from what it follows from by little: statics stays exact, shapes and
    masses are those of all forces."""
    changed = []
    for body in bodies:
        motion = body.points.motion.toarray()
        node = body.group("z1" if body.name == "blade" else "z0")[-1:]
        motion[-3:] = (1 - nearly) * motion[-3:] + nearly * body.motion_of(body.name, node)
        changed.append(replace(body, points=replace(body.points, motion=sp.csr_matrix(motion))))
    parts, model, B_r = reduced(changed, (3, 2))
    B = np.hstack([-changed[0].points.motion.toarray(), changed[1].points.motion.toarray()])
    f = np.random.default_rng(5).standard_normal(len(full[0]))
    exact = B @ np.linalg.solve(full[0] + SPRING * B.T @ B, f)
    found = B_r @ np.linalg.solve(model.K + SPRING * B_r.T @ B_r, condensed(parts, changed, f))
    assert found == pytest.approx(exact, rel=0, abs=1e-9 * np.abs(exact).max())
    for part in parts:
        shapes = part.Phi[:, : part.contact_shapes]
        M = part.body.M[part.interior][:, part.interior]
        assert part.contact_shapes == 3 * POINTS
        assert shapes.T @ (M @ shapes) == pytest.approx(np.eye(3 * POINTS), abs=1e-9)


def test_a_free_damper_floats(bodies):
    """Its six rigid motions: no stiffness, and the motion of the points that they are."""
    part, body = craig_bampton(bodies[1], [], 5), bodies[1]
    R = np.zeros((part.model.size, 6))
    R[: len(part.boundary)] = body.rigid_motions()[part.boundary]
    assert np.abs(part.model.K @ R).max() < 1e-11 * np.abs(part.model.K).max()
    exact = body.points.motion @ body.rigid_motions()
    assert part.model.points["damper"].motion @ R == pytest.approx(exact, rel=0, abs=1e-10)
    assert R[:, :3].T @ part.model.M @ R[:, :3] == pytest.approx(
        np.diag(body.mass()), rel=1e-9, abs=1e-12
    )


@pytest.mark.parametrize("modes", [(0, 0), (4, 3), (25, 20)])
def test_stuck_frequencies_are_within_their_bound(bodies, full, modes):
    """Against the full pencil, for soft and stiff springs on the points; near the error where that
    is small."""
    K, M, B = full
    parts, model, B_r = reduced(bodies, modes)
    left_out, tight = join(*(p.truncation for p in parts)), 0
    for k in (1e-2 * SPRING, SPRING, 1e3 * SPRING):
        exact = np.sqrt(sl.eigh(K + k * B.T @ B, M, eigvals_only=True)[:10])
        stuck = model.K + k * B_r.T @ B_r
        omega = np.sqrt(sl.eigh(stuck, model.M, eigvals_only=True)[:10])
        true, bound = omega / exact - 1, error_bound(stuck, model.M, left_out, omega)
        noise = 2 * rounding(K + k * B.T @ B, M, exact)  # of the pencil, and of the springs in it
        assert (true >= -noise).all() and (bound >= true - noise).all()
        small = (true < 0.01) & (true > 1e-7) & (omega < 0.5 * left_out.omega.min())
        assert (bound[small] < 1.5 * true[small]).all()
        tight += small.sum()
    assert tight or modes[0] < 25


def test_fewer_modes_are_the_reduction_with_fewer_modes(bodies):
    """The shapes are made again: they were orthogonal to the modes that are dropped."""
    for body in bodies:
        many, few = craig_bampton(body, [], 20), craig_bampton(body, [], 6)
        cut = many.fewer(6)
        assert (cut.contact_shapes, len(cut.mode_omega)) == (few.contact_shapes, 6)
        assert cut.omega == pytest.approx(few.omega, rel=1e-6)
        W = [p.model.points[body.name].motion.toarray() for p in (cut, few)]
        b = len(cut.boundary)
        static = [(w[:, b:] / p.omega**2 @ w[:, b:].T) for w, p in zip(W, (cut, few), strict=True)]
        assert static[0] == pytest.approx(static[1], rel=1e-9, abs=1e-9 * static[1].max())
        f = np.random.default_rng(3).standard_normal(body.dofs)
        motion = [
            w @ np.linalg.solve(p.model.K + SPRING * (w.T @ w), p.condense_dofs(f))
            for w, p in zip(W, (cut, few), strict=True)
        ]
        assert motion[0] == pytest.approx(motion[1], rel=1e-8)
        assert np.sort(sl.eigvalsh(cut.truncation.G[0])) == pytest.approx(
            np.sort(sl.eigvalsh(few.truncation.G[0])),
            rel=1e-5,
            abs=1e-6 * np.abs(few.truncation.G[0]).max(),
        )


def grid(n, m, seed=None):
    """Points of a rectangle twice as long as wide, in rows or at random, in the plane y = 0."""
    if seed is None:
        x, z = np.meshgrid(np.linspace(0, 2, n), np.linspace(0, 1, m), indexing="ij")
        return np.column_stack([x.ravel(), np.zeros(n * m), z.ravel()])
    return np.random.default_rng(seed).uniform(0, 1, (n * m, 3)) * [2, 0, 1]


@pytest.mark.parametrize("seed", [None, 3])
def test_cells_of_tractions(seed):
    """Each point in one cell of its side; cells of alike weight, and hardly longer than wide."""
    x = grid(24, 12, seed)
    x = np.vstack([x, x + [0, 1, 0]])
    weight = np.random.default_rng(1).uniform(0.5, 1, len(x))
    side = np.repeat(["a", "b"], len(x) // 2)
    T = traction_cells(x, weight, side, 40)
    cell = T.indices
    assert T.shape == (len(x), 40) and (np.diff(T.indptr) == 1).all()
    assert np.asarray(T.sum(axis=0)) == pytest.approx(np.ones((1, 40)))
    assert T.data == pytest.approx(weight / np.bincount(cell, weight)[cell])
    assert all(len(set(side[cell == k])) == 1 for k in range(40))
    mean = weight.sum() / 40
    assert np.bincount(cell, weight).max() < 2 * mean and np.bincount(cell, weight).min() > mean / 3
    long, wide = np.transpose([np.sort(np.ptp(x[cell == k], axis=0))[:0:-1] for k in range(40)])
    assert np.median(long / np.maximum(wide, 1e-9)) < 2
    assert traction_cells(x, weight, side, 1).shape[1] == 2  # one for each side
    assert traction_cells(x, weight, side, len(x)).shape[1] == len(x)


@pytest.mark.parametrize("most", [3, 5, 8, 23])
def test_cells_of_a_square_do_not_hang_on_rounding(most):
    """Equal weights, square cells, and rows of points at one place along them: ties, whatever the
    last digits are."""
    random, side = np.random.default_rng(most), np.zeros(81)
    x = grid(9, 9, None) * [0.5, 0, 1]
    cells = [
        traction_cells(
            x * (1 + 1e-15 * random.normal(size=x.shape)),
            1 + 1e-15 * random.normal(size=81),
            side,
            most,
        ).indices
        for _ in range(4)
    ]
    assert all((one == cells[0]).all() for one in cells[1:]) and len(set(cells[0])) == most


def test_a_cell_for_each_point(bodies):
    """The shapes of the points themselves."""
    for body in bodies:
        one = craig_bampton(body, [], 3)
        two = craig_bampton(body, [], 3, tractions=sp.identity(POINTS, format="csr"))
        assert (
            two.omega == pytest.approx(one.omega, rel=1e-12)
            and two.contact_shapes == one.contact_shapes
        )


def test_tractions_on_cells_are_exact_in_statics(bodies, full):
    """Under loads anywhere the mean motion of the cells, the damper held on springs that act on
    these means; springs on the points are met too stiffly, never too softly, and less so with
    shapes of every point."""
    K, M, B = full
    parts = [craig_bampton(body, [], 4, tractions=CELLS) for body in bodies]
    assert [part.contact_shapes for part in parts] == [9, 9]
    model = assemble(*(part.model for part in parts))
    B_r = (
        model.motion_of("damper", FIRST + np.arange(POINTS))
        - model.motion_of("blade", FIRST + np.arange(POINTS))
    ).toarray()
    mean = np.kron(CELLS.toarray().T, np.eye(3))
    k, f = SPRING * np.ones(9), np.random.default_rng(5).standard_normal(len(K))
    exact = mean @ B @ np.linalg.solve(K + (mean @ B).T * k @ (mean @ B), f)
    found = (
        mean
        @ B_r
        @ np.linalg.solve(model.K + (mean @ B_r).T * k @ (mean @ B_r), condensed(parts, bodies, f))
    )
    assert found == pytest.approx(exact, rel=0, abs=1e-9 * np.abs(exact).max())
    # springs on the points: stiffer than they are, and less so with more cells
    hz = [sl.eigh(K + SPRING * B.T @ B, M, eigvals_only=True)[:3]]
    for tractions in (CELLS, None):
        model = assemble(
            *(craig_bampton(body, [], 20, tractions=tractions).model for body in bodies)
        )
        B_r = (
            model.motion_of("damper", FIRST + np.arange(POINTS))
            - model.motion_of("blade", FIRST + np.arange(POINTS))
        ).toarray()
        hz.append(sl.eigh(model.K + SPRING * B_r.T @ B_r, model.M, eigvals_only=True)[:3])
    assert (hz[1] >= hz[2]).all() and (hz[2] >= hz[0] * (1 - 1e-9)).all()


def test_fewer_modes_beside_tractions(bodies):
    """The contact shapes are made again, of the same tractions."""
    many = craig_bampton(bodies[0], [], 12, tractions=CELLS)
    few = craig_bampton(bodies[0], [], 5, tractions=CELLS)
    assert many.fewer(5).contact_shapes == few.contact_shapes == 9
    hz = [
        np.sqrt(sl.eigh(part.model.K, part.model.M, eigvals_only=True))
        for part in (many.fewer(5), few)
    ]
    assert hz[0] == pytest.approx(hz[1], rel=1e-9)
