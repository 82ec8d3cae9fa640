"""The ticks that a reader of a figure sees, on the page and on its picture."""

import base64
import json

import numpy as np
import pytest

from tipdamp.hbm.drawing.axes import draw_panel
from tipdamp.hbm.drawing.figure import Curve, Figure, Panel
from tipdamp.report.drawing import plotly

Ticks = list[tuple[float, str]]  # where, and what is written there

FINE = [(0.8, 120.0), (40.0, 70.0), (3.0, 6.5), (2.1e-5, 3.3e-4), (2.1e6, 6.6e7)]


def layout(panel):
    """Of the page."""
    drawn = plotly.draw(Figure("x", "", "", [panel]))
    decoder, at = json.JSONDecoder(), drawn.index("[", drawn.index("Plotly.newPlot("))
    _, at = decoder.raw_decode(drawn, at)
    return decoder.raw_decode(drawn, drawn.index("{", at))[0]


def numbers(values):
    """A list, or what plotly packs it into."""
    if isinstance(values, dict):
        return np.frombuffer(base64.b64decode(values["bdata"]), values["dtype"]).tolist()
    return values


def on_page(axis, ends) -> Ticks:
    """Those named one by one, between the ends of the axis."""
    ticks = zip(numbers(axis["tickvals"]), axis["ticktext"], strict=True)
    return [(at, text) for at, text in ticks if ends[0] <= at <= ends[1]]


def on_picture(panel) -> tuple[Ticks, Ticks]:
    """Of x and y."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Base

    picture = Base()
    canvas, axes = FigureCanvasAgg(picture), picture.add_subplot()
    draw_panel(axes, panel, {})
    canvas.draw()
    found = []
    assert [axes.get_xscale() == "log", axes.get_yscale() == "log"] == [panel.log_x, panel.log_y]
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        ticks = [(one.get_loc(), one.label1.get_text()) for one in axis.get_major_ticks()]
        found.append([(at, text) for at, text in ticks if low <= at <= high])
        assert not any(one.label1.get_text() for one in axis.get_minor_ticks())
    return found[0], found[1]


def places(ticks):
    return [at for at, _ in ticks]


@pytest.mark.parametrize("ends", FINE)
@pytest.mark.parametrize("other", [FINE[0], FINE[1]])
def test_a_fine_axis_reads_alike_on_page_and_picture(ends, other):
    """Plain numbers where they belong, at least four of them and no crowd."""
    panel = Panel("", "", "", [Curve(ends, other)], True, True, ends, other)
    page = layout(panel)
    for axis, limits, picture in zip("xy", (ends, other), on_picture(panel), strict=True):
        drawn = page[f"{axis}axis"]
        assert drawn["type"] == "log" and numbers(drawn["range"]) == pytest.approx(
            np.log10(limits).tolist()
        )
        seen = on_page(drawn, limits)
        assert 4 <= len(seen) <= 12
        assert [float(text) for _, text in seen] == pytest.approx(places(seen))
        assert places(seen) == pytest.approx(places(picture))
        assert [text for _, text in seen] == [text for _, text in picture]


def test_a_fine_axis_without_ends_has_three_ticks_in_a_decade():
    panel = Panel("", "", "", [Curve([1.0, 100.0], [1.0, 2.0])], log_x=True)
    seen = on_page(layout(panel)["xaxis"], (1.0, 99.0))
    assert [text for _, text in seen] == ["1", "2", "5", "10", "20", "50"]
    assert set(places(seen)) <= {round(at, 9) for at in places(on_picture(panel)[0])}


def test_a_coarse_axis_has_a_tick_for_each_decade():
    panel = Panel("", "", "", [Curve([1.0, 2.0], [1e-7, 1e-3])], log_y=True, y_range=(1e-7, 1e-3))
    axis = layout(panel)["yaxis"]
    assert axis["type"] == "log" and axis["dtick"] == 1 and "tickvals" not in axis
    assert axis["range"] == pytest.approx([-7, -3]) or numbers(axis["range"]) == [-7, -3]
    assert places(on_picture(panel)[1]) == pytest.approx([1e-7, 1e-6, 1e-5, 1e-4, 1e-3])


@pytest.mark.parametrize("last", [1, 4, 12, 35, 270])
@pytest.mark.parametrize("whole", ["x", "y"])
def test_an_axis_that_counts_has_ticks_at_whole_numbers(last, whole):
    """At each of them where there are few, at no more than twenty where there are many."""
    counts, others = [0.0, float(last)], [0.013, 0.017]
    x, y = (counts, others) if whole == "x" else (others, counts)
    panel = Panel("", "", "", [Curve(x, y)], whole_x=whole == "x", whole_y=whole == "y")
    page, other = layout(panel)[f"{whole}axis"], layout(panel)["yx"["xy".index(whole)] + "axis"]
    assert page["tickformat"] == "d" and page["minor"]["ticks"] == ""
    assert page["dtick"] == int(page["dtick"]) >= 1
    assert last <= 20 * page["dtick"] and (page["dtick"] == 1 or last >= 10 * page["dtick"])
    assert "dtick" not in other and "tickformat" not in other
    seen = places(on_picture(panel)["xy".index(whole)])
    assert seen and all(at == round(at) for at in seen)


def test_rows_have_their_names_at_their_middles():
    panel = Panel("", "", "", [Curve([1.0, 2.0], [0.0, 3.0])], y_names=("a", "b", "c <1>"))
    seen = on_page(layout(panel)["yaxis"], (-1.0, 4.0))
    assert seen == [(0.45, "a"), (1.45, "b"), (2.45, "c &lt;1&gt;")]
    assert on_picture(panel)[1] == [(0.45, "a"), (1.45, "b"), (2.45, "c <1>")]


def test_no_letter_stands_for_a_power_of_ten():
    """15000 Hz, not 15k; along y a power from some size on."""
    page = layout(Panel("", "", "", [Curve([1.0, 15000.0], [1.0, 1e7])]))
    assert page["xaxis"]["exponentformat"] == "none"
    assert page["yaxis"]["exponentformat"] == "power" and 10 ** page["yaxis"]["minexponent"] == 1e4
