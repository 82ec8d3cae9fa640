"""A curve says how far it is where somebody watches, and nowhere else."""

import os
import pty
import subprocess
import sys

import pytest

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
