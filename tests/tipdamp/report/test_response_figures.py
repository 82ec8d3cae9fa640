"""Curves of a family: per newton and absolute."""

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, results_of
from tipdamp.report.drawing.figure import Curve, Marks
from tipdamp.report.figures import response_family


def test_left_per_newton_and_right_absolute(tmp_path):
    """In µm/N and µm, of m; a circle at the peak of the curve file."""
    results = results_of(*artefacts(tmp_path))
    figures = list(response_family.figures(results))
    assert len(figures) == len(results.orders)
    for figure, H in zip(figures, reversed(results.orders), strict=True):
        cases = results.of_order(H)
        assert {case.Fe for case in cases} != {1.0}
        for panel, scale in zip(
            figure.panels, ([1e6 / case.Fe for case in cases], [1e6] * len(cases)), strict=True
        ):
            curves = [item for item in panel.items if isinstance(item, Curve)][: len(cases)]
            circles = [item for item in panel.items if isinstance(item, Marks) and not item.filled]
            for curve, circle, case, factor in zip(curves, circles, cases, scale, strict=False):
                top = case.patch(results.first_patch).max(axis=1)
                np.testing.assert_allclose(curve.y, factor * top)
                assert circle.y == pytest.approx([factor * case.facts.peak_m])
