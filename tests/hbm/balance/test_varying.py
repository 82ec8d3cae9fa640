"""Forces and matrices that depend on the frequency, beside closed forms and fixed frequencies."""

import numpy as np
import pytest
import scipy.sparse as sp

from tipdamp import (
    CubicSpring,
    ForceTable,
    InputError,
    Jenkins1D,
    Problem,
    Unbalance,
    UnilateralSpring,
    compare,
    energy_balance,
    find_peaks,
    follow_band,
    follow_parameter,
    named_points,
    solutions_at,
)

TURN = np.array([[0.0, 1], [-1, 0]])
STUCK = {"kt": 5e5, "mu": 0.5, "preload": 1e6}


def blade(**damping):
    return Problem([[0.05]], K=[[1e6]], **(damping or {"C": [[4.0]]}))


def stiffness(w, k=1e6):
    return k + 5e5 + 4j * w - 0.05 * w**2


def curve_of(problem, band=(600, 1000), **more):
    return problem.follow_band(band, outputs={"x": 0}, harmonics=3, **more)


def test_unbalance_beside_its_closed_form():
    curve = curve_of(blade().force(0, Unbalance(1e-6)).add(Jenkins1D(), 0, **STUCK))
    w = 2 * np.pi * curve.frequency
    assert curve.complete
    assert curve.harmonics[:, 0, 1] == pytest.approx(1e-6 * w**2 / stiffness(w), rel=1e-9)


def test_base_motion_beside_its_closed_form():
    """Relative to the base: X_r = m w^2 X / (k + i w c - m w^2), with two orders of the motion."""
    shaken = blade().base_motion([1.0], 1e-5).base_motion([1.0], 2e-6j, harmonic=3)
    curve = curve_of(shaken.add(Jenkins1D(), 0, **STUCK))
    for k, X in ((1, 1e-5), (3, 2e-6j)):
        w = k * 2 * np.pi * curve.frequency
        closed = 0.05 * w**2 * X / stiffness(w)
        assert curve.harmonics[:, 0, k] == pytest.approx(closed, rel=1e-9)


def test_a_base_that_accelerates():
    shaken = blade().base_motion([1.0], lambda w: -9.81 / w**2)
    curve = curve_of(shaken.add(Jenkins1D(), 0, **STUCK))
    closed = -0.05 * 9.81 / stiffness(2 * np.pi * curve.frequency)
    assert curve.harmonics[:, 0, 1] == pytest.approx(closed, rel=1e-9)


def test_a_measured_force_adds_to_a_constant_one():
    table = ForceTable([500, 800, 1000], [5.0, 7.0 - 2j, 6.0])
    curve = curve_of(blade().force(0, 1.0).force(0, table).add(Jenkins1D(), 0, **STUCK))
    F = 1 + np.interp(curve.frequency, table.hz, table.values)
    closed = F / stiffness(2 * np.pi * curve.frequency)
    assert curve.harmonics[:, 0, 1] == pytest.approx(closed, rel=1e-9)
    with pytest.raises(InputError, match="1100 Hz lies outside, it has 500 to 1000 Hz"):
        curve_of(blade().force(0, table).add(Jenkins1D(), 0, **STUCK), (600, 1100))


def test_centrifugal_stiffening_at_an_engine_order():
    """k = k0 + k2 speed^2 at engine order 4: each point has the stiffness of its speed."""
    turning = blade().force(0, 5.0).add(Jenkins1D(), 0, **STUCK)
    turning = turning.of_speed(K=lambda speed: [[1e6 + 0.2 * speed**2]], engine_order=4)
    curve = curve_of(turning)
    w = 2 * np.pi * curve.frequency
    closed = 5 / stiffness(w, 1e6 + 0.2 * (w / 4) ** 2)
    assert curve.harmonics[:, 0, 1] == pytest.approx(closed, rel=1e-9)


def rotor():
    """A rotor of which damping and shaft stiffness depend on the speed, with a hardening bearing
    and unbalance."""
    turning = Problem(np.eye(2), 0.2 * np.eye(2), np.eye(2), general=True)
    turning = turning.of_speed(
        C=lambda speed: 0.2 * np.eye(2) + 0.4 * speed * TURN,
        K=lambda speed: (1 + 0.1 * speed**2) * np.eye(2) + 0.01 * speed * TURN,
    )
    turning = turning.force(0, Unbalance(0.2)).force(1, Unbalance(-0.2j))
    return turning.add(CubicSpring(0.02), 0)


