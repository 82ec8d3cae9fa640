"""Floquet multipliers of the points of a curve, against integrations that are disturbed, equations
of variation integrated by scipy, and closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag

from tests.hbm.cases import beam, load, rig, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.hbm.stability import random_points
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.contact_setting import ContactSetting
from tipdamp.hbm.balance.parameter import Damping
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import (
    Contacts,
    CubicSpring,
    DryFriction1T,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    MixedLaw,
    UnilateralSpring,
)
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.coordinates import OwnForce
from tipdamp.hbm.laws.uncoupled import breaks
from tipdamp.hbm.laws.uncoupled.law import located
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band, follow_parameter
from tipdamp.hbm.stability import kernels, multipliers
from tipdamp.hbm.stability.multipliers import Stability, StabilitySettings
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.period_map import largest_multiplier


def solved(problem, force, w, H, x=None):
    balance = HarmonicBalance(problem, {1: force}, H)
    point = solve_fixed(balance.evaluate, balance.linear(w) if x is None else x, w, balance.weights)
    assert point.converged
    return point


def duffing(cubic=1.0, c=0.02, P=1):
    """m = k = 1, as tests/reference I1 but for its damping."""
    one = np.eye(P)
    contacts = Contacts(*np.zeros((4, P)))
    return ContactProblem(one, c * one, one, one, CubicSpring(cubic), contacts)


def by_integration(point, w, c, cubic):
    """(2,) multipliers of Duffing's oscillator on the motion of a point."""
    H = (len(point.x) - 1) // 2

    def rate(t, y):
        x = fourier.basis(np.array([w * t]), H)[0] @ point.x
        Y = y.reshape(2, 2)
        return np.array([Y[1], -c * Y[1] - (1 + 3 * cubic * x**2) * Y[0]]).ravel()

    end = solve_ivp(rate, (0, 2 * np.pi / w), np.eye(2).ravel(), rtol=1e-11, atol=1e-12)
    return np.linalg.eigvals(end.y[:, -1].reshape(2, 2))


@pytest.mark.parametrize("w, H", [(0.5, 9), (1.3, 9), (1.9, 5), (0.24, 25)])
def test_duffing_against_the_equation_of_variation(w, H):
    point = solved(duffing(), np.array([0.5]), w, H)
    found = Stability().multipliers(point.detail, w)[:2]
    wanted = by_integration(point, w, 0.02, 1.0)
    wanted = wanted[np.lexsort((-wanted.imag, -np.abs(wanted)))]
    assert found == pytest.approx(wanted, abs=2e-6)
    assert np.prod(found).real == pytest.approx(np.exp(-0.02 * 2 * np.pi / w), rel=1e-6)


DAMPED_BEYOND_OSCILLATION = {
    "one mode": [[3.0]],
    "one mode, critical": [[2.0]],
    "one of two modes": [[0.05, -0.02], [-0.02, 4.0]],
    "both modes": [[3.0, -1.0], [-1.0, 2.5]],
}


@pytest.mark.parametrize("name", DAMPED_BEYOND_OSCILLATION)
def test_modes_that_do_not_oscillate(name):
    """Their poles are real, and each of them counts once."""
    C, w, H = np.array(DAMPED_BEYOND_OSCILLATION[name]), 1.1, 9
    n = len(C)
    K = np.array([[1.0, -0.3], [-0.3, 1.2]])[:n, :n]
    problem = Problem(np.eye(n), C, K).add(CubicSpring(0.5), 0).force(0, 0.9)
    solution = problem.solve_at(omega=w, outputs={"x": 0}, harmonics=H, stability="all")
    x = fourier.to_real(solution.contact_motion).ravel()

    def rate(t, flat):
        u = fourier.basis(np.array([w * t]), H)[0] @ x
        dq, dv = flat.reshape(2, n, 2 * n)
        return np.concatenate(
            [dv, -C @ dv - K @ dq - 1.5 * u**2 * np.eye(n)[:, :1] * dq[0]]
        ).ravel()

    end = solve_ivp(rate, (0, 2 * np.pi / w), np.eye(2 * n).ravel(), rtol=1e-11, atol=1e-13)
    wanted = np.linalg.eigvals(end.y[:, -1].reshape(2 * n, 2 * n))
    wanted = wanted[np.argsort(-np.abs(wanted))]
    found = solution.multipliers[: 2 * n]
    assert np.abs(found) == pytest.approx(np.abs(wanted), abs=1e-5)
    assert np.isnan(solution.multipliers[2 * n :]).all()


def test_duffing_is_unstable_between_its_folds():
    """Folds are where a multiplier passes 1: the frequency turns round there."""
    curve = follow_band(
        duffing(c=0.1),
        np.array([0.4]),
        tuple(np.array([0.4, 2.4]) / (2 * np.pi)),
        harmonics=5,
        outputs={"x": [1.0]},
        stability="all",
    )
    backwards = np.flatnonzero(np.diff(curve.frequency) < 0)
    unstable = np.flatnonzero(curve.unstable)
    assert curve.complete and len(backwards) > 3
    assert abs(unstable[0] - backwards[0]) <= 1 and abs(unstable[-1] - backwards[-1]) <= 1
    assert (np.diff(unstable) == 1).all() and (curve.stable ^ curve.unstable).all()
    assert np.abs(curve.multipliers[unstable, 0].imag).max() == 0


