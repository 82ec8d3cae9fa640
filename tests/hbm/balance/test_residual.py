"""The condensed Newton system against the full Jacobian by differences, for every kind of damping
and parameter."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la

from tests.hbm.cases import coupled, load, with_damping_matrix
from tests.hbm.conformance import SteppedFriction
from tests.hbm.small_rig import small_rig
from tipdamp import Jenkins1D, Problem
from tipdamp.hbm import fourier
from tipdamp.hbm.balance import aft, residual
from tipdamp.hbm.balance.contact_setting import ContactSetting
from tipdamp.hbm.balance.kernels import norms
from tipdamp.hbm.balance.parameter import Frequency, Level
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.receptance import stuck_receptance
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.settings import BalanceSettings
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.laws import DryFriction2T, IsotropicFriction, MixedLaw, UnilateralSpring
from tipdamp.hbm.response import forced_response


def pencil_case():
    problem, force = coupled(load("D1")["parameters"])
    return HarmonicBalance(problem, {1: force}, 3), 1.1, 0.3


def modal_case():
    model, pairs, tip = small_rig(stations=7)  # 102 dofs: the high modes go through the series
    problem, _ = contact_problem(
        model, pairs.select(np.arange(0, 14, 6)), DryFriction2T(), damping_ratio=0.02
    )
    return HarmonicBalance(problem, {1: 40 * tip}, 2), 2 * np.pi * 1300.0, 8e-6


def general_case():
    balance, w, size = modal_case()
    problem = with_damping_matrix(balance.problem)
    force = np.linalg.solve(balance.receptance.shapes.T, balance.force[:, 1])
    assert np.iscomplexobj(problem.receptance().shapes)
    return HarmonicBalance(problem, {1: force}, 2), w, size


@pytest.mark.parametrize(
    "by",
    [Frequency(), Level(), ContactSetting("preload"), ContactSetting("mu")],
    ids=lambda by: by.name,
)
@pytest.mark.parametrize("case", [pencil_case, modal_case, general_case])
def test_bordered_solve_and_determinant(case, by):
    balance, w, size = case()
    rng = np.random.default_rng(0)
    x = balance.linear(w) + size * rng.normal(size=balance.n_components * balance.nh) / balance.nh
    n = len(x)
    at = w if by == Frequency() else 1.0
    e = by.evaluate(balance, x, w, at)
    assert len(e.forces.contacts) > 0
    h = 1e-6 * size
    J = np.array(
        [
            (balance.evaluate(x + h * v, w).residual - balance.evaluate(x - h * v, w).residual)
            / (2 * h)
            for v in np.eye(n)
        ]
    ).T
    d = 1e-6 * at
    ends = [by.evaluate(balance, x, w, at + s).residual for s in (d, -d)]
    slope = (ends[0] - ends[1]) / (2 * d)
    assert np.abs(e.by_parameter - slope).max() < 1e-5 * np.abs(slope).max()
    row, corner = rng.normal(size=n) / size, 0.7 / at
    full = np.block([[J, slope[:, None]], [row[None], np.array([[corner]])]])
    dx, dp = e.solve(row, corner, 0.3)
    expected = np.linalg.solve(full, np.r_[-e.residual, 0.3])
    assert np.abs(dx - expected[:n]).max() < 1e-4 * np.abs(expected[:n]).max()
    assert dp == pytest.approx(expected[n], rel=1e-4)
    assert e.direction(row, corner)[2] == np.linalg.slogdet(full)[0]


def iterate_on_all(monkeypatch):
    """No pair is left out of Newton's system any more, and no component of a pair."""

    def whole(law, pairs, x, *rest):
        b = aft_evaluate(law, pairs, x, *rest)
        P, nd, nh = x.shape
        D = np.zeros((P, nd, nh, nd, nh))
        D[b.contacts] = b.D
        return replace(b, D=D, active=np.ones((P, nd), bool))

    aft_evaluate = aft.evaluate
    monkeypatch.setattr(aft, "evaluate", whole)


