"""Ticks of logarithmic axes: neither a bare axis nor a crowd, however short the range."""

import numpy as np
import pytest

from tipdamp.hbm.drawing.figure import fine_ticks


@pytest.mark.parametrize("ratio", [1.6, 2.0, 3.0, 4.9, 5.2, 8.0, 30.0, 400.0])
@pytest.mark.parametrize("start", np.geomspace(0.02, 0.2, 9))
def test_enough_in_any_range(ratio, start):
    places = np.outer(10.0 ** np.arange(-4, 5), fine_ticks((start, ratio * start))).ravel()
    inside = (places >= start) & (places <= ratio * start)
    assert (4 if ratio >= 2 else 3) <= inside.sum() <= 12


def test_without_limits():
    assert fine_ticks(None) == (1, 2, 5)
