"""Modules, files and links that the documents name are there."""

import ast
import inspect
import io
import re
import tokenize
from pathlib import Path

import pytest

import tipdamp

ROOT = Path(__file__).parents[1]
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PACKAGES = ("hbm", "modal", "static_contact", "tipdamp", "meshes", "tests")
FOLDERS = (*PACKAGES, "docs", "constraints")
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())


def _text(page):
    return page.read_text(encoding="utf-8")


def _names(source):
    """Names in a module, those of a lazy package that stand as text among them."""
    fields = {
        ast.Name: "id",
        ast.Attribute: "attr",
        ast.FunctionDef: "name",
        ast.ClassDef: "name",
        ast.alias: "name",
        ast.Constant: "value",
        ast.arg: "arg",
    }
    return {
        getattr(node, fields[type(node)])
        for node in ast.walk(ast.parse(source))
        if type(node) in fields
    }


def _missing(dotted):
    """Of `hbm.testing.check_law` what is not there: a module is a file, what follows a name in it
    (or its package)."""
    place, names = ROOT, dotted.split(".")
    while names and (place / names[0]).is_dir():
        place /= names.pop(0)
    if names and names[-1] in ("md", "py", "toml"):
        return []  # a file, see below
    if names and (place / f"{names[0]}.py").exists():
        place /= f"{names.pop(0)}.py"
    source = place if place.is_file() else place / "__init__.py"
    words = _names(_text(source)) if names and source.exists() else ()
    return [name for name in names if name not in words]


@each_page
def test_modules_and_their_names(page):
    for dotted in re.findall(
        rf"(?<![\w./-])(?:{'|'.join(PACKAGES)})(?:\.[A-Za-z_]\w*)+", _text(page)
    ):
        assert _missing(dotted) == [], dotted


@pytest.mark.parametrize("package", PACKAGES)
def test_modules_named_in_the_sources(package):
    named = {
        (source.relative_to(ROOT).as_posix(), dotted)
        for source in (ROOT / package).rglob("*.py")
        for dotted in re.findall(rf"`((?:{'|'.join(PACKAGES)})(?:\.[A-Za-z_]\w*)+)", _text(source))
    }
    assert [(source, dotted) for source, dotted in sorted(named) if _missing(dotted)] == []


@each_page
def test_files_and_folders(page):
    """A path from the root or beside the page; a bare name of a Python file is one of the
    repository."""
    text = _text(page)
    for path in re.findall(rf"(?<![\w./-])(?:{'|'.join(FOLDERS)})/[\w./-]*\w", text):
        assert (ROOT / path).exists() or (page.parent / path).exists(), path
    for name in re.findall(r"(?<![\w.-])([\w/]+\.py)\b", text):
        assert (ROOT / name).exists() or any(
            found for folder in FOLDERS for found in (ROOT / folder).rglob(name)
        ), name


@each_page
def test_links(page):
    for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", _text(page)):
        assert "://" in link or (page.parent / link).exists(), link


OURS = r"(?<![\w./-])(hbm|modal|static_contact|meshes)\.([A-Za-z_]\w*)"


def _outside(text):
    """Modules that a text names by their folder, and that nobody can import so."""
    return [
        f"{package}.{name}"
        for package, name in re.findall(OURS, text)
        if (ROOT / package / name).is_dir() or (ROOT / package / f"{name}.py").exists()
    ]


@pytest.mark.parametrize("page", [*PAGES, ROOT / "meshes/README.md"], ids=lambda p: p.name)
def test_pages_name_modules_as_they_are_imported(page):
    """`tipdamp.hbm.laws`: the folder hbm is no package of its own."""
    assert _outside(_text(page)) == []


@pytest.mark.parametrize("package", PACKAGES[:-1])
def test_sources_name_modules_as_they_are_imported(package):
    """In docstrings, which `help` shows, in messages and in comments."""
    found = [
        (source.relative_to(ROOT).as_posix(), name)
        for source in sorted((ROOT / package).rglob("*.py"))
        for token in tokenize.generate_tokens(io.StringIO(_text(source)).readline)
        if token.type in (tokenize.STRING, tokenize.COMMENT)
        for name in _outside(token.string)
    ]
    assert found == []


def test_help_names_modules_as_they_are_imported():
    """Of every public name and its members."""
    things = [getattr(tipdamp, name) for name in tipdamp.__all__]
    inside = [
        thing
        for owner in things
        if inspect.isclass(owner)
        for name, thing in inspect.getmembers(owner)
        if not name.startswith("_")
    ]
    assert [
        (str(thing), found)
        for thing in things + inside
        if (found := _outside(inspect.getdoc(thing) or ""))
    ] == []
    assert all(thing.__module__.startswith("tipdamp.") for thing in things)
