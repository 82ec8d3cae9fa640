"""Progress under a clock of its own: what is shown, when, and what is not."""

import io
import re

import pytest

from tipdamp.engine.progress import LINE_EVERY, display, duration


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture(autouse=True)
def wide_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")


def work(stream, ticks, **options):
    """Run `ticks`, pairs of (seconds that pass before the tick, done), and return what was
    written."""
    clock = Clock()
    with display(stream=stream, clock=clock, **options).job("respond") as tick:
        for seconds, done in ticks:
            clock.now += seconds
            tick(done, f"{2300 + clock.now:.1f} Hz")
    return stream.getvalue()


def plain(text):
    """Lines as they stand on the screen, redrawn ones too."""
    lines = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text).replace("\r", "\n").split("\n")
    return [line.rstrip() for line in lines if line.strip()]


def test_short_work_leaves_no_trace():
    assert work(io.StringIO(), [(0.5, 0.2), (0.5, 0.9), (0.9, 1.0)]) == ""
    assert work(Terminal(), [(1.9, 1.0)]) == ""


def test_plain_lines_are_rare_and_closed():
    # 20 s in all
    lines = work(io.StringIO(), [(0.125, k / 160) for k in range(1, 161)]).splitlines()
    assert len(lines) == 1 + int(18 // LINE_EVERY) + 1  # at 2 s, then one every 5 s, then the end
    assert lines[0] == "respond   10 %  2402.0 Hz  2.0 s"
    assert lines[-1] == "respond  done  2420.0 Hz  20 s"
    assert not any("\r" in line or "\x1b" in line for line in lines)


def test_terminal_shows_a_bar():
    text = work(Terminal(), [(3.0, 0.5), (1.0, 1.0)])
    assert "━" in text and "50 %  2403.0 Hz  3.0 s" in text
    assert plain(text)[-1] == "respond  done  2404.0 Hz  4.0 s"


def test_several_bars_at_once():
    stream, clock = Terminal(), Clock()
    show = display(stream=stream, clock=clock)
    with show.job("Fe = [6] N") as one, show.job("Fe = 12 N") as other:
        clock.now += 3
        one(0.25, "2800.0 Hz")
        other(0.5, "2700.0 Hz")
        show.sink.bars.refresh()
        one_bar, other_bar = plain(stream.getvalue())[-2:]
    assert one_bar.startswith("Fe = [6] N") and one_bar.endswith("25 %  2800.0 Hz  3.0 s")
    assert other_bar.startswith("Fe = 12 N") and other_bar.endswith("50 %  2700.0 Hz  3.0 s")
    done = [line for line in plain(stream.getvalue()) if "done" in line]
    assert done == ["Fe = 12 N  done  2700.0 Hz  3.0 s", "Fe = [6] N  done  2800.0 Hz  3.0 s"]


def test_bars_stay_within_a_narrow_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    drawn = [line for line in plain(work(Terminal(), [(3.0, 0.5)])) if "done" not in line]
    assert drawn and all(len(line) <= 30 for line in drawn)


def test_unknown_share_shows_figures_alone():
    assert work(io.StringIO(), [(3.0, None)]).splitlines()[0] == "respond  2403.0 Hz  3.0 s"
    assert " %" not in work(Terminal(), [(3.0, None)])


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_quiet_shows_nothing(stream):
    assert work(stream, [(30.0, 0.5)], quiet=True) == ""


def test_no_patience_announces_at_once():
    stream = io.StringIO()
    with display(stream=stream, clock=Clock()).job("factorise", patience=0):
        assert stream.getvalue() == "factorise  0.0 s\n"


def test_an_error_says_where_it_stopped():
    stream, clock = io.StringIO(), Clock()
    with (
        pytest.raises(ValueError, match="singular"),
        display(stream=stream, clock=clock).job("reduce") as tick,
    ):
        clock.now += 1.0
        tick(0.4, "blade1")
        raise ValueError("singular")
    assert stream.getvalue() == "reduce  stopped at 40 %  blade1  1.0 s\n"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (1.44, "1.4 s"),
        (25.4, "25 s"),
        (59.6, "1 min 00 s"),
        (185, "3 min 05 s"),
        (7830, "2 h 10 min"),
    ],
)
def test_duration(seconds, text):
    assert duration(seconds) == text
