"""Every local maximum of a curve, and solutions at a frequency that was not asked for
beforehand."""

import warnings
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from tests.hbm.cases import beam, jenkins, load, rig, unilateral
from tests.hbm.small_rig import small_rig
from tests.validation.peaks_from_both_ends import compare
from tests.validation.random_systems import contact_systems
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts, DryFriction2T, Jenkins1D
from tipdamp.hbm.response import follow_band, forced_response, solve_at
from tipdamp.hbm.result import ForcedResponse

C1 = load("C1")


def amplitude_at(problem, force, outputs, name, H):
    """Function of Hz: half peak to peak of a solution of its own, far from any curve."""

    def at(hz, kind="half_peak_to_peak"):
        found = solve_at(problem, force, hz, harmonics=H, outputs=outputs)
        assert found.converged
        return found.amplitude(kind)[list(outputs).index(name)]

    return at


@pytest.mark.slow
def test_all_maxima_are_found_and_solved():
    """The rig has more than one resonance in the band: each top is that of a search by single
    solutions."""
    (problem, force, outputs), level, H = rig(), 20, 3
    name = next(iter(outputs))
    one = {name: outputs[name]}
    given = dict(harmonics=H, outputs=one, truncation=False)
    curve = follow_band(problem, level * force, (2300, 3300), **given)
    found = find_peaks(curve, problem, name)
    assert (
        len(found) >= 2
        and (np.diff(found[:, 1]) <= 0).all()
        and tuple(found[0]) == curve.peak(name)
    )
    height = amplitude_at(problem, level * force, one, name, H)
    for hz, top in found:
        best = minimize_scalar(
            lambda f: -height(f),
            bounds=(hz - 0.2, hz + 0.2),
            method="bounded",
            options={"xatol": 3e-3},
        )
        assert top == pytest.approx(-best.fun, rel=2e-8)


def test_peaks_of_groups():
    """Largest and smallest of each patch as where every output's peak is solved, for less; others
    are not marked."""
    problem, force, outputs = rig()
    names = np.array(list(outputs))
    patches = [names[:5].tolist(), names[5:].tolist()]
    every, some = (
        follow_band(problem, 12 * force, (2300, 3300), harmonics=3, outputs=outputs, peaks=peaks)
        for peaks in (None, patches)
    )
    assert (
        some.residual_calls < every.residual_calls - 10 and some.peak_points.any(axis=0).sum() == 4
    )
    for patch in patches:
        solved = np.array([every.peak(name) for name in patch])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = np.array([some.peak(name) for name in patch])
        for best in (np.argmax, np.argmin):
            top = best(solved[:, 1])
            assert best(found[:, 1]) == top and not some.why_unsolved(patch[top])
            assert found[top, 1] == pytest.approx(solved[top, 1], rel=1e-9)
    for peaks, said in (
        (names, "groups of names"),
        ("tip", "groups of names"),
        ([["tip"]], "'tip' is unknown"),
    ):
        with pytest.raises(InputError, match=said):
            follow_band(problem, force, (2300, 3300), outputs=outputs, peaks=peaks)


@pytest.mark.slow
def test_maxima_are_solved_to_1e8():
    """Against the search of the maximum by single solutions, each with a start of its own."""
    problem, force, outputs = beam("C8")
    curve = follow_band(problem, 40 * force, (700, 1200), harmonics=3, outputs=outputs)
    hz, top = curve.peak("tip")
    height = amplitude_at(problem, 40 * force, outputs, "tip", 3)
    best = minimize_scalar(
        lambda f: -height(f), bounds=(hz - 0.5, hz + 0.5), method="bounded", options={"xatol": 1e-6}
    )
    assert top == pytest.approx(-best.fun, rel=1e-8) and hz == pytest.approx(best.x, rel=1e-5)
    again = minimize_scalar(
        lambda f: -height(f, "harmonic"), bounds=(hz - 0.5, hz + 0.5), method="bounded"
    )
    assert find_peaks(curve, problem, "tip", "harmonic")[0, 1] == pytest.approx(
        -again.fun, rel=1e-8
    )


def test_output_of_rounding_has_no_peaks():
    """A dof that stands still by symmetry, at 1e-16 of the others: its noise must not be
    refined."""
    model, pairs, tip = small_rig()
    model = replace(model, C=20.0 * np.outer(tip, tip))
    both = {"tip": tip, "still": np.eye(model.size)[12]}
    found = [
        forced_response(
            model, pairs, DryFriction2T(), 20 * tip, (900, 1800), harmonics=3, outputs=outputs
        )
        for outputs in (both, {"tip": tip})
    ]
    still = found[0].amplitude()[:, 1]
    assert still.max() < 1e-12 * found[0].peak("tip")[1]
    assert len(found[0].frequency) == len(found[1].frequency)


