"""What the figures of a comparison show: of curves that are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.comparison.test_peaks import results, two_blades
from tipdamp.comparison.figures import responses
from tipdamp.comparison.record import ComparedStudies, Computed
from tipdamp.hbm.drawing.figure import Curve, Marks


def test_responses_stand_per_newton_on_both_blades(tmp_path):
    """Of 1 and of 20 N the same curve in µm/N, since all is stuck: that of the blades together and
    of one against the other, each on its own blade."""
    (tmp_path / "a").mkdir()
    one = results(tmp_path / "a", 401)
    cases = list(one.cases)
    stops = cases[-1].facts.model_copy(update={"complete": False})
    cases[-1] = replace(cases[-1], facts=stops)
    one = replace(one, cases=tuple(cases))
    (figure,) = responses(ComparedStudies((Computed("a", one),), ()))
    hz = np.linspace(1200, 3300, 401)
    assert [panel.title for panel in figure.panels] == ["blade 1", "blade 2"]
    for panel, mine in zip(figure.panels, two_blades(1.0, hz).T, strict=True):
        lines = [item for item in panel.items if isinstance(item, Curve)]
        assert [line.name for line in lines] == ["Fe = 1 N", "Fe = 20 N"]
        for line in lines:
            assert list(line.x) == list(hz)
            assert line.y == pytest.approx(1e6 * abs(mine))
        (stopped,) = [item for item in panel.items if isinstance(item, Marks)]
        assert stopped.name == "curve stops"
        assert (list(stopped.x), list(stopped.y)) == (
            [3300.0],
            pytest.approx([1e6 * abs(mine[-1])]),
        )
        assert panel.y_label == "amplitude per force (µm/N)"
        assert panel.x_range == (1200.0, 3300.0)
