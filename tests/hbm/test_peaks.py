"""Every local maximum of a curve, and solutions at a frequency that was not asked for beforehand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from hbm.errors import InputError
from hbm.laws import DryFriction2T
from hbm.peaks import find_peaks
from hbm.response import follow_band, forced_response
from hbm.result import ForcedResponse
from hbm.solutions import solutions_at
from tests.hbm.cases import beam, jenkins, load, rig, unilateral
from tests.hbm.small_rig import small_rig

C1 = load("C1")


def amplitude_at(problem, force, outputs, name, H):
    """Function of Hz: half peak to peak of a solution of its own, far from any curve."""
    def at(hz, kind="half_peak_to_peak"):
        return follow_band(problem, force, (hz, 1.0001 * hz), harmonics=H, outputs=outputs).amplitude(kind)[
            0, list(outputs).index(name)]
    return at


@pytest.mark.slow
def test_all_maxima_are_found_and_solved():
    """The rig has more than one resonance in the band: each top is that of a search by single solutions."""
    (problem, force, outputs), level, H = rig(), 20, 3
    name = next(iter(outputs))
    one = {name: outputs[name]}
    curve = follow_band(problem, level * force, (2300, 3300), harmonics=H, outputs=one)
    found = find_peaks(curve, problem, name)
    assert len(found) >= 2 and (np.diff(found[:, 1]) <= 0).all() and tuple(found[0]) == curve.peak(name)
    height = amplitude_at(problem, level * force, one, name, H)
    for hz, top in found:
        best = minimize_scalar(lambda f: -height(f), bounds=(hz - 0.2, hz + 0.2), method="bounded",
                               options={"xatol": 3e-3})
        assert top == pytest.approx(-best.fun, rel=2e-8)


@pytest.mark.slow
def test_maxima_are_solved_to_1e8():
    """Against the search of the maximum by single solutions, each with a start of its own."""
    problem, force, outputs = beam("C8")
    curve = follow_band(problem, 40 * force, (700, 1200), harmonics=3, outputs=outputs)
    hz, top = curve.peak("tip")
    height = amplitude_at(problem, 40 * force, outputs, "tip", 3)
    best = minimize_scalar(lambda f: -height(f), bounds=(hz - 0.5, hz + 0.5), method="bounded", options={"xatol": 1e-6})
    assert top == pytest.approx(-best.fun, rel=1e-8) and hz == pytest.approx(best.x, rel=1e-5)
    again = minimize_scalar(lambda f: -height(f, "harmonic"), bounds=(hz - 0.5, hz + 0.5), method="bounded")
    assert find_peaks(curve, problem, "tip", "harmonic")[0, 1] == pytest.approx(-again.fun, rel=1e-8)


def test_output_of_rounding_has_no_peaks():
    """A dof that stands still by symmetry, at 1e-16 of the others: its noise must not be refined."""
    model, pairs, tip = small_rig()
    model = replace(model, C=20.0 * np.outer(tip, tip))
    both = {"tip": tip, "still": np.eye(model.size)[12]}
    found = [forced_response(model, pairs, DryFriction2T(), 20 * tip, (900, 1800), harmonics=3, outputs=outputs)
             for outputs in (both, {"tip": tip})]
    still = found[0].amplitude()[:, 1]
    assert still.max() < 1e-12 * found[0].peak("tip")[1]
    assert len(found[0].frequency) == len(found[1].frequency)


def test_solutions_between_the_points_are_solved():
    """Not interpolated: at any frequency each crossing is what `at` gives, and the equations hold."""
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
    """C1 at H = 9, close to its folds: three solutions; the square of how far the near ones are apart grows
    as the distance."""
    problem, force = unilateral(C1["parameters"])
    curve = follow_band(problem, force, (1 / (2 * np.pi), 1.6 / (2 * np.pi)), harmonics=9, outputs={"x": [1.0]})
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
