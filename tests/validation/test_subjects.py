"""Every row of the subjects within its limit; the command makes their pages."""

import importlib
from dataclasses import replace

import pytest

from tests.hbm.oscillator import Y2
from tests.validation import (
    Miss,
    Subject,
    peaks_from_both_ends,
    random_oscillators,
    rig_time_integration,
    row,
)
from tests.validation.__main__ import SUBJECTS, main, missed
from tipdamp.hbm.comparison import compare_point
from tipdamp.hbm.time.settings import IntegrationSettings

OWN_TESTS = {
    "nafems",
    "hertz",
    "random_beams",
    "random_oscillators",
    "rig_time_integration",
    "contact_stiffness",
    "peaks_from_both_ends",
}  # hold these rows
RELEASE = {"three_dampers"}  # minutes: for the pages alone
DOLFINX = {"rotating_beam", "held_wedge"}


@pytest.mark.slow
@pytest.mark.parametrize("name", [s for s in SUBJECTS if s not in OWN_TESTS | RELEASE])
def test_rows_within_limits(name):
    if name in DOLFINX:
        pytest.importorskip("dolfinx")
    importlib.import_module(f"tests.validation.{name}").SUBJECT.check()


@pytest.mark.slow
def test_rig_at_its_peaks():
    found = {row.against: row.error for row in rig_time_integration.rows(levels=(20,))}
    limits = {
        kind: limit
        for kind, limit in rig_time_integration.SUBJECT.limits.items()
        if "peak, 20 N" in kind
    }
    assert found.keys() == limits.keys() and all(
        found[kind] <= limit for kind, limit in limits.items()
    ), found


@pytest.mark.slow
def test_peaks_of_some_systems():
    """Those of the page, and of 240 random systems the first twelve."""
    replace(
        peaks_from_both_ends.SUBJECT, rows=lambda: peaks_from_both_ends.rows(smooth=4, contact=8)
    ).check()


@pytest.mark.slow
@pytest.mark.parametrize("which", [4, 12, 16])
def test_random_oscillators(which):
    """Two stable orbits whose differences of 1e-5 make a multiplier above 1, and an unstable one of
    several."""
    rows = list(random_oscillators.rows([which], fewer=False))
    assert len(rows) == 4
    for found in rows:
        assert found.error <= random_oscillators.SUBJECT.limit(found.against), found


@pytest.mark.slow
def test_barely_damped_mode_repeats_at_a_finer_tolerance():
    """Oscillator 45 at 85.41 Hz: at the tolerance of 1e-7 every other period differs by 3e-3, at
    1e-9 none."""
    _, problem, force, w, guess = next(random_oscillators.points([3]))
    balance, point, y2 = random_oscillators.solve(problem, force, w, guess, 32)
    found = compare_point(balance, point, [Y2["y2"]], IntegrationSettings(max_periods=60))
    assert found.agrees and found.stable and found.difference < 1e-3


def test_pages_of_two_subjects(tmp_path):
    main(["--out", str(tmp_path), "supported_beams", "craig_bampton"])
    assert {path.name for path in tmp_path.iterdir()} == {
        "worst.md",
        "supported_beams.md",
        "craig_bampton.md",
    }
    worst = (tmp_path / "worst.md").read_text()
    assert (
        "commit" in worst
        and "| closed form | F2, support 1, N |" in worst
        and "missed" not in worst
    )


def test_row_beyond_its_limit():
    with pytest.raises(AssertionError, match="two"):
        Subject(
            "",
            "",
            lambda: [row("one", 1.0, 1.0, "table"), row("two", 1.1, 1.0, "table")],
            {"table": 1e-6},
        ).check()
    with pytest.raises(AssertionError, match="closed"):
        Subject("", "", lambda: [row("one", 1.0, 1.0, "table")], {"closed": 1e-6}).check()


@pytest.mark.parametrize(
    "error, measured, within, words",
    [
        (0.1, 0.11, 1, None),
        (0.2, 0.11, 1, "known miss of 1e-06, now 0.2"),
        (0.0, 0.11, 1, "known miss"),
        (0.1, 0.11, 2, "fewer rows"),
    ],
)
def test_known_miss(error, measured, within, words):
    """Held to what was measured, and named with the asked limit; one that is met must leave the
    list."""
    rows = [row("one", 1.0, 1.0, "table"), row("two", 1.0 + error, 1.0, "table")]
    subject = Subject(
        "S", "", lambda: rows, {"table": 1e-6}, {"table": Miss(measured, within, "its author")}
    )
    if words is None:
        subject.check()
        assert missed(subject, rows) == [
            "- **missed**: S, table: asked 1e-06, measured 1.0e-01 (two; 1 of 2 rows are "
            "within); why: its author"
        ]
        return
    with pytest.raises(AssertionError, match=words):
        subject.check()
