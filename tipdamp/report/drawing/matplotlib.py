"""The same figures drawn with matplotlib, as PNG."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.drawing.axes import SETTINGS, draw_panel, plain_text
from tipdamp.hbm.drawing.figure import Figure
from tipdamp.report.libraries import need

DPI, PANEL_WIDTH, PIXELS_PER_INCH = 150, {1: 7.5, 2: 5.2, 3: 4.0}, 100
LEGEND_ROW, TITLE, PAD = 0.25, 0.32, 0.08  # inch: of a name, of the title, around a panel


def draw(figure: Figure, path: Path) -> None:
    """Write the figure to a PNG file."""
    backend, base, rc_context = _matplotlib()
    columns = min(figure.columns, len(figure.panels))
    wide = PANEL_WIDTH.get(columns, 4.0) * columns
    legend_columns = _legend_columns(figure.legend, wide)
    legend = LEGEND_ROW * -(-len(figure.legend) // legend_columns) + 0.1 if figure.legend else 0.0
    high = figure.rows * figure.row_height / PIXELS_PER_INCH + 0.45 + legend
    with rc_context(SETTINGS):
        out = base(figsize=(wide, high), dpi=DPI, facecolor="white")
        canvas = backend(out)
        handles: dict = {}
        for i, panel in enumerate(figure.panels):
            draw_panel(out.add_subplot(figure.rows, columns, i + 1), panel, handles)
        out.suptitle(plain_text(figure.title), x=0.01, ha="left", fontsize=11.5, fontweight="bold")
        if handles:
            out.legend(
                handles.values(),
                [plain_text(n) for n in handles],
                loc="lower center",
                ncols=legend_columns,
                frameon=False,
                fontsize=9,
            )
        _set_margins(out, canvas.get_renderer(), legend)
        # a sixth larger than with the default level, in less than half the time
        out.savefig(path, format="png", pil_kwargs={"compress_level": 1})


def _set_margins(out: Any, renderer: Any, legend: float) -> None:
    """As much between the panels as the widest of their labels take, measured once: a layout engine
    of matplotlib takes longer for this than the picture itself.

    legend - inch, below the panels
    """
    size = np.array(out.get_size_inches())
    grid = np.array(out.axes[0].get_gridspec().get_geometry())[::-1]  # columns, rows
    low, high = _reach_of_labels(out, renderer)
    # a panel keeps half of its share, however long the names are
    fit = np.minimum(1.0, 0.5 * (size - (0.0, legend + TITLE)) / grid / (low + high + 2 * PAD))
    low, high = (low + PAD) * fit, (high + PAD) * fit
    start, end = low + (0.0, legend), size - high - (0.0, TITLE)
    panel = (end - start - (grid - 1) * (low + high)) / grid
    (left, bottom), (right, top) = start / size, end / size
    wspace, hspace = (low + high) / panel
    out.subplots_adjust(left, bottom, right, top, wspace, hspace)


def _reach_of_labels(out: Any, renderer: Any) -> tuple[np.ndarray, np.ndarray]:
    """(2,) inch each that the widest labels of x and y take before and behind a panel."""
    low, high = np.zeros(2), np.zeros(2)
    for axes in out.axes:
        # the lines of the frame reach no further than the labels, and ask for all ticks again
        box = axes.get_tightbbox(renderer, bbox_extra_artists=axes.texts, for_layout_only=True)
        seen = box.get_points() / DPI
        place = axes.get_subplotspec().get_topmost_subplotspec().get_position(out)
        held = place.get_points() * out.get_size_inches()
        low, high = np.maximum(low, held[0] - seen[0]), np.maximum(high, seen[1] - held[1])
    return low, high


def _legend_columns(names: Sequence[str], wide: float) -> int:
    """As many columns as the longest name leaves room for."""
    longest = max((len(n) for n in names), default=0) + 7
    return max(1, min(len(names), int(wide * 13 / longest)))


def _matplotlib() -> tuple[Any, Any, Any]:
    """The canvas without a screen, the figure class and the context of settings: pyplot is not
    needed."""
    need("matplotlib")
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Base

    return FigureCanvasAgg, Base, rc_context
