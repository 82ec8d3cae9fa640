"""A curve says how far it is where somebody watches, and nowhere else."""

import io
import os
import pty
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tipdamp import (
    CubicSpring,
    Jenkins1D,
    MeasuredResponse,
    Problem,
    Search,
    backbone,
    curves_beside,
    fit_damping,
    follow_fold,
    follow_peak,
)
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
    stream = io.StringIO()
    line = watched._ProgressLine(stream, 1e-6, 1e-2, " m", by_factors=True)
    for value in (1e-5, 1e-4, 1e-3):
        line(value, 0.1, 3)
    assert [said.count("#") for said in stream.getvalue().split("\r")[1:]] == [6, 12, 18]


BLADE = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
DAMPED = BLADE.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
HARD = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0)


def _beside(progress):
    curve = HARD.force(0, 0.2).follow_band(
        (0.1, 0.3), outputs={"x": 0}, harmonics=3, progress=False
    )
    return curves_beside(curve, HARD, Search(frequencies=2, starts=2), progress=progress)


def _fitted(progress):
    curve = DAMPED.force(0, 5.0).follow_band((650, 950), outputs={"x": 0}, progress=False)
    run = MeasuredResponse(curve.frequency, curve.amplitude("harmonic")[:, 0], [1.0], level=5.0)
    guess = replace(DAMPED.contact_problem, damping_ratio=0.02)
    return fit_damping(guess, [1.0], [run], progress=progress)


OTHERS = {
    "backbone": (
        lambda told: backbone(DAMPED, 1, (1e-6, 1e-3), outputs={"x": 0}, progress=told),
        " m, ",
    ),
    "follow_peak": (
        lambda told: follow_peak(
            DAMPED, [5.0], "preload", (1, 0.5), outputs={"x": 0}, band=(600, 1000), progress=told
        ),
        "0.5, ",
    ),
    "follow_fold": (
        lambda told: follow_fold(
            HARD, [1.0], "level", (1.0, 0.5), outputs={"x": 0}, band=(0.1, 0.9), progress=told
        ),
        "0.5, ",
    ),
    "fit_damping": (_fitted, " Hz, "),
    "curves_beside": (_beside, " of 6 searches, "),
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_is_made_of_many_curves_shows_one_line(name, monkeypatch):
    monkeypatch.setattr(watched, "PATIENCE", 0.0)
    monkeypatch.setattr(watched, "EVERY", 0.0)
    stream = io.StringIO()
    monkeypatch.setattr(watched, "_stream", lambda: stream)
    make, words = OTHERS[name]
    make(False)
    assert stream.getvalue() == ""
    make(None)
    said = stream.getvalue().split("\r")[1:]
    shares = [line.count("#") for line in said[:-2]]
    assert shares == sorted(shares) and shares[0] < shares[-1] >= 20
    assert words in said[-3] and said[-2].strip() == said[-1] == ""


def test_a_fit_to_one_frequency_has_a_line():
    """Of several levels measured there: there is no way along which it could be."""
    line = watched._ProgressLine(io.StringIO(), 700.0, 700.0, " Hz")
    with np.errstate(all="raise"):
        line(700.0, 1.0, 3)
    assert line.share == 0.0
