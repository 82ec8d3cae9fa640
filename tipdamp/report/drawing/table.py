"""A table as plain text: the template of the page escapes and sets it."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Table:
    """columns (c,), rows of c texts; left - columns of words, set flush left, the others flush
    right."""

    kind: ClassVar[str] = "Table"

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left: tuple[int, ...] = (0,)
