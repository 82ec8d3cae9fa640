"""Every example of the gallery runs, is short, holds what it asserts and draws a picture."""

import ast
import runpy
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "docs" / "gallery").glob("*.py"))
MOST = 40  # lines
each_example = pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)


@each_example
def test_is_short_and_says_what_it_shows(path):
    text = path.read_text(encoding="utf-8")
    said = ast.get_docstring(ast.parse(text)) or ""
    assert len(text.splitlines()) < MOST
    assert "\n\n" in said, "a title, an empty line, what it shows"
    assert "assert " in text


@pytest.mark.slow
@each_example
def test_runs_and_draws(path, tmp_path, monkeypatch):
    plt.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            runpy.run_path(str(path))
        assert any(axes.has_data() for k in plt.get_fignums() for axes in plt.figure(k).axes)
    finally:
        plt.close("all")


def test_as_many_are_there_as_the_readme_says():
    assert "has thirty short examples" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(EXAMPLES) >= 30