def test_points_of_a_varying_problem_are_those_of_the_problem_fixed_there():
    curve = rotor().follow_band((0.08, 0.3), outputs={"x": 0, "y": 1}, harmonics=5)
    assert curve.complete and np.nanmax(curve.energy_error) < 1e-6
    top = int(curve.amplitude()[:, 0].argmax())
    for i in (1, top, len(curve.frequency) - 2):
        w = 2 * np.pi * curve.frequency[i]
        C = 0.2 * np.eye(2) + 0.4 * w * TURN
        K = (1 + 0.1 * w**2) * np.eye(2) + 0.01 * w * TURN
        fixed = Problem(np.eye(2), C, K, general=True).add(CubicSpring(0.02), 0)
        fixed = fixed.force(0, 0.2 * w**2).force(1, -0.2j * w**2)
        there = fixed.solve_at(
            curve.frequency[i], outputs={"x": 0, "y": 1}, harmonics=5, guess=curve.unknowns[i]
        )
        assert there.harmonics == pytest.approx(curve.harmonics[i], rel=1e-7, abs=1e-12)


def test_tangents_along_the_band_know_what_varies():
    """A step along the tangent of a point leaves a defect of second order."""
    from tipdamp.hbm.curve.solutions import restored

    curve = rotor().follow_band((0.08, 0.3), outputs={"x": 0}, harmonics=3)
    equation, points = restored(curve, rotor().contact_problem)
    point = points[len(points) // 3]
    here = equation.evaluate(point.x, point.parameter)
    left = []
    for h in (1e-4, 1e-5):
        dx = here.solve(np.zeros_like(point.x), 1.0, h)[0]
        moved = equation.evaluate(point.x + dx, point.parameter + h)
        left.append(np.linalg.norm(moved.residual))
    assert left[1] < 0.015 * left[0]


def test_what_belongs_to_a_curve_knows_what_varies():
    problem = rotor()
    curve = problem.follow_band(
        (0.08, 0.3), outputs={"x": 0, "y": 1}, harmonics=7, stability="all", at=[0.2]
    )
    whole, hz = problem.contact_problem, curve.peak("x")[0]
    assert [point.kind for point in named_points(curve, whole)] == [
        point.kind for point in curve.named_points
    ]
    found = solutions_at(curve, whole, 0.2)
    assert np.abs(found[0] - curve.harmonics[curve.frequency == 0.2][0]).max() < 1e-12
    beside = compare(curve, whole, 0.2)
    assert beside.agrees and beside.difference < 1e-4
    top = find_peaks(curve, whole, "y")[0]
    assert top == pytest.approx(curve.peak("y"), rel=1e-7)
    energy = energy_balance(curve, whole, int(np.abs(curve.frequency - hz).argmin()))
    assert abs(energy.error) < 1e-8


def test_a_branch_over_the_level_has_the_forces_of_its_frequency():
    problem = rotor()
    whole = problem.contact_problem
    given = {"outputs": {"x": [1.0, 0]}, "harmonics": 3}
    level = follow_parameter(whole, np.zeros(2), 0.15, "level", (0.5, 1.0), **given)
    fixed = problem.solve_at(0.15, outputs={"x": 0}, harmonics=3)
    assert level.harmonics[-1] == pytest.approx(fixed.harmonics, rel=1e-7, abs=1e-12)
    assert len(solutions_at(level, whole, 0.7)) == 1
    by_band = follow_band(whole, np.zeros(2), (0.1, 0.15), **given)
    assert by_band.harmonics[-1] == pytest.approx(fixed.harmonics, rel=1e-7, abs=1e-12)


def test_subharmonic_motions_have_the_forces_of_the_excitation():
    curve = curve_of(blade().force(0, Unbalance(1e-6)).add(Jenkins1D(), 0, **STUCK), periods=2)
    w = 2 * np.pi * curve.frequency
    assert curve.harmonics[:, 0, 2] == pytest.approx(1e-6 * w**2 / stiffness(w), rel=1e-9)


def test_matrices_of_the_speed_add_up_call_after_call():
    more = dict(C=lambda speed: [[4 + 1e-3 * speed]]), dict(K=lambda speed: [[1e6 + speed**2]])
    one = blade().force(0, 1.0).add(Jenkins1D(), 0, **STUCK)
    found = [
        curve_of(made, truncation=False)
        for made in (
            one.of_speed(**more[0], **more[1]),
            one.of_speed(**more[0]).of_speed(**more[1]),
        )
    ]
    assert np.array_equal(found[0].harmonics, found[1].harmonics)
    with pytest.raises(InputError, match="engine_order = 1, and 2 in a call before"):
        one.of_speed(**more[0], engine_order=2).of_speed(**more[1])


def test_a_base_moves_sparse_matrices():
    dense = Problem(np.eye(2), 0.1 * np.eye(2), 2 * np.eye(2))
    sparse = Problem(*(sp.csc_matrix(one) for one in (dense.M, dense.C, dense.K)))
    found = [
        one.base_motion([1.0, 0.5], 0.1).add(CubicSpring(1.0), 0).solve_at(0.2, outputs={"x": 1})
        for one in (dense, sparse)
    ]
    assert np.allclose(found[0].harmonics, found[1].harmonics, rtol=1e-9, atol=0)


def test_a_travelling_wave_excites_one_nodal_diameter():
    """Four blades with a stop: engine order 5 aliases to 1, each blade a quarter period later."""
    ring = np.roll(np.eye(4), 1, axis=0)
    K = 1.2 * np.eye(4) - 0.1 * (ring + ring.T)
    wheel = Problem(np.eye(4), 0.02 * np.eye(4), K).travelling_wave(range(4), 5, 0.3)
    for blade in range(4):
        wheel = wheel.add(UnilateralSpring(), blade, kn=0.5, preload=-0.1)
    found = wheel.solve_at(0.15, outputs={str(n): n for n in range(4)}, harmonics=5)
    k = np.arange(6)
    for n in range(4):
        expected = found.harmonics[0] * np.exp(1j * k * n * np.pi / 2)
        assert found.harmonics[n] == pytest.approx(expected, abs=1e-9)


BAD = {
    "entry 2 is not finite": lambda: ForceTable([1, 2], [1.0, np.nan]),
    "entry 2, 1 Hz: hz must rise": lambda: ForceTable([1, 1], [1.0, 2.0]),
    "same length": lambda: ForceTable([1, 2, 3], [1.0, 2.0]),
    "must be one number in kg m": lambda: Unbalance("a"),
    "K = 3: must be a function": lambda: curve_of(
        blade().of_speed(K=3).force(0, 1.0).add(Jenkins1D(), 0, **STUCK)
    ),
    r"of_speed, at [0-9.]+ rad/s: K is indefinite": lambda: (
        Problem([[1.0]], [[0.05]], [[1.0]])
        .of_speed(K=lambda speed: [[1 - 0.5 * speed**2]])
        .force(0, 0.1)
        .add(CubicSpring(0.1), 0)
        .follow_band((0.1, 0.3), outputs={"x": 0})
    ),
    r"of_speed, at 3769.91 rad/s.*same size": lambda: curve_of(
        blade().of_speed(K=lambda w: np.eye(2)).force(0, 1.0).add(Jenkins1D(), 0, **STUCK)
    ),
    "its amplitude at 600 Hz is nan": lambda: curve_of(
        blade().force(0, lambda w: np.nan).add(Jenkins1D(), 0, **STUCK)
    ),
    "engine_order = 0": lambda: curve_of(
        blade()
        .of_speed(K=lambda w: [[1e6]], engine_order=0)
        .force(0, 1.0)
        .add(Jenkins1D(), 0, **STUCK)
    ),
    r"amplitude = \[1, 2\]: must be one finite number in N": lambda: blade().force(0, [1, 2]),
    "amplitude = 'a': must be one": lambda: blade().travelling_wave([0], 1, "a"),
    "amplitude = None: must be one finite number in m": lambda: blade().base_motion([1.0], None),
    "its amplitude at 600 Hz is 'a'": lambda: curve_of(
        blade().base_motion([1.0], lambda w: "a").add(Jenkins1D(), 0, **STUCK)
    ),
    "direction = 'a': must be a row of 1": lambda: blade().base_motion("a", 1.0),
    r"direction = .*nan.*: must be a dof": lambda: blade().base_motion([np.nan], 1.0),
    "places = 3: must be a list": lambda: blade().travelling_wave(3, 1),
    "their forces cancel": lambda: blade().travelling_wave([0, 0, 0], 1),
    "harmonics = 3 keeps": lambda: curve_of(
        blade().force(0, Unbalance(1e-6), harmonic=7).add(Jenkins1D(), 0, **STUCK)
    ),
}


@pytest.mark.parametrize("said", BAD)
def test_bad_input_is_told_in_a_line(said):
    with pytest.raises(InputError, match=said) as told:
        BAD[said]()
    assert "\n" not in str(told.value)
