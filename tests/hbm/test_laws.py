"""Conformance of every contact law of the list in conformance.py."""

from dataclasses import replace

import numpy as np
import pytest

from hbm import fourier, laws
from hbm.balance import aft
from hbm.laws import Motion, sampled
from hbm.problem import contact_problem
from hbm.response import forced_response
from hbm.time.comparison import compare_point
from hbm.time.settings import IntegrationSettings
from tests.hbm.cases import solve
from tests.hbm.conformance import (
    LAWS,
    all_derivatives,
    bracket,
    one_dof,
    plain_corridor,
    plain_history,
    random_case,
    whole,
)

H = 5
each_law = pytest.mark.parametrize("case", LAWS, ids=lambda c: c.law.name)
each_start = pytest.mark.parametrize("start", aft.STARTS)


@pytest.mark.slow
@each_start
@each_law
def test_kernel_is_the_plain_loop_to_rounding(case, start):
    """Corridor laws: events by bisection and Gauss points; sampled laws: the same samples, pair by pair."""
    law = case.law
    x, pairs, _ = random_case(law, P=8, H=3, seed=3)
    b = bracket(law, pairs, x, start)
    if law.piecewise_linear(pairs) is not None:
        expected = np.zeros(x.shape)
        for p in range(len(pairs)):
            normal = "n" in law.components
            un = x[p, -1] if normal else np.zeros(7)
            sheet = [getattr(pairs, k)[p] for k in ("kt", "kn", "mu", "preload")]
            for d in range(max(law.sliders, 1)):
                tangent, opened = plain_corridor(*sheet, x[p, d], un.copy(), start)
                if law.sliders:
                    expected[p, d] = tangent
            if normal:
                expected[p, -1] = opened
        assert np.abs(b.g - expected).max() < 2e-12
    else:
        u = x @ fourier.basis(np.arange(64) * 2 * np.pi / 64, 3).T
        force = plain_history(law, pairs, u, start, 400)[0][1]
        F = np.tensordot(force, sampled.projector(fourier.basis(np.arange(64) * 2 * np.pi / 64, 3)), (0, 0))
        assert np.abs(whole(law, pairs, x, b) - F).max() < 2e-12
    assert (b.shares >= -1e-12).all() and np.allclose(b.shares.sum(axis=1), 1)


@each_start
@each_law
def test_derivatives_by_differences(case, start):
    law = case.law
    x, pairs, rng = random_case(law)
    D = all_derivatives(bracket(law, pairs, x, start), x)
    dx, h = rng.normal(size=x.shape), 1e-6
    numeric = (bracket(law, pairs, x + h * dx, start).g - bracket(law, pairs, x - h * dx, start).g) / (2 * h)
    error = np.abs(np.einsum("pijkl,pkl->pij", D, dx) - numeric).max(axis=(1, 2))
    # a pair that only just comes to rest has a kink there: one in thirty may sit on it where the motion is sampled
    assert np.sort(error)[-2 if case.order else -1] < 2e-6


@each_law
def test_derivatives_through_transitions(case):
    """Their integral along a path from rest to slip and lift-off is the change of the force: no jump is missed."""
    law = case.law
    x, pairs, _ = random_case(law, P=6, H=2)
    along, n = 1.5 * x, 600
    change = np.zeros(x.shape)
    for s in (np.arange(n) + 0.5) / n:
        change += np.einsum("pijkl,pkl->pij", all_derivatives(bracket(law, pairs, s * along), x), along) / n
    expected = bracket(law, pairs, along).g - bracket(law, pairs, 0 * along).g
    # in the plane a slider that only just slips goes to rest as a square root of the amplitude: steep, and hard to sum
    assert np.abs(change - expected).max() < (5e-3 if case.order else 2e-3) * np.abs(expected).max()


@each_law
def test_the_force_does_not_depend_on_the_samples_or_converges_at_its_order(case):
    law = case.law
    x, pairs, _ = random_case(law)
    if case.order is None:
        coarse, fine = (bracket(law, pairs, x, samples=n).g for n in (64, 1024))
        assert np.abs(coarse - fine).max() < 1e-12 * np.abs(fine).max()
        return
    finest = bracket(law, pairs, x, samples=8192).g
    errors = [np.sqrt(np.mean((bracket(law, pairs, x, samples=n).g - finest) ** 2)) for n in (128, 512, 2048)]
    assert (np.log(np.array(errors[:-1]) / errors[1:]) / np.log(4) > case.order - 0.25).all(), errors