@pytest.mark.parametrize("hz", [84.02, 156.0, 161.43, 204.0, 240.0])
def test_oscillator_with_friction_slip_and_lift_off(hz):
    """Stable and not: at 84 and 161 Hz a pair of complex multipliers stands outside of the unit
    circle. Disturbed event-driven integration gives the largest modulus."""
    w = 2 * np.pi * hz
    point = solved(oscillator(), 3 * FORCE, w, 21)
    integrator = ExactIntegrator(point.detail.balance, w)
    wanted, _ = largest_multiplier(integrator, integrator.on_orbit(point))
    found = Stability().multipliers(point.detail, w)
    assert abs(found[0]) == pytest.approx(wanted, rel=3e-4)
    assert (abs(found[0]) > 1) == (wanted > 1) == (hz in (84.02, 161.43))


@pytest.mark.parametrize("name, hz", [("B8", 900.0), ("B8", 1000.0), ("C8", 1000.0)])
def test_clamped_beams(name, hz):
    """As above, with one multiplier for each slider that rests at the begin and moves later."""
    problem, force, _ = beam(name)
    w = 2 * np.pi * hz
    point = solved(problem, 20 * force, w, 11)
    integrator = ExactIntegrator(point.detail.balance, w)
    wanted, _ = largest_multiplier(integrator, integrator.on_orbit(point))
    assert abs(Stability().multipliers(point.detail, w)[0]) == pytest.approx(wanted, rel=3e-3)


def test_unstable_branch_of_a_unilateral_spring():
    """C1 folds twice: between the folds one multiplier is real and above 1."""
    problem, force = unilateral(load("C1")["parameters"])
    curve = follow_band(
        problem, force, (0.05, 0.35), harmonics=7, outputs={"x": [1.0]}, stability="all"
    )
    back = np.flatnonzero(np.diff(curve.frequency) < 0)
    inside = curve.multipliers[back[1:], 0]
    assert curve.complete and len(back) > 5
    assert (inside.real > 1).all() and not inside.imag.any()
    assert curve.stable[: back[0]].all() and curve.stable[back[-1] + 2 :].all()


def test_period_doubling_of_a_unilateral_spring():
    """C1 at 1.2 N: near 0.121 Hz a multiplier lies below -1. An integration that starts beside the
    motion doubles its period."""
    problem, force = unilateral(load("C1")["parameters"] | {"F": 1.2})
    curve = follow_band(
        problem, force, (0.115, 0.125), harmonics=15, outputs={"x": [1.0]}, stability="all"
    )
    i = int(curve.multipliers[:, 0].real.argmin())
    w = 2 * np.pi * curve.frequency[i]
    assert curve.multipliers[i, 0].real < -1.01 and not curve.multipliers[i, 0].imag
    point = solved(problem, force, w, 15, curve.unknowns[i])
    integrator = ExactIntegrator(point.detail.balance, w)
    begin = integrator.on_orbit(point)
    state = integrator.from_vector(integrator.vector(begin) + 1e-3)
    for _ in range(400):
        state = integrator.periods(state).state
    one, two = integrator.periods(state), integrator.periods(state, 2)
    moved = [integrator.change(state, cycle) for cycle in (one, two)]
    assert moved[0] > 1e-2 and moved[1] < 0.2 * moved[0]


def test_stuck_contacts_leave_the_poles():
    """No contact moves: exp(s T) of the stuck system, here of modes with 2 % of damping."""
    problem, force, outputs = beam("B8")
    w = 2 * np.pi * 800
    point = solved(problem, 1e-6 * force, w, 3)
    s = np.linalg.eigvals(
        np.block(
            [
                [np.zeros_like(problem.M), np.eye(len(problem.M))],
                [
                    -np.linalg.solve(problem.M, problem.stuck_stiffness),
                    -np.linalg.solve(problem.M, problem.C),
                ],
            ]
        )
    )
    wanted = np.sort(np.abs(np.exp(2 * np.pi * s / w)))[::-1][:4]
    assert np.abs(Stability().multipliers(point.detail, w)) == pytest.approx(wanted, rel=1e-6)


def two_masses():
    """A slider and a cubic spring on two masses."""
    law = MixedLaw((Jenkins1D(), CubicSpring(2.0)), of_pair=(0, 1))
    K = np.array([[2.0, -1.0], [-1.0, 1.5]])
    B = np.zeros((6, 2))
    B[0, 0], B[5, 1] = 1.0, 1.0
    contacts = Contacts([0.0, 0.0], [0.8, 0.0], [0.5, 0.0], [0.4, 0.0])
    return ContactProblem(np.eye(2), 0.05 * K, K, B, law, contacts)


