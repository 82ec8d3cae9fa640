"""Progress of whatever takes longer than a moment: a bar on a terminal, a line now and then elsewhere.

    with progress("respond Fe = 6 N, H = 5") as tick:
        tick(0.58, "2850.1 Hz  step 34  3 it")

Work that ends within PATIENCE leaves no trace; longer work closes with one line that says how long it took.
Everything goes to stderr, so that results on stdout stay clean.
"""

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

PATIENCE = 2.0  # s before anything is shown
REDRAW = 0.1  # s between two drawings of the bar
LINE_EVERY = 5.0  # s between two plain lines when nobody watches
BAR = 24  # characters

Tick = Callable[[float | None, str], None]


@contextmanager
def progress(
    title: str,
    total: float | None = None,
    *,
    quiet: bool = False,
    patience: float = PATIENCE,
    stream: TextIO | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[Tick]:
    """Yield `tick(done, figures)`: how far the work is and what to show beside it.

    title     what is being done
    total     what `done` counts to; None where `done` is a fraction 0..1. `done` may be None when nobody knows.
    quiet     show nothing at all
    patience  s before the first drawing; 0 announces work that cannot tick, a factorisation say, at once
    stream    where to write, stderr by default; `clock` returns seconds, for tests
    """
    display = _Display(title, total, patience, stream or sys.stderr, clock)
    if quiet:
        yield lambda done, figures="": None
        return
    if patience == 0:
        display.tick(None)
    try:
        yield display.tick
    except BaseException as error:
        display.close("interrupted" if isinstance(error, KeyboardInterrupt) else "stopped")
        raise
    display.close("done")


class _Display:
    """The last figures, and when they were last shown."""

    def __init__(self, title, total, patience, stream, clock):
        self.title, self.total, self.stream, self.clock = title, total, stream, clock
        self.terminal = stream.isatty()
        self.start = clock()
        self.due = self.start + patience  # when to draw next
        self.shown = False
        self.fraction, self.figures = None, ""

    def tick(self, done: float | None, figures: str = "") -> None:
        self.fraction = None if done is None else min(max(done / (self.total or 1.0), 0.0), 1.0)
        self.figures = figures
        now = self.clock()
        if now < self.due:
            return
        self.due = now + (REDRAW if self.terminal else LINE_EVERY)
        self._write(_line(self.title, self.fraction, figures, now - self.start, bar=self.terminal))

    def close(self, how: str) -> None:
        elapsed = self.clock() - self.start
        if not self.shown and elapsed < PATIENCE and how == "done":
            return
        if how != "done" and self.fraction is not None:
            how += f" at {100 * self.fraction:.0f} %"
        parts = [self.title, how, self.figures, duration(elapsed)]
        self._write("  ".join(part for part in parts if part), last=True)

    def _write(self, line: str, last: bool = False) -> None:
        if self.terminal:
            width = shutil.get_terminal_size().columns - 1
            line = "\r\x1b[K" + line[:width] + ("\n" if last else "")
        else:
            line += "\n"
        self.shown = True
        self.stream.write(line)
        self.stream.flush()


def _line(title: str, fraction: float | None, figures: str, elapsed: float, bar: bool) -> str:
    parts = [title]
    if fraction is not None:
        if bar:
            filled = round(BAR * fraction)
            parts.append("[" + "#" * filled + "-" * (BAR - filled) + "]")
        parts.append(f"{100 * fraction:3.0f} %")
    return "  ".join([*parts, *([figures] if figures else []), duration(elapsed)])


def duration(seconds: float) -> str:
    """1.4 s, 25 s, 3 min 05 s, 2 h 10 min."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes == 0:
        return f"{rest} s"
    hours, minutes_left = divmod(minutes, 60)
    return f"{hours} h {minutes_left:02d} min" if hours else f"{minutes} min {rest:02d} s"
