"""Where a curve ends with a motion that friction does not hold, integration finds it: beyond the
end the damper moves on from period to period, before it the motion settles."""

import numpy as np
import pytest

from tests.hbm.cases import rig
from tipdamp.hbm.comparison import integrator_of
from tipdamp.hbm.curve.solutions import point_of
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.time.settings import IntegrationSettings

SETTINGS = IntegrationSettings(tolerance=1e-4, massless_above=8.0)
PERIODS = 80


@pytest.fixture(scope="module")
def rolling():
    """(curve, problem) of the rig whose flat does not resist to roll, well above its slip limit."""
    problem, force, outputs = rig(roll=False)
    curve = follow_band(problem, 40 * force, (2300, 3300), harmonics=3, outputs=outputs)
    assert "the damper rolls" in curve.ended
    return curve, problem


def slides_a_period(curve, problem, hz, periods=PERIODS):
    """(2, P, 2) share of the size of the motion by which the sliders moved on in the middle and in
    the last of some periods, integrated from the nearest point of the curve."""
    solved = np.flatnonzero(curve.converged)
    nearest = solved[np.argmin(np.abs(curve.frequency[solved] - hz))]
    balance, point = point_of(curve, problem, int(nearest))
    integrator = integrator_of(balance, 2 * np.pi * hz, SETTINGS)
    state, found = integrator.on_orbit(point), []
    for number in range(periods):
        cycle = integrator.periods(state)
        if number in (periods // 2, periods - 1):
            step = integrator.vector(cycle.state) - integrator.vector(state)
            sliders = step[len(integrator.stuck.weight) :] / integrator.size
            found.append(sliders.reshape(len(problem.contacts), -1))
        state = cycle.state
    return np.array(found)


def test_damper_rolls_beyond_the_end(rolling):
    """As a rigid body: all stations of a side move on alike, the same way in every period, and not
    along the axis."""
    curve, problem = rolling
    middle, last = slides_a_period(curve, problem, curve.frequency[curve.converged].max() + 60)
    for side in (slice(0, 9), slice(9, 18)):
        along, across = last[side].T
        mean = across.mean()
        assert np.abs(across - mean).max() < 0.01 * abs(mean)
        assert np.abs(along).max() < 0.01 * abs(mean)
        assert middle[side, 1].mean() == pytest.approx(mean, rel=0.2)
        assert abs(mean) > 1e-4


def test_motion_settles_before_the_end(rolling):
    curve, problem = rolling
    middle, last = slides_a_period(curve, problem, curve.frequency[curve.converged].max() - 60)
    assert np.abs(middle).max() < 1e-5
    assert np.abs(last).max() < 1e-6


def test_end_of_too_few_harmonics_is_told():
    """With one harmonic the damper seems to roll; with three it does not there, nor by
    integration."""
    problem, force, outputs = rig(roll=False)
    curve = follow_band(problem, 28 * force, (2300, 3300), harmonics=1, outputs=outputs)
    assert not curve.complete and "too few harmonics; with harmonics = 3" in curve.ended
    assert "no periodic state" not in curve.ended
    end = curve.frequency[curve.converged].max()
    finer = follow_band(problem, 28 * force, (2300, 3300), harmonics=3, outputs=outputs)
    assert finer.frequency[finer.converged].max() > 1.01 * end
    middle, last = slides_a_period(finer, problem, end + 15)
    assert np.abs(last).max() < 1e-6
