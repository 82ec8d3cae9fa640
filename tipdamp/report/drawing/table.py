"""A table as plain text, which the template of the page escapes and sets; a figure as a CSV table:
every number that it draws, one row each."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from tipdamp.hbm.drawing.figure import Band, Curve, Figure, Item, Line, Tiles

HEAD = ("panel", "drawn as", "name", "x", "y", "y high", "label")


@dataclass(frozen=True)
class Table:
    """records - a row each, {title of the column: text}, all with the same columns; left - places
    of the columns of words, set flush left, the others flush right."""

    kind: ClassVar[str] = "Table"

    caption: str
    records: Sequence[Mapping[str, str]]
    left: tuple[int, ...] = (0,)

    @property
    def columns(self) -> tuple[str, ...]:
        """Titles."""
        return tuple(self.records[0]) if self.records else ()

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """Texts."""
        return tuple(tuple(record.values()) for record in self.records)


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
        x, y = (item.value, "") if item.axis == "x" else ("", item.value)
        yield "line", "", digits(x), digits(y), "", plain(item.label)
        return
    name = plain(item.name)
    if isinstance(item, Curve):
        for x, y in zip(item.x, item.y, strict=True):
            yield "curve", name, digits(x), digits(y), "", ""
    elif isinstance(item, Band):
        for x, low, high in zip(item.x, item.low, item.high, strict=True):
            yield "band", name, digits(x), digits(low), digits(high), ""
    elif isinstance(item, Tiles):
        for row, column in np.argwhere(np.isfinite(item.values)):
            value = item.values[row, column]
            yield "tiles", name, digits(item.x[column]), digits(item.y[row]), "", digits(value)
    else:
        labels = item.labels or ("",) * len(item.x)
        for x, y, label in zip(item.x, item.y, labels, strict=True):
            yield "marks", name, digits(x), digits(y), "", plain(label)


def digits(value: float | str) -> str:
    """Nine digits; nothing stays nothing."""
    return "" if value == "" else f"{value:.9g}"
