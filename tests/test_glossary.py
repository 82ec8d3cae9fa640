"""The names that the glossary gives are names of the code."""

import re
from pathlib import Path

from tipdamp.hbm.drawing.branches import CONTACTS

ROOT = Path(__file__).parents[1]


ROWS = [
    line.split("|")
    for line in (ROOT / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
    if line.count("|") == 6 and not line.startswith(("|---", "| concept"))
]
GREEK = "alpha beta gamma delta zeta eta theta lambda lam mu nu rho tau phi psi omega".split()
SYMBOL = re.compile(rf"(?i:{'|'.join(GREEK)}|[a-z])(?:_\w+|\d+)?")


def symbols(text):
    """Letters and Greek names of a formula, without index, number and the d of a change."""
    found = {re.sub(r"^d(?=[a-zA-Z]$)", "", word) for word in re.findall(r"[A-Za-z]\w*", text)}
    return {re.split(r"_|(?=\d)", one)[0] for one in found if SYMBOL.fullmatch(one)}


def test_symbols_of_the_theory_stand_in_the_glossary_alone():
    known = symbols(" ".join(t for row in ROWS for t in re.findall("`([^`]+)`", row[2])))
    pages = sorted((ROOT / "docs" / "theory").glob("*.md"))
    met = {}
    for page in pages:
        text = re.sub("```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert not re.search(r"^\| *symbol", text, re.MULTILINE), f"{page.name} has its own list"
        formulas = re.findall("^    (.*)$", text, re.MULTILINE)
        met[page.name] = symbols(" ".join(f for f in formulas if not f.startswith("python")))
    assert len(set().union(*met.values())) > 30
    assert {name: found - known for name, found in met.items() if found - known} == {}


def test_what_happens_to_a_contact_has_a_line_of_its_own():
    assert {*CONTACTS} <= {row[1].strip() for row in ROWS}


def test_names_of_the_glossary_are_in_the_code():
    assert len(ROWS) > 80
    code = [
        p
        for package in ("hbm", "modal", "static_contact", "tipdamp")
        for p in (ROOT / package).rglob("*.py")
    ]
    words = set(re.findall(r"\w+", " ".join(p.read_text(encoding="utf-8") for p in code))) | {
        p.stem for p in code
    }
    assert [
        name for row in ROWS for name in re.findall(r"`(\w+)`", row[4]) if name not in words
    ] == []
