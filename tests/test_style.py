"""How source is written, where ruff has no rule for it: read from every file."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("hbm", "modal", "static_contact", "tipdamp", "meshes")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def nested_conditionals(text):
    """Lines of the conditional expressions that hold another one, be it in an f-string."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.IfExp)
        and any(isinstance(inner, ast.IfExp) for inner in ast.walk(node) if inner is not node)
    ]


@pytest.mark.parametrize(
    "text",
    [
        "x = 1 if a else 2 if b else 3",
        "x = 1 if a else (2 if b else 3)",
        "x = (1 if b else 2) if a else 3",
        "x = 1 if (2 if b else 3) else 4",
        "x = f\"{'>' if b else '>='} 1\" if a else ''",
        "def f():\n    return [f(1 if b else 2) for b in c] if a else []",
    ],
)
def test_a_conditional_within_another_is_found(text):
    assert nested_conditionals(text) == [text.count("\n") + 1]


def test_conditionals_side_by_side_are_none():
    text = "x = (1 if a else 2) + (3 if b else 4)\nif a:\n    x = 1 if b else 2\n"
    assert nested_conditionals(text) == []


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_statements_before_nested_conditionals(path):
    """Three outcomes are an `if` with `elif`, returns of a small function, or a table."""
    assert nested_conditionals(path.read_text(encoding="utf-8")) == []
