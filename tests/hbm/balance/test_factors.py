"""Large systems of Newton's method, solved by iterations: the same solutions and determinants as by
LU factors."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.balance.test_condensation import linearised
from tests.hbm.test_many_pairs import curve_of_bar
from tipdamp.hbm.balance import factors, newton
from tipdamp.hbm.balance.condensation import active_contacts, by_orders
from tipdamp.hbm.balance.factors import (
    BorderedSystem,
    DirectSolver,
    IterativeSolver,
    flops,
    gmres,
    solver_of,
)


def system(scale=1.0, level=6.0, corner=0.7):
    """The bordered system of the bar, some of whose pairs slip, lift or are open; scale : of what
    the contacts change."""
    here = linearised(level=level)
    acting, G = here._condensed()[:2]
    rng = np.random.default_rng(1)
    n = len(acting.rows) * here.balance.nh
    column, row = rng.normal(size=(2, n))
    return BorderedSystem(acting._replace(D=scale * acting.D), G, column, row, corner)


def exactly(given):
    """(solution for ones, sign of the determinant) by numpy."""
    A = given.matrix()
    return np.linalg.solve(A, np.ones(len(A))), np.linalg.slogdet(A)[0]


def test_product_is_that_of_the_matrix():
    given = system()
    v = np.random.default_rng(2).normal(size=len(given.row) + 1)
    expected = given.matrix() @ v
    for real, rounding in ((np.float64, 1e-13), (np.float32, 1e-5)):
        found = given.product(by_orders(given.G), real)(v.astype(real))
        assert found.dtype == real
        assert np.abs(found - expected).max() < rounding * np.abs(expected).max()


@pytest.mark.parametrize("scale", [0.3, 1.0, -1.0, 3.0, -3.0])
@pytest.mark.parametrize("level", [2.0, 6.0, 30.0])
def test_solution_and_sign_are_those_of_the_factors(scale, level, monkeypatch):
    """Without falling back on them; contacts that change three times as much, or the other way,
    give determinants of either sign."""
    monkeypatch.setattr(factors, "dgetrf", None)
    given = system(scale, level)
    x, sign = exactly(given)
    found = IterativeSolver(given)
    assert np.abs(found.solve(np.ones(len(x))) - x).max() < 1e-7 * np.abs(x).max()
    assert found.sign == sign


def test_determinants_of_both_signs_are_told_apart():
    signs = {
        IterativeSolver(system(scale, corner=corner)).sign
        for scale in (1.0, -3.0)
        for corner in (0.7, -70.0)
    }
    assert signs == {1.0, -1.0}


def test_factors_are_made_where_iterations_do_not_converge(monkeypatch):
    given = system()
    monkeypatch.setattr(factors, "DEFAULT", replace(factors.DEFAULT, iterations=2))
    x, sign = exactly(given)
    found = IterativeSolver(given)
    assert np.abs(found.solve(np.ones(len(x))) - x).max() < 1e-9 * np.abs(x).max()
    assert found.sign == sign


def test_singular_system_has_no_solution():
    """Nor the direction of a branch: what is found by iterations is none of any size."""
    given = system()
    given = given._replace(row=0 * given.row, corner=0.0)
    right = np.ones(len(given.row) + 1)
    assert np.isnan(DirectSolver(given.matrix()).solve(right)).all()
    found = IterativeSolver(given)
    x = found.solve(right)
    assert found.sign == 0 and (np.isnan(x).all() or np.abs(x).max() > 1e6)


def test_points_of_a_curve_are_the_same(monkeypatch):
    """A curve over the resonance of the bar, every system by iterations."""
    expected = curve_of_bar(3.0, half=True)
    monkeypatch.setattr(newton, "solver_of", IterativeSolver)
    found = curve_of_bar(3.0, half=True)
    assert found.complete and expected.complete
    for one, other in zip(found.peak("tip"), expected.peak("tip"), strict=True):
        assert one == pytest.approx(other, rel=1e-9)


def test_gmres_of_a_known_matrix():
    """n distinct eigenvalues: n iterations give the solution, and the projection has them."""
    values = np.array([-2.0, 0.5, 1.0, 3.0])
    x, projected, left = gmres(lambda v: values * v, np.ones(4), 10, 1e-12)
    assert x == pytest.approx(1 / values) and left < 1e-12
    assert np.sort(np.linalg.eigvals(projected).real) == pytest.approx(values)


def test_what_takes_less_time_is_chosen():
    """The rig's eighteen pairs are factorised at any usual number of harmonics; hundreds of
    components with several are not, but are with one."""
    for components, orders, direct in (
        (54, 4, True),
        (306, 2, True),
        (160, 10, False),
        (300, 4, False),
    ):
        by_factors, by_iterations = flops(components, orders)
        assert (by_factors < by_iterations) == direct
    assert isinstance(solver_of(system()), DirectSolver)


def test_overflowed_receptance_has_no_solution():
    given = system()
    found = IterativeSolver(given._replace(G=np.full_like(given.G, np.nan)))
    assert found.sign == 0 and np.isnan(found.solve(np.ones(len(given.row) + 1))).all()


def test_orders_that_are_not_coupled_take_no_iterations(monkeypatch):
    """But for those of the border, of rank two: contacts that turn and scale each order by
    itself."""
    given, taken = system(), []
    rng = np.random.default_rng(4)
    D = np.zeros_like(given.acting.D)
    for k in range(1, D.shape[2], 2):
        real, imaginary = 1e4 * rng.normal(size=(2, *D[:, :, 0, :, 0].shape))
        D[:, :, k, :, k] = D[:, :, k + 1, :, k + 1] = real
        D[:, :, k + 1, :, k], D[:, :, k, :, k + 1] = imaginary, -imaginary
    monkeypatch.setattr(factors, "gmres", lambda *a: taken.append(gmres(*a)) or taken[-1])
    given = given._replace(acting=given.acting._replace(D=D))
    x, sign = exactly(given)
    found = IterativeSolver(given)
    assert np.abs(found.solve(np.ones(len(x))) - x).max() < 1e-7 * np.abs(x).max()
    assert found.sign == sign and max(len(projected) for _, projected, _ in taken) <= 4


def test_singular_order_of_a_regular_system_is_left_to_the_factors():
    """Of one contact with one component: 1 + D G of order 1 is zero, coupling and border make the
    whole regular."""
    D, G = np.zeros((1, 1, 3, 1, 3)), np.ones((1, 1, 2), dtype=complex)
    D[0, 0, :, 0, :] = [[0.5, 0.3, 0.2], [0.5, -1.0, 0.0], [0.7, 0.0, -1.0]]
    one = active_contacts(np.arange(1), D, np.ones((1, 1), dtype=bool))
    given = BorderedSystem(one, G, np.array([0.1, 1.0, 2.0]), np.array([1.0, 2.0, -1.0]), 0.5)
    x, sign = exactly(given)
    found = IterativeSolver(given)
    assert found.solve(np.ones(4)) == pytest.approx(x) and found.sign == sign != 0
