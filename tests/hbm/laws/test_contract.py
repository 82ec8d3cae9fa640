"""Every contact law keeps the contract, and does what friction and contact do."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from tests.hbm.cases import solve
from tests.hbm.conformance import LAWS, located_slider, mixed, one_dof, own_law, random_case
from tipdamp.hbm import fourier, laws
from tipdamp.hbm.balance import aft
from tipdamp.hbm.balance.differences import check_derivatives
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.comparison import compare_point
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import sampled
from tipdamp.hbm.response import forced_response
from tipdamp.hbm.testing import check_law, forces, history, total_force
from tipdamp.hbm.time.settings import IntegrationSettings

H = 5
each_law = pytest.mark.parametrize("case", LAWS, ids=lambda c: c.law.name)
each_start = pytest.mark.parametrize("start", aft.STARTS)
Dahl, BoucWen = own_law("dahl").Dahl, own_law("bouc_wen").BoucWen


@each_law
def test_contract(case):
    check_law(case.law)


@pytest.mark.slow
def test_contract_of_a_mixture():
    check_law(mixed(14), random_case(laws.DryFriction2T(), P=14)[1])


@pytest.mark.slow
@pytest.mark.parametrize(
    "law",
    [
        laws.CubicSpring(np.linspace(-2, 2, 12)),
        BoucWen(np.linspace(0.05, 0.5, 12), np.linspace(0.2, 0.8, 12), 0.8, 0.2, order=2),
    ],
    ids=lambda law: law.name,
)
def test_contract_with_a_parameter_per_contact(law):
    check_law(law)


class _NotAnalytic(Dahl):
    def step(self, motion, state, contacts):
        force, state = super().step(motion, state, contacts)
        return force.real + 0 * force, state


class _OneForAll(Dahl):
    def step(self, motion, state, contacts):
        force, state = super().step(motion, state, contacts)
        return force + 1e-3 * force.sum(), state


class _OtherFriction(laws.DryFriction2T):
    def harmonics(self, contacts, *rest):
        return super().harmonics(replace(contacts, mu=1.01 * contacts.mu), *rest)


class _OtherTable(laws.DryFriction2T):
    def piecewise_linear(self, contacts):
        return super().piecewise_linear(replace(contacts, mu=1.2 * contacts.mu))


class _OtherDerivative(laws.DryFriction2T):
    def harmonics(self, *given):
        f = super().harmonics(*given)
        return replace(f, D=1.01 * f.D)


class _OtherPreload(laws.DryFriction2T):
    def harmonics(self, *given):
        f = super().harmonics(*given)
        return replace(f, by_preload=1.01 * f.by_preload)


class _OtherLimit(laws.DryFriction2T):
    def by_friction(self, *given):
        return 1.01 * super().by_friction(*given)


class _OtherTangents(Dahl):
    def tangents(self, *given):
        force, state, t = super().tangents(*given)
        return force, state, replace(t, force_state=0 * t.force_state)


class _OneStepsTangent(Dahl):
    """Wrong in a single step of a single contact."""

    def tangents(self, *given):
        force, state, t = super().tangents(*given)
        wrong = t.force_u.copy()
        wrong[-1:] *= 1.01
        return force, state, replace(t, force_u=wrong)


class _OneContactsDerivative(Dahl):
    """Wrong in the contact that slips most."""

    def harmonics(self, *given):
        f = super().harmonics(*given)
        wrong = f.D.copy()
        if len(wrong):
            wrong[np.abs(wrong).reshape(len(wrong), -1).max(axis=1).argmax()] *= 1.001
        return replace(f, D=wrong)


class _OtherRest(laws.UnilateralSpring):
    def stuck_force(self, contacts):
        return 0.9 * super().stuck_force(contacts)


class _SticksTooSurely(laws.DryFriction2T):
    def sticks_surely(self, contacts, amplitude):
        return super().sticks_surely(contacts, 0.3 * amplitude)


class _Directed(Dahl):
    def step(self, motion, state, contacts):
        force, state = super().step(motion, state, contacts)
        return force + 0.01 * motion.u**2, state


class _Clocked(laws.DryFriction2T):
    """Knows where the period begins."""

    def harmonics(self, contacts, x, *rest):
        f = super().harmonics(contacts, x, *rest)
        return replace(f, g=f.g * (1 + 1e-4 * x[:, -1:, 1:2]))


class _Drifting(laws.ContactLaw):
    components: ClassVar[tuple] = ("n",)
    states: ClassVar[int] = 1

    def step(self, motion, state, contacts):
        return state + 0 * motion.u, state + 1e-3 * motion.dt


@dataclass(frozen=True)
class Viscous(laws.ContactLaw):
    """A dashpot c (N s/m)."""

    components: ClassVar[tuple] = ("t1",)

    c: float | np.ndarray

    def step(self, motion, state, contacts):
        return np.reshape(self.c, (-1, 1)) * motion.v, state


class _NotOfRate(Viscous):
    def harmonics(self, *given):
        return replace(super().harmonics(*given), by_omega=None)


@pytest.mark.parametrize(
    "law, message",
    [
        (_NotAnalytic(), "analytic"),
        (_OneForAll(), "another force or state than step"),
        (_OtherFriction(), "harmonics differ from those of step"),
        (_OtherTable(), "table gives another force"),
        (_OtherDerivative(), "derivatives of harmonics by the motion"),
        (_OtherPreload(), "derivatives of harmonics by the preload"),
        (_OtherLimit(), "derivatives of harmonics by mu"),
        (_NotOfRate(0.3), "by omega"),
        (_OtherTangents(), "tangents by the state before"),
        (_OneStepsTangent(), "tangents by the motion"),
        (_OneContactsDerivative(), "derivatives of harmonics by the motion"),
        (_OtherRest(), "harmonics differ"),
        (_SticksTooSurely(), "does not stick"),
        (_Clocked(), "shifted in time"),
        (_Directed(), "mirrored"),
        (_Drifting(), "does not repeat"),
    ],
    ids=lambda v: getattr(v, "name", ""),
)
def test_a_broken_contract_is_found(law, message):
    with pytest.raises(AssertionError, match=message):
        check_law(law)


@dataclass(frozen=True)
class _ForceAndPosition(laws.ContactLaw):
    """dF/du = k (1 - F sign(du)/limit) [Dahl 1968], exact in a step; states F in N and u in m."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    k: float | np.ndarray
    limit: float | np.ndarray

    def stuck_stiffness(self, contacts):
        return self.k * np.ones((len(contacts), 1))

    def step(self, motion, state, contacts):
        u, F = motion.u[:, 0], state[:, 0]
        du = u - state[:, 1]
        end = self.limit * np.where(np.real(du) < 0, -1.0, 1.0)
        F = end + (F - end) * np.exp(-self.k * du / end)
        return F[:, None], np.stack([F, u], axis=1)