@pytest.mark.parametrize("w", [0.7, 1.1, 1.6])
def test_friction_and_a_cubic_spring(w):
    """The period map by differences of an integration of its own: scipy between the instants of
    the slider."""
    problem, force = two_masses(), np.array([0.5, 0.2])
    point = solved(problem, force, w, 25)
    kt, limit, T = 0.8, 0.2, 2 * np.pi / w
    F = force

    def period(y):
        """(x1, x2, v1, v2, slider) after a period, in 800 steps of Runge and Kutta."""
        n = 800
        h = T / n

        def rate(t, z, slider):
            pull = kt * (z[0] - slider)
            q = np.array([np.clip(pull, -limit, limit), 2.0 * z[1] ** 3])
            a = F * np.cos(w * t) - problem.C @ z[2:] - problem.K @ z[:2] - q
            return np.r_[z[2:], a]

        z, slider = y[:4].copy(), y[4]
        for i in range(n):
            t = i * h
            k1 = rate(t, z, slider)
            k2 = rate(t + h / 2, z + h / 2 * k1, slider)
            k3 = rate(t + h / 2, z + h / 2 * k2, slider)
            k4 = rate(t + h, z + h * k3, slider)
            z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            slider = np.clip(slider, z[0] - limit / kt, z[0] + limit / kt)
        return np.r_[z, slider]

    u = point.x.reshape(2, 3, -1)
    H = (u.shape[2] - 1) // 2
    at, rate = fourier.basis(np.zeros(1), H)[0], fourier.basis_rate(np.zeros(1), H)[0]
    y = np.r_[u[0, 0] @ at, u[1, 2] @ at, w * (u[0, 0] @ rate), w * (u[1, 2] @ rate), 0.0]
    for _ in range(6):  # from the motion of 25 harmonics, the slider at zero
        y = period(y)
    h = 1e-6
    J = np.array([(period(y + h * e) - period(y - h * e)) / (2 * h) for e in np.eye(5)]).T
    wanted = np.linalg.eigvals(J)
    wanted = wanted[np.abs(wanted - 1) > 1e-7]  # of a slider that rests
    wanted = wanted[np.argsort(-np.abs(wanted))][:2]
    found = Stability().multipliers(point.detail, w)[:2]
    assert np.abs(found) == pytest.approx(np.abs(wanted), rel=4e-3)
    assert np.abs(found.real) == pytest.approx(np.abs(wanted.real), abs=4e-3)


class Remembering(ContactLaw):
    """A slider without variation."""

    components = ("t1",)
    states = 1
    sliders = 1

    def step(self, motion, state, contacts):
        """Jenkins' element."""
        return Jenkins1D().step(motion, state, contacts)


def test_law_that_does_not_say():
    """Of a law of one's own with states: neither stable nor unstable."""
    mass = Problem([[1.0]], [[0.05]], [[1.0]]).force(0, 1.0)
    mass = mass.add(Remembering(), 0, kt=0.5, mu=0.5, preload=1.0)
    curve = mass.follow_band((0.19, 0.2), harmonics=1, outputs={"x": 0}, stability="all")
    assert curve.share_slip.max() > 0.1
    assert np.isnan(curve.multipliers).all() and not (curve.stable | curve.unstable).any()


@pytest.mark.slow
@pytest.mark.parametrize("kind", random_points.LAWS)
def test_random_points_beside_orbits_of_their_own(kind):
    """By an integration that shares nothing with ours: the leading multiplier to 1e-4, and the way
    by which stability is lost. More of them in the validation."""
    compared = [one for one in random_points.several(kind, 3) if not one.marked]
    assert compared
    for found in compared:
        assert found.error <= 1e-4, found
        assert found.agrees or not found.clear, found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_coupled_tangents_along_a_line(seed):
    """A contact that moves along its first tangent alone is one with two limits."""
    found = []
    for law in (IsotropicFriction(), DryFriction2T()):
        problem, force, w = random_system(law, seed)
        B = problem.B.copy()
        B[1::3] = 0.0
        given = problem.M, problem.C, problem.K, B, law, problem.contacts
        point = random_points.solved(ContactProblem(*given), force, w, (3, 11))
        assert seed != 4 or (point.detail.forces.shares[:, 2] > 0).any()
        found.append(Stability().multipliers(point.detail, w))
    assert found[0] == pytest.approx(found[1], abs=1e-5)


def test_coupled_tangents_beside_another_law():
    """In a mixture, whichever comes first: as each by itself on bodies that do not touch."""
    one, contacts = np.eye(6), Contacts([0.5, 0.6], [0.5, 0.4], [0.5, 0.6], [1.0, 0.8])
    laws, push = (IsotropicFriction(), DryFriction2T()), np.array([1, 0.6j, 0.1] * 2)
    alone = []
    for i, law in enumerate(laws):
        own = one[:3, :3], 0.05 * one[:3, :3], one[:3, :3], one[:3, :3], law
        alone_there = ContactProblem(*own, contacts.select([i]))
        point = random_points.solved(alone_there, push[:3], 1.2, (1, 5))
        assert point.detail.forces.shares[0, 1] > 0.1
        alone.append(Stability(StabilitySettings(kept=6)).multipliers(point.detail, 1.2))
    mixed = ContactProblem(one, 0.05 * one, one, one, MixedLaw(laws, (0, 1)), contacts)
    point = random_points.solved(mixed, push, 1.2, (1, 5))
    both = Stability(StabilitySettings(kept=8)).multipliers(point.detail, 1.2)
    every = np.concatenate(alone)
    for found in both:
        assert np.nanmin(np.abs(every - found)) < 1e-4


