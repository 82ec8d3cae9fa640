"""Figures as plain data: described once, drawn by `plotly` for the page and by `matplotlib` as PNG.

A Figure holds panels, a panel holds items (Curve, Band, Marks, Tiles, Line). Coordinates are in the
units of the axis labels. NaN in a curve or band is a gap. Items of one name share one entry of the
legend; an empty name has none. Names, titles and labels are plain text: the backends escape what
their own markup would read.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

Values = Any  # numbers in a row: an array or a sequence

INK, GREY, PALE = "#222222", "#8a8a8a", "#e3e3e3"
# Okabe and Ito (2008): told apart by colour-blind readers
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
ORANGE = "#E69F00"
DARK = "#12355b"
# dark to light: an order that survives grey print
SEQUENCE = ("#3b0f70", "#16508f", "#159a8a", "#7ab83a", "#f2ae00")
COMPONENTS = {"t1": BLUE, "t2": VERMILION, "n": INK}  # of a contact
DASHES = ("solid", "dash", "dashdot", "dot")


@dataclass(frozen=True)
class Curve:
    """A line through (x, y). dash - one of DASHES."""

    x: Values
    y: Values
    name: str = ""
    color: str = INK
    dash: str = "solid"
    width: float = 1.6


@dataclass(frozen=True)
class Band:
    """The area between low and high over x; x may run back, as on a fold."""

    x: np.ndarray
    low: np.ndarray
    high: np.ndarray
    name: str = ""
    color: str = GREY
    opacity: float = 0.25


@dataclass(frozen=True)
class Marks:
    """Points. symbol - circle, diamond, square, x, cross, triangle-up, triangle-down, star or
    hexagram;    labels - one text beside each, or none."""

    x: Values
    y: Values
    name: str = ""
    color: str = INK
    symbol: str = "circle"
    filled: bool = True
    size: float = 7.0
    labels: tuple = ()


@dataclass(frozen=True)
class Tiles:
    """Cells in colour: values (m, n) around the places y (m,), x (n,), ascending, on the scale from
    0 to `top`; NaN stays blank. label - of the scale"""

    x: np.ndarray
    y: np.ndarray
    values: np.ndarray
    label: str
    top: float
    name: str = ""


@dataclass(frozen=True)
class Line:
    """A straight line across the panel at a value of its x or y axis.

    end - where its label stands: 'high' (top, or above the line) or 'low'; left - label left of a
    line at an x value, or at the left end of a line at a y value
    """

    axis: str
    value: float
    label: str = ""
    color: str = GREY
    dash: str = "dash"
    end: str = "high"
    left: bool = False


Item = Curve | Band | Marks | Tiles | Line


@dataclass(frozen=True)
class Panel:
    """One pair of axes; items - Curve, Band, Marks, Tiles and Line, in the order of drawing;
    log_x, log_y - logarithmic axes, with log_x finely ticked ones;
    whole_x, whole_y - of axes that count: ticks at whole numbers alone;
    y_names - instead of numbers at 0.45, 1.45, ..."""

    title: str
    x_label: str
    y_label: str
    items: Sequence[Item]
    log_x: bool = False
    log_y: bool = False
    x_range: tuple | None = None
    y_range: tuple | None = None
    whole_x: bool = False
    whole_y: bool = False
    y_names: Sequence[str] = ()


@dataclass(frozen=True)
class Figure:
    """name - of the PNG file; caption - what one sees; row_height - px of one row of panels."""

    kind: ClassVar[str] = "Figure"

    name: str
    title: str
    caption: str
    panels: Sequence[Panel]
    columns: int = 2
    row_height: int = 340

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // self.columns)

    @property
    def legend(self) -> list[str]:
        """Names in the order of their first appearance."""
        items = (item for panel in self.panels for item in panel.items)
        return list(dict.fromkeys(i.name for i in items if not isinstance(i, Line) and i.name))


def outlines(band: Band) -> list[tuple[np.ndarray, np.ndarray]]:
    """Closed polygons (x, y) of a band, one for each run without a gap."""
    x, low, high = (np.asarray(v, dtype=float) for v in (band.x, band.low, band.high))
    good = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    edges = np.flatnonzero(np.diff(np.r_[False, good, False].astype(int)))
    runs = [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]
    return [(np.r_[x[r], x[r][::-1]], np.r_[low[r], high[r][::-1]]) for r in runs]


def edges(places: np.ndarray) -> np.ndarray:
    """(n+1,) borders of the cells around places (n,), half way between them."""
    if len(places) == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middle = 0.5 * (places[1:] + places[:-1])
    return np.r_[2 * places[0] - middle[0], middle, 2 * places[-1] - middle[-1]]


TICKS = (  # in each decade, from wide to short ranges
    (1, 2, 5),
    (1, 1.5, 2, 3, 4, 5, 7),
    (1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9),
)
FEWEST_TICKS = 4


def fine_ticks(limits: tuple | None) -> tuple[float, ...]:
    """Where in each decade a logarithmic axis has ticks: more of them where its limits are near, so
    that it has four if these are a factor of two apart."""
    if limits is None:
        return TICKS[0]
    decade = 10.0 ** np.arange(np.floor(np.log10(limits[0])), np.log10(limits[1]) + 1)
    for ticks in TICKS:
        places = np.outer(decade, ticks)
        if ((places >= limits[0]) & (places <= limits[1])).sum() >= FEWEST_TICKS:
            return ticks
    return TICKS[-1]


def level_colors(n: int) -> list[str]:
    """n colours from dark to light."""
    rgb = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in SEQUENCE], dtype=float)
    at = np.linspace(0, 1, n)
    mixed = np.column_stack(
        [np.interp(at, np.linspace(0, 1, len(rgb)), rgb[:, k]) for k in range(3)]
    )
    return ["#" + "".join(f"{int(round(v)):02x}" for v in row) for row in mixed]
