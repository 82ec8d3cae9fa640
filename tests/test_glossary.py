"""The names that the glossary gives are names of the code."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_names_of_the_glossary_are_in_the_code():
    rows = [
        line.split("|")
        for line in (ROOT / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
        if line.count("|") == 6 and not line.startswith(("|---", "| concept"))
    ]
    assert len(rows) > 80
    code = [
        p
        for package in ("hbm", "modal", "static_contact", "tipdamp")
        for p in (ROOT / package).rglob("*.py")
    ]
    words = set(re.findall(r"\w+", " ".join(p.read_text(encoding="utf-8") for p in code))) | {
        p.stem for p in code
    }
    assert [
        name for row in rows for name in re.findall(r"`(\w+)`", row[4]) if name not in words
    ] == []