@pytest.mark.parametrize("law", [DryFriction2T(), IsotropicFriction()], ids=lambda law: law.name)
def test_stuck_contacts_left_out_of_newton(law, monkeypatch):
    """Newton's step, the sign of its determinant, and the solution, against the system on all rows
    of all pairs."""
    model, pairs, tip = small_rig(stations=4)
    pairs = pairs.replace(preload=pairs.preload * np.linspace(0.4, 6, len(pairs)))
    problem, _ = contact_problem(model, pairs, law, damping_ratio=0.02)
    balance = HarmonicBalance(problem, {1: 60 * tip}, 5)
    rng, n = np.random.default_rng(0), balance.n_components * balance.nh
    row, corner, found = rng.normal(size=n) / 1e-5, 1e-3, []
    moved = []
    for hz in (300.0, 420.0, 1250.0):
        w = 2 * np.pi * hz
        guess = balance.linear(w)
        for everywhere in (False, True):
            with monkeypatch.context() as changed:
                if everywhere:
                    iterate_on_all(changed)
                with changed.context() as exact:
                    # of the matrix alone
                    exact.setattr(residual, "DEFAULT", BalanceSettings(regularisation=0.0))
                    e = balance.evaluate(guess, w)
                    step = *e.solve(row, corner, 0.3), e.direction(row, corner)[2]
                point = solve_fixed(balance.evaluate, guess, w, balance.weights)
            assert point.converged
            found.append((*step, point.x))
            moved.append(len(point.detail.forces.contacts))
    assert (
        moved[1::2] == [len(pairs)] * 3 and 0 < min(moved[::2]) and max(moved[::2]) < len(pairs)
    ), moved
    for (dx, dp, sign, x), (dx_all, dp_all, sign_all, x_all) in zip(
        found[::2], found[1::2], strict=True
    ):
        assert np.abs(dx - dx_all).max() < 1e-10 * np.abs(dx_all).max() and sign == sign_all
        assert dp == pytest.approx(dp_all, rel=1e-10)
        assert np.abs(x - x_all).max() < 1e-10 * np.abs(x_all).max()


@pytest.mark.parametrize(
    "law, passes", [(DryFriction2T(), 1), (IsotropicFriction(), 1), (SteppedFriction(), 3)]
)
def test_preload_derivative_needs_no_second_pass(law, passes, monkeypatch):
    """Event-driven laws give it with the forces; sampled laws are asked twice more. Against
    fourth-order differences, away from a factor of 1."""
    model, pairs, tip = small_rig(stations=2)
    # one is open at rest
    pairs = pairs.replace(preload=pairs.preload * np.r_[-0.2, np.ones(len(pairs) - 1)])
    problem, _ = contact_problem(model, pairs, law, damping_ratio=0.02)
    balance = HarmonicBalance(problem, {1: 40 * tip}, 3)
    w = 2 * np.pi * 1300.0
    done = []
    x = (
        balance.linear(w)
        + 8e-5 * np.random.default_rng(0).normal(size=balance.n_components * 7) / 7
    )
    evaluate = aft.evaluate
    monkeypatch.setattr(aft, "evaluate", lambda *a: done.append(1) or evaluate(*a))
    e = ContactSetting("preload").evaluate(balance, x, w, 0.7)
    assert len(done) == passes and len(e.forces.contacts) > 0 and 0 < e.forces.shares[0, 2] < 1
    at = [
        # a turning slider is integrated to 1e-8: a step that this does not show in
        ContactSetting("preload").evaluate(balance, x, w, 0.7 + k * 1e-4).residual
        for k in (-2, -1, 1, 2)
    ]
    slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / 12e-4
    assert np.abs(e.by_parameter - slope).max() < 1e-6 * np.abs(slope).max()


