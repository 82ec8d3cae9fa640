"""The committed validation pages: complete, within what is promised, and what the command makes."""

import ast
import shutil
import warnings

import pytest

from tests import validation, validation_code, validation_figures, validation_targets
from tests.benchmarks import __main__ as every_benchmark
from tests.benchmarks import hbm_truth_rig, record
from tests.validation import FRONT, PAGES, read_page, sections, worst

EACH = pytest.mark.parametrize("section", sections(), ids=lambda s: s.key)
MISSED = {("robustness_truth", f"time integration, {kind} orbits") for kind in ("stable", "unstable")} | {
    ("b", f"exact marching, H = {H}") for H in (20, 199)}
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
    """And made for this code, or a warning says so: on another every figure must be looked at anew, not this page."""
    text = FRONT.read_text(encoding="utf-8")
    codes = validation_code.on_page(text)
    assert text == validation.front(codes)
    if codes != validation_code.now():
        warnings.warn("docs/validation.md was made for other code: python -m tests.validation --front", stacklevel=1)


def test_figures_of_other_code_are_marked(tmp_path, monkeypatch):
    """On the page, in the row of the front page and in its list: other code, and a store that does not say."""
    codes = validation_code.now()
    monkeypatch.setattr(validation, "PAGES", tmp_path)
    monkeypatch.setattr(record, "RESULTS", tmp_path)
    monkeypatch.setattr(validation, "sections", lambda: [])
    with monkeypatch.context() as before:
        before.setitem(record.AT_START, "statics", "0123456789abcdef")
        record.record("growth", {"rows": []})
    marks = validation.code_marks(codes)
    said = f"other code, {record.made('growth')['date']}"
    assert marks == dict.fromkeys(validation_figures.STORES, "") | {"growth": said}
    target = validation_targets.figure("memory", "8 GiB", 7.0, 8, "growth")
    assert f"| 7 | yes | {said} |" in validation_targets.lines([target], marks)[2]
    assert f"**Measured on other code** than {codes['statics']}" in validation_figures.growth()
    monkeypatch.setattr(validation_figures, "pages", dict)
    assert f"- {said}: " in validation.front(codes)
    record.record("growth", {"rows": []})
    assert not any(validation.code_marks(codes).values()) and "other code" not in validation_figures.growth()
    (tmp_path / "growth.json").write_text('{"rows": []}')
    assert validation.code_marks(codes)["growth"] == "code not recorded"
    assert "code not recorded" in validation_figures.growth()


def test_a_page_says_on_which_code_it_was_computed(tmp_path, monkeypatch):
    section = validation.Section("one", "One", "", None, code="statics")
    rows = [("one", 1, 1.0, 1.0, 0.0, "table")]
    text = validation.page(section, rows, validation.made("statics"))
    assert f"; code {record.fingerprint('statics')}. [All" in text and "other code" not in text
    assert "**Measured on other code**" in validation.page(section, rows, validation.made("hbm"))
    monkeypatch.setattr(validation, "PAGES", tmp_path)
    monkeypatch.setattr(validation, "sections", lambda: [section])
    (tmp_path / "one.md").write_text(validation.page(section, rows, validation.made("hbm")))
    assert validation.code_marks(validation_code.now())["one"].startswith("other code")


def test_a_fingerprint_is_that_of_the_packages(tmp_path, monkeypatch):
    """A change in modal changes what the statics stand on, not the harmonic balance."""
    for package in {p for packages in record.PACKAGES.values() for p in packages}:
        (tmp_path / package).mkdir(parents=True, exist_ok=True)
        (tmp_path / package / "a.py").write_text("")
    monkeypatch.setattr(record, "ROOT", tmp_path)
    before = validation_code.now()
    (tmp_path / "modal" / "a.py").write_text("x = 1\n")
    after = validation_code.now()
    assert before["hbm"] == after["hbm"] and before["statics"] != after["statics"] and before["study"] != after["study"]
    assert validation_code.on_page(validation_code.sentence(after)) == after


def test_points_that_could_not_be_compared_are_counted(monkeypatch):
    """Beside the error of those that could: 2 of 10 within 50 Hz, the other two of the store and six not in it."""
    states = [(True, False), (True, False), (True, True), (False, False)]
    store = [("12", f"{step:+g}", 2800.0 + step, 5, {"periodic": p, "left": away, "error": 1e-3})
             for step, (p, away) in zip((-10, -5, 5, 10), states, strict=True)]
    monkeypatch.setattr(hbm_truth_rig, "points", lambda: iter(store))
    monkeypatch.setattr(validation_targets, "worst", lambda *_: (1e-3, "12 N", 5))
    row = validation_targets.rig_truth(12, 5, "within 50 Hz of it", "1.5 %", 1.5e-2)
    assert row.measured.endswith("; 2 of 10 points compared")
    assert "| yes, of those compared |" in validation_targets.lines([row])[2]
    monkeypatch.setattr(validation_targets, "worst", lambda *_: None)
    row = validation_targets.rig_truth(12, 5, "within 50 Hz of it", "1.5 %", 1.5e-2)
    assert row.measured == "not measured; 2 of 10 points compared" and row.held is None


def test_more_than_one_thread_is_refused(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with pytest.raises(SystemExit, match="one thread"):
        record.one_thread()
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    record.one_thread()


@pytest.mark.parametrize("name", [*every_benchmark.RUNS, "demo"])
def test_a_benchmark_looks_at_its_threads_first(name):
    """Read, not run: one that did not would measure for an hour."""
    tree = ast.parse((validation.ROOT / "tests" / "benchmarks" / f"{name}.py").read_text(encoding="utf-8"))
    main = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "main")
    assert ast.unparse(main.body[0]) == "one_thread()"


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


def test_a_miss_says_how_many_rows_are_within(tmp_path, monkeypatch):
    monkeypatch.setattr(validation, "PAGES", tmp_path)
    rows = [(case, 1, 1.0, 1.0, error, "table") for case, error in (("one", 1e-7), ("two", 2e-6), ("three", 1e-3))]
    (tmp_path / "bad.md").write_text(validation.page(validation.Section("bad", "Bad", "", None), rows, "today; here"))
    row = validation_targets.accuracy("tables", "1e-6", "bad", "table", 1e-6)
    assert row.held is False and row.measured == "1.0e-03 (three, H = 1); 1 of 3 rows are within"


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
    assert all(t.measured.startswith("not measured") for t in after)
    assert len(validation_targets.short(after)) == sum(t.held is None for t in after)
    monkeypatch.setattr(validation_figures, "recorded", lambda name: None)
    assert all("Not measured: run `" in page for page in validation_figures.pages().values())


def test_what_is_not_held_stands_out():
    missed = validation_targets.figure("calls", "3", 3.1, 3, "speed")
    assert missed.held is False and "| **3.1** | **NO** |" in validation_targets.lines([missed])[2]
    assert validation_targets.short([missed]) == ["- **missed**: calls: 3.1; asked: at most 3"]
    why = validation_targets.Target("rows", "1e-6", "2e-6", False, "b", "corners")
    assert validation_targets.short([why]) == ["- **missed**: rows: 2e-6; asked: 1e-6 (corners)"]
    assert validation_targets.figure("ratio", "10", 9.9, 10, "speed", least=True).held is False


def test_every_page_of_figures_has_its_store():
    assert set(validation_figures.STORES) == set(validation_figures.pages())
    assert set(validation_figures.STORES.values()) | {s.store for s in sections() if s.store} <= set(record.RUNS)
