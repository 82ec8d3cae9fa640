"""Files that a mesh file includes: a study that names the one depends on all of them."""

import re
from pathlib import Path

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
    for abaqus, nastran in LINE.findall(path.read_bytes()):
        name = (abaqus or nastran).decode("utf-8", "replace").strip().strip("'\"")
        file = (path.parent / name).resolve()
        if file.is_file() and file not in found:
            _collect(file, found)
