"""Figures drawn with plotly, as pieces of the HTML page."""

import html

import numpy as np

from tipdamp.hbm.drawing.figure import (
    INK,
    SEQUENCE,
    Band,
    Curve,
    Figure,
    Line,
    Tiles,
    edges,
    fine_ticks,
    outlines,
)
from tipdamp.report.libraries import need

FONT = (
    'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "DejaVu Sans", '
    "sans-serif"
)
TOP, BOTTOM, LEGEND_ROW, LEGEND_LETTERS = 34, 62, 22, 125  # px; letters of one legend row
DECADES = range(-6, 9)
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
    plotly = library()
    rows, columns = figure.rows, min(figure.columns, len(figure.panels))
    legend = -(-sum(len(n) + 9 for n in figure.legend) // LEGEND_LETTERS)
    bottom = BOTTOM + LEGEND_ROW * legend
    height = rows * figure.row_height + TOP + bottom
    inner = height - TOP - bottom
    specs: list = [
        [{} if r * columns + c < len(figure.panels) else None for c in range(columns)]
        for r in range(rows)
    ]
    out = plotly.subplots.make_subplots(
        rows,
        columns,
        specs=specs,
        subplot_titles=[plain_text(p.title) for p in figure.panels],
        horizontal_spacing=0.24 / max(columns, 2),
        vertical_spacing=min(84 / inner, 0.4) if rows > 1 else 0,
    )
    titled = [i for i, panel in enumerate(figure.panels) if panel.title]
    # at the left: the tool bar covers the right
    for i, title in zip(titled, out.layout.annotations, strict=True):
        title.update(
            x=out.get_subplot(i // columns + 1, i % columns + 1).xaxis.domain[0], xanchor="left"
        )
    seen: set[str] = set()
    for i, panel in enumerate(figure.panels):
        _panel(out, panel, dict(row=i // columns + 1, col=i % columns + 1), seen)
    out.update_layout(
        template="simple_white",
        height=height,
        font={"family": FONT, "size": 12.5, "color": INK},
        margin={"l": 70, "r": 18, "t": TOP, "b": bottom},
        hovermode="closest",
        legend={
            "orientation": "h",
            "yref": "container",
            "y": 0.0,
            "yanchor": "bottom",
            "x": 0.5,
            "xanchor": "center",
            "font": {"size": 12},
        },
    )
    out.update_annotations(font_size=13)
    return out.to_html(
        full_html=False, include_plotlyjs=False, config=CONFIG, div_id=f"figure-{figure.name}"
    )


def _panel(out, panel, where, seen):
    for item in panel.items:
        if isinstance(item, Line):
            _line(out, item, where)
            continue
        if isinstance(item, Tiles):
            _tiles(out, item, where)
            continue
        shown = bool(item.name) and item.name not in seen
        seen.add(item.name)
        legend = {
            "name": plain_text(item.name),
            "legendgroup": plain_text(item.name),
            "showlegend": shown,
        }
        for k, trace in enumerate(_traces(item)):
            out.add_scatter(
                **trace, **(legend if k == 0 else {**legend, "showlegend": False}), **where
            )
    x = {
        "title_text": plain_text(panel.x_label),
        "title_standoff": 6,
        "title_font_size": 12.5,
        "range": panel.x_range,
        "exponentformat": "none",
    }
    y = {
        "title_text": plain_text(panel.y_label),
        "title_standoff": 6,
        "title_font_size": 12.5,
        "range": panel.y_range,
        "exponentformat": "power",
    }  # no µ or k before the unit of the label
    for axis, whole in ((x, panel.whole_x), (y, panel.whole_y)):
        axis.update(
            {"tickformat": "d", "minor": {"ticks": ""}, **_whole_ticks(panel, axis is x)}
            if whole
            else {}
        )
    if panel.y_names:
        y.update(
            tickvals=0.45 + np.arange(len(panel.y_names)),
            ticktext=[plain_text(n) for n in panel.y_names],
        )
    logarithmic = [(y, panel.y_range)] * panel.log_y + [(x, panel.x_range)] * panel.log_x
    for axis, limits in logarithmic:
        fine = [digit * 10.0**k for k in DECADES for digit in fine_ticks(limits)]
        axis.update(
            type="log",
            **(
                {"tickvals": fine, "ticktext": [f"{tick:g}" for tick in fine]}
                if panel.log_x
                else {"dtick": 1, "minor": {"ticks": "outside"}}
            ),
            range=None if limits is None else np.log10(limits),
        )
    out.update_xaxes(**x, showgrid=True, gridcolor="#ececec", mirror=True, **where)
    out.update_yaxes(**y, showgrid=True, gridcolor="#ececec", mirror=True, **where)


def _whole_ticks(panel, of_x):
    """Distance of the ticks, 1 where there are few."""
    values = [
        v
        for item in panel.items
        if not isinstance(item, Line)
        for v in np.asarray(item.x if of_x else item.y)
    ]
    return {"dtick": max(1, int(np.ptp(values)) // 10)} if values else {}


def _tiles(out, item, where):
    colors = [[k / (len(SEQUENCE) - 1), color] for k, color in enumerate(SEQUENCE)]
    bar = {
        "title": {"text": plain_text(item.label), "side": "right", "font": {"size": 11.5}},
        "thickness": 12,
        "outlinewidth": 0,
        "tickfont": {"size": 11},
        "exponentformat": "power",
    }
    out.add_heatmap(
        x=small(edges(item.x)),
        y=small(edges(item.y)),
        z=small(item.values),
        colorscale=colors,
        zmin=0.0,
        zmax=item.top,
        xgap=1,
        ygap=1,
        showscale=where["col"] == 1 and where["row"] == 1,
        colorbar=bar,
        hovertemplate="%{x:.5~g}, %{y:d}: %{z:.4~g}<extra></extra>",
        **where,
    )


def _traces(item) -> list[dict]:
    hover = "%{x:.5~g}, %{y:.4~g}<extra>" + plain_text(item.name) + "</extra>"
    if isinstance(item, Band):
        polygons = outlines(item)
        if not polygons:
            return []
        gap = np.array([np.nan])
        x, y = (
            np.concatenate([part for p in polygons for part in (p[k], gap)])[:-1] for k in (0, 1)
        )
        return [
            {
                "x": small(x),
                "y": small(y),
                "mode": "lines",
                "fill": "toself",
                "hoverinfo": "skip",
                "line": {"width": 0, "color": item.color},
                "fillcolor": _rgba(item.color, item.opacity),
            }
        ]
    points = {"x": small(item.x), "y": small(item.y), "hovertemplate": hover}
    if isinstance(item, Curve):
        return [
            {
                **points,
                "mode": "lines",
                "line": {
                    "color": item.color,
                    "dash": item.dash,
                    "width": item.width,
                    "simplify": False,
                },
                "connectgaps": False,
            }
        ]
    symbol = item.symbol if item.filled or item.symbol == "x" else f"{item.symbol}-open"
    text = (
        {"text": [plain_text(label) for label in item.labels], "textposition": "bottom right"}
        if item.labels
        else {}
    )
    return [
        {
            **points,
            **text,
            "mode": "markers+text" if item.labels else "markers",
            "marker": {
                "color": item.color,
                "symbol": "x-thin" if item.symbol == "x" else symbol,
                "size": item.size,
                "line": {"color": item.color, "width": 1.6},
            },
        }
    ]


def _line(out, item, where):
    text = {}
    if item.label:
        position = f"{'top' if item.end == 'high' else 'bottom'} {'left' if item.left else 'right'}"
        text = {
            "annotation_text": plain_text(item.label),
            "annotation_position": position,
            "annotation_font_color": item.color,
            "annotation_font_size": 11,
        }
    add = out.add_vline if item.axis == "x" else out.add_hline
    add(
        item.value,
        line={"color": item.color, "dash": item.dash, "width": 1.2},
        opacity=1.0,
        **text,
        **where,
    )


def small(values):
    """Seven digits: enough for the eye."""
    return np.asarray(values, dtype=np.float32)


def _rgba(color, opacity):
    return "rgba({},{},{},{:g})".format(*(int(color[k : k + 2], 16) for k in (1, 3, 5)), opacity)


def plain_text(text) -> str:
    """Plain text for plotly, which reads a few HTML tags, and templates between %{ and }."""
    return html.escape(str(text), quote=False).replace("%{", "% {")


def library():
    """plotly with the parts that are used here; InputError where it is missing."""
    need("plotly")
    import plotly
    import plotly.graph_objects
    import plotly.offline
    import plotly.subplots

    return plotly