@pytest.mark.slow
@each_law
def test_periodic_after_the_first_cycle_or_creeping_there(case):
    law = case.law
    x, pairs, _ = random_case(law)
    u = x @ fourier.basis(np.arange(200) * 2 * np.pi / 200, H).T
    before, after = plain_history(law, pairs, u, "zero_slider", case.cycles + 1)[0]
    assert np.abs(after - before).max() < (1e-12 if case.cycles == 1 else 1e-4)


@each_law
def test_friction_cone_pressure_and_lift_off(case):
    law = case.law
    x, pairs, _ = random_case(law, P=50)
    u = x @ fourier.basis(np.arange(400) * 2 * np.pi / 400, H).T
    force, state = (a[1] for a in plain_history(law, pairs, u, "zero_slider", 1))
    N = np.broadcast_to(np.maximum(pairs.preload, 0), force.shape[:2])
    if case.normal == "variable":
        N = force[:, :, -1]
        assert (N >= 0).all()
        lifted = pairs.preload + pairs.kn * u[:, -1].T <= 0
        assert lifted.any() and (force[lifted] == 0).all()
        tangents = law.sliders                                   # on re-contact a slider starts where it is
        assert np.array_equal(state[lifted][:, :tangents], u[:, :tangents].transpose(2, 0, 1)[lifted])
    T = force[:, :, :-1] if case.normal == "variable" else force
    if case.friction:
        size = np.linalg.norm(T, axis=2, keepdims=True) if case.friction == "together" else np.abs(T)
        assert (size <= (pairs.mu * N)[:, :, None] * (1 + 1e-9) + 1e-15).all()
        assert np.isclose(size, (pairs.mu * N)[:, :, None], rtol=1e-3).mean() > 0.02      # and the limit is reached


@each_start
@each_law
def test_friction_never_gives_energy(case, start):
    law = case.law
    for seed in range(5):
        x, pairs, _ = random_case(law, P=60, seed=seed)
        F, U = (fourier.to_complex(a) for a in (whole(law, pairs, x, bracket(law, pairs, x, start, 256)), x))
        work = np.pi * np.sum(np.arange(H + 1) * (F * U.conj()).imag, axis=(1, 2))
        assert (work > (-1e-3 if case.order else -1e-11)).all() and (not case.friction or work.max() > 0.1)


@each_law
def test_no_pairs_and_no_normal_load(case):
    law = case.law
    x, pairs, _ = random_case(law)
    none = laws.Contacts(*np.zeros((4, 0)))
    b = bracket(law, none, x[:0])
    assert b.g.shape == x[:0].shape and not len(b.contacts) and b.shares.shape == (0, 3)
    if case.normal == "variable":
        x[:, -1] = 0.0                  # closed by nothing: no force at all
    b = bracket(law, replace(pairs, preload=0 * pairs.preload), x)
    force = whole(law, replace(pairs, preload=0 * pairs.preload), x, b)
    assert np.isfinite(b.D).all()
    assert np.abs(force).max() < 1e-12 or not case.normal


@each_law
def test_zero_stiffness_gives_no_force(case):
    law = case.law
    x, pairs, _ = random_case(law)
    slack = replace(pairs, kn=0 * pairs.kn, kt=0 * pairs.kt, preload=np.abs(pairs.preload))
    b = bracket(law, slack, x)
    force = whole(law, slack, x, b)
    if case.normal == "variable":
        force[:, -1, 0] -= slack.preload
    assert np.isfinite(b.D).all() and (np.abs(force).max() < 1e-12 or not law.stuck_stiffness(pairs).any())


