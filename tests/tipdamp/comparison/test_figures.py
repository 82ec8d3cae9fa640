"""What the figures of a comparison show: of curves that are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.comparison.test_peaks import results, two_blades
from tests.tipdamp.comparison.test_tables import comparison, level
from tipdamp.comparison.figures import AT_LEAST, BEST, SYMBOLS, optimisation, places, responses
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


def test_curves_join_the_peaks_of_one_mode(tmp_path):
    """In µm/N over Fc/Fe, and in Hz: parted where another mode begins; all within the axes."""
    given = comparison(tmp_path)
    vars(given.computed[1].results.study)["path"] = tmp_path / "stiff.toml"
    soft = [
        level("soft", 1.0, 8e-7),
        level("soft", 2.0, 7e-7, hz=2790.0, mac=0.9),
        level("soft", 4.0, 4e-7, hz=2200.0, mac=0.1),
        level("soft", 8.0, 2e-7, hz=2180.0, mac=0.9),
    ]
    stiff = [level("stiff", Fe, 3e-7) for Fe in (1.0, 10.0)]
    given = replace(given, peaks=(*soft, *stiff))
    (figure,), (found,) = optimisation(given), places(given)
    heights = [([100, 50], [0.8, 0.7]), ([25, 12.5], [0.4, 0.2]), ([100, 10], [0.3, 0.3])]
    hertz = [([100, 50], [2800, 2790]), ([25, 12.5], [2200, 2180]), ([100, 10], [2800, 2800])]
    for panel, expected in ((figure.panels[0], heights), (found.panels[0], hertz)):
        lines = [item for item in panel.items if isinstance(item, Curve)]
        assert [one.color for one in lines[:2]] == [lines[0].color] * 2 != [lines[2].color] * 2
        for line, (x, y) in zip(lines, expected, strict=True):
            assert (list(line.x), list(line.y)) == (pytest.approx(x), pytest.approx(y))
        marks = {item.name: item for item in panel.items if isinstance(item, Marks)}
        assert list(marks["soft"].x) == pytest.approx([12.5, 25, 50, 100])
        assert marks["soft"].color == lines[0].color and marks["stiff"].color == lines[2].color
        assert [marks[name].symbol for name in ("soft", "stiff")] == [*SYMBOLS[:2]]
        assert panel.log_x and panel.x_range == pytest.approx((10 / 1.2, 120))
    assert figure.panels[0].log_y and figure.panels[0].y_range == pytest.approx((0.2 / 1.2, 0.96))


def test_bounds_bars_and_the_least_are_in_the_unit_of_the_curve(tmp_path):
    """A triangle at what a peak is at least, a bar over the scatter beside its mark, a star at the
    least: µm/N, and the axes hold them all."""
    given = comparison(tmp_path)
    soft = [level("soft", Fe, h) for Fe, h in ((1.0, 8e-7), (10.0, 4e-7), (50.0, 6e-7))]
    bound = level("soft", 100.0, None, at_least=3e-6, complete=False)
    spread = [level("soft", 10.0, h, scatter="mu") for h in (1e-7, 9e-7)]
    given = replace(given, peaks=(*soft, bound, *spread))
    (figure,) = optimisation(given)
    items = {item.name: item for item in figure.panels[0].items if item.name}
    triangle, star = items[AT_LEAST[False]], items[BEST]
    assert (list(triangle.x), list(triangle.y)) == ([1.0], pytest.approx([3.0]))
    assert triangle.symbol == "triangle-up" and not triangle.filled
    assert (list(star.x), list(star.y)) == ([10.0], pytest.approx([0.4]))
    (bar,) = [item for name, item in items.items() if name.startswith("scatter of")]
    assert bar.x == pytest.approx([10.0] * 3, rel=0.03)
    assert bar.y[:2] == pytest.approx([0.1, 0.9]) and np.isnan(bar.y[2])
    low, high = figure.panels[0].y_range
    assert low < 0.1 and 3.0 < high < 4.0
