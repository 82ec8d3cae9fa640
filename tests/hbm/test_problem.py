"""A problem put together piece by piece is the one that its matrices, rows and contacts make."""

import re
import warnings

import numpy as np
import pytest
import scipy.linalg as la

from tipdamp import (
    ContactProblem,
    Contacts,
    CubicSpring,
    Doubt,
    DryFriction2T,
    InputError,
    Jenkins1D,
    MixedLaw,
    Problem,
    Unbalance,
    UnilateralSpring,
    backbone,
    follow_band,
    follow_parameter,
    solve_at,
)

CHAIN = [[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]]
BAND = (0.05, 0.4)


def duffing():
    return Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)


def test_duffing_in_three_lines():
    """At one harmonic the amplitude a solves ((k - w^2 + 3/4 a^2)^2 + (c w)^2) a^2 = F^2 [Kovacic,
    Brennan 2011]."""
    curve = duffing().follow_band((0.05, 0.12), outputs={"x": 0}, harmonics=1)
    w, a = 2 * np.pi * curve.frequency, np.abs(curve.harmonics[:, 0, 1])
    assert ((1 - w**2 + 0.75 * a**2) ** 2 + (0.02 * w) ** 2) * a**2 == pytest.approx(0.04, rel=1e-8)


def test_several_laws_are_one_mixed_law():
    chain = Problem(np.eye(3), 0.05 * np.eye(3), CHAIN)
    chain = chain.add(CubicSpring(1.0), (0, 1)).add(Jenkins1D(), 2, kt=0.5, mu=1.0, preload=0.1)
    chain = chain.add(UnilateralSpring(), [0, 1, -1], kn=2.0, preload=-0.1).force(0, 0.1)
    rows = np.zeros((9, 3))
    rows[2], rows[3], rows[8] = [1, -1, 0], [0, 0, 1], [0, 1, -1]
    law = MixedLaw((CubicSpring(1.0), Jenkins1D(), UnilateralSpring()), (0, 1, 2))
    contacts = Contacts([0, 0, 2.0], [0, 0.5, 0], [0, 1.0, 0], [0, 0.1, -0.1])
    whole = ContactProblem(np.eye(3), 0.05 * np.eye(3), np.array(CHAIN), rows, law, contacts)
    asked = {"harmonics": 5, "outputs": {"tip": [0.0, 0, 1]}}
    one = chain.follow_band(BAND, harmonics=5, outputs={"tip": 2})
    other = follow_band(whole, [0.1, 0, 0], BAND, **asked)
    assert np.array_equal(one.harmonics, other.harmonics)


def test_equal_laws_are_evaluated_together():
    """A ring of four Duffing oscillators costs four calls of a law at each point else, each with
    three components; the curve is that of two laws that differ by rounding."""
    pair = Problem(np.eye(2), 0.05 * np.eye(2), [[2.0, -1], [-1, 2]]).force(0, 0.3)
    one = pair.add(CubicSpring(1.0), 0).add(CubicSpring(1.0), 1)
    two = pair.add(CubicSpring(1.0), 0).add(CubicSpring(1.0 + 1e-15), 1)
    assert one.contact_problem.law == CubicSpring(1.0)
    assert isinstance(two.contact_problem.law, MixedLaw)
    both = [problem.solve_at(0.2, outputs={"x": 0}).harmonics for problem in (one, two)]
    assert both[0] == pytest.approx(both[1], rel=1e-9, abs=1e-12)
    mixed = one.add(UnilateralSpring(), 0, kn=1.0, preload=-0.1).contact_problem.law
    assert mixed == MixedLaw((CubicSpring(1.0), UnilateralSpring()), (0, 0, 1))


def test_a_law_of_several_components_takes_a_place_for_each():
    free = Problem(np.eye(3), 0.1 * np.eye(3), np.eye(3))
    held = free.add(DryFriction2T(), [0, 1, 2], kn=1.0, kt=1.0, mu=0.3, preload=1.0).force(0, 0.5)
    assert np.array_equal(held.contact_problem.B, np.eye(3))
    assert held.solve_at(0.2, outputs={"x": 0}).converged