@pytest.mark.parametrize("setting", ["kn", "kt"])
@pytest.mark.parametrize("origin", ["preloaded", "unloaded"])
@pytest.mark.parametrize("some", [None, (0, 2)])
def test_stiffness_derivatives_are_analytic(setting, origin, some, monkeypatch):
    """Of an event-driven law, without a second pass; against fourth-order differences, away from a
    factor of 1."""
    model, pairs, tip = small_rig(stations=2)
    pairs = pairs.replace(preload=pairs.preload * np.r_[-0.2, np.ones(len(pairs) - 1)])
    pairs = pairs.replace(gap=-pairs.preload / pairs.kn)
    problem, _ = contact_problem(model, pairs, DryFriction2T(), origin=origin, damping_ratio=0.02)
    balance = HarmonicBalance(problem, {1: 40 * tip}, 3)
    w = 2 * np.pi * 1300.0
    done = []
    x = (
        balance.linear(w)
        + 8e-5 * np.random.default_rng(0).normal(size=balance.n_components * 7) / 7
    )
    evaluate, varied = aft.evaluate, ContactSetting(setting, some)
    monkeypatch.setattr(aft, "evaluate", lambda *a: done.append(1) or evaluate(*a))
    e = varied.evaluate(balance, x, w, 0.7)
    assert len(done) == 1 and len(e.forces.contacts) > 0
    at = [varied.evaluate(balance, x, w, 0.7 + k * 1e-4).residual for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / 12e-4
    assert np.abs(e.by_parameter - slope).max() < 1e-6 * np.abs(slope).max()


@pytest.mark.parametrize("singular", [False, True])
def test_softest_motion_is_the_singular_vector(singular, monkeypatch):
    """Slipping pairs; and the same with a motion that nothing holds, to the last digit."""
    balance, w, size = modal_case()
    away = (
        size * np.random.default_rng(1).normal(size=balance.n_components * balance.nh) / balance.nh
    )
    e = balance.evaluate(balance.linear(w) + away, w)
    rows = e._condensed().acting.rows
    A = e._system(len(rows) * balance.nh)
    if singular:  # I + DG takes this direction to nothing
        v = np.zeros(len(A))
        v[[0, 5]] = 0.6, 0.8
        A -= np.outer(A @ v, v)
        monkeypatch.setattr(type(e), "_system", lambda e, size: A)
    U, s, Vt = np.linalg.svd(A)
    value, q = e.smallest_motion()
    dg = np.zeros((balance.n_components, balance.nh))
    dg[rows] = Vt[-1].reshape(-1, balance.nh)
    expected = balance.receptance.shapes @ (e.factors * (balance.shapes.T @ fourier.to_complex(dg)))
    along = abs(np.vdot(expected, q)) / np.linalg.norm(expected) / np.linalg.norm(q)
    assert (
        value < 1e-13 and s[-1] / s[0] < 1e-13
        if singular
        else value == pytest.approx(s[-1] / s[0], rel=1e-2)
    )
    assert along > 1 - 1e-6


@pytest.mark.parametrize("dashpots", [(), ((3, 3),), ((0, 3), (4, 4)), ((3, 4),)])
def test_general_damping_with_and_without_mass(dashpots):
    """Dofs 3 and 4 of five have no mass; dashpots at these or between dofs. Against a dense
    solution."""
    rng = np.random.default_rng(1)
    A = rng.normal(size=(5, 5))
    K, M = A @ A.T + 5 * np.eye(5), np.diag([1.0, 2.0, 0.5, 0.0, 0.0])
    C = 0.1 * np.outer([1.0, -1, 0, 0, 0], [1.0, -1, 0, 0, 0])
    for i, j in dashpots:
        row = np.zeros(5)
        row[[i, j]] = (1.0, -1.0) if i != j else 1.0
        C += 0.3 * np.outer(row, row)
    R = stuck_receptance(M, C, K)
    w = np.array([0.0, 0.7, 2.3, 40.0])
    d = R.factors(w)[0]
    for k in range(len(w)):
        expected = np.linalg.inv(K - w[k] ** 2 * M + 1j * w[k] * C)
        assert (
            np.abs((R.shapes * d[:, k]) @ R.shapes.T - expected).max()
            < 1e-10 * np.abs(expected).max()
        )


def test_a_dashpot_beside_a_spring_alone():
    """Of a dof without mass that nothing couples to the others: 1/(k + i w c)."""
    M, K = np.diag([1.0, 0.0]), np.diag([1.0, 2.0])
    R = stuck_receptance(M, 0.3 * K, K)
    w = np.array([0.0, 0.7, 2.3, 40.0])
    found = np.einsum("r,rk,r->k", R.shapes[1], R.factors(w)[0], R.into[1])
    assert found == pytest.approx(1 / (2.0 + 0.6j * w), rel=1e-12)


def _damped_blades(seed=0):
    """M, C, K (4, 4) of a body whose damping couples its modes."""
    A = np.random.default_rng(seed).normal(size=(3, 4, 4))
    return [scale * (a @ a.T + 4 * np.eye(4)) for scale, a in zip((1.0, 0.1, 1.0), A, strict=True)]


def _check_receptance(M, C, K, accuracy):
    R = stuck_receptance(M, C, K)
    assert R.poles.size
    for w in np.sqrt(la.eigvalsh(K, M)[[0, -1]]) * [[0.5], [1.0], [2.0]]:
        for v in w:
            found = R.shapes @ (R.factors(v)[0] * R.shapes.T)
            of = K - v**2 * M + 1j * v * C
            assert np.abs(of @ found - np.eye(len(K))).max() < accuracy


@pytest.mark.parametrize("turned", [False, True], ids=["apart", "turned"])
def test_equal_blades_have_equal_poles(turned):
    """Any modes of equal poles will do that are orthogonal as the receptance takes them to be."""
    turn = la.qr(np.random.default_rng(1).normal(size=(8, 8)))[0] if turned else np.eye(8)
    _check_receptance(*(turn @ la.block_diag(A, A) @ turn.T for A in _damped_blades()), 1e-12)


@pytest.mark.parametrize("beside", [0.0, 1e-15, 1e-12, 1e-6, -1e-12])
def test_where_two_poles_meet_they_have_one_mode(beside):
    """Between oscillating and overdamped two poles become one, and so do their modes."""
    M, C, K = _damped_blades()
    free = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, K), np.zeros((4, 4))]])

    def oscillating(f):
        poles = la.eigvals(free - f * la.block_diag(np.zeros((4, 4)), np.linalg.solve(M, C)))
        return np.count_nonzero(np.abs(poles.imag) > 1e-12 * np.abs(poles)) == 8

    low, high = 1.0, 1e3
    assert oscillating(low) and not oscillating(high)
    for _ in range(60):
        low, high = (
            (0.5 * (low + high), high)
            if oscillating(0.5 * (low + high))
            else (low, 0.5 * (low + high))
        )
    _check_receptance(M, high * (1 + beside) * C, K, 1e-9)


