"""Pairs that face two ways in three dimensions: many random gaps, soft and hard, against a second
solver."""

from functools import cache

import numpy as np
import pytest

from tests.static_contact.corner import SHARES, by_interior_point, corner, pulls, random_pairs
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.normal.complementarity import NoEquilibrium, solve_complementarity
from tipdamp.static_contact.normal.normal_contact import Loading, NormalContact

made = cache(corner)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHARES)
def test_random_gaps_against_an_interior_point(name):
    """60 cases for each way of pulling, every third hard. Symmetric ones balance on single lines of
    pairs, where many positions of the damper are solutions; the forces are the same in all of
    them."""
    bodies, reduced, model, pairs = made()
    load = pulls(bodies, reduced, name)[1]
    random = np.random.default_rng(0)
    for i in range(60):
        case = random_pairs(pairs, random, hard=i % 3 == 0)
        statics = StaticContact(model, case)
        found = statics.solve(load)
        N = by_interior_point(model.K, statics.B.toarray(), load, case.gap, case.kn)
        assert found.force == pytest.approx(N, abs=1e-8 * N.max()), i
        assert found.residual < 1e-8 and found.balance < 1e-8


def test_what_lifts_off_is_still_refused():
    bodies, reduced, model, pairs = made()
    load = pulls(bodies, reduced, "both")[1]
    with pytest.raises(NoEquilibrium, match="do not hold the damper"):
        StaticContact(model, random_pairs(pairs, np.random.default_rng(1), hard=False)).solve(-load)


@pytest.mark.parametrize("anchor, at", [(0.0, 0.0), (1e-2, 0.0), (0.3, 4e-6)])
def test_a_set_with_anchors_is_one_linear_system(anchor, at):
    """u, N and a of the four equations of `normal_contact`, all unknowns in one dense matrix; every
    pair pulled to `at` by a spring of its own."""
    random = np.random.default_rng(3)
    P, h = 7, 2
    root = random.standard_normal((P, P))
    G, c = 1e-6 * (root @ root.T + np.eye(P)), random.uniform(0, 1e-6, P)
    Y, E = random.standard_normal((P, h)), 1e5 * np.diag([0.0, 1.0])
    k0 = random.uniform(1e5, 1e6, P)
    closed = np.array([1, 0, 1, 1, 0, 0, 1], dtype=bool)
    load = Loading(1e-5 * random.standard_normal(P), 10 * random.standard_normal(h))
    gap, at = random.uniform(0, 1e-5, P), at * random.standard_normal(P)
    problem = NormalContact(G + np.diag(c), c, Y, E, k0, np.ones(P, dtype=bool))
    found = problem.solve_set(closed, load, gap, anchor, at)
    one, k = np.eye(P), anchor * np.diag(k0)
    whole = np.block(
        [
            [one + G @ k, G, -Y],
            [np.where(closed[:, None], one, 0.0), np.diag(np.where(closed, -c, 1.0)), 0.0 * Y],
            [Y.T @ k, Y.T, E],
        ]
    )
    right = [load.u0 + G @ k @ at, np.where(closed, gap, 0.0), load.work + Y.T @ k @ at]
    u, N, a = np.split(np.linalg.solve(whole, np.concatenate(right)), [P, 2 * P])
    assert found.u == pytest.approx(u, rel=1e-8, abs=1e-12 * np.abs(u).max())
    assert found.N == pytest.approx(N, rel=1e-8, abs=1e-8 * np.abs(N).max())
    assert found.amount == pytest.approx(a, rel=1e-8)


def plank(load_at, gap, push=100.0):
    """A rigid plank that heaves and pitches on springs of 1 N/um at -1, 0 and 1; (problem, load,
    gap)."""
    Y, c = np.array([[1.0, -1], [1, 0], [1, 1]]), np.full(3, 1e-6)
    problem = NormalContact(np.diag(c), c, Y, np.zeros((2, 2)), 1 / c, np.ones(3, dtype=bool))
    return problem, Loading(np.zeros(3), push * np.array([1.0, load_at])), np.array(gap)


@pytest.mark.parametrize("outer", [2e-4, 1e-2, 1.0])
def test_a_plank_that_balances_on_its_middle(outer):
    """Its pitch is free, so that no set holds it without anchors; they leave no force behind, in
    the pairs or in the balance, however far the ends are."""
    found = solve_complementarity(*plank(0.0, [outer, 0, outer]))
    assert found.method == "proximal" and found.closed.tolist() == [False, True, False]
    assert found.N == pytest.approx([0, 100, 0], rel=1e-8)
    assert found.u[1] == pytest.approx(1e-4, rel=1e-8) and (found.u[[0, 2]] < outer).all()
    assert found.u[0] + found.u[2] == pytest.approx(2e-4, rel=1e-8)


def test_a_plank_that_tips_until_an_end_touches():
    """Statics alone: the load stands at a third of the way to the end that touches."""
    found = solve_complementarity(*plank(1 / 3, [1.0, 0, 1.0]))
    assert found.N == pytest.approx([0, 200 / 3, 100 / 3], rel=1e-6)
    assert found.closed.tolist() == [False, True, True]


def test_a_plank_that_is_loaded_beyond_its_end_goes_on_turning():
    with pytest.raises(NoEquilibrium, match="do not hold the damper") as told:
        solve_complementarity(*plank(1.5, [0.0, 0, 0]))
    drift = told.value.drift  # about the end that stays closed, away from the others
    assert drift[0] < 0 and drift / -drift[0] == pytest.approx([-1, -0.5, 0], abs=1e-6)


@pytest.mark.parametrize("spread", [1e-4, 1e-8, 1e-10])
def test_hard_pairs_whose_compliances_spread_by_decades(spread):
    """Refinement leaves of the equations no more than rounding, also where springs resist the loose
    motions."""
    random = np.random.default_rng(3)
    P, h = 12, 3
    ways = np.linalg.qr(random.standard_normal((P, P)))[0]
    G = 1e-6 * (ways * np.geomspace(1, spread, P)) @ ways.T
    Y, E = random.standard_normal((P, h)), np.diag([0.0, 1e5, 1e6])
    load = Loading(1e-5 * random.standard_normal(P), 10 * random.standard_normal(h))
    gap, closed = random.uniform(0, 1e-5, P), np.arange(P) % 5 > 0
    problem = NormalContact((G + G.T) / 2, np.zeros(P), Y, E, np.full(P, 1e6), np.ones(P, bool))
    u, N, a = problem.solve_set(closed, load, gap)
    assert not N[~closed].any()
    terms = np.abs(load.work) + np.abs(E @ a) + np.abs(Y.T) @ np.abs(N)
    assert (np.abs(E @ a + Y.T @ N - load.work) < 1e-14 * terms).all()
    moved = load.u0 - problem.A @ N + Y @ a
    size = np.linalg.norm(Y @ a) + np.linalg.norm(problem.A.diagonal() * N)
    assert np.linalg.norm((moved - gap)[closed]) < 1e-14 * size
    assert u == pytest.approx(np.where(closed, gap, moved), abs=1e-12 * size)
