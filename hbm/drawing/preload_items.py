"""What a preload looks like in every picture: filled marks where pairs are closed, hollow ones
where they are open, and what lies far below at the end of the axis."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import BLUE, GREEN, GREY, ORANGE, VERMILION, Curve, Item, Marks

CUT = 0.25  # of the largest preload: what open pairs take of an axis at most
ROWS = (BLUE, ORANGE, GREEN, VERMILION)
SYMBOLS = ("circle", "square", "diamond")


def row_items(
    x: np.ndarray, load: np.ndarray, name: str, row: int, low: float, before: int = 0
) -> Iterator[Item]:
    """Preloads (n,) of a row of pairs along x; low : end of the axis; before : rows of other sides
    on the same axes, whose colours it does not take."""
    order = np.argsort(x)
    x, y = x[order], load[order]
    color, symbol = ROWS[(row + before) % len(ROWS)], SYMBOLS[row % len(SYMBOLS)]
    closed, opened = y > 0, (y <= 0) & (y >= low)
    yield Curve(x, np.maximum(y, low), "", color, width=1.0)
    yield Marks(x[closed], y[closed], name, color, symbol)
    if opened.any():
        yield Marks(x[opened], y[opened], f"{name}, open", color, symbol, filled=False)
    yield from cut_marks(x, y, low)


def lowest_shown(load: np.ndarray) -> float:
    """Lower end of an axis of preloads: pairs with wide gaps are so negative that closed ones would
    lie flat beside."""
    top, low = float(load.max()), min(float(load.min()), 0.0)
    return max(low, -CUT * top) if top > 0 else low


def cut_marks(x: np.ndarray, y: np.ndarray, low: float) -> Iterator[Marks]:
    """What lies below the axis, at its end."""
    if (y < low).any():
        yield Marks(
            x[y < low],
            np.full(int((y < low).sum()), low),
            "open, below the axis",
            GREY,
            "x",
            size=5,
        )