def test_peaks_alone():
    """As of the same points of the whole curve; another word is refused."""
    problem, force = unilateral(load("C1")["parameters"])
    options = dict(harmonics=3, outputs={"x": [1.0]})
    whole, peaks = (
        follow_band(problem, force, (0.15, 0.25), stability=points, **options)
        for points in ("all", "peaks")
    )
    at = peaks.peak_points.any(axis=1)
    assert at.sum() and np.isnan(peaks.multipliers[~at]).all()
    assert np.array_equal(peaks.multipliers[at], whole.multipliers[at], equal_nan=True)
    with pytest.raises(InputError, match="stability = 'some': must be one of none, peaks, all"):
        follow_band(problem, force, (0.15, 0.25), stability="some", **options)


def test_curve_without_multipliers():
    problem, force = unilateral(load("C1")["parameters"])
    curve = follow_band(problem, force, (0.1, 0.3), harmonics=1, outputs={"x": [1.0]})
    assert not curve.multipliers.size and not (curve.stable | curve.unstable).any()


@pytest.mark.parametrize("parameter", [ContactSetting("mu"), Damping()])
def test_along_a_parameter(parameter):
    """As at the frequency with that setting, but for what more harmonics change."""
    curve = follow_parameter(
        oscillator(),
        3 * FORCE,
        204.0,
        parameter,
        (1.0, 1.6),
        harmonics=5,
        outputs=Y2,
        at=(1.3,),
        stability="all",
    )
    there = int(np.abs(curve.parameter - 1.3).argmin())
    problem, _ = parameter.rebuild(oscillator(), {1: 3 * FORCE}, 1.3)
    point = solved(problem, 3 * FORCE, 2 * np.pi * 204.0, 5, curve.unknowns[there])
    wanted = Stability().multipliers(point.detail, 2 * np.pi * 204.0)
    assert curve.parameter[there] == pytest.approx(1.3)
    assert curve.multipliers[there] == pytest.approx(wanted, abs=1e-3, nan_ok=True)


@pytest.mark.slow
def test_modes_and_steps_of_the_rig():
    """Twice and eight times as many of them."""
    problem, force, _ = rig()
    w = 2 * np.pi * 2780
    point = solved(problem, 20 * force, w, 5)
    found, modes, steps = (
        abs(Stability(StabilitySettings(**more)).multipliers(point.detail, w)[0])
        for more in ({}, {"massless_above": 28.0}, {"steps": 200, "per_mode": 24})
    )
    assert found == pytest.approx(modes, rel=2e-4) and found == pytest.approx(steps, rel=1e-6)


def random_system(law, seed):
    """(problem, force, w) of 3 to 6 masses with one or two contacts."""
    random = np.random.default_rng(seed)
    r, P, nd = int(random.integers(3, 7)), int(random.integers(1, 3)), len(law.components)
    A, G = random.standard_normal((2, r, r))
    M = np.eye(r) + 0.2 * A @ A.T / r
    K = np.diag(random.uniform(0.5, 4, r)) + 0.3 * G @ G.T / r
    B = 0.7 * random.standard_normal((P * nd, r))
    contacts = Contacts(
        random.uniform(0.5, 5, P),
        random.uniform(0.3, 2, P),
        random.uniform(0.2, 0.7, P),
        random.uniform(0.1, 0.6, P),
    )
    problem = ContactProblem(M, 0.02 * K + 0.01 * M, K, B, law, contacts)
    force = random.uniform(0.2, 1.5) * random.standard_normal(r)
    return problem, force, random.uniform(0.5, 2.5)


def touching(point):
    """Whether a slider that sticks through was moved to where it is by the motion."""
    balance = point.detail.balance
    law, of = balance.problem.law, balance.problem.contacts
    sliders = breaks.Sliders(
        law.sliders, law.components[-1] == "n", of.kt, of.kn, of.mu, of.preload
    )
    x = np.ascontiguousarray(point.x.reshape(len(of), balance.nd, -1))
    pieces, counts, *_ = located(sliders, x, balance.start, balance.grid)
    one = counts[:, : law.sliders] == 1
    return bool((one & (pieces[:, : law.sliders, 0, breaks.BY_U] != 0)).any())


