"""The committed validation pages: complete, within what is promised, and what the command makes."""

import shutil

import pytest

from tests import validation, validation_figures, validation_targets
from tests.validation import FRONT, PAGES, read_page, sections, worst

EACH = pytest.mark.parametrize("section", sections(), ids=lambda s: s.key)
MISSED = {("robustness_truth", f"time integration, {kind} orbits") for kind in ("stable", "unstable")}
"""Promises that are not kept, and stand in bold on the front page. One that is kept again must leave this list."""


def rows_of(section):
    when, rows = read_page(section.key)
    if not rows:
        pytest.skip("the benchmark behind this section has not been run; the front page says so")
    assert when and all(len(row) == 6 for row in rows)
    return rows


@EACH
def test_worst_rows_are_within_what_is_promised(section):
    for case, H, _, _, error, against in worst(rows_of(section)):
        limit = section.limit(against)
        kept = limit is None or float(error) <= limit
        assert kept != ((section.key, against) in MISSED), f"{case}, H = {H}, {against}: {error}, promised {limit:g}"


@EACH
def test_every_promise_is_compared(section):
    """A kind of reference that is promised has rows: a misspelt one would never be looked at."""
    kinds = {row[5] for row in rows_of(section)}
    for key in section.allowed:
        assert any(kind.startswith(key) for kind in kinds), key


def test_the_front_page_is_that_of_the_pages():
    assert FRONT.read_text(encoding="utf-8") == validation.front()


def test_the_command_makes_the_page_again(tmp_path, monkeypatch):
    """The cheapest section computed anew; numbers to 1e-7, errors of rounding aside."""
    committed = read_page("samples")[1]
    shutil.copytree(PAGES, tmp_path / "validation")
    monkeypatch.setattr(validation, "PAGES", tmp_path / "validation")
    monkeypatch.setattr(validation, "FRONT", tmp_path / "validation.md")
    (tmp_path / "validation" / "samples.md").unlink()
    assert "Independence of the samples | **not measured**" in validation.front()
    validation.main(["samples"])
    again = read_page("samples")[1]
    assert len(again) == len(committed)
    for new, old in zip(again, committed, strict=True):
        assert new[1] == old[1] and float(new[2]) == pytest.approx(float(old[2]), rel=1e-7)
        assert float(new[4]) < 1e-9
    assert "Independence of the samples | **not measured**" not in (tmp_path / "validation.md").read_text()


def test_a_section_that_is_not_there_is_named():
    with pytest.raises(SystemExit, match="there are: a, b"):
        validation.main(["x"])


def test_a_row_that_misses_its_promise_stands_out(tmp_path, monkeypatch):
    bad = validation.Section("bad", "Bad", "", None, {"table": 1e-6})
    monkeypatch.setattr(validation, "PAGES", tmp_path)
    monkeypatch.setattr(validation, "sections", lambda: [bad])
    rows = [("one", 1, 1.0, 1.0, 0.0, "table"), ("two", 1, 1.1, 1.0, 0.1, "table"), ("three", 1, 1, 1, 0, "table")]
    (tmp_path / "bad.md").write_text(validation.page(bad, rows, "today; here"))
    assert "| table | two | 1 | 1.0e-01 | **1e-06** |" in validation.front()
    rows.append(("four", 1, float("nan"), 1.0, float("nan"), "table"))
    assert worst(rows)[0][0] == "four"
    assert "| two | 1 | 1.1 | 1 | 1.0e-01 | table | 1e-06 | **NO** |" in validation.page(bad, rows[:3], "today; here")


def test_without_its_run_a_promise_says_so(tmp_path, monkeypatch):
    """No promise vanishes with its figures: the same rows stand, as not measured."""
    before = [*validation_targets.hbm(), *validation_targets.statics()]
    monkeypatch.setattr(validation, "PAGES", tmp_path)
    monkeypatch.setattr(validation_targets, "recorded", lambda name: None)
    monkeypatch.setattr(validation_targets, "stored", lambda: (None, []))
    after = [*validation_targets.hbm(), *validation_targets.statics()]
    assert len(before) - len(after) in range(5)                 # the random points are one row instead of four
    assert all(t.measured.startswith(("not measured", "held by the suite")) for t in after)
    assert len(validation_targets.short(after)) == sum(t.held is None for t in after)
    monkeypatch.setattr(validation_figures, "recorded", lambda name: None)
    assert all("Not measured: run `" in page for page in validation_figures.pages().values())


def test_what_is_not_held_stands_out():
    missed = validation_targets.figure("calls", "3", 3.1, 3, "speed")
    assert missed.held is False and "| **3.1** | **NO** |" in validation_targets.lines([missed])[2]
    assert validation_targets.short([missed]) == ["- **missed**: calls: 3.1; asked: at most 3"]
    assert validation_targets.figure("ratio", "10", 9.9, 10, "speed", least=True).held is False


def test_every_benchmark_of_the_list_is_there():
    from tests.benchmarks import __main__ as every
    for name in every.RUNS:
        assert (validation.ROOT / "tests" / "benchmarks" / f"{name}.py").exists(), name
