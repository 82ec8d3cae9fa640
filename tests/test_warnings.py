"""Warnings of the library are of one class, which a page explains."""

import ast
from pathlib import Path

import pytest

from tipdamp import CubicSpring, Doubt, Problem

ROOT = Path(__file__).parents[1]
LIBRARY = [p for name in ("hbm", "modal", "static_contact") for p in (ROOT / name).rglob("*.py")]


def test_every_warning_is_a_doubt():
    found = 0
    for path in LIBRARY:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "warnings.warn":
                assert ast.unparse(node.args[1]) == "Doubt", f"{path}:{node.lineno}"
                found += 1
    assert found > 10


def test_the_page_is_named_and_there():
    page = ROOT / Doubt.__doc__.split("\n\n")[1].split()[0]
    assert "tipdamp.Doubt" in page.read_text(encoding="utf-8")


def test_a_peak_at_the_end_of_a_band_is_a_doubt():
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
    curve = duffing.follow_band((0.05, 0.1), outputs={"x": 0}, harmonics=1)
    with pytest.warns(Doubt, match="peak of 'x'"):
        curve.peak("x")
