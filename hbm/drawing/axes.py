"""The items of a panel drawn on axes of matplotlib."""

from typing import TYPE_CHECKING, Any

from tipdamp.hbm.drawing.figure import (
    INK,
    SEQUENCE,
    Band,
    Curve,
    Line,
    Marks,
    Panel,
    Tiles,
    edges,
    fine_ticks,
    outlines,
)
from tipdamp.hbm.errors import library

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

DASH = {"solid": "-", "dash": (0, (5, 3)), "dashdot": (0, (6, 2, 1, 2)), "dot": (0, (1, 1.6))}
SYMBOL = {
    "circle": "o",
    "diamond": "D",
    "square": "s",
    "x": "x",
    "cross": "P",
    "triangle-up": "^",
    "triangle-down": "v",
    "star": "*",
    "hexagram": "H",
}


SETTINGS = {
    "font.size": 9.5,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "grid.color": "#ececec",
    "text.color": INK,
    "axes.titlesize": 10.5,
    "font.family": "sans-serif",
}


def draw_panel(axes: Any, panel: Panel, handles: dict[str, Any]) -> None:
    """Draw a panel, with its title and labels; what the names of a legend stand for is added to the
    handles."""
    axes.set(xlabel=plain_text(panel.x_label), ylabel=plain_text(panel.y_label))
    if panel.title:
        axes.set_title(plain_text(panel.title))
    axes.set_axisbelow(True)
    _set_scales(axes, panel)
    for item in panel.items:
        if isinstance(item, Line):
            _line(axes, item)
            continue
        handle = _ITEM[type(item)](axes, item)
        if item.name and handle is not None:
            handles.setdefault(item.name, handle)
    for axis, whole in ((axes.xaxis, panel.whole_x), (axes.yaxis, panel.whole_y)):
        if whole:
            axis.get_major_locator().set_params(integer=True, min_n_ticks=1)
    if panel.y_names:
        axes.set_yticks(
            [0.45 + k for k in range(len(panel.y_names))],
            [plain_text(n) for n in panel.y_names],
            fontsize=8,
        )
    if panel.x_range is not None:
        axes.set_xlim(*panel.x_range)
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    elif not panel.log_y:
        _room_above_labels(axes, panel)


def _set_scales(axes: Any, panel: Panel) -> None:
    """Logarithmic where the panel has it so."""
    if panel.log_y:
        axes.set_yscale("log")
    if panel.log_x:
        axes.set_xscale("log")
        _fine_ticks(axes.xaxis, panel.x_range)
        if panel.log_y:
            _fine_ticks(axes.yaxis, panel.y_range)


def _fine_ticks(axis: Any, limits: tuple[float, float] | None) -> None:
    """As plain numbers."""
    ticker = library("matplotlib.ticker", "a picture")
    axis.set_major_locator(ticker.LogLocator(subs=fine_ticks(limits)))
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(ticker.NullFormatter())


def _room_above_labels(axes: "Axes", panel: Panel) -> None:
    """Labels of level lines stand above them, inside the frame."""
    low, high = axes.get_ylim()
    for item in panel.items:
        if isinstance(item, Line) and item.axis == "y" and item.label and item.end == "high":
            axes.set_ylim(top=max(axes.get_ylim()[1], item.value + 0.09 * (high - low)))


def _curve(axes: "Axes", item: Curve) -> "Line2D":
    return axes.plot(
        item.x, item.y, color=item.color, linestyle=DASH[item.dash], linewidth=0.8 * item.width
    )[0]


def _band(axes: "Axes", item: Band) -> "Polygon | None":
    patches = [
        axes.fill(x, y, color=item.color, alpha=item.opacity, linewidth=0)[0]
        for x, y in outlines(item)
    ]
    return patches[0] if patches else None


def _marks(axes: "Axes", item: Marks) -> "Line2D":
    face = item.color if item.filled else "white"
    handle = axes.plot(
        item.x,
        item.y,
        linestyle="none",
        marker=SYMBOL[item.symbol],
        markersize=0.65 * item.size,
        markerfacecolor=face,
        markeredgecolor=item.color,
        markeredgewidth=1.1,
        zorder=4,
    )[0]
    for x, y, label in zip(item.x, item.y, item.labels or (), strict=False):
        axes.annotate(
            plain_text(label),
            (x, y),
            xytext=(5, -5),
            textcoords="offset points",
            va="top",
            color=item.color,
            fontsize=8.5,
        )
    return handle


def _line(axes: "Axes", item: Line) -> None:
    draw_line = axes.axvline if item.axis == "x" else axes.axhline
    draw_line(item.value, color=item.color, linestyle=DASH[item.dash], linewidth=0.9)
    if not item.label:
        return
    high = item.end == "high"
    place: dict[str, Any]
    if item.axis == "x":
        place = {
            "xy": (item.value, 0.98 if high else 0.02),
            "xycoords": axes.get_xaxis_transform(),
            "ha": "right" if item.left else "left",
            "va": "top" if high else "bottom",
            "xytext": (-2 if item.left else 2, 0),
        }
    else:
        place = {
            "xy": (0.02 if item.left else 0.98, item.value),
            "xycoords": axes.get_yaxis_transform(),
            "ha": "left" if item.left else "right",
            "va": "bottom" if high else "top",
            "xytext": (0, 2 if high else -2),
        }
    axes.annotate(
        plain_text(item.label), color=item.color, fontsize=8, textcoords="offset points", **place
    )


def _tiles(axes: Any, item: Tiles) -> None:
    colors = library("matplotlib.colors", "a picture").LinearSegmentedColormap.from_list(
        "levels", SEQUENCE
    )
    mesh = axes.pcolormesh(
        edges(item.x),
        edges(item.y),
        item.values,
        cmap=colors,
        vmin=0.0,
        vmax=item.top,
        edgecolors="white",
        linewidth=0.8,
    )
    axes.figure.colorbar(mesh, ax=axes, label=plain_text(item.label), pad=0.02)


_ITEM: dict = {Curve: _curve, Band: _band, Marks: _marks, Tiles: _tiles}


def plain_text(text: object) -> str:
    """Plain text for matplotlib, which reads formulas between dollars."""
    return str(text).replace("$", r"\$")
