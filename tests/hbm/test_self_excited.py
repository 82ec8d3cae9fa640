"""Limit cycles beside time integration: the frequency is found."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tipdamp import CubicSpring, Doubt, InputError, Jenkins1D, OwnForce, Problem, limit_cycle

STEPS = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}


def cycle_in_time(rate, y, settled, i=0):
    """(period, largest q_i) of the limit cycle of y' = rate(y), from one maximum to the next."""
    y = solve_ivp(lambda t, y: rate(y), (0, settled), y, **STEPS).y[:, -1]

    def turns(t, y):
        return y[len(y) // 2 + i]

    turns.direction = -1
    found = solve_ivp(lambda t, y: rate(y), (0, 60), y, events=turns, **STEPS)
    t = found.t_events[0]
    return (t[3] - t[1]) / 2, found.y_events[0][1][i]


def van_der_pol(mu):
    return OwnForce(lambda u, v: mu * (u**2 - 1) * v, 1, lambda u, v: rates(mu, u, v))


def rates(mu, u, v):
    return (2 * mu * u * v)[:, :, None], (mu * (u**2 - 1))[:, :, None]


@pytest.mark.parametrize("mu", [pytest.param(0.1, marks=pytest.mark.slow), 1.0])
def test_van_der_pol_beside_time_integration(mu):
    oscillator = Problem([[1.0]], [[0.0]], [[1.0]]).add(van_der_pol(mu), 0)
    found = oscillator.limit_cycle(0.16, outputs={"x": 0}, harmonics=15)
    period, _ = cycle_in_time(
        lambda y: [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]], [2.0, 0], 100 / mu
    )
    assert 1 / found.frequency == pytest.approx(period, rel=1e-8)
    assert found.force_residual < 1e-8


@pytest.mark.slow
def test_flutter_of_circulatory_forces_ends_where_dashpots_take_as_much():
    """Two modes coupled by a circulatory force, as of a disk brake, with cubic dashpots."""
    K = np.array([[1.0, 0.3], [-0.3, 1.2]])
    C = 0.02 * np.eye(2)
    dashpot = OwnForce(lambda u, v: 0.5 * v**3, 1)
    brake = Problem(np.eye(2), C, K, general=True).add(dashpot, 0).add(CubicSpring(0.2), 1)
    found, *others = (
        brake.limit_cycle(hz, outputs={"x": 0, "y": 1}, harmonics=11) for hz in (0.17, 0.16, 0.18)
    )
    # of the two modes of one frequency the one that grows, however rounding orders them
    assert [one.frequency for one in others] == pytest.approx(2 * [found.frequency], rel=1e-9)

    def rate(y):
        q, v = y[:2], y[2:]
        return [*v, *(-K @ q - C @ v - [0.5 * v[0] ** 3, 0.2 * q[1] ** 3])]

    period, top = cycle_in_time(rate, [0.1, 0, 0, 0], 1500)
    tau = np.linspace(0, 2 * np.pi, 4096)
    x = (found.harmonics[0] @ np.exp(1j * np.outer(np.arange(12), tau))).real
    assert 1 / found.frequency == pytest.approx(period, rel=1e-7)
    assert x.max() == pytest.approx(top, rel=1e-5)


def test_friction_limits_negative_damping():
    """C feeds energy in; where a slider slips it takes more: beside the energy of the cycle."""
    engine = Problem([[1.0]], [[-0.02]], [[1.0]], general=True)
    damped = engine.add(Jenkins1D(), 0, kt=0.4, mu=1.0, preload=0.1)
    found = damped.limit_cycle(0.18, outputs={"x": 0}, harmonics=9)
    w, X, k = 2 * np.pi * found.frequency, found.harmonics[0], np.arange(10)
    fed = np.pi * 0.02 * w * (k**2 * np.abs(X) ** 2).sum()
    assert found.dissipated[0] == pytest.approx(fed, rel=1e-6)
    assert found.share_slip[0] > 0.02


def test_a_motion_far_from_the_frequency_asked_for_is_told():
    excited = Problem([[1.0]], [[0.0]], [[1.0]]).add(van_der_pol(1.0), 0)
    with pytest.warns(Doubt, match="the motion found has 0.15.* Hz, far from hz = 3"):
        excited.limit_cycle(3.0, outputs={"x": 0})


def test_a_cycle_begins_again_from_its_unknowns():
    oscillator = Problem([[1.0]], [[0.0]], [[1.0]]).add(van_der_pol(1.0), 0)
    first = oscillator.limit_cycle(0.16, outputs={"x": 0}, harmonics=5)
    again = limit_cycle(
        oscillator.contact_problem,
        first.frequency,
        outputs={"x": [1.0]},
        harmonics=15,
        guess=first.unknowns,
    )
    assert again.frequency == pytest.approx(first.frequency, rel=1e-3)


BAD = {
    "none was found near 0.16 Hz": lambda: oscillator(C=[[0.1]]).limit_cycle(
        0.16, outputs={"x": 0}
    ),
    "hz = -1": lambda: oscillator().limit_cycle(-1, outputs={"x": 0}),
    "amplitude = 0": lambda: oscillator().limit_cycle(0.16, 0, outputs={"x": 0}),
    "a limit cycle vibrates": lambda: oscillator().limit_cycle(0.16, outputs={"x": 0}, harmonics=0),
    "do not depend on the frequency": lambda: oscillator(structural=0.1).limit_cycle(
        0.16, outputs={"x": 0}
    ),
    "multipliers are those of forced motions": lambda: oscillator().limit_cycle(
        0.16, outputs={"x": 0}, stability="all"
    ),
    "without forces": lambda: oscillator().force(0, 1.0).limit_cycle(0.16, outputs={"x": 0}),
}


def oscillator(**given):
    return Problem(**({"M": [[1.0]], "C": [[0.0]], "K": [[1.0]]} | given)).add(CubicSpring(1.0), 0)


@pytest.mark.parametrize("said", BAD)
def test_what_has_no_limit_cycle_is_told_in_a_line(said):
    with pytest.raises(InputError, match=said) as told:
        BAD[said]()
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("hz", [0.16, 0.3])
def test_free_motions_without_damping_are_no_limit_cycles(hz):
    """They are a family, and none of them is approached."""
    duffing = Problem([[1.0]], [[0.0]], [[1.0]]).add(CubicSpring(1.0), 0)
    with pytest.raises(InputError, match="limit_cycle: none was found near"):
        duffing.limit_cycle(hz, 1.0, outputs={"x": 0}, harmonics=7)
