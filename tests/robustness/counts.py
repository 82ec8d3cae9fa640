"""Counts of the long runs, kept beside the suite: the page shows the last of each."""

import json
from datetime import date
from pathlib import Path

FILE = Path(__file__).with_name("counts.json")


def read() -> dict[str, dict]:
    """{run: {what: figure or text}}"""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else {}


def keep(run: str, **figures) -> None:
    """Write the figures of a run, and print them."""
    print(run, figures)
    found = {**read(), run: {"date": str(date.today()), **figures}}
    FILE.write_text(json.dumps(dict(sorted(found.items())), indent=1) + "\n", encoding="utf-8")
