"""The site: docstrings become pages, every public name has one, and the whole builds without a
warning."""

import ast
import importlib.util
import inspect
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tipdamp

ROOT = Path(__file__).parents[1]
SITE = ROOT / "docs" / "site"


def script(name):
    """A program of docs/site, as a module."""
    spec = importlib.util.spec_from_file_location(f"site_{name}", SITE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def api():
    return script("api")


def test_every_public_name_has_a_page_with_its_example(api, tmp_path):
    api.write_api(tmp_path / "api")
    pages = {path.stem: path.read_text() for path in (tmp_path / "api").glob("*.md")}
    assert set(pages) == {*tipdamp.__all__, "index"}
    assert [name for name in tipdamp.__all__ if "```pycon\n>>> " not in pages[name]] == []
    assert all(f"[{name}]({name}.md)" in pages["index"] for name in tipdamp.__all__)
    assert all(f"`from tipdamp import {name}`" in pages[name] for name in tipdamp.__all__)
    assert "## plot" in pages["ForcedResponse"]


def test_docstrings_become_lists_and_code(api):
    doc = "Of a *b* c.\n\nfirst : (n,) m,\n    and more\nEnds here.\n\n>>> 1 + 1\n2"
    assert api.as_markdown(doc) == [
        *("Of a \\*b\\* c.", ""),
        *("- **first** : (n,) m,", "  and more", "", "Ends here.", ""),
        *("```pycon", ">>> 1 + 1", "2", "```", ""),
    ]


def called():
    """(name, function, class or method) that a page shows how to call."""
    for name in tipdamp.__all__:
        thing = getattr(tipdamp, name)
        yield name, thing
        for member, what in vars(thing).items() if inspect.isclass(thing) else ():
            if inspect.isfunction(what) and not member.startswith("_"):
                yield member, what


def test_signatures_are_python(api):
    """As they stand: keyword-only arguments after a star, no modules, no quoted types."""
    shown = [(api.signature(name, thing), thing) for name, thing in called()]
    shown = [(text, thing) for text, thing in shown if text]
    assert len(shown) > 150
    for text, thing in shown:
        (made,) = ast.parse(f"def {text}: ...").body
        own = [p for p in inspect.signature(thing).parameters.values() if p.name != "self"]
        assert [a.arg for a in made.args.kwonlyargs] == [
            p.name for p in own if p.kind is p.KEYWORD_ONLY
        ], text
        assert not re.search(r"\b(numpy|collections|typing|hbm|balance)\.", text), text
        hints = [a.annotation for a in (*made.args.args, *made.args.kwonlyargs)]
        assert not [h for h in hints if isinstance(h, ast.Constant) and isinstance(h.value, str)]


@pytest.mark.parametrize("options", [tipdamp.CurveOptions, tipdamp.FollowOptions])
def test_options_are_linked(api, options, tmp_path):
    api.write_api(tmp_path / "api")
    keywords = options.__name__.replace("Options", "Keywords")
    takes = [
        name
        for name in tipdamp.__all__
        if inspect.isfunction(thing := getattr(tipdamp, name))
        and keywords in str(thing.__annotations__.get("options"))
    ]
    assert len(takes) > 1
    for name in takes:
        page = (tmp_path / "api" / f"{name}.md").read_text()
        assert f"[{options.__name__}]({options.__name__}.md)" in page, name


def test_every_fence_is_closed(api, tmp_path):
    api.write_api(tmp_path / "api")
    for path in (tmp_path / "api").glob("*.md"):
        assert len(re.findall(r"^```", path.read_text(), re.M)) % 2 == 0, path.stem


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("chromium"), reason="no chromium")
def test_a_page_wider_than_a_phone_is_found(tmp_path):
    head = '<!doctype html><meta name="viewport" content="width=device-width"><title>x</title>'
    (tmp_path / "narrow.html").write_text(f"{head}<p>short")
    (tmp_path / "wide.html").write_text(f'{head}<p style="width: 900px; margin: 0">long')
    look = script("look")
    ((page, width, found),) = look.too_wide(tmp_path)
    assert (page, width) == ("wide.html", 390) and 900 <= found < 950
    look.draw(tmp_path / "wide.html", tmp_path / "wide.png", 390)
    assert (tmp_path / "wide.png").read_bytes()[:4] == b"\x89PNG"


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
    if shutil.which("chromium"):
        assert script("look").too_wide(out) == []
