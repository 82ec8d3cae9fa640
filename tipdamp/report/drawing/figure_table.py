"""A figure as a CSV table: every number that it draws, one row each."""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tipdamp.hbm.drawing.figure import Band, Curve, Figure, Item, Line, Tiles

HEAD = ("panel", "drawn as", "name", "x", "y", "y high", "label")


def write(figure: Figure, path: Path) -> None:
    """Columns of HEAD after a line with the labels of the axes of each panel; a band has its lower
    and upper bound in y and y high, tiles their value as label."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(HEAD)
        for panel in figure.panels:
            title = plain(panel.title)
            out.writerow((title, "axes", "", plain(panel.x_label), plain(panel.y_label), "", ""))
            for item in panel.items:
                out.writerows((title, *row) for row in _rows(item))


def plain(text: str) -> str:
    """A name that no spreadsheet takes for a formula."""
    return f"'{text}" if text[:1] in tuple("=+-@\t\r") else text


def _rows(item: Item) -> Iterator[tuple]:
    if isinstance(item, Line):
        place = (f"{item.value:.9g}", "") if item.axis == "x" else ("", f"{item.value:.9g}")
        yield ("line", "", *place, "", plain(item.label))
        return
    name = plain(item.name)
    if isinstance(item, Curve):
        yield from (
            ("curve", name, f"{x:.9g}", f"{y:.9g}", "", "")
            for x, y in zip(item.x, item.y, strict=True)
        )
    elif isinstance(item, Band):
        yield from (
            ("band", name, f"{x:.9g}", f"{a:.9g}", f"{b:.9g}", "")
            for x, a, b in zip(item.x, item.low, item.high, strict=True)
        )
    elif isinstance(item, Tiles):
        yield from (
            ("tiles", name, f"{x:.9g}", f"{y:.9g}", "", f"{v:.9g}")
            for y, row in zip(item.y, item.values, strict=True)
            for x, v in zip(item.x, row, strict=True)
            if np.isfinite(v)
        )
    else:
        labels = item.labels or ("",) * len(item.x)
        yield from (
            ("marks", name, f"{x:.9g}", f"{y:.9g}", "", plain(label))
            for x, y, label in zip(item.x, item.y, labels, strict=True)
        )