@pytest.mark.parametrize("law", [Jenkins1D(), UnilateralSpring(), DryFriction1T(), DryFriction2T()])
def test_random_systems(law):
    """The leading modulus and the verdict by disturbed event-driven integration. Left out: what
    sticks through, motions that 41 harmonics do not hold, and sliders that touch their limit
    without slip, where a derivative has two sides."""
    compared = 0
    for seed in range(40):
        problem, force, w = random_system(law, seed)
        point = None
        for H in (3, 11, 41):
            balance = HarmonicBalance(problem, {1: force}, H)
            x = np.zeros((balance.n_components, balance.nh))
            if point is None:
                x[:] = balance.linear(w).reshape(x.shape)
            else:
                x[:, : point.x.size // len(x)] = point.x.reshape(len(x), -1)
            point = solve_fixed(balance.evaluate, x.ravel(), w, balance.weights)
            if not point.converged:
                break
        if not point.converged or (point.detail.forces.shares[:, 0] > 0.9).any():
            continue
        integrator = ExactIntegrator(point.detail.balance, w)
        begin = integrator.on_orbit(point)
        if touching(point) or integrator.change(begin, integrator.periods(begin)) > 1e-4:
            continue
        wanted, _ = largest_multiplier(integrator, begin)
        found = abs(Stability().multipliers(point.detail, w)[0])
        assert found == pytest.approx(wanted, rel=1e-3), seed
        assert (found > 1) == (wanted > 1), seed
        compared += 1
        if compared == 6:
            break
    assert compared == 6


STOPS = [(10.0, 0.3), (100.0, 0.3), (10.0, 0.1), (1000.0, 0.9), (1e6, 1.3)]


@pytest.mark.parametrize("kn, f", STOPS)
def test_a_stiff_stop_that_is_never_touched(kn, f):
    """Linear: the multipliers are exp(s T), whatever the stiffness that it would have."""
    mass = Problem([[1.0]], [[0.02]], [[1.0]]).add(UnilateralSpring(), 0, kn=kn, preload=-kn)
    band = np.array([0.99, 1.01]) * f / (2 * np.pi)
    curve = mass.force(0, 0.01).follow_band(band, outputs={"x": 0}, harmonics=3, stability="all")
    exact = np.exp((-0.01 + 1j * np.sqrt(1 - 1e-4)) / curve.frequency)
    exact = np.where(exact.imag >= 0, exact, exact.conj())
    assert np.abs(curve.multipliers[:, 0] - exact).max() < 1e-5


def chain(n, law, w, **given):
    """M, C, K and the problem of n masses, the first driven, with a contact at the middle one; its
    settings by the amplitude there without it."""
    r, middle = np.random.default_rng(1), n // 2
    M, k = np.diag(r.uniform(0.5, 1.5, n)), r.uniform(0.7, 1.5, n + 1)
    K = np.diag(k[:n] + k[1:]) - np.diag(k[1:n], 1) - np.diag(k[1:n], -1)
    C, force = 0.02 * M + 0.004 * K, np.eye(n)[0]
    free = np.abs(np.linalg.solve(K - w**2 * M + 1j * w * C, force)[middle])
    given["preload"] *= free
    return M, C, K, Problem(M, C, K).force(0, 1.0).add(law, middle, **given)


LONG = {
    "a stop, among the modes": (UnilateralSpring(), 0.6, {"kn": 100.0, "preload": -40.0}),
    "a stop, below the modes": (UnilateralSpring(), 0.25, {"kn": 100.0, "preload": -40.0}),
    "friction": (Jenkins1D(), 0.6, {"kt": 100.0, "mu": 1.0, "preload": 0.8}),
}


@pytest.mark.parametrize("name", LONG)
def test_a_stiff_contact_on_a_long_chain(name):
    """Where it is open or slips the inertia of its place sits in a mode that is fast while it
    sticks: as with the mass of every mode kept."""
    law, w, given = LONG[name]
    *_, problem = chain(30, law, w, **given)
    solution = problem.solve_at(omega=w, outputs={"x": 15}, harmonics=40, stability="all")
    assert 0 < solution.share_stick[0] < 1
    motion = fourier.to_real(solution.contact_motion).ravel()
    point = solved(problem.contact_problem, np.eye(30)[0], w, 40, motion)
    exact = Stability(StabilitySettings(massless_above=1e6)).multipliers(point.detail, w)
    found = Stability().multipliers(point.detail, w)
    assert np.abs(found) == pytest.approx(np.abs(exact), abs=1e-3)


def test_each_leading_multiplier_has_the_modes_that_it_needs():
    """Not one of them alone: beside the chain, whose stop needs faster modes, an oscillator that
    needs none."""
    law, w, given = LONG["a stop, below the modes"]
    M, C, K, one = chain(30, law, w, **given)
    M, C, K = block_diag(M, 1.0), block_diag(C, 2e-3), block_diag(K, 1.2 * w**2)
    stop = {**given, "preload": one.contact_problem.contacts.preload[0]}
    problem = Problem(M, C, K).add(law, 15, **stop).add(CubicSpring(0.5), 30)
    problem = problem.force(0, 1.0).force(30, 0.02)
    solution = problem.solve_at(omega=w, outputs={"x": 15}, harmonics=40)
    motion = fourier.to_real(solution.contact_motion).ravel()
    force = np.eye(31)[0] + 0.02 * np.eye(31)[30]
    point = solved(problem.contact_problem, force, w, 40, motion)
    exact = Stability(StabilitySettings(massless_above=1e6)).multipliers(point.detail, w)
    found = Stability().multipliers(point.detail, w)
    assert np.abs(found) == pytest.approx(np.abs(exact), rel=1e-3)


@pytest.mark.parametrize("n, kn, w", [(3, 1e6, 0.3), (13, 1e4, 0.3), (30, 1e4, 0.6)])
def test_a_stiff_stop_on_a_chain_that_is_never_touched(n, kn, w):
    """Linear: the multipliers are exp(s T) of the chain alone."""
    M, C, K, problem = chain(n, UnilateralSpring(), w, kn=kn, preload=-10 * kn)
    solution = problem.solve_at(omega=w, outputs={"x": 0}, harmonics=3, stability="all")
    zero = np.zeros((n, n))
    system = np.block([[zero, np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    exact = np.sort(np.exp(2 * np.pi / w * np.linalg.eigvals(system).real))[::-1]
    assert solution.stable
    assert np.abs(solution.multipliers) == pytest.approx(exact[:4], abs=1e-6)


@pytest.mark.slow
def test_fast_modes_beside_many_slow_ones_keep_their_mass():
    """Thirty masses at a third of the frequency to four times it, the fastest damped least: its
    multiplier leads, although it is not among the slowest that are always kept.

    dq'' = -C dq' - (K + 3 u^2 b b') dq, integrated over a period.
    """
    speed = np.linspace(0.33, 4.0, 30)
    C, K = np.diag(np.linspace(0.3, 0.01, 30)), np.diag(speed**2)
    b, w = np.full(30, 0.05), 1.0
    contacts = Contacts(*np.zeros((4, 1)))
    problem = ContactProblem(np.eye(30), C, K, b[None], CubicSpring(0.5), contacts)
    point = solved(problem, 0.1 * np.eye(30)[5], w, 5)
    x = point.x.reshape(point.detail.balance.n_components, -1)[0]

    def rate(t, flat):
        u = fourier.basis(np.array([w * t]), 5)[0] @ x
        dq, dv = flat.reshape(2, 30, 60)
        return np.concatenate([dv, -C @ dv - (K + 1.5 * u**2 * np.outer(b, b)) @ dq]).ravel()

    end = solve_ivp(rate, (0, 2 * np.pi / w), np.eye(60).ravel(), rtol=1e-8, atol=1e-9)
    wanted = np.sort(np.abs(np.linalg.eigvals(end.y[:, -1].reshape(60, 60))))[::-1]
    found = np.abs(Stability().multipliers(point.detail, w))
    assert found == pytest.approx(wanted[:4], abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("places", [[(0, 1), 1], [(0, 1)], [1, 0]])
def test_matrices_that_are_not_symmetric_beside_the_equation_in_variations(places):
    """dq'' = -C dq' - (K + sum 3 u^2 b b') dq, integrated over a period, with contacts at other
    places than the dofs."""
    C, K = np.array([[0.1, 0.3], [-0.3, 0.15]]), np.array([[2.0, -0.4], [0.1, 1.2]])
    driven = Problem(np.eye(2), C, K, general=True).force(0, 0.5)
    for place in places:
        driven = driven.add(CubicSpring(1.0), place)
    curve = driven.follow_band((0.15, 0.3), outputs={"x": 0, "y": 1}, harmonics=9, stability="all")
    B = np.array([driven.row(place) for place in places])
    for i in range(0, len(curve), 40):
        w, X = 2 * np.pi * curve.frequency[i], curve.harmonics[i]

        def rate(t, flat, w=w, X=X):
            u = B @ (X @ np.exp(1j * w * t * np.arange(10))).real
            dq, dv = flat.reshape(2, 2, 4)
            return np.concatenate([dv, -C @ dv - (K + (B.T * 3 * u**2) @ B) @ dq]).ravel()

        found = solve_ivp(rate, (0, 2 * np.pi / w), np.eye(4).ravel(), rtol=1e-9, atol=1e-11)
        own = np.linalg.eigvals(found.y[:, -1].reshape(4, 4))
        for one in curve.multipliers[i][~np.isnan(curve.multipliers[i])]:
            assert np.abs(own - one).min() < 1e-4


def van_der_pol(w, with_derivative):
    """Two masses, a cubic spring on one and van der Pol's force between both."""

    def by(u, v):
        return (0.6 * u * v)[..., None], (0.3 * (u**2 - 1))[..., None]

    force = OwnForce(
        lambda u, v: 0.3 * (u**2 - 1) * v, 1, derivative=by if with_derivative else None
    )
    M, C, K = np.diag([1.0, 0.5]), 0.2 * np.eye(2), np.array([[1.5, -0.5], [-0.5, 1.5]])
    problem = Problem(M, C, K).add(CubicSpring(0.4), 0).add(force, (0, 1)).force(0, 1.0)

    def system(t, y):
        x, v, phi = y[:2], y[2:4], y[4:].reshape(4, 4)
        u, rate = x[0] - x[1], v[0] - v[1]
        f = 0.3 * (u**2 - 1) * rate
        push = np.array([np.cos(w * t) - 0.4 * x[0] ** 3 - f, f])
        stretch = np.outer([1, -1], [1, -1])
        by_x = K + 0.6 * u * rate * stretch + np.diag([1.2 * x[0] ** 2, 0.0])
        by_v = C + 0.3 * (u**2 - 1) * stretch
        below = -np.linalg.solve(M, np.hstack([by_x, by_v]))
        A = np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), below])
        a = (push - C @ v - K @ x) / M.diagonal()
        return np.r_[v, a, (A @ phi).ravel()]

    return problem, system


@pytest.mark.parametrize("w", [0.9, 1.35, 1.9])
@pytest.mark.parametrize("with_derivative", [True, False])
def test_forces_of_the_velocity_beside_the_equation_in_variations(w, with_derivative):
    """Of one's own, beside a cubic spring: the multipliers are those of scipy's integration."""
    problem, system = van_der_pol(w, with_derivative)
    found = problem.solve_at(omega=w, harmonics=25, outputs={"x": 0, "y": 1}, stability="all")
    assert found.converged
    k = np.arange(26)
    y = np.r_[found.harmonics.real.sum(axis=1), -(w * k * found.harmonics.imag).sum(axis=1)]
    given = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}
    end = solve_ivp(system, (0, 2 * np.pi / w), np.r_[y, np.eye(4).ravel()], **given).y[:, -1]
    assert end[:4] == pytest.approx(y, abs=1e-6)
    own = np.linalg.eigvals(end[4:].reshape(4, 4))
    assert np.sort(np.abs(found.multipliers)) == pytest.approx(np.sort(np.abs(own)), abs=1e-4)
    assert found.stable == (np.abs(own).max() < 1)


def test_van_der_pol_loses_its_periodic_motion():
    """Forced: where the modulus of scipy's multipliers is 1 there is the second frequency."""
    force = OwnForce(lambda u, v: 0.3 * (u**2 - 1) * v, 1)
    problem = Problem([[1.0]], [[0.0]], [[1.0]]).add(force, 0).force(0, 1.0)
    given = {"outputs": {"x": 0}, "harmonics": 11, "stability": "all"}
    curve = problem.follow_band(omega=(1.1, 1.5), **given)
    [point] = curve.named_points
    assert point.kind == "Neimark-Sacker"
    w, x = 2 * np.pi * point.frequency, problem.solve_at(hz=point.frequency, **given).harmonics[0]

    def system(t, y):
        A = np.array([[0, 1], [-1 - 0.6 * y[0] * y[1], 0.3 * (1 - y[0] ** 2)]])
        a = np.cos(w * t) - y[0] - 0.3 * (y[0] ** 2 - 1) * y[1]
        return np.r_[y[1], a, (A @ y[2:].reshape(2, 2)).ravel()]

    y = [x.real.sum(), -(w * np.arange(12) * x.imag).sum(), 1, 0, 0, 1]
    tight = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}
    end = solve_ivp(system, (0, 2 * np.pi / w), y, **tight).y[:, -1]
    assert np.linalg.det(end[2:].reshape(2, 2)) == pytest.approx(1.0, abs=1e-5)


