"""Files that a mesh file includes: a study that names the one depends on all of them."""

import re
from functools import lru_cache
from pathlib import Path

from tipdamp.hbm.memory import available_bytes

ENDS = (".inp", ".bdf", ".nas", ".dat")
ABAQUS = rb"\*INCLUDE[ \t]*,[^\n]*INPUT[ \t]*=([^\n,]+)"
NASTRAN = rb"INCLUDE[ \t]+([^\n]+)"
LINE = re.compile(rb"^[ \t]*(?:%s|%s)" % (ABAQUS, NASTRAN), re.IGNORECASE | re.MULTILINE)


def included_files(path: Path) -> list[Path]:
    """Files that are included by a mesh file, or by one of them, in the order of their names; those
    that do not exist, of which its reader tells, are left out."""
    found: dict[Path, None] = {}
    _collect(path, found)
    return sorted(set(found) - {path.resolve()})


def _collect(path: Path, found: dict[Path, None]) -> None:
    if path.suffix.lower() not in ENDS and not found:
        return
    found[path.resolve()] = None
    there = path.stat()
    if there.st_size > available_bytes():  # who reads it tells that
        return
    for name in _named(path, there.st_mtime_ns, there.st_size):
        file = (path.parent / name).resolve()
        if file.is_file() and file not in found:
            _collect(file, found)


@lru_cache(maxsize=1000)
def _named(path: Path, *_: int) -> tuple[str, ...]:
    """Names in the INCLUDE lines of a file, which all cases of a sweep may share."""
    lines = LINE.findall(path.read_bytes())
    names = ((abaqus or nastran).decode("utf-8", "replace") for abaqus, nastran in lines)
    return tuple(name.strip().strip("'\"") for name in names)
