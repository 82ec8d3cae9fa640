"""The journal of a curve: an interrupted curve goes on where it was, with the same numbers.

follow_band(problem, F, band, outputs=rows, journal=Journal(kept.append))                  # was
interrupted follow_band(problem, F, band, outputs=rows, journal=Journal(kept.append, list(kept)))
# goes on
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np


class JournalBlock(NamedTuple):
    """Steps as two plain arrays: numbers (n,) float64, and layout (k,) int64, for each step its
    mark, the number of its arrays, and for each of these whether it is complex, its number of
    dimensions, and these."""

    numbers: np.ndarray
    layout: np.ndarray


class StaleJournal(Exception):
    """The journal is not that of this curve, or damaged."""


class Journal:
    """Results of the costly steps of a curve in their order, handed over in blocks every few
    seconds.

    The points of a curve follow from these results: made once more with the blocks of an
    interrupted one, it takes them from there, and is solved from where they end. Raises
    StaleJournal where they are those of another curve: then the curve is to be made without them.

    blocks : of the interrupted curve; keep(block) : is called with each further one; clock :
    returns seconds
    every : s between two blocks: with the time of a step, less than 10 s of work can be lost
    """

    every: float = 5.0

    def __init__(
        self,
        keep: Callable[[JournalBlock], None],
        blocks: Iterable[JournalBlock] = (),
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.keep = keep
        self.clock = clock
        self.due = clock() + self.every
        self.known = chain.from_iterable(map(unpacked, blocks))
        self.fresh: list[tuple[int, tuple[np.ndarray, ...]]] = []

    def result(
        self, mark: int, compute: Callable[[], tuple[np.ndarray, ...]]
    ) -> tuple[np.ndarray, ...]:
        """The arrays of the next step: those of the journal, or computed; mark : tells it from
        other steps."""
        known = next(self.known, None)
        if known is not None:
            if known[0] != mark:
                raise StaleJournal
            return known[1]
        # copies: a solver may use its arrays again, and those of a journal lie in memory like
        # these, to the last bit
        arrays = tuple(np.array(a, order="C") for a in compute())
        self.fresh.append((mark, arrays))
        if self.clock() >= self.due:
            self.flush()
        return arrays

    def flush(self) -> None:
        """Hand over what is not yet."""
        if self.fresh:
            self.keep(packed(self.fresh))
        self.fresh = []
        self.due = self.clock() + self.every


def packed(steps: Iterable[tuple[int, tuple[np.ndarray, ...]]]) -> JournalBlock:
    """Steps (mark, real or complex arrays) as one block."""
    numbers: list[np.ndarray] = []
    layout: list[int] = []
    for mark, arrays in steps:
        layout += [mark, len(arrays)]
        for a in arrays:
            layout += [int(np.iscomplexobj(a)), a.ndim, *a.shape]
            numbers.append(np.ascontiguousarray(a).ravel().view(float))
    return JournalBlock(np.concatenate([np.empty(0), *numbers]), np.array(layout, dtype=np.int64))


def unpacked(block: JournalBlock) -> Iterator[tuple[int, tuple[np.ndarray, ...]]]:
    """The steps of a block; raises StaleJournal where its two arrays do not fit."""
    try:
        if block.numbers.dtype != float or block.layout.dtype.kind != "i" or block.layout.ndim != 1:
            raise ValueError
        numbers = block.numbers
        layout = map(int, block.layout)
        at = 0
        for mark in layout:
            arrays = []
            for _ in range(next(layout)):
                parts, dimensions = 1 + next(layout), next(layout)
                shape = [next(layout) for _ in range(dimensions)]
                if min(shape, default=0) < 0:
                    raise ValueError
                part = numbers[at : at + parts * math.prod(shape)].copy()
                at += len(part)
                arrays.append((part.view(complex) if parts == 2 else part).reshape(shape))
            yield mark, tuple(arrays)
    except (StopIteration, ValueError, TypeError):
        raise StaleJournal from None
