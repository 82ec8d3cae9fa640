"""Every row of the catalogue is answered as its last column says."""

import re
from pathlib import Path

import pytest

from tests.robustness.suite import ROWS

CATALOGUE = Path(__file__).parents[1] / "reference" / "robustness" / "bad-inputs.md"


@pytest.mark.parametrize(
    "row",
    [pytest.param(r, id=f"{r.number} {r.fault}", marks=[pytest.mark.slow] * r.slow) for r in ROWS],
)
def test_row(row, tmp_path):
    assert list(row.check(tmp_path))


def test_every_row_of_the_catalogue_is_there():
    numbers = re.findall(r"^\| (\d+b?) \|", CATALOGUE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(numbers) > 70 and set(numbers) <= {r.number for r in ROWS}
