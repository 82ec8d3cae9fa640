"""Event-driven integration: fourth order through events, equal to exact orbits, without chatter of
light nodes."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tests.hbm.cases import coupled, jenkins, load, solve, unilateral
from tests.hbm.contact_nodes import with_node
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.hbm.small_rig import small_rig
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.comparison import compare, compare_point
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.time import events, guards, period_map, shooting
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.poles import poles
from tipdamp.hbm.time.settings import IntegrationSettings

BUILD = {"A1": jenkins, "C1": unilateral, "C2": unilateral, "D1": coupled, "D2": coupled}


def row_of(case, omega):
    data = load(case)
    return next(r for r in data.get("results", data.get("steady_state")) if r["Omega"] == omega)


def exact(case, omega):
    return np.atleast_1d(row_of(case, omega)["X1"])


def at(case, omega, H=9, guess=None):
    """(problem, q, point, balance) of a reference case at an angular frequency."""
    problem, force = BUILD[case](load(case)["parameters"])
    return (problem, *solve(problem, force, omega, H, guess=guess))


def three_of_c1(H=5):
    """The three solutions of C1 at 1.15, lowest first: (q, point, balance) of each."""
    found = {}
    for known in row_of("C1", 1.15)["HB01_all_solutions"]:
        for angle in np.linspace(0, -np.pi, 24):
            guess = np.zeros(2 * H + 1)
            guess[:3] = known["X0"], known["X1"] * np.cos(angle), known["X1"] * np.sin(angle)
            try:
                _, q, point, balance = at("C1", 1.15, H, guess)
            except AssertionError:
                continue
            found[round(abs(q[0, 1]), 6)] = q, point, balance
    return [found[k] for k in sorted(found)]


@pytest.mark.parametrize("limit", [np.inf, 2500.0])
def test_poles_give_the_receptance(limit):
    """Exactly with all poles; with those above 2500 rad/s static to the square of 3.7/2500."""
    for problem in (oscillator(), oscillator(kn=1e7), coupled(load("D1")["parameters"])[0]):
        R = problem.receptance()
        P, w = poles(R, limit), 3.7
        G = (P.out / (1j * w - P.s)) @ P.into.T / 2
        G = G + (P.out.conj() / (1j * w - P.s.conj())) @ P.into.conj().T / 2
        G = G + (P.static[:, 0] @ P.static[:, 1].T).real
        K = problem.stuck_stiffness - w**2 * problem.M + 1j * w * problem.C
        assert np.abs(G @ K - np.eye(len(K))).max() < (1e-9 if np.isinf(limit) else 1e-4)


@pytest.mark.parametrize(
    "case,omega", [("A1", 1.05), ("C1", 1.2), ("C2", 1.0), ("D1", 1.0), ("D1", 1.5)]
)
def test_fourth_order_through_events(case, omega):
    _, q, point, balance = at(case, omega)
    expected, errors = exact(case, omega), []
    for steps in (32, 128):
        integrator = ExactIntegrator(balance, omega, IntegrationSettings(tolerance=0, steps=steps))
        steady = shooting.shoot(integrator, integrator.on_orbit(point), np.eye(len(q)))
        assert steady.periodic
        errors.append(np.abs(np.abs(steady.harmonics[:, 1]) - expected).max() / expected.max())
    assert errors[1] < 1e-7 and errors[1] < errors[0] / 100  # 1/256 at fourth order
    integrator = ExactIntegrator(balance, omega)
    steady = shooting.shoot(integrator, integrator.on_orbit(point), np.eye(len(q)))
    assert np.abs(np.abs(steady.harmonics[:, 1]) - expected).max() < 1e-8 * expected.max()


@pytest.mark.parametrize(
    "case,omega", [("D1", 0.9), ("D1", 1.0), ("D1", 1.2), ("C1", 1.3), ("C2", 1.0)]
)
def test_events_of_the_exact_orbit(case, omega):
    row = row_of(case, omega)
    expected = len(row["events"]) if case == "D1" else row["contact_events_per_period"]
    _, q, point, balance = at(case, omega)
    integrator = ExactIntegrator(balance, omega)
    state = integrator.periods(integrator.on_orbit(point), 200).state
    assert integrator.periods(state).events == expected


@pytest.mark.parametrize("omega", [1.2, 1.25, 1.3])
def test_floquet_multiplier_of_lift_off(omega):
    _, q, point, balance = at("C1", omega, H=20)
    integrator = ExactIntegrator(balance, omega, IntegrationSettings(tolerance=1e-9))
    steady = shooting.shoot(integrator, integrator.on_orbit(point), [[1.0]])
    multiplier, _ = period_map.largest_multiplier(integrator, steady.state)
    assert multiplier == pytest.approx(max(row_of("C1", omega)["floquet_moduli"]), rel=1e-7)


def test_shooting_and_integration_end_on_the_same_orbit():
    q, point, balance = solve(oscillator(), FORCE, 2 * np.pi * 163, 3, start="zero_force")
    integrator = ExactIntegrator(balance, point.parameter)
    far = integrator.on_orbit(point)
    shot = shooting.shoot(integrator, far, [Y2["y2"]])
    left_alone = shooting.integrate(integrator, far, [Y2["y2"]])
    assert shot.periodic and left_alone.periodic
    assert abs(shot.harmonics[0, 1] - left_alone.harmonics[0, 1]) < 1e-7 * abs(shot.harmonics[0, 1])


@pytest.mark.slow
@pytest.mark.parametrize("level", [12, 20])
def test_newton_in_a_krylov_space(level):
    """Three bodies, 230 unknowns, up to all 18 pairs slipping: GMRES solves (1 - J) step = map -
    state to 1e-3."""
    model, pairs, tip = small_rig(stations=9)
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.02)
    q, point, balance = solve(problem, level * tip, 2 * np.pi * 1250, 3)
    integrator = ExactIntegrator(balance, point.parameter)
    begin = integrator.periods(integrator.on_orbit(point), 3).state
    v = integrator.vector(begin)
    base, _ = shooting.period_map(integrator, v)
    step, used = shooting.newton_by_krylov(integrator, v, base, integrator.size)
    h = 1e-6 * integrator.size / np.abs(step).max()
    slope = (shooting.period_map(integrator, v + h * step)[0] - base) / h
    assert len(v) > integrator.settings.max_columns and used < 40
    assert np.linalg.norm(step - slope - (base - v)) < 2e-3 * np.linalg.norm(base - v)
    assert shooting.shoot(integrator, begin, [tip]).periodic


def test_balance_against_integration_from_its_orbit():
    """163 Hz, H = 9, and the published time integration (2.27307e-4 m); what friction takes, by
    both."""
    q, point, balance = solve(oscillator(), FORCE, 2 * np.pi * 163, 9, start="zero_force")
    c = compare_point(balance, point, [Y2["y2"]])
    assert c.agrees and c.difference < 2e-4
    assert abs(c.steady.harmonics[0, 1]) == pytest.approx(2.27307e-4, rel=5e-6)
    g = fourier.to_complex(point.detail.forces.g)[:, :2, 1:]
    u = fourier.to_complex(point.x.reshape(2, 3, -1))[:, :2, 1:]
    work = np.pi * np.sum(np.arange(1, 10) * (g * u.conj()).imag, axis=(1, 2))
    assert np.allclose(c.steady.dissipated, work, rtol=3e-3)


def test_a_stuck_orbit_repeats_at_once():
    q, point, balance = solve(oscillator(), FORCE, 2 * np.pi * 150, 3, start="zero_force")
    c = compare_point(balance, point, [Y2["y2"]])
    assert c.steady.periods == 1 and c.difference < 1e-10 and "stays on the orbit" in c.said


@pytest.mark.slow
def test_unstable_orbit_is_left():
    """C1 at 1.15: the middle one of three solutions is unstable. At H = 1 it is missed by 12 %, and
    Newton on the period map finds it all the same; left to itself the integration goes from there
    to another one."""
    low, middle, high = three_of_c1(H=9)
    for _, point, balance in (low, high):
        c = compare_point(balance, point, [[1.0]])
        assert c.agrees and "stays on the orbit" in c.said
    c = compare_point(middle[2], middle[1], [[1.0]])
    assert c.agrees and c.multiplier > 1.05 and "it is unstable" in c.said
    middle = three_of_c1(H=1)[1]
    c = compare_point(middle[2], middle[1], [[1.0]])
    assert abs(c.steady.harmonics[0, 1]) == pytest.approx(
        np.abs(three_of_c1(H=9)[1][0][0, 1]), rel=1e-4
    )
    assert (
        c.agrees
        and c.difference > 0.1
        and "it is unstable" in c.said
        and "more harmonics than H = 1" in c.said
    )
    c = compare_point(middle[2], middle[1], [[1.0]], IntegrationSettings(patience=1000))
    assert c.left and not c.agrees and "left for another orbit" in c.said


@pytest.mark.slow
def test_close_orbits_are_told_apart():
    """C1 at 1.155781, next to its fold at 1.155788 (by points 0.005 apart), H = 9: from the
    unstable solution the integration goes to the stable one beside it, between two and three per
    cent away; the stable one is missed by less than a thousandth."""
    patient = IntegrationSettings(patience=5000, max_periods=5000)
    problem, force = unilateral(load("C1")["parameters"])
    curve = follow_band(
        problem, force, (1 / (2 * np.pi), 1.6 / (2 * np.pi)), harmonics=9, outputs={"x": [1.0]}
    )
    hz = 1.155781 / (2 * np.pi)
    sizes = np.abs(solutions_at(curve, problem, hz)[:, 0, 1])
    stable, unstable = np.argsort(sizes)[:2]
    c = compare(curve, problem, hz, int(unstable), patient)
    assert 0.02 < c.difference < 0.03 and c.left and "left for another orbit" in c.said
    assert abs(c.steady.harmonics[0, 1]) == pytest.approx(sizes[stable], rel=1e-3)
    c = compare(curve, problem, hz, int(stable), patient)
    assert c.difference < 1e-3 and not c.left and "stays on the orbit" in c.said


@pytest.mark.parametrize("case,omega", [("C1", 1.2), ("C1", 1.3), ("D1", 1.0), ("D1", 1.5)])
def test_light_contact_node_follows_statically(case, omega):
    """A node of a millionth of the mass between body and contact: the exact orbit of the body
    without the node."""
    problem, force = BUILD[case](load(case)["parameters"])
    node = with_node(problem, 1e-6)
    q, point, balance = solve(node, np.r_[force, np.zeros(len(node.K) - len(problem.K))], omega, 20)
    integrator = ExactIntegrator(balance, omega)
    state = integrator.on_orbit(point)
    steady = shooting.integrate(integrator, state, np.eye(len(q))[: len(problem.K)])
    expected = exact(case, omega)
    assert steady.periodic
    assert np.abs(np.abs(steady.harmonics[:, 1]) - expected).max() < 1e-5 * expected.max()
    assert len(integrator.stuck.system.s) == len(problem.K)


def test_a_node_with_mass_chatters():
    """D1 at 1.0 has four events a period; with the mass of its node there are many more."""
    problem, force = coupled(load("D1")["parameters"])
    node = with_node(problem, 1e-4)
    q, point, balance = solve(node, np.r_[force, 0, 0], 1.0, 9)
    counts = []
    for above in (50.0, np.inf):
        integrator = ExactIntegrator(
            balance, 1.0, IntegrationSettings(tolerance=1e-5, massless_above=above)
        )
        counts.append(integrator.periods(integrator.on_orbit(point), 5).events / 5)
    assert counts[0] < 8 and counts[1] > 2 * counts[0]


def test_modes_that_only_contacts_hold_keep_their_mass():
    """The free damper on stiff contacts: no spring is left to it when they open."""
    q, point, balance = solve(
        oscillator(kn=1e8, kt=1e8), FORCE, 2 * np.pi * 60, 1, start="zero_force"
    )
    integrator = ExactIntegrator(balance, point.parameter, IntegrationSettings(massless_above=20))
    assert np.abs(integrator.stuck.system.s).max() > 20 * point.parameter


@pytest.mark.parametrize(
    "name,value,allowed",
    [
        ("massless_above", -1, "number, above 0"),
        ("samples", 10.5, "whole number, 1 or more"),
        ("tolerance", np.inf, "number, 0 or more"),
        ("max_columns", True, "whole number, 0 or more"),
    ],
)
def test_settings_are_numbers(name, value, allowed):
    with pytest.raises(InputError, match=f"settings: {name} = {value}: must be a {allowed}"):
        IntegrationSettings(**{name: value})


def test_first_crossing_and_turn_of_a_cubic():
    """x^3 - 1.5 x^2 + 0.56 x - 0.05 passes zero at 0.1348 upwards; its rate falls below zero at
    0.2517."""
    c0 = -0.05
    r0 = 0.56
    c1 = 0.01
    r1 = 0.56
    assert guards.crossing(c0, r0, c1, r1, 0.0) == pytest.approx(
        np.sort(np.roots([1, -1.5, 0.56, -0.05]).real)[0]
    )
    assert guards.turning(-c0, -r0, -c1, -r1, 0.0, 0.0) == pytest.approx(
        (3 - np.sqrt(9 - 4 * 3 * 0.56)) / 6
    )
    assert guards.crossing(-1.0, 0.1, -0.9, 0.1, 0.0) == guards.NEVER
    assert guards.crossing(0.1, 0.0, 1.0, 0.0, 0.0) == 0.0


def test_an_interrupt_is_heard_between_periods(monkeypatch):
    """Compiled code hears nothing of it: one call a period."""
    _, q, point, balance = at("C1", 1.05, 3)
    integrator, calls, run = ExactIntegrator(balance, 1.05), [], events.run

    def counted(*given):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return run(*given)

    monkeypatch.setattr(events, "run", counted)
    with pytest.raises(KeyboardInterrupt):
        integrator.periods(integrator.at_rest(), 60)
    assert len(calls) == 4


def test_error_of_a_step_is_what_the_cubic_adds_to_the_quadratic():
    """Over the step, by plain evaluation of both: the quadratic through the force at the ends and
    its rate at the begin, the cubic through the rate at the end, too."""
    _, _, point, balance = at("A1", 1.05)
    integrator = ExactIntegrator(balance, 1.05, IntegrationSettings(steps=64))
    present = integrator._present(integrator.on_orbit(point))
    system, steps, share = integrator.stuck.system, integrator.steps, np.linspace(0, 1, 1001)
    guards.freeze(integrator.table, present)
    present.gamma[:] = -0.7  # in slip, g follows the motion
    begin, end = np.zeros((2, 4, len(present.a)))
    push = events.instant(system, present, 0.0, present.z, begin)
    for level in (0, 1, 2):
        h = steps.lengths[level]
        start = events.Instant(0.0, begin, push, level, 0.0)
        _, z, error = events.step(system, present, steps, start, h, level)
        events.instant(system, present, h, z, end)
        (g0, rate0), (g1, rate1) = begin[2:, 0], end[2:, 0]
        quadratic = g0 + rate0 * h * share + (g1 - g0 - rate0 * h) * share**2
        cubic = CubicHermiteSpline([0, 1], [g0, g1], [h * rate0, h * rate1])(share)
        assert error == pytest.approx(np.abs(cubic - quadratic).max(), rel=0.01)
