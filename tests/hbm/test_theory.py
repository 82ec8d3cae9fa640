"""The examples of docs/theory, run as they stand; and the files that the response's pages name are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
THEORY = ROOT / "docs" / "theory"


@pytest.mark.parametrize("page,examples", [("harmonic_balance", 4), ("time_integration", 1), ("contact_stiffness", 1)])
def test_the_examples_run(page, examples):
    text = (THEORY / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) == examples
    names = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


@pytest.mark.parametrize("page", ["harmonic_balance", "time_integration"])
def test_files_and_links_of_the_page(page):
    text = (THEORY / f"{page}.md").read_text(encoding="utf-8")
    for name in re.findall(r"`([a-z_/]+\.py)`", text):
        assert any((ROOT / "hbm").rglob(name)), name
    for link in re.findall(r"\]\(([^)]+)\)", text):
        assert (THEORY / link).exists(), link
