"""Curves side by side that do not fit into memory are refused before the first, with what would
fit."""

import re

import pytest

from tests.conftest import changed
from tipdamp.checks import room
from tipdamp.cli import main
from tipdamp.engine.curves import Curves
from tipdamp.hbm.memory import curve_bytes


class Begun(RuntimeError):
    """A curve is begun."""


@pytest.fixture
def respond(matrices_study, monkeypatch, capsys):
    """respond(bytes available, levels, *arguments): the exit code and what is said; 3 where a curve
    is begun."""

    def begin(*_):
        raise Begun("a curve is begun")

    monkeypatch.setattr(room, "SMALL", 0.0)
    monkeypatch.setattr(Curves, "make", begin)
    text = matrices_study.read_text()

    def run(there, levels, *arguments):
        matrices_study.write_text(
            changed(
                text, ("levels = [5]", f"levels = {levels}"), ("harmonics = [1]", "harmonics = [3]")
            )
        )
        monkeypatch.setattr(room, "available_bytes", lambda: there)
        for stage in ("inspect", "reduce", "preload", "tune"):
            assert main([stage, str(matrices_study), "--quiet"]) == 0
        capsys.readouterr()
        code = main(["respond", str(matrices_study), "--quiet", *arguments])
        return code, capsys.readouterr().err

    return run


def test_too_many_side_by_side(respond):
    """One fits where two do not; where not even one does, fewer harmonics."""
    strong = [500, 600]
    code, said = respond(1.0, strong, "--jobs", "1")
    assert code == 2 and (
        found := re.search(r"(\d+) of the (\d+) kept pairs may slip or lift off at once at 6", said)
    )
    assert "a curve may need" in said and ": lower [respond] levels, or keep fewer pairs" in said
    assert found[1] == found[2]
    one, least = (curve_bytes(int(found[1]), int(found[1]), 3, H) for H in (3, 1))
    code, said = respond(1.5 * one, strong, "--jobs", "2")
    assert (
        code == 2
        and "2 curves side by side may need" in said
        and "run with --jobs 1, or set [respond]" in said
    )
    assert respond(1.5 * one, strong, "--jobs", "1")[0] == 3
    code, said = respond(1.01 * least, strong, "--jobs", "1")
    assert code == 2 and "set [respond] harmonics to 1 or less, or lower [respond] levels" in said


def test_what_does_not_slip_needs_no_room(respond):
    """Where all pairs at once would not fit, those are counted that a level moves."""
    there = 1.2 * curve_bytes(0, 4, 3, 3)
    assert respond(there, [1e-6], "--jobs", "1")[0] == 3
    assert respond(there, [600], "--jobs", "1")[0] == 2
