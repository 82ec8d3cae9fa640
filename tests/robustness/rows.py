"""A row of the catalogue: a fault that is made for good, and the answer that it gets."""

import contextlib
import io
import logging
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import CHAIN, write_chain
from tipdamp.cli import main

LIBRARIES = ("numba", "matplotlib", "PIL")
LEFT_ALONE = {"study.toml", "corner.toml", "model.npz", "pairs.csv", "blades.inp", "damper.inp"}


class Row(NamedTuple):
    """number - of the catalogue, or 'x..' beside it; asked - its class of answer: E, W, S, R;
    check(folder) yields what was answered."""

    number: str
    fault: str
    asked: str
    check: Callable
    slow: bool = False


ROWS: list[Row] = []


def row(number: str, fault: str, asked: str, slow: bool = False) -> Callable:
    """Enter a generator of answers into the catalogue."""

    def enter(check):
        ROWS.append(Row(number, fault, asked, check, slow))
        return check

    return enter


def in_order() -> list[Row]:
    """By the number of the catalogue, those beside it at the end."""
    return sorted(
        ROWS,
        key=lambda r: (r.number[0] == "x", int("".join(filter(str.isdigit, r.number))), r.number),
    )


class Said(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def line(self) -> str:
        """What a table shows: the complaint, else the warnings."""
        warnings = [line for line in self.out.splitlines() if line.startswith("warning: ")]
        return " ".join((self.err.strip() or "; ".join(warnings)).split())


def tipdamp(*arguments) -> Said:
    """One call of the command line in this process, everything that it says, its log included."""
    out, err = io.StringIO(), io.StringIO()
    handler = logging.StreamHandler(err)
    handler.addFilter(lambda record: not record.name.startswith(LIBRARIES))
    logging.getLogger().addHandler(handler)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([str(a) for a in arguments])
    except SystemExit as usage:  # of argparse
        code = int(usage.code)
    finally:
        logging.getLogger().removeHandler(handler)
    return Said(code, out.getvalue(), err.getvalue())


def refused(study: Path, pattern: str, verb="inspect", code=2, more=()) -> str:
    """The line with which a study is refused: one, without traceback, and no result is left."""
    said = tipdamp(verb, study, *(() if verb == "export" else ("--quiet",)), *more)
    assert said.code == code, said
    lines = [
        line
        for line in said.err.strip().splitlines()
        if "is read from outside the study's folder" not in line
    ]
    assert len(lines) == 1 and lines[0].startswith("tipdamp: ") and "Traceback" not in said.err, (
        said.err
    )
    assert re.search(pattern, lines[0]), lines[0]
    left = [
        p for p in study.parent.rglob("*") if p.name.startswith(".tmp-") or p.name == "report.html"
    ]
    assert not left, left
    return lines[0].removeprefix("tipdamp: ").replace(str(study.parent) + "/", "")


def warned(study: Path, pattern: str, verb="inspect") -> str:
    """The warning with which a study is run: also in the result file."""
    said = tipdamp(verb, study, "--quiet")
    assert said.code == 0, said
    found = [
        line
        for line in said.out.splitlines()
        if line.startswith("warning: ") and re.search(pattern, line)
    ]
    assert found, said.out
    return found[0].replace(str(study.parent) + "/", "")


def accepted(study: Path, verb="inspect", more=()) -> Said:
    """A study that runs."""
    said = tipdamp(verb, study, "--quiet", *more)
    assert said.code == 0, said
    return said


def stages(study: Path, last: str) -> None:
    """The stages up to one of them."""
    for verb in ("inspect", "reduce", "preload", "tune", "respond"):
        accepted(study, verb)
        if verb == last:
            return


def corner(folder: Path, *changes, **meshes) -> Path:
    """The smallest study with meshes, with changes (old, new) of its text."""
    return corner_study.write(folder, change=changes, **meshes)


def chain(folder: Path, *changes, add="") -> Path:
    """The smallest study with matrices, with changes (old, new) of its text."""
    study, text = write_chain(folder), CHAIN
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    study.write_text(text + add, encoding="utf-8")
    return study


def arrays(study: Path, **changes) -> Path:
    """The study with other arrays in its matrices: {name: f(array)}, or the value itself."""
    path = study.parent / "model.npz"
    with np.load(path) as z:
        found = {name: z[name] for name in z.files}
    for name, change in changes.items():
        found[name] = change(found[name]) if callable(change) else np.asarray(change)
    np.savez(path, **found)
    return study


def entry(i, j, value):
    """A change of one entry, and of its mirror image."""

    def change(A):
        A = A.copy()
        A[i, j] = A[j, i] = value
        return A

    return change


def cells(study: Path, column: str, value) -> Path:
    """The study with another value in a column of its pairs."""
    path = study.parent / "pairs.csv"
    head, *lines = path.read_text().splitlines()
    place = head.split(",").index(column)
    changed = []
    for line in lines:
        fields = line.split(",")
        fields[place] = str(value)
        changed.append(",".join(fields))
    path.write_text("\n".join([head, *changed]) + "\n", encoding="utf-8")
    return study