@pytest.mark.slow
@each_law
def test_through_forced_response(case):
    """A point on springs: the curve is complete, and at its top the harmonics balance the force of the plain loop."""
    model, pairs, force = one_dof(case.law)
    curve = forced_response(model, pairs, case.law, force, (1.2, 2.4), harmonics=3, damping_ratio=0.03, contact=True,
                            outputs={k: row for k, row in zip("xyz", np.eye(3), strict=True)},
                            samples=128 if case.friction == "creep" else 512)
    assert curve.complete, curve.ended
    i = int(np.nanargmax(curve.amplitude("rms").max(axis=1)))
    problem = contact_problem(model, pairs, case.law, damping_ratio=0.03)[0]
    U = curve.contact_motion[i][0]
    u = fourier.to_real(U) @ fourier.basis(np.arange(2048) * 2 * np.pi / 2048, 3).T
    history = plain_history(case.law, problem.pairs, u[None], curve.start, max(case.cycles, 2))[0][1][:, 0]
    F = fourier.to_complex(history.T @ sampled.projector(fourier.basis(np.arange(2048) * 2 * np.pi / 2048, 3)))
    assert np.abs(F - curve.contact_force[i][0]).max() < 2e-3 * np.abs(F).max()
    assert not case.friction or curve.share_slip[i, 0] > 0.05
    lost = np.pi * np.sum(np.arange(4) * (curve.contact_force * curve.contact_motion.conj()).imag, axis=(2, 3))
    assert np.allclose(curve.dissipated, lost, rtol=0, atol=1e-10 * np.abs(lost).max() + 1e-13)
    assert (lost[i, 0] > 0.01 and curve.slipping_pairs.tolist() == [0]) or not case.friction
    # K_s phi = phi k: the damping ratios are those of the stuck modes, here along x, y, z
    rows = ["xyz"["t1 t2 n".split().index(c)] for c in case.law.components]
    k_s = problem.law.stuck_stiffness(problem.pairs)[0]
    w = 2 * np.pi * curve.frequency[i]
    for row, X, Fc, ks in zip(rows, U, curve.contact_force[i][0], k_s, strict=True):
        j = "xyz".index(row)
        k, orders = model.K[j, j], np.arange(4)
        push = np.zeros(4, complex)
        push[1] = force[j]
        push[0] = problem.law.stuck_force(problem.pairs)[0, -1] if row == "z" else 0.0
        Z = k - (orders * w) ** 2 + 2j * 0.03 * np.sqrt(k + ks) * orders * w
        assert np.abs(Z * X + Fc - push).max() < 1e-7 * np.abs(force[j])


@pytest.mark.slow
@pytest.mark.parametrize("case", LAWS, ids=lambda c: c.law.name)
def test_through_time_integration(case):
    model, pairs, force = one_dof(case.law)
    problem, _ = contact_problem(model, pairs, case.law, damping_ratio=0.03)
    _, point, balance = solve(problem, force, 2 * np.pi * 1.7, 15, samples=None if case.order is None else 256)
    c = compare_point(balance, point, np.eye(3), IntegrationSettings(samples=256))
    assert c.agrees and c.difference < 1e-3


@each_law
def test_step_tangents_by_differences(case):
    law = case.law
    x, pairs, rng = random_case(law)
    u = x[:, :, 0]
    state = 0.3 * rng.normal(size=(len(pairs), law.states))

    def step(u, state):
        return law.step(Motion(u, 0 * u, 1.0), state, pairs)
    _, _, t = law.tangents(Motion(u, 0 * u, 1.0), state, pairs)
    h = 1e-7
    for k in range(u.shape[1]):
        e = np.eye(u.shape[1])[k] * h
        (fp, sp), (fm, sm) = step(u + e, state), step(u - e, state)
        assert np.abs((fp - fm) / (2 * h) - t.force_u[:, :, k]).max() < 2e-6
        assert np.abs((sp - sm) / (2 * h) - t.state_u[:, :, k]).max(initial=0) < 2e-6
    for k in range(law.states):
        e = np.eye(law.states)[k] * h
        (fp, sp), (fm, sm) = step(u, state + e), step(u, state - e)
        assert np.abs((fp - fm) / (2 * h) - t.force_state[:, :, k]).max() < 2e-6
        assert np.abs((sp - sm) / (2 * h) - t.state_state[:, :, k]).max() < 2e-6
