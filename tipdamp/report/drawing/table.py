"""A table as plain text, which the template of the page escapes and sets; a figure as a CSV table:
every number that it draws, one row each."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import ClassVar

import numpy as np

from tipdamp.hbm.drawing.figure import Band, Figure, Item, Line, Marks, Tiles

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
                drawn_as, name = type(item).__name__.lower(), plain(vars(item).get("name", ""))
                for *numbers, label in zip_longest(*_columns(item), fillvalue=""):
                    out.writerow((title, drawn_as, name, *map(digits, numbers), label))


def plain(text: str) -> str:
    """A name that no spreadsheet takes for a formula."""
    return f"'{text}" if text[:1] in tuple("=+-@\t\r") else text


def _columns(item: Item) -> tuple[Iterable, Iterable, Iterable, Iterable]:
    """x, y, y high and label of every number of an item; () what it has not."""
    if isinstance(item, Line):
        at, label = [item.value], [plain(item.label)]
        return (at, (), (), label) if item.axis == "x" else ((), at, (), label)
    if isinstance(item, Band):
        return item.x, item.low, item.high, ()
    if isinstance(item, Tiles):
        rows, columns = np.nonzero(np.isfinite(item.values))
        values = map(digits, item.values[rows, columns])
        return item.x[columns], item.y[rows], (), values
    return item.x, item.y, (), map(plain, item.labels) if isinstance(item, Marks) else ()


def digits(value: float | str) -> str:
    """Nine digits; nothing stays nothing."""
    return "" if value == "" else f"{value:.9g}"
