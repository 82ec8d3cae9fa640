"""The bound of the reduction error: never below the true error, and near it where the error is
small."""

import numpy as np
import pytest
import scipy.linalg as sl

from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.truncation import Truncation, error_bound, join, rounding

from .random_bodies import random_body


def body_of(seed, name="body"):
    """A random body on a line, every dof an x displacement of a node of its own; held by a
    spring."""
    K, M, _ = random_body(seed)
    n = np.arange(K.shape[0])
    return Body.from_matrices(name, K, M, n + 1, np.column_stack([n, 0 * n, 0 * n]), n, 0 * n)


def frequencies(K, M, count):
    return np.sqrt(sl.eigh(K, M, subset_by_index=(0, count - 1), eigvals_only=True))


@pytest.mark.slow
@pytest.mark.parametrize("modes", [0, 3, 20, 60])
@pytest.mark.parametrize("seed", [2, 5, 8])
def test_bound_holds_and_is_tight(seed, modes):
    """Two bodies joined by springs on their masters, against the full pencil."""
    bodies = [body_of(seed, "one"), body_of(seed + 30, "two")]
    masters = np.array([1, 5, 9, 20])
    parts = [craig_bampton(b, masters, modes) for b in bodies]
    model = assemble(*(p.model for p in parts))
    truncation = join(*(p.truncation for p in parts))
    one, two = bodies
    K = sl.block_diag(one.K.toarray(), two.K.toarray())
    M = sl.block_diag(one.M.toarray(), two.M.toarray())
    k, stiff = 3e6, model.K.copy()
    for node in masters:
        for A, i, j in (
            (K, node - 1, one.dofs + node - 1),
            (stiff, model.dofs("one", node)[0], model.dofs("two", node)[0]),
        ):
            A[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    omega = frequencies(stiff, model.M, min(15, model.size))
    exact = frequencies(K, M, len(omega))
    true, bound = omega / exact - 1, error_bound(stiff, model.M, truncation, omega)
    assert (bound >= true - rounding(K, M, exact)).all()  # the full pencil is rounded too
    small = (true < 0.01) & (true > 1e-8) & (omega < 0.5 * truncation.omega.min())
    assert small.sum() >= (modes > 10) * 2 and (bound[small] < 1.5 * true[small]).all()


def test_fewer_modes_are_the_reduction_with_fewer_modes():
    body = body_of(2)
    many, few = craig_bampton(body, [1, 7], 30), craig_bampton(body, [1, 7], 9)
    cut = many.fewer(9)
    for name in ("K", "M"):
        a, b = getattr(cut.model, name), getattr(few.model, name)
        # signs of modes are free
        assert np.abs(np.abs(a) - np.abs(b)).max() < 1e-6 * np.abs(b).max()
    assert cut.truncation.G[0] == pytest.approx(few.truncation.G[0], rel=1e-6)
    assert cut.omega[-1] <= few.truncation.omega[0] <= cut.truncation.omega[0] * (1 + 1e-9)
    with pytest.raises(InputError, match="the reduction holds 30"):
        many.fewer(31)


def test_modes_below_a_frequency():
    body = body_of(5)
    by_number = craig_bampton(body, [1, 7], 12)
    cut_hz = by_number.omega[9:11].mean() / (2 * np.pi)
    by_frequency = craig_bampton(body, [1, 7], below_hz=cut_hz)
    assert by_frequency.omega == pytest.approx(by_number.omega[:10], rel=1e-9)
    assert by_frequency.truncation.omega[0] >= 2 * np.pi * cut_hz
    with pytest.raises(InputError, match="give either a number of modes or the frequency"):
        craig_bampton(body, [1, 7])


def test_no_bound_beyond_the_modes_left_out():
    reduction = craig_bampton(body_of(2), [1, 7], 2)
    omega = frequencies(reduction.model.K, reduction.model.M, 4)
    bound = error_bound(reduction.model.K, reduction.model.M, reduction.truncation, omega)
    assert np.isinf(bound[omega >= reduction.truncation.omega[0]]).all() and np.isfinite(bound[0])


def test_all_modes_leave_nothing_out(tmp_path):
    body = body_of(2)
    reduction = craig_bampton(body, [1, 7], body.dofs - 2)
    assert np.isinf(reduction.truncation.omega).all() and not reduction.truncation.G[0].any()
    K, M = reduction.model.K, reduction.model.M
    omega = frequencies(K, M, 5)
    whole = rounding(body.K.toarray(), body.M.toarray(), omega)
    bound = error_bound(K, M, reduction.truncation, omega)
    assert (bound <= 2 * rounding(K, M, omega) + 4 * whole).all()
    assert rounding(K, M, omega).max() < 1e-11
    again = Truncation.load(reduction.truncation.save(tmp_path / "t.npz"))
    assert np.array_equal(again.G[0], reduction.truncation.G[0]) and again.body.tolist() == ["body"]


def exact_frequencies(k, count):
    """rad/s of unit masses in a row between two walls, joined by springs k, by counting signs
    [Sturm] in extended precision."""
    diagonal, beside = np.longdouble(k[:-1]) + k[1:], np.longdouble(k[1:-1]) ** 2

    def below(x):
        found, q = 0, np.longdouble(1)
        for i, d in enumerate(diagonal):
            q = d - x - (beside[i - 1] / q if i else 0)
            found += q < 0
        return found

    def one(j):
        low, high = np.longdouble(0), 2 * diagonal.max()
        for _ in range(100):
            middle = (low + high) / 2
            low, high = (low, middle) if below(middle) > j else (middle, high)
        return float(np.sqrt(low))

    return np.array([one(j) for j in range(count)])


def test_the_bound_has_the_rounding_inside_the_reduction():
    """Springs that differ 1e4 times; the highest frequency of the reduced body is far below that of
    the whole one, by which its matrices are rounded."""
    rng = np.random.default_rng(0)
    k = 1e4 * np.where(rng.random(41) < 0.5, 1.0, 1e4) * (1 + rng.random(41))
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    n = np.arange(40)
    place = np.column_stack([n, 0 * n, 0 * n])
    body = Body.from_matrices("chain", K, np.eye(40), n + 1, place, n, 0 * n)
    reduction = craig_bampton(body, [1, 20], 12)
    omega = frequencies(reduction.model.K, reduction.model.M, 5)
    true = omega / exact_frequencies(k, 5) - 1
    bound = error_bound(reduction.model.K, reduction.model.M, reduction.truncation, omega)
    assert (bound >= true).all()


def test_load_modes_make_interior_loads_exact_in_statics():
    """Displacement under an interior load on the whole body; without the load mode it is the
    masters' alone."""
    body = body_of(2)
    load = ([100, 101], np.array([[3.0, 0, 0], [-1.0, 0, 0]]))
    f = np.zeros(body.dofs)
    f[[99, 100]] = 3, -1
    exact = np.linalg.solve(body.K.toarray(), f)
    w = 0.5 * np.sqrt(
        sl.eigh(body.K.toarray(), body.M.toarray(), subset_by_index=(0, 0), eigvals_only=True)[0]
    )
    error, dynamic = {}, {}
    # repeated, and on a master: nothing new
    for loads in ((), [load], [load, load, ([1], np.array([[1.0, 0, 0]]))]):
        reduction = craig_bampton(body, [1, 7], 10, loads=loads)
        K, M = reduction.model.K, reduction.model.M
        u = reduction.recover(np.linalg.solve(K, reduction.condense(*load)))[:, 0]
        error[len(loads)] = np.abs(u - exact).max() / np.abs(exact).max()
        assert reduction.load_modes == min(len(loads), 1)
        x = reduction.recover(np.linalg.solve(K - w**2 * M, reduction.condense(*load)))[:, 0]
        true = np.linalg.solve(body.K.toarray() - w**2 * body.M.toarray(), f)
        dynamic[len(loads)] = np.abs(x - true).max() / np.abs(true).max()
    assert error[0] > 1e-2 and error[1] < 1e-8 and error[3] < 1e-8
    assert dynamic[0] > 1e-2 and dynamic[1] < 0.1 * dynamic[0] and dynamic[3] < 0.1 * dynamic[0]


def test_mixed_modes_and_load_modes_are_orthonormal():
    body = body_of(5)
    reduction = craig_bampton(
        body, [1], 6, loads=[([50], np.array([[1.0, 0, 0]])), ([90], np.array([[1.0, 0, 0]]))]
    )
    Phi, inner = reduction.Phi, reduction.interior
    assert Phi.T @ body.M[inner][:, inner] @ Phi == pytest.approx(np.eye(8), abs=1e-8)
    K = Phi.T @ body.K[inner][:, inner] @ Phi
    assert np.abs(K - np.diag(reduction.omega**2)).max() < 1e-8 * reduction.omega[-1] ** 2
    assert reduction.fewer(3).load_modes == 2