def test_solutions_between_the_points_are_solved():
    """Not interpolated: at any frequency each crossing is what `at` gives, and the equations
    hold."""
    problem, force = unilateral(C1["parameters"])
    band, hz = np.array([0.8, 1.5]) / (2 * np.pi), 1.15 / (2 * np.pi)
    curve = follow_band(problem, force, band, harmonics=1, outputs={"x": [1.0]})
    assert not (curve.frequency == hz).any()
    known = next(r for r in C1["results"] if r["Omega"] == 1.15)["HB01_all_solutions"]
    found = np.sort(np.abs(solutions_at(curve, problem, hz)[:, 0, 1]))
    assert np.allclose(found, np.sort([s["X1"] for s in known]), rtol=1e-8)


def test_solutions_outside_or_from_a_file(tmp_path):
    problem, force = jenkins(load("A1")["parameters"])
    curve = follow_band(problem, force, (0.1, 0.2), harmonics=3, outputs={"x": [1.0]}, at=[0.15])
    with pytest.raises(InputError, match="0.3 Hz: the band of the curve is 0.1 to 0.2 Hz"):
        solutions_at(curve, problem, 0.3)
    loaded = ForcedResponse.load(curve.save(tmp_path / "curve.npz"))
    assert np.array_equal(solutions_at(loaded, problem, 0.15), solutions_at(curve, problem, 0.15))
    assert np.array_equal(solutions_at(loaded, problem, 0.16), solutions_at(curve, problem, 0.16))
    found = find_peaks(curve, problem, "x")
    assert len(found) and np.array_equal(find_peaks(loaded, problem, "x"), found)


def test_at_outside_the_band_is_refused():
    problem, force = jenkins(load("A1")["parameters"])
    with pytest.raises(InputError, match=r"at = 0.3 Hz: lies outside band = \(0.1, 0.2\) Hz"):
        follow_band(problem, force, (0.1, 0.2), harmonics=3, outputs={"x": [1.0]}, at=[0.3])


def test_both_solutions_next_to_a_fold_are_found():
    """C1 at H = 9, close to its folds: three solutions; the square of how far the near ones are
    apart grows
    as the distance."""
    problem, force = unilateral(C1["parameters"])
    curve = follow_band(
        problem, force, (1 / (2 * np.pi), 1.6 / (2 * np.pi)), harmonics=9, outputs={"x": [1.0]}
    )
    turns = np.flatnonzero(np.diff(np.sign(np.diff(curve.frequency)))) + 1
    assert len(turns) == 2
    for turn, inside in zip(turns, (-1, 1), strict=True):
        apart = []
        for distance in (3e-6, 10e-6, 17e-6):
            hz = curve.frequency[turn] * (1 + inside * distance)
            sizes = np.sort(np.abs(solutions_at(curve, problem, hz)[:, 0, 1]))
            assert len(sizes) == 3
            apart.append(np.diff(sizes).min())
        first, second = np.diff(np.square(apart))
        assert first == pytest.approx(second, rel=0.1)


STIFF = jenkins(dict(m=1.0, k=1.0, c=0.02, kt=1e6, slip_limit_muN=1.0, F=1.2))


@pytest.fixture(scope="module")
def both_ways():
    problem, force = STIFF
    return [
        follow_band(problem, force, np.array(band) / (2 * np.pi), harmonics=9, outputs={"x": [1.0]})
        for band in ((0.3, 2.0), (2.0, 0.3))
    ]


