"""Forces and matrices that vary, that are not symmetric, and motions that excite themselves."""

import numpy as np

from tests.hbm.balance.test_general import rubbing_rotor
from tests.hbm.balance.test_varying import STUCK, blade, curve_of, stiffness
from tests.hbm.test_self_excited import cycle_in_time, van_der_pol
from tests.validation import Row, Subject, row
from tipdamp import Jenkins1D, Problem, Unbalance, compare

CLOSED, CYCLE = "closed form, contact stuck", "period by scipy, H = 15"
INTEGRATION = "time integration, H = 25"


def rows():
    yield from _closed_forms()
    yield from _rotor((-2.0, 2.0, 10.0))
    yield from _van_der_pol((1.0,))


def long():
    """With less self-excitation, too, which takes longer to settle."""
    yield from rows()
    yield from _van_der_pol((0.1,))


def _closed_forms():
    w = 2 * np.pi * np.linspace(620, 980, 5)
    cases = {
        "unbalance": (blade().force(0, Unbalance(1e-6)), 1e-6 * w**2 / stiffness(w)),
        "base motion": (blade().base_motion([1.0], 1e-5), 0.05 * w**2 * 1e-5 / stiffness(w)),
        "structural damping": (
            blade(structural=0.02).force(0, 5.0),
            5.0 / (1e6 * (1 + 0.02j) + 5e5 - 0.05 * w**2),
        ),
        "centrifugal stiffening, engine order 4": (
            blade()
            .force(0, 5.0)
            .of_speed(K=lambda speed: [[1e6 + 0.2 * speed**2]], engine_order=4),
            5.0 / stiffness(w, 1e6 + 0.2 * (w / 4) ** 2),
        ),
    }
    for name, (problem, closed) in cases.items():
        stuck = problem.add(Jenkins1D(), 0, **STUCK)
        curve = curve_of(stuck, at=w / (2 * np.pi))
        at = [int(np.abs(curve.frequency - one / (2 * np.pi)).argmin()) for one in w]
        yield row(f"{name}, {len(w)} frequencies", curve.harmonics[at, 0, 1], closed, CLOSED)


def _rotor(away):
    curve, problem = rubbing_rotor()
    hz, _ = curve.peak("x")
    for step in away:
        found = compare(curve, problem, hz + step, which=0)
        case = f"two disks that rub, {step:+g} Hz from the peak"
        against = INTEGRATION if found.agrees else "not comparable"
        ours, steady = (np.abs(X[0, 1]) for X in (found.harmonics, found.steady.harmonics))
        yield Row(case, ours, steady, float(found.difference), against)


def _van_der_pol(mus):
    for mu in mus:
        oscillator = Problem([[1.0]], [[0.0]], [[1.0]]).add(van_der_pol(mu), 0)
        found = oscillator.limit_cycle(0.16, outputs={"x": 0}, harmonics=15)
        period, _ = cycle_in_time(
            lambda y, mu=mu: [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]], [2.0, 0], 100 / mu
        )
        yield row(f"van der Pol, mu = {mu:g}, s", 1 / found.frequency, period, CYCLE)


SUBJECT = Subject(
    "The general problem",
    "Harmonic 1 of an oscillator with a stuck contact: unbalance, a base that moves, structural "
    "damping, stiffness of the speed; a rotor of two disks with gyroscopic moments that rubs "
    "against a stop, and van der Pol's limit cycle, beside time integration.",
    rows,
    {CLOSED: 1e-9, INTEGRATION: 1e-4, CYCLE: 1e-6},
    long=long,
)
