"""Forces on several coordinates: polynomials with shared coordinates and functions of one's own,
beside the equation of motion and each other."""

import numpy as np
import pytest

from tipdamp import (
    Contacts,
    CubicSpring,
    DryFriction2T,
    InputError,
    Jenkins1D,
    MixedLaw,
    OwnForce,
    Polynomial,
    Problem,
    UnilateralSpring,
    check_force,
    compare,
    contact_problem,
)
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.time.settings import IntegrationSettings

# of the energy q1^4/4 + q1^2 q2^2/2 + q2 q3^3 on four coordinates
TERMS = {
    (3, 0, 0, 0): (1.0, 0, 0, 0),
    (1, 2, 0, 0): (1.0, 0, 0, 0),
    (2, 1, 0, 0): (0, 1.0, 0, 0),
    (0, 0, 3, 0): (0, 1.0, 0, 0),
    (0, 1, 2, 0): (0, 0, 3.0, 0),
    (0, 0, 0, 5): (0, 0, 0, 0.2),
}


def energy_force(u, v):
    a, b, c, d = (u[:, i] for i in range(4))
    f = [a**3 + a * b**2, a**2 * b + c**3, 3 * b * c**2, 0.2 * d**5]
    return np.stack(f, axis=1)


def energy_rate(u, v):
    a, b, c, d = (u[:, i] for i in range(4))
    J = np.zeros((len(u), 4, 4))
    J[:, 0, 0], J[:, 0, 1], J[:, 1, 0] = 3 * a**2 + b**2, 2 * a * b, 2 * a * b
    J[:, 1, 1], J[:, 1, 2], J[:, 2, 1] = a**2, 3 * c**2, 3 * c**2
    J[:, 2, 2], J[:, 3, 3] = 6 * b * c, d**4
    return J, 0 * J


LAWS = [Polynomial(TERMS), OwnForce(energy_force, 4), OwnForce(energy_force, 4, energy_rate)]


def four():
    K = np.diag([2.0, 2.5, 3.0, 3.5]) - 0.5 * (np.eye(4, k=1) + np.eye(4, k=-1))
    return Problem(np.eye(4), 0.05 * np.eye(4), K).force(0, 0.4)


@pytest.mark.parametrize("law", LAWS)
def test_the_equation_of_motion_holds_on_four_coordinates(law):
    found = (
        four()
        .add(law, [0, 1, 2, 3])
        .solve_at(0.2, outputs={str(i): i for i in range(4)}, harmonics=9)
    )
    tau = 2 * np.pi * np.arange(512) / 512
    waves = np.exp(1j * np.outer(np.arange(10), tau))
    u = (found.harmonics @ waves).real.T
    f = (energy_force(u, 0 * u).T @ waves.conj().T) * 2 / 512
    f[:, 0] /= 2
    k, w, K = np.arange(10), 2 * np.pi * 0.2, four().K
    q = found.harmonics
    left = K @ q + 1j * k * w * 0.05 * q - (k * w) ** 2 * q + f
    left[0, 1] -= 0.4
    assert np.abs(left).max() < 1e-9


def test_stability_and_time_integration_of_a_polynomial():
    problem = four().add(LAWS[0], [0, 1, 2, 3])
    curve = problem.follow_band((0.15, 0.35), outputs={"x": 0}, harmonics=7, stability="peaks")
    assert curve.complete and np.nanmax(curve.force_residual) < 1e-8
    coarse = IntegrationSettings(samples=256)
    found = compare(curve, problem.contact_problem, 0.2, which=0, settings=coarse)
    assert found.agrees and found.difference < 1e-4


def test_beside_contacts_and_other_laws():
    problem = four().add(LAWS[0], [0, 1, 2, 3]).add(CubicSpring(0.3), (0, 3))
    problem = problem.add(Jenkins1D(), 2, kt=0.5, mu=0.3, preload=0.2)
    problem = problem.add(UnilateralSpring(), 1, kn=1.0, preload=-0.1)
    curve = problem.follow_band((0.15, 0.3), outputs={"x": 0}, harmonics=5)
    assert isinstance(problem.contact_problem.law, MixedLaw)
    assert curve.complete and np.nanmax(curve.force_residual) < 1e-8
    assert np.nanmax(curve.energy_error) < 1e-6


@pytest.mark.parametrize("law", LAWS)
def test_conformance(law):
    check_force(law)


BAD = {
    "terms = ": lambda: Polynomial({(1, 2): (1.0,)}),
    "terms = 3": lambda: Polynomial(3),
    "exponent": lambda: Polynomial({(1.5,): (1.0,)}),
    "must be finite": lambda: Polynomial({(1,): (np.nan,)}),
    "function = 3": lambda: OwnForce(3),
    "size = 0": lambda: OwnForce(energy_force, 0),
    "moves along q1, q2, q3, q4": lambda: four().add(LAWS[0], [0, 1]),
    "force of step has the shape": lambda: four().add(OwnForce(lambda u, v: u[:, :1], 2), [0, 1]),
    "not finite": lambda: four().add(OwnForce(lambda u, v: u / 0.0, 1), 0),
    "are not the derivatives of step": lambda: (
        four()
        .add(OwnForce(energy_force, 4, lambda u, v: (0 * energy_rate(u, v)[0],) * 2), [0, 1, 2, 3])
        .solve_at(0.2, outputs={"x": 0})
    ),
    "analytic": lambda: (
        four().add(OwnForce(lambda u, v: abs(u) * u, 1), 0).solve_at(0.2, outputs={"x": 0})
    ),
    "derivative gives": lambda: four().add(
        OwnForce(energy_force, 4, lambda u, v: (u, v)), range(4)
    ),
    r"derivative gives \(1, 4, 4\), must be two": lambda: four().add(
        OwnForce(energy_force, 4, lambda u, v: energy_rate(u, v)[0]), range(4)
    ),
}


@pytest.mark.parametrize("said", BAD)
def test_bad_forces_are_told_in_a_line(said):
    with np.errstate(all="ignore"), pytest.raises(InputError, match=said) as told:
        BAD[said]()
    assert "\n" not in str(told.value)


def test_pairs_of_a_table_take_no_coordinates():
    model, pairs = two_blades()
    law = MixedLaw((DryFriction2T(), Polynomial({(3,): (1.0,)})), [0] * (len(pairs) - 1) + [1])
    with pytest.raises(InputError, match="acts on coordinates of its own, q1"):
        contact_problem(model, pairs, law, damping_ratio=0.01)


def test_a_law_with_odd_names_twice_is_refused():
    class Twice(OwnForce):
        @property
        def components(self):
            return ("a", "a")

    with pytest.raises(InputError, match="in this order"):
        Twice(energy_force, 2).check(Contacts(0, 0, 0, 0))
