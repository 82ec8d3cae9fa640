"""The progress reporter under a clock of its own: what is shown, when, and what is not."""

import io

import pytest

from tipdamp.progress import LINE_EVERY, duration, progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def work(stream, ticks, total=None, **options):
    """Run `ticks`, pairs of (seconds that pass before the tick, done), and return what was written."""
    clock = Clock()
    with progress("respond", total, stream=stream, clock=clock, **options) as tick:
        for seconds, done in ticks:
            clock.now += seconds
            tick(done, f"{2300 + clock.now:.1f} Hz")
    return stream.getvalue()


def test_short_work_leaves_no_trace():
    assert work(io.StringIO(), [(0.5, 0.2), (0.5, 0.9), (0.9, 1.0)]) == ""
    assert work(Terminal(), [(1.9, 1.0)]) == ""


def test_plain_lines_are_rare_and_closed():
    lines = work(io.StringIO(), [(0.125, k / 160) for k in range(1, 161)]).splitlines()  # 20 s in all
    assert len(lines) == 1 + int(18 // LINE_EVERY) + 1  # at 2 s, then one every 5 s, then the end
    assert lines[0] == "respond   10 %  2402.0 Hz  2.0 s"
    assert lines[-1] == "respond  done  2420.0 Hz  20 s"
    assert not any("\r" in line or "\x1b" in line for line in lines)


def test_terminal_redraws_one_line():
    text = work(Terminal(), [(3.0, 5.0), (1.0, 10.0)], total=10.0)
    assert text.count("\n") == 1 and text.endswith("\n")
    first, second, last = text.split("\r\x1b[K")[1:]
    assert "[############------------]   50 %" in first and "2403.0 Hz  3.0 s" in first
    assert "100 %" in second
    assert last == "respond  done  2404.0 Hz  4.0 s\n"


def test_long_lines_are_cut_to_the_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    text = work(Terminal(), [(3.0, 0.5)])
    assert all(len(line.rstrip("\n")) <= 29 for line in text.split("\r\x1b[K"))


def test_unknown_fraction_shows_figures_alone():
    assert work(io.StringIO(), [(3.0, None)]).splitlines()[0] == "respond  2403.0 Hz  3.0 s"


def test_quiet_shows_nothing():
    assert work(io.StringIO(), [(30.0, 0.5)], quiet=True) == ""


def test_no_patience_announces_at_once():
    stream = io.StringIO()
    with progress("factorise", patience=0, stream=stream, clock=Clock()):
        assert stream.getvalue() == "factorise  0.0 s\n"


def test_an_error_passes_and_says_where_it_stopped():
    stream, clock = io.StringIO(), Clock()
    with pytest.raises(ValueError, match="singular"), progress("reduce", stream=stream, clock=clock) as tick:
        clock.now += 1.0
        tick(0.4, "blade1")
        raise ValueError("singular")
    assert stream.getvalue() == "reduce  stopped at 40 %  blade1  1.0 s\n"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(1.44, "1.4 s"), (25.4, "25 s"), (59.6, "1 min 00 s"), (185, "3 min 05 s"), (7830, "2 h 10 min")],
)
def test_duration(seconds, text):
    assert duration(seconds) == text