class _OtherPosition(_ForceAndPosition):
    def tangents(self, *given):
        force, state, t = super().tangents(*given)
        wrong = t.state_u.copy()
        wrong[:, 1] *= 1.01
        return force, state, replace(t, state_u=wrong)


def test_states_in_newton_and_in_metre():
    """Each is changed by its own size, and what is returned is held to its own."""
    check_law(_ForceAndPosition(4e6, 40.0), amplitude=1e-5)
    with pytest.raises(AssertionError, match="tangents by the motion"):
        check_law(_OtherPosition(4e6, 40.0), amplitude=1e-5)


@pytest.mark.parametrize(
    "make, message",
    [
        (
            lambda P: laws.CubicSpring([1.0, 2]),
            r"CubicSpring: cubic has 2 values, must be one number or one per contact",
        ),
        (
            lambda P: laws.CubicSpring("stiff"),
            r"CubicSpring: cubic = 'stiff', must be a number or one number per contact",
        ),
        (
            lambda P: laws.CubicSpring(np.eye(2)),
            r"CubicSpring: cubic = .*, must be a number or one number per contact",
        ),
        (lambda P: laws.CubicSpring(np.inf), r"CubicSpring: cubic = inf, must be finite"),
        (
            lambda P: BoucWen(1.5, 0.1),
            r"BoucWen: alpha = 1\.5, must be finite and at least 0 and at most 1",
        ),
        (lambda P: BoucWen(0.1, 0.0), r"BoucWen: reach = 0\.0, must be finite and above 0"),
    ],
)
def test_parameters_out_of_place_are_refused(make, message):
    contacts = random_case(laws.CubicSpring(1.0), P=5)[1]
    with pytest.raises(InputError, match=message):
        make(5).check(contacts)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dahl", "bouc_wen"])
def test_documented_laws_meet_their_references(name):
    own_law(name).main()


