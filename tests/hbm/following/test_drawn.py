"""Followed peaks draw themselves."""

import numpy as np
import pytest

from tipdamp.hbm.following.follow import follow_peak
from tipdamp.hbm.laws import Jenkins1D
from tipdamp.hbm.problem import Problem

pyplot = pytest.importorskip("matplotlib.pyplot")
pyplot.switch_backend("agg")
BLADE = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
DAMPED = BLADE.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
TIP = {"tip": [1.0]}


def test_height_over_the_parameter():
    given = dict(outputs=TIP, band=(600, 1000), harmonics=1)
    peaks = follow_peak(DAMPED, np.array([5.0]), "level", (1.0, 2.0), **given)
    axes = peaks.plot(unit="mm")
    x, drawn = axes.lines[0].get_data()
    assert np.allclose(x, peaks.parameter) and np.allclose(drawn, 1e3 * peaks.height)
    assert axes.get_xlabel() == "level (times the force)"
    pyplot.close("all")


def test_the_axis_has_the_unit_of_the_parameter():
    """N for the level of a force of 1 N; factors are named as such."""
    given = dict(outputs=TIP, band=(600, 1000), harmonics=1)
    for parameter, label in (("level", "level (N)"), ("mu", "mu factor")):
        peaks = follow_peak(DAMPED, np.array([1.0]), parameter, (1.0, 1.1), **given)
        assert peaks.plot().get_xlabel() == label
        assert peaks.to_pandas().columns[0] == label.removesuffix(" (N)") in repr(peaks)
    pyplot.close("all")
