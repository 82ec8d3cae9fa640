"""The same figures drawn with matplotlib, as PNG."""

from tipdamp.hbm.drawing.axes import SETTINGS, draw_panel, plain_text
from tipdamp.hbm.drawing.figure import Figure
from tipdamp.report.libraries import need

DPI, PANEL_WIDTH, PIXELS_PER_INCH = 150, {1: 7.5, 2: 5.2, 3: 4.0}, 100
LEGEND_ROW = 0.25  # inch


def draw(figure: Figure, path) -> None:
    """Write the figure to a PNG file."""
    backend, base, rc_context = _matplotlib()
    columns = min(figure.columns, len(figure.panels))
    wide = PANEL_WIDTH.get(columns, 4.0) * columns
    legend_columns = _legend_columns(figure.legend, wide)
    legend = LEGEND_ROW * -(-len(figure.legend) // legend_columns) + 0.1 if figure.legend else 0.0
    high = figure.rows * figure.row_height / PIXELS_PER_INCH + 0.45 + legend
    with rc_context(SETTINGS):
        out = base(figsize=(wide, high), dpi=DPI, facecolor="white")
        out.set_layout_engine(
            "constrained", rect=(0, legend / high, 1, 1 - legend / high), w_pad=0.1, h_pad=0.1
        )
        backend(out)
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
        out.get_layout_engine().execute(out)
        out.set_layout_engine(None)  # else all is laid out and drawn twice
        out.savefig(path, format="png")


def _legend_columns(names, wide) -> int:
    """As many columns as the longest name leaves room for."""
    longest = max((len(n) for n in names), default=0) + 7
    return max(1, min(len(names), int(wide * 13 / longest)))


def _matplotlib():
    """The canvas without a screen, the figure class and the context of settings: pyplot is not
    needed."""
    need("matplotlib")
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Base

    return FigureCanvasAgg, Base, rc_context