def test_a_motion_of_rounding_says_nothing_of_the_derivatives():
    """Contacts that by symmetry do not move along their tangent: the step of Dahl's law returns
    rounding there, and the law is right; a wrong one is told where contacts move."""
    contacts = laws.Contacts(
        kn=np.zeros(3), kt=np.full(3, 1e6), mu=np.full(3, 0.5), preload=np.full(3, 20.0)
    )
    x = np.random.default_rng(1).normal(size=(3, 1, 2 * H + 1))
    check_derivatives(Dahl(), contacts, 1e-21 * x, 6e3)
    check_derivatives(Dahl(), contacts, 1e-7 * x, 6e3)

    class NotAnalytic(Dahl):
        def step(self, motion, state, contacts):
            force, new = super().step(motion, state, contacts)
            return np.sqrt(force * np.conj(force)), new

    with pytest.raises(InputError, match="not the derivatives"):
        check_derivatives(NotAnalytic(), contacts, 1e-5 * x, 6e3)


@each_start
@pytest.mark.parametrize(
    "case",
    [case for case in LAWS if case.order or case.law.name != "IsotropicFriction"],
    ids=lambda c: c.law.name,
)
def test_cycle_against_plain_loops(case, start):
    """To rounding: event-driven laws by bisection and Gauss points, the others by the same samples
    in a loop."""
    law = case.law
    x, contacts, _ = random_case(law, P=8, H=3, seed=3)
    f = forces(law, contacts, x, 1.0, start, 64)
    if law.piecewise_linear(contacts) is None:
        force = history(law, contacts, x, 1.0, start, 64, 400)[0]
        F = np.tensordot(
            force, sampled.projector(fourier.basis(np.arange(64) * 2 * np.pi / 64, 3)), (0, 0)
        )
        assert np.abs(total_force(law, contacts, x, f) - F).max() < 2e-12
        return
    expected, normal = np.zeros(x.shape), "n" in law.components
    for p, sheet in enumerate(
        zip(contacts.kt, contacts.kn, contacts.mu, contacts.preload, strict=True)
    ):
        un = x[p, -1] if normal else np.zeros(7)
        for d in range(max(law.sliders, 1)):
            tangent, opened = located_slider(*sheet, x[p, d], un.copy(), start)
            if law.sliders:
                expected[p, d] = tangent
        if normal:
            expected[p, -1] = opened
    assert np.abs(f.g - expected).max() < 2e-12


@pytest.mark.slow
@pytest.mark.parametrize("case", [case for case in LAWS if case.order], ids=lambda c: c.law.name)
def test_order_of_convergence_in_samples(case):
    x, contacts, _ = random_case(case.law)
    finest = forces(case.law, contacts, x, samples=8192).g
    errors = [
        np.sqrt(np.mean((forces(case.law, contacts, x, samples=n).g - finest) ** 2))
        for n in (128, 512, 2048)
    ]
    assert (np.log(np.array(errors[:-1]) / errors[1:]) / np.log(4) > case.order - 0.25).all(), (
        errors
    )


@pytest.mark.parametrize("case", [case for case in LAWS if case.normal], ids=lambda c: c.law.name)
def test_friction_cone_pressure_and_lift_off(case):
    law = case.law
    x, contacts, _ = random_case(law, P=50)
    force, state, _ = history(law, contacts, x, 1.0, samples=400, periods=2)
    u = (x @ fourier.basis(np.arange(400) * 2 * np.pi / 400, H).T).transpose(2, 0, 1)
    N, T = np.broadcast_to(np.maximum(contacts.preload, 0), force.shape[:2]), force
    if case.normal == "variable":
        N, T = force[:, :, -1], force[:, :, :-1]
        assert (N >= 0).all()
        lifted = contacts.preload + contacts.kn * u[:, :, -1] <= 0
        assert lifted.any() and (force[lifted] == 0).all()
        # on re-contact a slider starts where it is
        assert np.array_equal(state[lifted][:, : law.sliders], u[:, :, : law.sliders][lifted])
    if case.friction:
        size = (
            np.linalg.norm(T, axis=2, keepdims=True) if case.friction == "together" else np.abs(T)
        )
        assert (size <= (contacts.mu * N)[:, :, None] * (1 + 1e-9) + 1e-15).all()
        # and the limit is reached
        assert np.isclose(size, (contacts.mu * N)[:, :, None], rtol=1e-3).mean() > 0.02


@each_start
@each_law
def test_friction_never_gives_energy(case, start):
    law = case.law
    for seed in range(5):
        x, contacts, _ = random_case(law, P=60, seed=seed)
        work = fourier.work(
            total_force(law, contacts, x, forces(law, contacts, x, 1.0, start, 256)), x
        )
        assert (work > (-1e-3 if case.order else -1e-11)).all() and (
            not case.friction or work.max() > 0.1
        )