def test_high_poles_enter_the_jacobian_by_a_series():
    """102 dofs, general damping: the receptance between pairs, series and all, is that of all
    poles."""
    balance, w, _ = general_case()
    factors = balance.receptance.factors(w * np.arange(balance.H + 1))[0]
    every = np.arange(balance.n_components)
    assert (
        0
        < len(balance.contact_receptance.terms(w * balance.H, every)[0])
        < balance.receptance.shapes.shape[1] / 2
    )
    G = balance.contact_receptance.between(every, every, factors, w)
    for k in range(balance.H + 1):
        direct = (balance.shapes * factors[:, k]) @ balance.shapes.T
        assert np.abs(G[:, :, k] - direct).max() < 1e-10 * np.abs(direct).max()


@pytest.mark.parametrize(
    "law",
    [
        DryFriction2T(),
        IsotropicFriction(),
        MixedLaw((DryFriction2T(), UnilateralSpring()), (0, 1, 0, 1)),
    ],
)
def test_contact_open_at_rest_carries_nothing(law):
    """A negative preload is a gap: under almost no force the model swings about where it is."""
    model, pairs, tip = small_rig(stations=2)
    pairs = pairs.replace(preload=pairs.preload * np.r_[-0.2, np.ones(len(pairs) - 1)])
    curve = forced_response(
        model,
        pairs,
        law,
        1e-3 * tip,
        (400, 420),
        harmonics=1,
        damping_ratio=0.02,
        outputs={"tip": tip},
        contact=True,
    )
    assert curve.complete
    assert np.abs(curve.harmonics[:, 0, 0]).max() < 1e-6 * np.abs(curve.harmonics[:, 0, 1]).max()


def test_a_mean_that_moves_far_costs_few_points():
    """Where a contact begins to slip, a small constant force moves the mean 34 times as far as the
    mass vibrates, for next to no work; the vibration is that without it."""
    mass = Problem(M=[[1.0]], K=[[1e3]], damping_ratio=0.002)
    rubbing = mass.add(Jenkins1D(), 0, kt=1e6, mu=0.5, preload=20.0).force(0, 4.0)
    moved = replace(rubbing, static=[0.5])
    still, drifting = (
        one.follow_band((120, 200), harmonics=3, outputs={"x": 0}) for one in (rubbing, moved)
    )
    mean = np.abs(drifting.harmonics[:, 0, 0]).max()
    assert (
        mean > 30 * drifting.amplitude().max()
        and mean > 1e9 * np.abs(still.harmonics[:, 0, 0]).max()
    )
    assert drifting.peak("x")[1] == pytest.approx(still.peak("x")[1], rel=1e-6)
    assert len(drifting) < 1.6 * len(still)


@pytest.mark.parametrize("size", [1.0, 1e-200, 1e200])
def test_norms_of_mean_and_vibration_neither_vanish_nor_overflow(size):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(5, 3, 4)) + 1j * rng.normal(size=(5, 3, 4))
    unit = rng.uniform(0.1, 10.0, (5, 3))
    parts = X[:, :, :1] / unit[:, :, None], X[:, :, 1:] / unit[:, :, None]
    expected = np.stack([np.linalg.norm(part.reshape(5, -1), axis=1) for part in parts], axis=1)
    assert norms(size * X, unit) / size == pytest.approx(expected, rel=1e-12)