def test_forces_of_the_velocity_beside_friction_are_not_told():
    problem, _ = van_der_pol(1.0, True)
    problem = problem.add(Jenkins1D(), 0, kt=0.5, mu=0.5, preload=0.3)
    found = problem.solve_at(omega=1.0, harmonics=5, outputs={"x": 0}, stability="all")
    assert found.converged and np.isnan(found.multipliers).all()


def test_a_multiplier_that_few_steps_damp_away_is_waited_for():
    """It would be left out as a small one, where the leading ones alone were to settle."""
    leading, true, asked = [0.9, 0.8, 0.7, 0.6], 1.5, []

    def after(steps, _):
        asked.append(steps)
        return np.array([*leading, true * (1 - 1 / (1 + (steps / 60) ** 4))], dtype=complex)

    every, steps = Stability()._settled(after, 12)
    assert np.abs(every).max() == pytest.approx(true, rel=1e-3)
    assert steps == asked[-1] > 200
    assert after(24, True).real.min() < 0.1  # of the first, where the leading ones are as they stay


def test_a_slider_that_touches_its_limit_leaves_the_poles():
    """Coupled friction that sticks through the cycle, at points of a curve that come down to its
    limit: the multipliers are the exponentials of the poles of the stuck system."""
    M, C = (
        np.diag([0.83, 1.18, 0.5]),
        0.02 * np.array([[2, -0.3, 0], [-0.3, 2.5, -0.5], [0, -0.5, 1.6]]),
    )
    K = np.array([[1.6, -0.475, 0], [-0.475, 2.48, -0.756], [0, -0.756, 1.78]])
    kn, kt, limit = 0.86, 1.0, 0.415 * 4.7
    problem = Problem(M, C, K).add(
        IsotropicFriction(), [2, 1, 0], kn=kn, kt=kt, mu=0.415, preload=4.7
    )
    problem = problem.force(2, 0.43).force(0, 0.38 - 0.3j)
    stuck = np.linalg.solve(M, np.hstack([K + np.diag([kn, kt, kt]), C]))
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-stuck]])
    given = {"outputs": {"x": 0}, "harmonics": 15, "stability": "all"}
    onset = [
        point.frequency
        for point in problem.follow_band(omega=(0.7, 3.2), **given).named_points
        if point.kind == "onset of slip"
    ]
    assert len(onset) > 1 and limit > 0
    sticks = 0
    for hz in np.outer(onset, 1 + np.array([-1e-8, 0.0, 1e-8])).ravel():
        found = problem.solve_at(hz=hz, **given)
        if not found.converged or found.share_slip.max() > 0:
            continue
        sticks += 1
        own = np.abs(np.exp(np.linalg.eigvals(A) / hz))
        assert abs(found.multipliers[0]) == pytest.approx(own.max(), abs=1e-9)
    assert sticks > 3