def test_forces_are_added_and_have_orders():
    problem = duffing().force(0, 0.1j).force(0, 0.05, harmonic=3)
    assert problem.forces[1] == pytest.approx([0.2 + 0.1j]) and problem.forces[3] == [0.05]
    assert duffing().forces[1] == [0.2]  # each call made a new problem


@pytest.mark.parametrize(
    "wrong, said",
    [
        (lambda p: p.add(CubicSpring(1.0), 3), "where = 3: dof 3 must be between 0 and 0"),
        (lambda p: p.add(CubicSpring(1.0), "tip"), "must be a dof 0..0, two dofs"),
        (lambda p: p.add(DryFriction2T(), 0), "moves along t1, t2, n: a list of 3 dofs"),
        (lambda p: p.add("CubicSpring", 0), "CubicSpring"),
        (lambda p: p.add(CubicSpring(1.0), [0]), "a row of zeros .* its number alone, 0"),
        (lambda p: p.add(DryFriction2T(), [(0, 0), [0], [0.0]]), "a row of zeros"),
        (lambda p: p.force([0]), "a row of zeros"),
        (lambda p: p.force([1.0, 2.0]), "or a row of 1 numbers"),
        (lambda p: p.limit_cycle(0.2), "limit_cycle: a linear system has none; add"),
        (
            lambda p: p.add(CubicSpring(1.0), 0).follow_band(BAND, outputs={"x": 0}),
            "no excitation: force",
        ),
        (
            lambda p: p.add(CubicSpring(1.0), 0).force(0).follow_band(BAND, outputs={"x": [0]}),
            "a row of zeros",
        ),
        (
            lambda p: p.force(0).follow_band(BAND, outputs={"x": (0, 5)}),
            r"output 'x' = \(0, 5\): dof 5 must be between 0 and 0",
        ),
        (
            lambda p: p.force(0).follow_band(BAND, outputs={"x": [1.0, 2.0]}),
            r"output 'x' = \[1.0, 2.0\]: must be a dof 0..0",
        ),
        (lambda p: p.base_motion([1.0, 2.0], 1e-4), r"direction = .*2.* or a row of 1 numbers"),
        (lambda p: p.travelling_wave([0, 7], 1), "places = 7: dof 7 must be between 0 and 0"),
        (lambda p: Problem([[1.0]]), "K is missing"),
    ],
)
def test_wrong_use_is_told(wrong, said):
    with pytest.raises(InputError, match=said):
        wrong(Problem([[1.0]], [[0.02]], [[1.0]]))


def test_pairs_are_named_where_there_are_contacts():
    """A Duffing oscillator has none; a Jenkins element beside the cubic spring is one."""
    duffing = Problem(M=np.eye(1), C=0.1 * np.eye(1), K=np.eye(1)).add(CubicSpring(1.0), 0).force(0)
    alone = duffing.follow_band((0.05, 0.1), outputs={"x": 0})
    assert "pair" not in repr(alone) and "slip" not in repr(alone)
    both = duffing.add(Jenkins1D(), 0, kt=0.5, mu=0.3, preload=1.0)
    assert "1 of 1 pairs slip or open" in repr(both.follow_band((0.05, 0.1), outputs={"x": 0}))


def test_a_constant_load_that_never_closes_is_told():
    with pytest.warns(UserWarning, match="-4 N at contact 0: 1 of 1 are open for good"):
        duffing().add(Jenkins1D(), 0, kt=1.0, mu=0.3, preload=-4.0)


