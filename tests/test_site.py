"""The site: docstrings become pages, every public name has one, and the whole builds without a
warning."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tipdamp

ROOT = Path(__file__).parents[1]
SITE = ROOT / "docs" / "site"


@pytest.fixture(scope="module")
def api():
    spec = importlib.util.spec_from_file_location("site_api", SITE / "api.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_public_name_has_a_page_with_its_example(api, tmp_path):
    api.write_api(tmp_path / "api")
    pages = {path.stem: path.read_text() for path in (tmp_path / "api").glob("*.md")}
    assert set(pages) == {*tipdamp.__all__, "index"}
    assert [name for name in tipdamp.__all__ if "```pycon\n>>> " not in pages[name]] == []
    assert all(f"[{name}]({name}.md)" in pages["index"] for name in tipdamp.__all__)
    assert "## plot" in pages["ForcedResponse"]


def test_docstrings_become_lists_and_code(api):
    doc = "Of a *b* c.\n\nfirst : (n,) m,\n    and more\nEnds here.\n\n>>> 1 + 1\n2"
    assert api.as_markdown(doc) == [
        *("Of a \\*b\\* c.", ""),
        *("- **first** : (n,) m,", "  and more", "", "Ends here.", ""),
        *("```pycon", ">>> 1 + 1", "2", "```", ""),
    ]


def test_every_fence_is_closed(api, tmp_path):
    api.write_api(tmp_path / "api")
    for path in (tmp_path / "api").glob("*.md"):
        assert len(re.findall(r"^```", path.read_text(), re.M)) % 2 == 0, path.stem


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    for library in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(library)
    out = tmp_path / "site"
    done = subprocess.run(
        [sys.executable, str(SITE / "build.py"), str(out)], capture_output=True, text=True
    )
    assert done.returncode == 0 and "WARNING" not in done.stderr, done.stderr[-3000:]
    pages = list(out.rglob("*.html"))
    assert {out / "index.html", out / "search.html", out / "gallery" / "duffing.html"} <= set(pages)
    missing = [
        (page.name, target)
        for page in pages
        for target in re.findall(r'(?:href|src)="([^"#?:]+)[^":]*"', page.read_text())
        if not (page.parent / target).exists()
    ]
    assert missing == []
