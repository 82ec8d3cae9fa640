"""Every row of the subjects within its limit; the command makes their pages."""

import importlib

import pytest

from tests.validation.__main__ import SUBJECTS, main

LONG = {"nafems", "hertz", "random_beams"}      # their first rows are tests of their own
WITHOUT_LIMITS = {"rigid_friction"}
DOLFINX = {"rotating_beam"}


@pytest.mark.slow
@pytest.mark.parametrize("name", [s for s in SUBJECTS if s not in LONG | WITHOUT_LIMITS])
def test_rows_within_limits(name):
    if name in DOLFINX:
        pytest.importorskip("dolfinx")
    importlib.import_module(f"tests.validation.{name}").SUBJECT.check()


def test_pages_of_two_subjects(tmp_path):
    main(["--out", str(tmp_path), "supported_beams", "craig_bampton"])
    assert {path.name for path in tmp_path.iterdir()} == {"worst.md", "supported_beams.md", "craig_bampton.md"}
    worst = (tmp_path / "worst.md").read_text()
    assert "commit" in worst and "| closed form | F2, support 1, N |" in worst and "missed" not in worst


def test_row_beyond_its_limit():
    from tests.validation import Subject, row
    with pytest.raises(AssertionError, match="two"):
        Subject("", "", lambda: [row("one", 1.0, 1.0, "table"), row("two", 1.1, 1.0, "table")], {"table": 1e-6}).check()
    with pytest.raises(AssertionError, match="closed"):
        Subject("", "", lambda: [row("one", 1.0, 1.0, "table")], {"closed": 1e-6}).check()
