"""Warnings of the library are of one class, which a page explains."""

import ast
import re
from pathlib import Path

import pytest

from tipdamp import CubicSpring, Doubt, Problem

ROOT = Path(__file__).parents[1]
LIBRARY = [p for name in ("hbm", "modal", "static_contact") for p in (ROOT / name).rglob("*.py")]


PAGE = ROOT / Doubt.__doc__.split("\n\n")[1].split()[0]
CALLS = [
    (f"{path.relative_to(ROOT)}:{node.lineno}", node)
    for path in LIBRARY
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "warnings.warn"
]


def test_every_warning_is_a_doubt():
    assert len(CALLS) > 10
    assert [at for at, call in CALLS if ast.unparse(call.args[1]) != "Doubt"] == []


def test_the_page_is_named_and_has_the_beginning_of_every_message():
    """Of those that begin with a text; others come with the sentence that a check has made."""
    text = PAGE.read_text(encoding="utf-8")
    assert "tipdamp.Doubt" in text
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    known = [name.split("...")[0] for row in rows for name in re.findall("`([^`]+)`", row)]
    messages = {
        at: call.args[0].values[0].value
        for at, call in CALLS
        if isinstance(call.args[0], ast.JoinedStr)
        and isinstance(call.args[0].values[0], ast.Constant)
    }
    assert len(messages) > 10
    untold = {
        at for at, said in messages.items() if not any(map(said.startswith, filter(None, known)))
    }
    assert untold == set()


def test_a_peak_at_the_end_of_a_band_is_a_doubt():
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
    curve = duffing.follow_band((0.05, 0.1), outputs={"x": 0}, harmonics=1)
    with pytest.warns(Doubt, match="peak of 'x'"):
        curve.peak("x")
