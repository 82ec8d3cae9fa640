"""Warnings of the library are of one class, which a page explains."""

import ast
import re
from pathlib import Path

import pytest

from tipdamp import CubicSpring, Doubt, Problem
from tipdamp.hbm.errors import EXPLAINED

ROOT = Path(__file__).parents[1]
PACKAGES = ("hbm", "modal", "static_contact", "tipdamp")
TREES = {
    path: ast.parse(path.read_text(encoding="utf-8"))
    for package in PACKAGES
    for path in (ROOT / package).rglob("*.py")
    if "subjects" not in path.parts  # captions of the report
}
PAGE = ROOT / EXPLAINED
CALLS = [
    (f"{path.relative_to(ROOT)}:{node.lineno}", node)
    for path, tree in TREES.items()
    for node in ast.walk(tree)
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "warnings.warn"
]
SAYS = re.compile(r"(^|_)(doubts?|warnings?)$|^hold_in_words$|^_lack$")  # functions that tell them
APPENDED = {"said.append", "found.append", "doubts.append", "warnings.append"}
CHECKS = ROOT / "tipdamp" / "report" / "checks.py"  # all that it yields


def literal(node):
    """A text of the source with {..} for what is not known, None of another expression."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) else "{..}" for v in node.values)
    return literal(node.left) if isinstance(node, ast.BinOp) else None


def told(path, tree):
    """(place, text) of the sentences that functions of such names yield, return or append, and of
    those that any function appends to what it says."""
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        named = SAYS.search(function.name)
        for node in ast.walk(function):
            if isinstance(node, ast.Yield) and (named or path == CHECKS):
                found = node.value
            elif isinstance(node, ast.Return) and named:
                found = node.value
            elif isinstance(node, ast.Call) and ast.unparse(node.func) in APPENDED:
                found = node.args[0]
            else:
                continue
            for one in found.elts if isinstance(found, ast.List | ast.Tuple) else [found]:
                text = literal(one)
                if text and " " in text.strip() and not text.startswith(" "):  # no part of one
                    yield f"{path.relative_to(ROOT)}:{one.lineno}", text


def known():
    """Patterns of the page: what stands for `...` is anything."""
    text = PAGE.read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| ")]
    names = [name for row in rows for name in re.findall("`([^`]+)`", row)]
    return [re.compile(".*".join(map(re.escape, name.split("...")))) for name in names]


def test_every_warning_is_a_doubt():
    assert len(CALLS) > 10
    assert [at for at, call in CALLS if ast.unparse(call.args[1]) != "Doubt"] == []


def test_the_page_has_every_sentence():
    """Those that the source spells, in a call or in a function that tells doubts."""
    assert "tipdamp.Doubt" in PAGE.read_text(encoding="utf-8")
    patterns = known()
    raised = {at: text for at, call in CALLS if (text := literal(call.args[0]))}
    raised |= dict(one for path, tree in TREES.items() for one in told(path, tree))
    assert len(raised) > 60 and {place.split("/")[0] for place in raised} == set(PACKAGES)
    untold = {at: text for at, text in raised.items() if not any(p.match(text) for p in patterns)}
    assert untold == {}


def test_a_peak_at_the_end_of_a_band_is_a_doubt():
    """Which names the page that explains it."""
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
    curve = duffing.follow_band((0.05, 0.1), outputs={"x": 0}, harmonics=1)
    with pytest.warns(Doubt, match=rf"peak of 'x'.* \({re.escape(EXPLAINED)}\)$"):
        curve.peak("x")