@pytest.mark.parametrize("case", [case for case in LAWS if case.normal], ids=lambda c: c.law.name)
def test_no_force_without_normal_load(case):
    law = case.law
    x, contacts, _ = random_case(law)
    if case.normal == "variable":
        x[:, -1] = 0.0
    unloaded = replace(contacts, preload=0 * contacts.preload)
    f = forces(law, unloaded, x)
    assert np.isfinite(f.D).all() and np.abs(total_force(law, unloaded, x, f)).max() < 1e-12


@pytest.mark.parametrize(
    "case", [case for case in LAWS if case.normal or case.friction], ids=lambda c: c.law.name
)
def test_no_force_without_stiffness(case):
    law = case.law
    x, contacts, _ = random_case(law)
    slack = replace(
        contacts, kn=0 * contacts.kn, kt=0 * contacts.kt, preload=np.abs(contacts.preload)
    )
    f = forces(law, slack, x)
    force = total_force(law, slack, x, f)
    if case.normal == "variable":
        force[:, -1, 0] -= slack.preload
    assert np.isfinite(f.D).all() and np.abs(force).max() < 1e-12


@pytest.mark.slow
@each_law
def test_through_forced_response(case):
    """A point on springs: the curve is complete, and at its top the harmonics balance the force of
    the plain loop."""
    model, pairs, force = one_dof(case.law)
    curve = forced_response(
        model,
        pairs,
        case.law,
        force,
        (1.2, 2.4),
        harmonics=3,
        damping_ratio=0.03,
        contact=True,
        outputs={k: row for k, row in zip("xyz", np.eye(3), strict=True)},
        samples=128 if case.friction == "creep" else 512,
        truncation=False,
    )
    assert curve.complete, curve.ended
    i = int(np.nanargmax(curve.amplitude("rms").max(axis=1)))
    problem = contact_problem(model, pairs, case.law, damping_ratio=0.03)[0]
    U = curve.contact_motion[i][0]
    u, cycles = fourier.to_real(U)[None], max(case.cycles, 2)
    plain = history(case.law, problem.contacts, u, 1.0, curve.start, 2048, cycles)[0]
    F = fourier.to_complex(
        plain[:, 0].T @ sampled.projector(fourier.basis(np.arange(2048) * 2 * np.pi / 2048, 3))
    )
    assert np.abs(F - curve.contact_force[i][0]).max() < 2e-3 * np.abs(F).max()
    assert not case.friction or curve.share_slip[i, 0] > 0.05
    lost = np.pi * np.sum(
        np.arange(4) * (curve.contact_force * curve.contact_motion.conj()).imag, axis=(2, 3)
    )
    assert np.allclose(curve.dissipated, lost, rtol=0, atol=1e-10 * np.abs(lost).max() + 1e-13)
    assert (lost[i, 0] > 0.01 and curve.slipping_pairs.tolist() == [0]) or not case.friction
    # K_s phi = phi k: the damping ratios are those of the stuck modes, here along x, y, z
    rows = ["xyz"["t1 t2 n".split().index(c)] for c in case.law.components]
    k_s = problem.law.stuck_stiffness(problem.contacts)[0]
    w = 2 * np.pi * curve.frequency[i]
    for row, X, Fc, ks in zip(rows, U, curve.contact_force[i][0], k_s, strict=True):
        j = "xyz".index(row)
        k, orders = model.K[j, j], np.arange(4)
        push = np.zeros(4, complex)
        push[1] = force[j]
        push[0] = problem.law.stuck_force(problem.contacts)[0, -1] if row == "z" else 0.0
        Z = k - (orders * w) ** 2 + 2j * 0.03 * np.sqrt(k + ks) * orders * w
        assert np.abs(Z * X + Fc - push).max() < 1e-7 * np.abs(force[j])


@pytest.mark.slow
@pytest.mark.parametrize("case", LAWS, ids=lambda c: c.law.name)
def test_through_time_integration(case):
    model, pairs, force = one_dof(case.law)
    problem, _ = contact_problem(model, pairs, case.law, damping_ratio=0.03)
    _, point, balance = solve(
        problem, force, 2 * np.pi * 1.7, 15, samples=None if case.order is None else 256
    )
    c = compare_point(balance, point, np.eye(3), IntegrationSettings(samples=256))
    assert c.agrees and c.difference < 1e-3
