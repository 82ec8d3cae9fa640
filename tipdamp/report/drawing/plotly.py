"""Figures drawn with plotly, as pieces of the HTML page."""

import html
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.drawing.figure import (
    INK,
    SEQUENCE,
    Band,
    Curve,
    Figure,
    Line,
    Marks,
    Panel,
    Tiles,
    edges,
    fine_ticks,
    outlines,
)
from tipdamp.report.libraries import need

FONT = {
    "family": 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, '
    '"DejaVu Sans", sans-serif',
    "size": 12.5,
}
LEGEND = {"orientation": "h", "x": 0.5, "xanchor": "center"}  # below the picture
TOP, BOTTOM, LEGEND_ROW, LEGEND_LETTERS = 34, 62, 22, 125  # px; letters of one legend row
LETTER = 7.5  # px, of an axis title
DECADES = range(-6, 9)
PLAIN = 4  # power of ten up to which ticks have none: 15000 Hz, not 1.5 times 10^4
FRAME = {"showgrid": True, "gridcolor": "#ececec", "mirror": True}
CONFIG = {
    "displaylogo": False,
    "responsive": True,
    "displayModeBar": "hover",
    # none that could leave the machine
    "modeBarButtons": [["zoom2d", "pan2d", "resetScale2d", "toImage"]],
}


def plotly_script() -> str:
    """plotly.js itself, to be written into the page once."""
    return library().offline.get_plotlyjs()


def draw(figure: Figure) -> str:
    """The figure as a <div> with its script; the page must hold plotly.js."""
    inner = figure.rows * figure.row_height
    layout, data, seen = _layout(figure, inner), list[dict](), set[str]()
    for i, (panel, (across, up)) in enumerate(
        zip(figure.panels, _domains(figure, inner), strict=True)
    ):
        k = str(i + 1) if i else ""
        axes = {"xaxis": f"x{k}", "yaxis": f"y{k}"}
        data += _panel(panel, axes, seen)
        x, y = _axes(panel)
        y["title"] = _y_title(figure, i, inner * (up[1] - up[0]))
        layout[f"xaxis{k}"] = {"anchor": axes["yaxis"], "domain": across, **x, **FRAME}
        layout[f"yaxis{k}"] = {"anchor": axes["xaxis"], "domain": up, **y, **FRAME}
        if panel.title:  # at the left: the tool bar covers the right
            layout["annotations"].append(
                _text(panel.title, (across[0], "paper", "left"), (up[1], "paper", "bottom"))
            )
        lines = [item for item in panel.items if isinstance(item, Line)]
        layout["shapes"] += [_line(one, axes) for one in lines]
        layout["annotations"] += [_label(one, axes) for one in lines if one.label]
    return as_html(checked(data, layout), f"figure-{figure.name}", CONFIG)


