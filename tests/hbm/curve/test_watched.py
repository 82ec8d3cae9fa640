"""A curve says how far it is where somebody watches, and nowhere else."""

import io
import os
import pty
import subprocess
import sys

import numpy as np
import pytest

from tipdamp import CubicSpring, Problem
from tipdamp.hbm.curve import watched

SCRIPT = """
from tipdamp import CubicSpring, Problem
from tipdamp.hbm.curve import watched
watched.PATIENCE = 0.0
duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
duffing.follow_band((0.08, 0.35), outputs={"x": 0}, harmonics=3, progress=PROGRESS)
"""


def _said(progress, terminal):
    command = [sys.executable, "-c", SCRIPT.replace("PROGRESS", progress)]
    if not terminal:
        done = subprocess.run(command, capture_output=True, check=True)
        return (done.stdout + done.stderr).decode()
    ours, theirs = pty.openpty()
    subprocess.run(command, stderr=theirs, check=True)
    os.set_blocking(ours, False)
    try:
        return os.read(ours, 100_000).decode()
    except BlockingIOError:  # nothing was written
        return ""
    finally:
        os.close(ours)
        os.close(theirs)


@pytest.mark.slow
def test_a_terminal_shows_a_line_that_goes():
    said = _said("None", True)
    assert " Hz, " in said and " points, " in said
    assert (
        "\n" not in said and said.rpartition("\r")[2] == "" and said.split("\r")[-2].strip() == ""
    )


@pytest.mark.slow
@pytest.mark.parametrize("progress, terminal", [("None", False), ("False", True)])
def test_pipes_and_those_who_ask_for_it_see_nothing(progress, terminal):
    assert _said(progress, terminal) == ""


def test_what_is_done_at_the_points_of_a_curve_is_told():
    """Peaks, points between and multipliers take longer than the branch: each evaluation is told,
    at the end of the band and with step 0."""
    told = []
    duffing = Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.02)
    curve = duffing.follow_band(
        (0.14, 0.24),
        outputs={"x": 0},
        harmonics=3,
        stability="all",
        progress=lambda *figures: told.append(figures),
    )
    last = max(i for i, (_, step, _) in enumerate(told) if step)
    after = np.array(told[last + 1 :])
    assert np.all(after[:, :2] == [0.24, 0.0]) and len(after) > len(curve.parameter)
    assert np.all(np.diff(after[after[:, 2] > 0, 2]) >= 0)


def test_the_share_of_a_line_does_not_fall(monkeypatch):
    """A branch that folds goes back, what is done of it does not."""
    monkeypatch.setattr(watched, "PATIENCE", 0.0)
    monkeypatch.setattr(watched, "EVERY", 0.0)
    stream = io.StringIO()
    line = watched._ProgressLine(stream, 1.0, 2.0, " Hz")
    for value in (1.5, 1.75, 1.25, 1.75):
        line(value, 0.1, 3)
    assert [said.count("#") for said in stream.getvalue().split("\r")[1:]] == [12, 18, 18, 18]