@pytest.mark.parametrize("kind", ["half_peak_to_peak", "harmonic", "rms"])
def test_a_spring_of_a_million_times_the_stiffness(both_ways, kind):
    """Residuals of 1e-13 of the motion are 1e-7 of the contact force: the largest maximum from both
    ends."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of smaller maxima
        tops = [find_peaks(curve, STIFF[0], "x", kind)[0] for curve in both_ways]
    assert tops[0][1] == pytest.approx(tops[1][1], rel=1e-8) and tops[0][0] == pytest.approx(
        tops[1][0], rel=1e-7
    )


@pytest.mark.parametrize("kind", ["harmonic", "rms"])
def test_a_peak_that_is_not_solved_is_named(both_ways, kind):
    """Of these kinds a curve holds no solved maximum: its highest point stands for it, which the
    sentence says."""
    for curve in both_ways:
        with pytest.warns(
            UserWarning,
            match=f"peak of 'x': the largest .* not solved: find_peaks.*'{kind}'. solves",
        ):
            hz, top = curve.peak("x", kind)
        i = int(np.argmax(curve.amplitude(kind)))
        assert (hz, top) == (
            curve.frequency[i],
            curve.amplitude(kind)[i, 0],
        ) and not curve.why_unsolved("x")


def test_a_top_where_the_branch_was_left_is_named(both_ways):
    curve = both_ways[0]
    i = int(np.argmax(curve.amplitude()))
    for at, named in ((i, True), (i + 1, True), (i + 2, False), (i - 1, False)):
        jumps = np.zeros(len(curve.frequency), dtype=bool)
        jumps[at] = True
        assert ("left and taken up" in replace(curve, jumps=jumps).why_unsolved("x")) == named


def test_a_sharp_linear_resonance_is_solved(recwarn):
    """Damping 1e-5: the last bit of the frequency changes the response by 1e-11; Newton's method
    cannot do better."""
    one = np.ones((1, 1))
    problem = ContactProblem(
        one, None, one, one, Jenkins1D(), Contacts([0.0], [1.0], [1.0], [1e9]), damping_ratio=1e-5
    )
    curve = follow_band(problem, np.ones(1), (0.2, 0.25), harmonics=3, outputs={"x": [1.0]})
    assert curve.peak("x")[1] == pytest.approx(
        0.5 / (2e-5 * np.sqrt(1 - 1e-10)), rel=1e-9
    ) and not len(recwarn)


@pytest.mark.parametrize("order", [1, 3])
def test_harmonic_is_of_the_order_of_the_force(order):
    problem, force = jenkins(load("A1")["parameters"])
    curve = follow_band(
        problem, {order: force}, np.array([0.1, 0.2]) / order, harmonics=9, outputs={"x": [1.0]}
    )
    size = np.abs(curve.harmonics[:, 0])
    assert np.allclose(curve.amplitude("harmonic")[:, 0], size[:, order], rtol=1e-14)
    assert np.array_equal(curve.amplitude("harmonic"), curve.amplitude("harmonic", order))
    assert np.allclose(curve.amplitude("harmonic", 3 * order)[:, 0], size[:, 3 * order], rtol=1e-14)
    hz, top = find_peaks(curve, problem, "x", "harmonic")[0]
    assert top >= size[:, order].max() and top == pytest.approx(size[:, order].max(), rel=1e-2)
    at = solve_at(problem, {order: force}, hz, harmonics=9, outputs={"x": [1.0]})
    assert at.amplitude("harmonic")[0] == pytest.approx(top, rel=1e-8)
    other = find_peaks(curve, problem, "x", "harmonic", order=3 * order)[0, 1]
    assert other == pytest.approx(size[:, 3 * order].max(), rel=2e-2) and other >= size[
        :, 3 * order
    ].max() * (1 - 1e-9)


def test_harmonic_of_a_force_of_two_orders():
    problem, force = jenkins(load("A1")["parameters"])
    curve = follow_band(
        problem, {1: force, 3: 0.3 * force}, (0.1, 0.2), harmonics=5, outputs={"x": [1.0]}
    )
    both = np.hypot(*np.abs(curve.harmonics[:, 0, [1, 3]]).T)
    assert np.allclose(curve.amplitude("harmonic")[:, 0], both, rtol=1e-14)
    assert find_peaks(curve, problem, "x", "harmonic")[0, 1] == pytest.approx(both.max(), rel=1e-2)
    for order in (0, 6, 1.5, True):
        with pytest.raises(
            InputError, match="order = .*: must be a whole number from 1 to harmonics = 5"
        ):
            curve.amplitude("harmonic", order)
    with pytest.raises(InputError, match="order = 3: belongs to the kind 'harmonic', not to 'rms'"):
        curve.peak("x", "rms", order=3)


@pytest.mark.parametrize("number", [10, 26])
def test_a_small_loop_beside_a_long_step(number):
    """Three solutions inside of a fold that a step had passed over, from either end."""
    found = compare(next(islice(contact_systems(number + 1), number, None)))
    assert (
        found.folds >= 2
        and not found.lost
        and not found.one_sided
        and not found.named
        and found.difference < 1e-8
    )