def test_damping_of_a_stop_with_clearance_is_told():
    """Ratios are of the modes with the stop closed; the warning says what the open chain has: that
    by which its free motion decays, from the eigenvalues of its state matrix."""
    zeta, kn, M = 0.008, 3e5, np.diag([1.0, 2.0, 1.5])
    K = np.array([[3.0, -1, 0], [-1, 2, -1], [0, -1, 1]]) * 1e5
    w2, shapes = la.eigh(K + kn * np.diag([0, 0, 1.0]), M)
    C = M @ shapes @ np.diag(2 * zeta * np.sqrt(w2)) @ shapes.T @ M
    state = np.block([[np.zeros((3, 3)), np.eye(3)], [-la.solve(M, K), -la.solve(M, C)]])
    poles = la.eigvals(state)
    lowest = poles[np.abs(poles).argmin()]
    own, hz = -lowest.real / abs(lowest), abs(lowest) / (2 * np.pi)

    def chain(preload, **damping):
        return Problem(M, K=K, **damping).add(UnilateralSpring(), 2, kn=kn, preload=preload)

    with pytest.warns(Doubt) as told:
        assert chain(-300.0, damping_ratio=zeta).contact_problem
    (said,) = [str(one.message) for one in told]
    assert own > 1.1 * zeta
    assert "0.008 is that of a mode with every contact closed; while" in said
    found = re.search(r"mode 1, (\S+) Hz, has (\S+): give C", said)
    assert float(found[1]) == pytest.approx(hz, rel=1e-3)
    assert float(found[2]) == pytest.approx(own, rel=2e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert chain(-300.0, C=C).contact_problem and chain(3.0, damping_ratio=zeta).contact_problem


def test_outputs_by_dof_and_stability_of_one_solution():
    """A dof is its row, of every function that takes outputs; one solution has the multipliers of
    the point of the curve there: of a linear oscillator exp(-zeta w0 T), as it is damped."""
    pair = Problem(np.eye(2), 0.1 * np.eye(2), [[2.0, -1], [-1, 2]]).add(CubicSpring(1e-9), 0)
    driven = pair.force(0, 0.3)
    problem, force = driven.contact_problem, np.array([0.3, 0])
    one, row = (
        solve_at(problem, force, 0.2, outputs={"x": where}, stability="all")
        for where in (1, [0.0, 1])
    )
    assert np.array_equal(one.harmonics, row.harmonics)
    assert np.abs(one.multipliers) == pytest.approx(np.exp(-0.05 / 0.2), rel=1e-6)
    assert one.stable and not one.unstable and one.truncation.size == 1
    without = solve_at(problem, force, 0.2, outputs={"x": 1})
    assert not without.multipliers.size and not without.stable
    mode = backbone(problem, 1, (1e-3, 2e-3), outputs={"x": 0}, harmonics=1)
    assert mode.frequency[0] == pytest.approx(1 / (2 * np.pi), rel=1e-4)
    with pytest.raises(InputError, match=r"output 'x': dof 2 does not exist, 0\.\.1 do"):
        solve_at(problem, force, 0.2, outputs={"x": 2})


def test_a_single_unstable_solution_says_so():
    """The middle one of three motions of a Duffing oscillator."""
    curve = duffing().follow_band((0.05, 0.6), outputs={"x": 0}, harmonics=3, stability="all")
    i = int(np.flatnonzero(curve.unstable)[len(np.flatnonzero(curve.unstable)) // 2])
    hz = curve.frequency[i]
    found = duffing().solve_at(
        hz, outputs={"x": 0}, harmonics=3, guess=curve.unknowns[i], stability="all"
    )
    assert found.unstable and not found.stable
    assert found.multipliers[0] == pytest.approx(curve.multipliers[i, 0], rel=1e-6)


def test_an_output_is_a_dof_wherever_it_is_given():
    """Of one dof, too, where a whole number could be a row; two dofs are a difference, as in
    `add`."""
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    blade = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    given = blade.contact_problem, np.array([5.0]), 850.0
    one, row, own = (
        solve_at(*given, outputs={"x": 0}),
        solve_at(*given, outputs={"x": [1.0]}),
        blade.solve_at(850.0, outputs={"x": 0}),
    )
    assert one.amplitude() == row.amplitude() == own.amplitude() > 0
    with pytest.raises(InputError, match="output 'x': dof 3 does not exist, 0..0 do"):
        solve_at(*given, outputs={"x": 3})
    pair = Problem(np.eye(2), 0.01 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]]).force(0, 0.1)
    pair = pair.add(CubicSpring(0.1), 0)
    apart = solve_at(pair.contact_problem, np.array([0.1, 0.0]), 0.1, outputs={"x": (0, 1)})
    own = pair.solve_at(0.1, outputs={"x": (0, 1)})
    assert apart.harmonics == pytest.approx(own.harmonics, rel=1e-12)
    # a row
    assert np.isfinite(pair.solve_at(0.1, outputs={"x": (0, 1.0)}).harmonics).all()


m, c, k, G, ME = 1.3, 0.09, 2.1, 0.35, 0.02
SKEW = np.array([[0.0, 1.0], [-1.0, 0.0]])


def unbalanced_rotor():
    rotor = Problem(m * np.eye(2), c * np.eye(2), k * np.eye(2), general=True)
    rotor = rotor.of_speed(C=lambda speed: c * np.eye(2) + speed * G * SKEW)
    return rotor.force(0, Unbalance(ME)).force(1, Unbalance(-1j * ME))


def stiffened():
    blade = Problem([[1.0]], [[0.05]], [[1.0]]).force(0, 0.1)
    return blade.of_speed(K=lambda speed: [[1 + 0.4 * speed**2]], engine_order=3)


LINEAR = {  # problem, band in Hz, its response in closed form
    "unbalance of a rotor": (
        unbalanced_rotor,
        (0.05, 0.5),
        lambda w: ME * w**2 / (k + G * w**2 - m * w**2 + 1j * c * w),
    ),
    "stiffened by speed": (
        stiffened,
        (0.1, 0.3),
        lambda w: 0.1 / (1 + 0.4 * (w / 3) ** 2 - w**2 + 0.05j * w),
    ),
    "structural damping on a shaken base": (
        lambda: Problem([[m]], K=[[k]], structural=0.03).base_motion([1.0], lambda w: -9.8 / w**2),
        (0.1, 0.3),
        lambda w: -9.8 * m / (k * (1 + 0.03j) - m * w**2),
    ),
}


@pytest.mark.parametrize("name", LINEAR)
def test_without_a_law_the_response_is_the_linear_one(name):
    """In closed form; the last step of a point is linearised, which leaves some 1e-12."""
    made, band, exact = LINEAR[name][0](), *LINEAR[name][1:]
    curve = made.follow_band(band, outputs={"x": 0})
    assert curve.complete and curve.harmonics[:, 0, 2:].any() == 0
    X = exact(2 * np.pi * curve.frequency)
    assert np.abs(curve.harmonics[:, 0, 1] / X - 1).max() < 1e-11
    hz = float(curve.frequency[len(X) // 2])
    alone = made.solve_at(hz, outputs={"x": 0}).harmonics[0, 1]
    assert abs(alone / exact(2 * np.pi * hz) - 1) < 1e-12


def test_a_problem_brings_its_forces_to_each_function():
    """As to its own methods; without any, what is missing is said."""
    blade = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0)
    driven, outputs = blade.force(0, 0.2), {"x": [1.0]}
    own = driven.follow_band((0.1, 0.3), outputs={"x": 0})
    assert follow_band(driven, None, (0.1, 0.3), outputs=outputs).frequency.tolist() == (
        own.frequency.tolist()
    )
    one = driven.solve_at(0.2, outputs={"x": 0})
    assert solve_at(driven, None, 0.2, outputs=outputs).amplitude() == one.amplitude()
    over = follow_parameter(driven, None, 0.2, "level", (0.5, 1.0), outputs=outputs)
    assert over.amplitude()[-1] == pytest.approx(one.amplitude(), rel=1e-6)
    for call in (follow_band, solve_at):
        with pytest.raises(InputError, match="no excitation"):
            call(blade, None, 0.2, outputs=outputs)
