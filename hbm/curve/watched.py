"""A line that says how far a curve, or what is made of many, is, where somebody watches: in a
terminal or a notebook."""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import parent_process
from typing import TextIO

PATIENCE = 2.0  # s before a curve is shown
EVERY = 0.2  # s between two lines
BAR = 24  # characters

Progress = Callable[[float, float, int], None]


@contextmanager
def watched(
    given: Progress | bool | None, first: float, last: float, unit: str, by_factors: bool = False
) -> Iterator[Progress | None]:
    """What is called at each point: the given function; where None is given, a line that is
    overwritten and goes at the end, after a moment's patience. by_factors : whether the steps grow
    with the value, as over an amplitude; where both ends are of one sign.

    Nothing where False is given, in a pipe, and in processes that others started.
    """
    stream = _stream() if given is None else None
    if stream is None:
        yield given if callable(given) else None
        return
    line = _ProgressLine(stream, first, last, unit, by_factors and first * last > 0)
    try:
        yield line
    finally:
        line.clear()


def _stream() -> TextIO | None:
    if parent_process() is not None:
        return None
    if "ipykernel" in sys.modules:  # a notebook, whose errors are red
        return sys.stdout
    return sys.stderr if sys.stderr is not None and sys.stderr.isatty() else None


class Finishing:
    """Called at each evaluation once the branch is there, for what is done at its points; tells
    `progress(value, 0.0, calls)` with the value at its end."""

    def __init__(self, progress: Progress | None, value: float) -> None:
        self.progress = progress
        self.value = value
        self.calls = 0

    def __call__(self) -> None:
        self.calls += 1
        if self.progress:
            self.progress(self.value, 0.0, self.calls)


class _ProgressLine:
    """`line(value, step, calls)` of a curve between two values; its share never falls, though a
    branch may fold."""

    def __init__(
        self, stream: TextIO, first: float, last: float, unit: str, by_factors: bool = False
    ) -> None:
        self.stream = stream
        self.unit = unit
        self.by_factors = by_factors
        self.first, self.last = self._place(first), self._place(last)
        self.began = time.monotonic()
        self.next = self.began + PATIENCE
        self.points = 0
        self.width = 0
        self.share = 0.0

    def __call__(self, value: float, step: float, calls: int) -> None:
        self.points += step != 0
        way = self.last - self.first or 1.0  # of one measured frequency there is none
        share = (self._place(value) - self.first) / way
        self.share = min(max(share, self.share), 1.0)
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + EVERY
        bar = ("#" * round(BAR * self.share)).ljust(BAR, ".")
        said = f"{bar} {value:.6g}{self.unit}, {self.points} points, {now - self.began:.0f} s"
        self._write(said)

    def _place(self, value: float) -> float:
        return math.log(max(abs(value), sys.float_info.min)) if self.by_factors else value

    def clear(self) -> None:
        """Nothing remains of it."""
        if self.width:
            self._write("")
            self.stream.write("\r")
            self.stream.flush()

    def _write(self, text: str) -> None:
        self.stream.write("\r" + text.ljust(self.width))
        self.stream.flush()
        self.width = len(text)
