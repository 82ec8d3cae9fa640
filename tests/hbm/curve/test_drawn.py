"""The curve between its points, drawn by PCHIP."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from tests.hbm.cases import beam
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve import drawn
from tipdamp.hbm.response import follow_band


def test_slopes_are_those_of_pchip():
    """At interior points, rising and falling and at extrema, against scipy."""
    rng = np.random.default_rng(0)
    p, values = np.cumsum(rng.uniform(0.1, 1.0, 30)), rng.normal(size=(30, 2))
    h = np.diff(p)[:, None]
    found = drawn._drawn_slopes(h, np.diff(values, axis=0) / h, np.zeros_like(values))
    assert found[1:-1] == pytest.approx(
        PchipInterpolator(p, values, axis=0).derivative()(p[1:-1]), abs=1e-12
    )


@pytest.mark.parametrize("case, level", [("B8", 20), ("C8", 40)])
def test_kinks_are_drawn_where_they_are(case, level):
    """Contacts that begin to slip make kinks: beside a curve of many points, off by 3e-3 of the
    peak at most."""
    problem, force, outputs = beam(case)
    fine, curve = (
        follow_band(
            problem, level * force, (700, 1200), harmonics=3, outputs=outputs, settings=settings
        )
        for settings in (Settings(drawn_error=1e-4, largest_step=0.06), None)
    )
    assert curve.complete and curve.peak("tip")[1] == pytest.approx(fine.peak("tip")[1], rel=1e-9)
    hz = np.linspace(700, 1200, 5001)
    drawn_fine, drawn_curve = (
        PchipInterpolator(c.frequency, c.amplitude()[:, 0])(hz) for c in (fine, curve)
    )
    assert np.abs(drawn_curve - drawn_fine).max() < 3e-3 * drawn_fine.max()
    assert len(curve.frequency) < 120