@pytest.fixture
def maps(monkeypatch):
    """(numbers of intervals of the period maps that are made, in turn)."""
    lengths = []

    def counted(poles, segments, begins):
        lengths.append(len(segments.length))
        return kernels.monodromy(poles, segments, begins)

    monkeypatch.setattr(multipliers, "monodromy", counted)
    return lengths


@pytest.mark.parametrize("case, hz", [("B8", 900.0), ("duffing", 1.3 / (2 * np.pi))])
def test_a_motion_that_goes_its_way_back_is_integrated_half_a_period(case, hz, maps):
    """With the same multipliers as over the whole period."""
    problem, force = beam(case)[:2] if case == "B8" else (duffing(), np.ones(1))
    level = 20 if case == "B8" else 1
    point = solved(problem, level * force, 2 * np.pi * hz, 7)
    half = Stability().multipliers(point.detail, 2 * np.pi * hz)
    intervals = maps.copy()
    whole = Stability(StabilitySettings(alike=-1.0)).multipliers(point.detail, 2 * np.pi * hz)
    assert [2 * n for n in intervals] == maps[len(intervals) :]
    assert np.allclose(half, whole, rtol=0, atol=1e-10, equal_nan=True)


def test_a_motion_that_lifts_off_is_integrated_whole(maps):
    problem, force, _ = beam("C8")
    point = solved(problem, 40 * force, 2 * np.pi * 1000.0, 7)
    Stability().multipliers(point.detail, 2 * np.pi * 1000.0)
    intervals = maps.copy()
    Stability(StabilitySettings(alike=-1.0)).multipliers(point.detail, 2 * np.pi * 1000.0)
    assert intervals == maps[len(intervals) :]


