"""Progress of whatever takes longer than a moment: bars on a terminal, a line now and then
elsewhere.

    with display().job("respond") as tick:
        tick(0.58, "2850.1 Hz  step 34  3 it")

Several jobs may be open at once, each with a bar of its own: `tick.beside(title)` opens a further
one. A job that ends within PATIENCE leaves no trace; a longer one closes with a line that says how
long it took. Everything goes to stderr, so that results on stdout stay clean.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TextIO

PATIENCE = 2.0  # s before a job is shown
LINE_EVERY = 5.0  # s between two lines of a job where there is no terminal
BAR = 24  # characters

Tick = Callable[[float | None, str], None]


class Job:
    """A piece of work: share done (0..1, None where nobody knows) and figures to show beside it."""

    def __init__(self, title: str, clock: Callable[[], float]) -> None:
        self.title, self.clock, self.start = title, clock, clock()
        self.share: float | None = None
        self.figures = ""

    @property
    def elapsed(self) -> float:
        """s since it began."""
        return self.clock() - self.start

    @property
    def state(self) -> str:
        """Share, figures and elapsed time."""
        share = "" if self.share is None else f"{100 * self.share:3.0f} %"
        return self._line(share)

    def last_line(self, how: str) -> str:
        """What remains of it: done, stopped or interrupted."""
        if how != "done" and self.share is not None:
            how += f" at {100 * self.share:.0f} %"
        return self._line(self.title, how)

    def _line(self, *parts: str) -> str:
        return "  ".join(filter(None, (*parts, self.figures, duration(self.elapsed))))


class Lines:
    """A plain line for each job now and then; nothing without a stream."""

    def __init__(self, stream: TextIO | None) -> None:
        self.stream = stream
        self.due: dict[Job, float] = {}

    def update(self, job: Job) -> None:
        """A line, unless one was written a moment ago."""
        if job.elapsed >= self.due.get(job, 0.0):
            self.due[job] = job.elapsed + LINE_EVERY
            self.close(job, f"{job.title}  {job.state}")

    def close(self, _: Job, line: str) -> None:
        """The last line of a job, '' where it leaves no trace."""
        if line and self.stream is not None:
            self.stream.write(line + "\n")
            self.stream.flush()


class Bars:
    """Bars of rich, one below the other; what is written to stderr meanwhile stands above them."""

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskID, TextColumn
        from rich.table import Column

        title, state = (
            TextColumn(text, markup=False, table_column=Column(no_wrap=True, overflow="ellipsis"))
            for text in ("{task.fields[job].title}", "{task.fields[job].state}")
        )
        self.bars = Progress(
            title,
            BarColumn(BAR),
            state,
            console=Console(file=stream),
            transient=True,
            redirect_stdout=False,
        )
        self.tasks: dict[Job, TaskID] = {}

    def update(self, job: Job) -> None:
        """A bar, from the first time on; rich draws it anew ten times a second, with the elapsed
        time."""
        if not self.tasks:
            self.bars.start()
        done, total = job.share or 0.0, None if job.share is None else 1.0
        if job in self.tasks:
            self.bars.update(self.tasks[job], completed=done, total=total)
        else:
            self.tasks[job] = self.bars.add_task("", job=job, completed=done, total=total)  # type: ignore[arg-type]

    def close(self, job: Job, line: str) -> None:
        """The bar is removed, the last line stands above the others."""
        if job in self.tasks:
            self.bars.remove_task(self.tasks.pop(job))
            if not self.tasks:
                self.bars.stop()
        if line:
            self.bars.console.print(line, markup=False, highlight=False, soft_wrap=True)


class Display:
    """Jobs of one command, shown together."""

    def __init__(self, sink: Lines | Bars, clock: Callable[[], float]) -> None:
        self.sink, self.clock = sink, clock

    @contextmanager
    def job(self, title: str, *, patience: float = PATIENCE) -> Iterator["Ticker"]:
        """Yield `tick(done, figures)`: which share of the work is done (None: unknown), and what to
        show beside it.

        patience - s before the job is shown; 0 announces work that cannot tick, a factorisation
        say, at once"""
        job = Job(title, self.clock)
        tick = Ticker(self, job, patience)
        tick.show()
        try:
            yield tick
        except BaseException as error:
            self.sink.close(
                job,
                job.last_line("interrupted" if isinstance(error, KeyboardInterrupt) else "stopped"),
            )
            raise
        self.sink.close(
            job, job.last_line("done") if job.elapsed >= min(patience, PATIENCE) else ""
        )


class Ticker:
    """`tick(done, figures)` of a job on a display."""

    def __init__(self, display: Display, job: Job, patience: float) -> None:
        self.display, self.job, self.patience = display, job, patience

    def __call__(self, done: float | None, figures: str = "") -> None:
        self.job.share = None if done is None else min(max(done, 0.0), 1.0)
        self.job.figures = figures
        self.show()

    def show(self) -> None:
        """Show the job, once it takes longer than a moment."""
        if self.job.elapsed >= self.patience:
            self.display.sink.update(self.job)

    def beside(self, title: str) -> AbstractContextManager["Ticker"]:
        """A further job on the same display."""
        return self.display.job(title)


def display(
    *,
    quiet: bool = False,
    stream: TextIO | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Display:
    """Bars where `stream` (stderr by default) is a terminal, plain lines elsewhere, nothing where
    quiet.

    clock - returns seconds, for tests
    """
    stream = stream or sys.stderr
    if quiet:
        return Display(Lines(None), clock)
    return Display(Bars(stream) if stream.isatty() else Lines(stream), clock)


@contextmanager
def progress(title: str, *, quiet: bool = False) -> Iterator[Ticker]:
    """A single job on a display of its own."""
    with display(quiet=quiet).job(title) as tick:
        yield tick


def duration(seconds: float) -> str:
    """1.4 s, 25 s, 3 min 05 s, 2 h 10 min."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes == 0:
        return f"{rest} s"
    hours, minutes_left = divmod(minutes, 60)
    return f"{hours} h {minutes_left:02d} min" if hours else f"{minutes} min {rest:02d} s"