def _layout(figure: Figure, inner: int) -> dict:
    """What surrounds the panels, which take `inner` px together: room for titles and legend."""
    legend = -(-sum(len(n) + 9 for n in figure.legend) // LEGEND_LETTERS)
    bottom = BOTTOM + LEGEND_ROW * legend
    return {
        "height": inner + TOP + bottom,
        "font": {**FONT, "color": INK},
        "margin": {"l": 70, "r": 18, "t": TOP, "b": bottom},
        "separators": ".",  # of decimals alone: no comma in thousands
        "hovermode": "closest",
        "legend": {
            **LEGEND,
            "yref": "container",
            "y": 0.0,
            "yanchor": "bottom",
            "font": {"size": 12},
        },
        "annotations": [],
        "shapes": [],
    }


def checked(data: list[dict], layout: dict) -> Any:
    """The plotly figure, without the template that `as_html` adds.

    Made in one piece: plotly checks a figure that grows piece by piece again and again, and so it
    does with the hundreds of entries of a template.
    """
    return library().graph_objects.Figure({"data": data, "layout": {"template": {}, **layout}})


def as_html(figure: Any, name: str, config: dict) -> str:
    """A <div> of that name with the script that draws a figure of `checked` into it."""
    content = figure.to_dict()
    content["layout"]["template"] = _template()
    return library().io.to_html(
        content,
        config=config,
        include_plotlyjs=False,
        full_html=False,
        validate=False,
        div_id=name,
    )


@cache
def _template() -> dict:
    """Looks of axes and traces that a figure does not set itself."""
    return library().io.templates["simple_white"].to_plotly_json()


def _domains(figure: Figure, inner: int) -> list[tuple[list[float], list[float]]]:
    """Part of the width and of the height that each panel takes, row after row from above."""
    rows, columns = figure.rows, min(figure.columns, len(figure.panels))
    gaps = 0.24 / max(columns, 2), min(84 / inner, 0.4)
    across, up = (
        [[k * (1 + gap) / n, min((k + 1) * (1 + gap) / n - gap, 1.0)] for k in range(n)]
        for n, gap in zip((columns, rows), gaps, strict=True)
    )
    return [(one, row) for row in reversed(up) for one in across][: len(figure.panels)]


def _panel(panel: Panel, axes: dict[str, str], seen: set[str]) -> list[dict]:
    """The traces of a panel; names that stand in the legend are added to `seen`."""
    traces: list[dict] = []
    for item in panel.items:
        if isinstance(item, Tiles):
            traces.append({**_tiles(item), **axes, "showscale": axes["xaxis"] == "x"})
        elif not isinstance(item, Line):
            name, shown = plain_text(item.name), bool(item.name) and item.name not in seen
            seen.add(item.name)
            legend = {"name": name, "legendgroup": name, "showlegend": shown}
            traces += [
                {"type": "scatter", **one, **legend, **axes} for one in _TRACES[type(item)](item)
            ]
    return traces


def _axes(panel: Panel) -> tuple[dict, dict]:
    """Layout of the axes x and y."""
    x: dict = {
        "title": _axis_title(panel.x_label),
        "range": panel.x_range,
        "exponentformat": "none",
    }
    y: dict = {
        "range": panel.y_range,
        "exponentformat": "power",
        "minexponent": PLAIN,
        "automargin": True,
    }  # no µ or k before the unit of the label
    if panel.whole_x:
        x |= _whole_ticks(panel, "x")
    if panel.whole_y:
        y |= _whole_ticks(panel, "y")
    if panel.y_names:
        names = [plain_text(n) for n in panel.y_names]
        y |= {"tickvals": 0.45 + np.arange(len(names)), "ticktext": names}
    if panel.log_x:
        x |= _logarithmic(panel.x_range, fine=True)
    if panel.log_y:
        y |= _logarithmic(panel.y_range, fine=panel.log_x)
    return x, y


def _whole_ticks(panel: Panel, axis: str) -> dict:
    """At whole numbers, 1 apart where there are few."""
    values = [
        v
        for item in panel.items
        if isinstance(item, Curve | Marks | Tiles)
        for v in np.asarray(vars(item)[axis])
    ]
    distance = {"dtick": max(1, int(np.ptp(values)) // 10)} if values else {}
    return {"tickformat": "d", "minor": {"ticks": ""}, **distance}


def _logarithmic(limits: tuple | None, fine: bool) -> dict:
    """With a tick for each decade, or finely with plain numbers."""
    places = [digit * 10.0**k for k in DECADES for digit in fine_ticks(limits)]
    ticks = (
        {"tickvals": places, "ticktext": [f"{tick:g}" for tick in places]}
        if fine
        else {"dtick": 1, "minor": {"ticks": "outside"}}
    )
    return {"type": "log", **ticks, "range": None if limits is None else np.log10(limits)}


def _y_title(figure: Figure, i: int, height: float) -> dict | None:
    """Of panel i, height px high: none where that to the left says the same, whose frame it would
    lie on in a narrow window; in two lines where one is too long."""
    label, columns = figure.panels[i].y_label, min(figure.columns, len(figure.panels))
    if i % columns and figure.panels[i - 1].y_label == label:
        return None
    title = _axis_title(label)
    if LETTER * len(label) > height:
        title["text"] = title["text"].replace(" (", "<br>(", 1)
    return title


def _axis_title(label: str) -> dict:
    return {"text": plain_text(label), "standoff": 6, "font": {"size": 12.5}}


def _tiles(item: Tiles) -> dict:
    colors = [[k / (len(SEQUENCE) - 1), color] for k, color in enumerate(SEQUENCE)]
    bar = {
        "title": {"text": plain_text(item.label), "side": "right", "font": {"size": 11.5}},
        "thickness": 12,
        "outlinewidth": 0,
        "tickfont": {"size": 11},
        "exponentformat": "power",
        "minexponent": PLAIN,
    }
    return {
        "type": "heatmap",
        "x": small(edges(item.x)),
        "y": small(edges(item.y)),
        "z": small(item.values),
        "colorscale": colors,
        "zmin": 0.0,
        "zmax": item.top,
        "xgap": 1,
        "ygap": 1,
        "colorbar": bar,
        "hovertemplate": "%{x:.5~g}, %{y:d}: %{z:.4~g}<extra></extra>",
    }


def _band(item: Band) -> Iterator[dict]:
    """One trace for all its polygons."""
    if polygons := outlines(item):
        gap = np.array([np.nan])
        x, y = (
            np.concatenate([part for p in polygons for part in (p[k], gap)])[:-1] for k in (0, 1)
        )
        yield {
            "x": small(x),
            "y": small(y),
            "mode": "lines",
            "fill": "toself",
            "hoverinfo": "skip",
            "line": {"width": 0, "color": item.color},
            "fillcolor": _rgba(item.color, item.opacity),
        }


def _curve(item: Curve) -> Iterator[dict]:
    yield {
        **_points(item),
        "mode": "lines",
        "line": {"color": item.color, "dash": item.dash, "width": item.width, "simplify": False},
        "connectgaps": False,
    }


def _marks(item: Marks) -> Iterator[dict]:
    symbol = item.symbol if item.filled or item.symbol == "x" else f"{item.symbol}-open"
    labels = {"text": [plain_text(one) for one in item.labels], "textposition": "bottom right"}
    yield {
        **_points(item),
        **(labels if item.labels else {}),
        "mode": "markers+text" if item.labels else "markers",
        "marker": {
            "color": item.color,
            "symbol": "x-thin" if item.symbol == "x" else symbol,
            "size": item.size,
            "line": {"color": item.color, "width": 1.6},
        },
    }


_TRACES: dict[type, Callable[[Any], Iterator[dict]]] = {
    Band: _band,
    Curve: _curve,
    Marks: _marks,
}


def _points(item: Curve | Marks) -> dict:
    """The places, and what is said on hover."""
    # a trace of no points would have no entry in the legend, which other panels rely on
    x, y = (small(values) if len(values) else [None] for values in (item.x, item.y))
    hover = "%{x:.5~g}, %{y:.4~g}<extra>" + plain_text(item.name) + "</extra>"
    return {"x": x, "y": y, "hovertemplate": hover}


def _line(item: Line, axes: dict[str, str]) -> dict:
    """A line across the panel."""
    x, y, value = axes["xaxis"], axes["yaxis"], item.value
    upright = {"x0": value, "x1": value, "xref": x, "y0": 0, "y1": 1, "yref": f"{y} domain"}
    level = {"x0": 0, "x1": 1, "xref": f"{x} domain", "y0": value, "y1": value, "yref": y}
    return {
        **(upright if item.axis == "x" else level),
        "type": "line",
        "line": {"color": item.color, "dash": item.dash, "width": 1.2},
        "opacity": 1.0,
    }


def _label(item: Line, axes: dict[str, str]) -> dict:
    """The label of a line, beside it at one of its ends."""
    x, y, high = axes["xaxis"], axes["yaxis"], item.end == "high"
    across: tuple
    up: tuple
    if item.axis == "x":
        across = item.value, x, "right" if item.left else "left"
        up = int(high), f"{y} domain", "top" if high else "bottom"
    else:
        across = int(not item.left), f"{x} domain", "left" if item.left else "right"
        up = item.value, y, "bottom" if high else "top"
    return _text(item.label, across, up, color=item.color)


def _text(text: str, across: tuple, up: tuple, **font: str) -> dict:
    """An annotation; across, up - place, what it refers to, and the edge of the text there."""
    places = {
        f"{k}{part}": value
        for k, place in (("x", across), ("y", up))
        for part, value in zip(("", "ref", "anchor"), place, strict=True)
    }
    return {**places, "text": plain_text(text), "showarrow": False, "font": {"size": 13, **font}}


def small(values: ArrayLike) -> np.ndarray:
    """Seven digits: enough for the eye."""
    return np.asarray(values, dtype=np.float32)


def _rgba(color: str, opacity: float) -> str:
    return "rgba({},{},{},{:g})".format(*(int(color[k : k + 2], 16) for k in (1, 3, 5)), opacity)


def plain_text(text: str) -> str:
    """Plain text for plotly, which reads a few HTML tags, and templates between %{ and }."""
    return html.escape(str(text), quote=False).replace("%{", "% {")


def library() -> Any:
    """plotly with the parts that are used here; InputError where it is missing."""
    need("plotly")
    import plotly
    import plotly.graph_objects
    import plotly.io
    import plotly.offline

    return plotly