def test_of_points_alike_every_fourth_is_checked(maps):
    """And each one between other events; the multipliers are those of points that are checked."""
    problem, force, _ = beam("C8")
    every, each = Stability(), StabilitySettings(unchecked=0)
    for hz in np.linspace(980.0, 1000.0, 12):
        point = solved(problem, 40 * force, 2 * np.pi * hz, 7)
        found = every.multipliers(point.detail, 2 * np.pi * hz)
        made = len(maps)
        checked = Stability(each).multipliers(point.detail, 2 * np.pi * hz)
        del maps[made:]
        assert np.allclose(found, checked, rtol=0, atol=1e-4, equal_nan=True)
    assert 12 < len(maps) < 24


def test_a_stop_far_stiffer_than_where_the_parameter_begins():
    """Between touch and leaving lie few steps, however many a period has: the product of both
    multipliers is that of the damping alone, exp(-c T), while kn grows by five decades."""
    stop = Problem([[1.0]], [[0.1]], [[1.0]]).add(UnilateralSpring(), 0, kn=10.0, preload=0.3)
    curve = follow_parameter(
        stop.force(0, 1.0),
        np.ones(1),
        None,
        "kn",
        (0.1, 1e4),
        omega=1.7,
        outputs={"x": 0},
        harmonics=41,
        stability="all",
    )
    both = np.abs(curve.multipliers[:, 0] * curve.multipliers[:, 1])
    assert curve.complete and np.abs(both / np.exp(-0.1 * 2 * np.pi / 1.7) - 1).max() < 1e-3


@pytest.mark.parametrize("sliders", [0, 1])
def test_a_multiplier_of_one_counts_where_nothing_is_neutral(sliders):
    """As at a fold: of a motion without sliders, which everything holds."""
    law, stiffness = (Jenkins1D(), 1.0) if sliders else (CubicSpring(1.0), 0.0)
    one = np.eye(1)
    settings = Contacts([0.0], [stiffness], [stiffness], [stiffness])
    problem = ContactProblem(one, 0.1 * one, one, one, law, settings)
    point, stability = solved(problem, 2.0 * np.ones(1), 1.2, 5), Stability()
    found = stability.multipliers(point.detail, 1.2)
    assert np.isfinite(found[:2]).all()
    assert stability._leading(np.array([1.0, 0.5])).tolist() == [[1.0, 0.5], [0.5]][sliders]
