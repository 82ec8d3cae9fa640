"""Branches over the level of the force and over settings of the pairs: all that holds for a band holds for them."""

import numpy as np
import pytest

from hbm.continuation.settings import Settings
from hbm.errors import InputError
from hbm.peaks import find_peaks
from hbm.response import follow_band, follow_parameter
from hbm.solutions import solutions_at
from tests.hbm.cases import beam, load, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator

C1 = load("C1")
HZ = 1.15 / (2 * np.pi)
X = {"x": [1.0]}


PROBLEM, C1_FORCE = unilateral(C1["parameters"])


def c1(name, between, **more):
    return follow_parameter(PROBLEM, C1_FORCE, HZ, name, between, harmonics=1, outputs=X, **more)


@pytest.mark.parametrize("name,between", [("level", (0.2, 3.0)), ("level", (3.0, 0.2)), ("preload", (0.1, 4.0)),
                                          ("kn", (0.3, 3.0))])
def test_folds_over_a_parameter(name, between):
    """At the factor 1 there are the three solutions that the verification table has at this frequency."""
    passed = []
    curve = c1(name, between, at=[1.0], contact=True, progress=lambda value, step, iterations: passed.append(value))
    assert curve.complete and curve.parameter_name == name and (curve.frequency == HZ).all()
    turns = np.count_nonzero(np.diff(np.sign(np.diff(curve.parameter))))
    known = next(r for r in C1["results"] if r["Omega"] == 1.15)["HB01_all_solutions"]
    found = np.sort(np.abs(solutions_at(curve, PROBLEM, 1.0)[:, 0, 1]))
    expected = np.sort([s["X1"] for s in known])
    if name == "preload":
        # the preload of this case is that of a gap: its branches do not all meet, but each is one of the table
        assert all(np.abs(expected / amplitude - 1).min() < 1e-8 for amplitude in found) and len(found)
    else:
        assert turns >= 2 and np.allclose(found, expected, rtol=1e-8)
    assert curve.contact_force.shape == (len(curve.parameter), 1, 1, 2) and len(passed) > 10


@pytest.mark.parametrize("name,level,between", [("mu", 5, (1.0, 0.9)), ("level", 1, (5.0, 4.9))])
def test_a_branch_begins_where_newton_from_the_stuck_state_fails(name, level, between):
    """Five times the excitation at 160 Hz, H = 5: the other ways to a first point know the setting at its begin."""
    curve = follow_parameter(oscillator(), level * FORCE, 160, name, between, harmonics=5, outputs=Y2)
    band = follow_band(oscillator(), 5 * FORCE, (160, 180), harmonics=5, outputs=Y2)
    assert curve.complete
    alike = np.abs(solutions_at(band, oscillator(), 160)[:, 0, 1] / curve.harmonics[0, 0, 1] - 1)
    assert alike.min() < 1e-6


@pytest.mark.parametrize("name,between", [("level", (0.3, 6.0)), ("mu", (1.5, 0.6)), ("kt", (3.0, 0.3)),
                                          ("kn", (3.0, 0.3))])
def test_an_oscillator_over_a_parameter_ends_where_the_scaled_model_is(name, between):
    """The last point against the first of a band of the model with that setting."""
    curve = follow_parameter(oscillator(), FORCE, 170, name, between, harmonics=3, outputs=Y2)
    assert curve.complete, curve.ended
    settings = {"mu": 0.5, "kn": 3e5, "kt": 3e5}
    other = oscillator(**(settings | ({name: between[1] * settings[name]} if name != "level" else {})))
    level = between[1] if name == "level" else 1.0
    band = follow_band(other, level * FORCE, (170, 172), harmonics=3, outputs=Y2)
    assert np.abs(solutions_at(band, other, 170)[:, 0, 1] / curve.harmonics[-1, 0, 1] - 1).min() < 1e-6


def test_the_end_is_explained_in_the_parameter():
    curve = c1("level", (0.2, 3.0), settings=Settings(max_points=12))
    assert not curve.complete and "level = " in curve.ended and "Hz" not in curve.ended


def test_the_peak_over_a_parameter_is_solved():
    """C8 over the friction coefficient: the response is largest somewhere inside, and the top stands still there."""
    problem, force, outputs = beam("C8")
    curve = follow_parameter(problem, 40 * force, 932.1, "mu", (3.0, 0.05), harmonics=3, outputs=outputs)
    assert curve.complete
    for value, top in find_peaks(curve, problem, "tip"):
        beside = [follow_parameter(problem, 40 * force, 932.1, "mu", (v, 1.01 * v), harmonics=3, outputs=outputs)
                  .amplitude()[0, 0] for v in (value * (1 - 1e-4), value * (1 + 1e-4))]
        assert top >= max(beside) * (1 - 1e-9)


@pytest.mark.parametrize("changes,message", [
    (dict(parameter="levels"), "parameter = 'levels': .*level"), (dict(between=(1.0, 1.0)), "between = .*different"),
    (dict(between=(0.0, 1.0)), "between = .*positive"), (dict(between=3), "between = 3"),
    (dict(hz=-1.0), "hz = -1"), (dict(hz=(1, 2)), r"hz = \(1, 2\)"),
    (dict(at=[7.0]), r"at = 7: lies outside between = \(0.5, 2\)")])
def test_errors_name_their_argument(changes, message):
    problem, force = unilateral(C1["parameters"])
    given = dict(hz=HZ, parameter="level", between=(0.5, 2.0)) | changes
    with pytest.raises(InputError, match=message):
        follow_parameter(problem, force, harmonics=1, outputs=X, **given)
