"""What a verb would say again: where nothing has changed it is told without loading a library.

A receipt `.stages/VERB.receipt` in the results folder holds what the verb said, under one hash of
all that decides about it: the sources of the program and the interpreter, the study, the contents
of every file that is named in it, options and environment, and the records of the stages up to this
one. The files that those records name must have the contents recorded. Whatever differs, is absent
or cannot be read: there is no receipt, and the verb looks for itself.
"""

import fcntl
import hashlib
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from tipdamp.engine.sources import packages, sources
from tipdamp.hbm.memory import available_bytes
from tipdamp.readers.includes import included_files
from tipdamp.results import ON_REQUEST, STAGES
from tipdamp.study.toml_file import read_toml

# what a study or a record raises that is damaged, or is none
UNUSABLE = (OSError, ValueError, TypeError, LookupError, RuntimeError, AttributeError)


class Asked(NamedTuple):
    """What the command line asks for: options - whatever else decides about what is said."""

    verb: str
    study: str
    out: str | None
    options: tuple = ()


class Receipt(NamedTuple):
    """said - on stdout; complaint - on stderr; code - of the exit; needs_bytes - the most memory
    that a stage was estimated to need, of which a warning would be told where it is not there."""

    said: list[str]
    complaint: str
    code: int
    needs_bytes: float


def read_from(asked: Asked) -> tuple[Path, str]:
    """Results folder, and one hash of all that the verb reads but the results."""
    study = Path(asked.study)
    content = read_toml(study)
    results = content.get("results") or Path("results") / study.stem
    folder = Path(asked.out) if asked.out else study.parent / results
    # of a law of one's own, 'dahl.py:Dahl', the file
    texts = [part for text in _texts(content) for part in (text, text.rpartition(":")[0]) if part]
    named = {study.parent / text for text in texts}
    named |= {file for path in named if os.path.isfile(path) for file in included_files(path)}
    marks = [[str(path), str(path.resolve()), _digest(path)] for path in (study, *sorted(named))]
    ours = sorted((name, value) for name, value in os.environ.items() if "TIPDAMP" in name)
    about = [sys.version, sys.prefix, os.uname().nodename, sorted(os.sched_getaffinity(0)), ours]
    places = [os.getcwd(), str(folder.resolve())]
    return folder, _hash([asked, marks, about, places, _program()])


def begin(asked: Asked | None) -> tuple[Path, str] | None:
    """As `read_from`; None where there is nothing to keep a receipt of."""
    with suppress(*UNUSABLE):
        return read_from(asked) if asked else None
    return None


def find(asked: Asked) -> Receipt | None:
    """What the verb would say again; None where it has to look for itself."""
    with suppress(*UNUSABLE):
        folder, mark = read_from(asked)
        with _held(folder):
            kept = json.loads(_fitting(folder / ".stages" / _name(asked)).read_bytes())
            state = _state(asked.verb, folder, mark)
            receipt = Receipt(*kept["receipt"])
            if kept["state"] != state or kept["check"] != _hash([state, receipt]):
                return None
            return receipt if receipt.needs_bytes <= available_bytes() else None
    return None


def keep(asked: Asked | None, before: tuple[Path, str] | None, receipt: Receipt) -> None:
    """Leave a receipt for what was said; before - from `begin` as the verb began: none is left
    where something has changed since."""
    if (
        not asked
        or before is None
        or receipt.needs_bytes > available_bytes()
        or begin(asked) != before
    ):
        return
    folder, mark = before
    with suppress(*UNUSABLE):
        name = _name(asked)
        state = _state(asked.verb, folder, mark)
        content = {"receipt": receipt, "state": state, "check": _hash([state, receipt])}
        aside = folder / ".stages" / f".tmp-{os.getpid()}-{name}"
        aside.unlink(missing_ok=True)
        aside.write_text(json.dumps(content), encoding="utf-8")
        os.replace(aside, folder / ".stages" / name)


def _name(asked: Asked) -> str:
    return f"{asked.verb}.receipt"


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """The lock of the results folder, as `Store.lock` takes it; OSError where another run has
    it."""
    with _fitting(folder / ".stages" / ".lock").open("rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield


def _state(verb: str, folder: Path, mark: str) -> str:
    """Hash of the mark and of the records of the stages up to the verb, absent ones too; ValueError
    where a file is not as it was recorded or leads out of the folder, or a run was killed."""
    before = [*STAGES, "run"].index(verb) + 1
    stages = [*list(STAGES)[:before], *ON_REQUEST]
    if [*folder.glob(".tmp-*"), *folder.glob("*/.tmp-*"), *folder.glob(".stages/*.running")]:
        raise ValueError
    texts = {}
    for stage in stages:
        record = _inside(folder, f".stages/{stage}.json")
        there = os.path.lexists(record)
        texts[stage] = _fitting(record).read_text(encoding="utf-8") if there else None
        for name, recorded in json.loads(texts[stage] or '{"outputs": {}}')["outputs"].items():
            digest = _digest(_inside(folder, name))
            if digest is None or _mark(digest) != recorded:
                raise ValueError(name)
    return _hash([mark, texts])


def _inside(folder: Path, name: str) -> Path:
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(path)
    return path


def _program() -> str:
    """Hash of the sources, pages included."""
    digest = hashlib.sha256()
    for path in sources(packages(), with_report=True):
        digest.update(f"{path}".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _texts(content: Any) -> Iterator[str]:
    """Every text of a study: those that name files are among them."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for part in content.values() if isinstance(content, dict) else content:
            yield from _texts(part)


def _digest(path: Path) -> str | None:
    """Of the contents of a file; None where it is none."""
    if not os.path.isfile(path):  # a text that can be no path is none
        return None
    with _fitting(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _fitting(path: Path) -> Path:
    """The path; ValueError where it is no file, such as a pipe, or one that does not fit into the
    memory: the verb tells it."""
    if not path.is_file() or path.stat().st_size > available_bytes():
        raise ValueError(path)
    return path


def _mark(digest: str) -> str:
    """As the record of a stage has it: `fingerprint` of the file."""
    return hashlib.sha256(bytes.fromhex(digest) + b"\0").hexdigest()[:16]


def _hash(parts: object) -> str:
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()
