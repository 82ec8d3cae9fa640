"""Ansys archive files (.cdb of CDWRITE, and the .dat of Workbench): NBLOCK, EBLOCK and CMBLOCK
components.

Solid elements with repeated nodes are what Ansys makes of wedges and tetrahedra: they are read as
such.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.mesh_checks import some
from tipdamp.readers.content import (
    FULL_INTEGRATION,
    HEX20,
    TET10,
    WEDGE15,
    Content,
    Reader,
    decode,
    span,
)

BRICKS = {45: 8, 185: 8, 64: 8, 5: 8, 95: 20, 186: 20, 90: 20}  # element routine -> nodes
TETRAHEDRA = {285: 4, 72: 4, 187: 10, 92: 10, 87: 10}

# columns of a brick that are the corners and edges of what it stands for (I J K L M N O P, then the
# 12 middles)
_WEDGE6 = [0, 1, 2, 4, 5, 6]
_WEDGE15 = [0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18]
_TET4, _TET10 = [0, 1, 2, 4], [0, 1, 2, 4, 8, 9, 11, 16, 17, 18]
_NOT_READ = ("D", "F", "CE", "CP", "CEINTF", "RBE3", "SFE", "MPDATA", "/UNITS", "TBDATA")
_ORDER = {"hexahedron20": HEX20, "wedge15": WEDGE15, "tetra10": TET10}


def read(path: Path, data: bytes) -> Content:
    """Content of an archive. Components become groups; cells also form groups 'mat_N' and
    'type_N'."""
    content = Content()
    lines = decode(data, content).splitlines()
    elements, routines, skipped = _blocks(path, lines, content)
    for command in ("N", "E", "EN"):
        if skipped.get(command):
            raise InputError(
                f"{path}: {skipped[command]} nodes or elements are defined by single commands "
                f"({command}); write the archive with CDWRITE in blocked format"
            )
    _elements(path, content, elements, routines)
    _components(content, elements)
    if not any(line.strip().upper() in ("FINISH", "/EOF") for line in lines):
        content.warnings.append("the archive does not end with FINISH: is it whole?")
    if skipped:
        content.unused.append(
            "commands " + ", ".join(f"{k} ({n})" for k, n in sorted(skipped.items()))
        )
    if elements:
        content.unused.append(f"KEYOPTs: {FULL_INTEGRATION}")
    return content


def _blocks(
    path: Path, lines: Sequence[str], content: Content
) -> tuple[list[tuple], dict[int, int], dict[str, int]]:
    """(number, type, material, nodes) of the elements, {type: routine}, {command that is not read:
    count}."""
    routines: dict[int, int] = {}
    skipped: dict[str, int] = {}
    elements: list[tuple] = []
    place = 0
    while place < len(lines):
        words = [w.strip() for w in lines[place].split(",")]
        name, place = words[0].upper(), place + 1
        if name == "ET" and len(words) > 2:
            routines[_whole(words[1], path, place)] = _whole(
                re.sub(r"^[A-Za-z]+", "", words[2]), path, place
            )
        elif name == "ETBLOCK":
            place = _etblock(path, lines, place, routines)
        elif name == "NBLOCK":
            place = _nblock(path, lines, place, words, content)
        elif name == "EBLOCK":
            place = _eblock(path, lines, place, words, elements)
        elif name == "CMBLOCK":
            place = _cmblock(
                path, lines, place, words, content, [element[0] for element in elements]
            )
        elif (
            name in _NOT_READ
            or name in ("N", "E", "EN")
            and len(words) > 1
            and words[1][:1].isdigit()
        ):
            skipped[name] = skipped.get(name, 0) + 1
    return elements, routines, skipped


def _whole(text: str, path: Path, line: int) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(f"{path}, line {line}: '{shown(text)}' must be a whole number") from None


def _format(path: Path, lines: Sequence[str], place: int, what: str) -> tuple[int, int, int]:
    """Widths of the Fortran format line, such as (3i9,6e21.13e3): [(count, width)] of integers,
    then of reals."""
    line = lines[place].strip() if place < len(lines) else ""
    whole = re.match(r"\((\d*)i(\d+)", line, re.IGNORECASE)
    if not whole:
        raise InputError(f"{path}, line {place + 1}: '{shown(line)}' is not the format of {what}")
    real = re.search(r"(\d*)[ef](\d+)\.", line, re.IGNORECASE)
    return int(whole[1] or 1), int(whole[2]), (int(real[2]) if real else 0)


def _fields(line: str, width: int) -> list[str]:
    return [line[i : i + width] for i in range(0, len(line.rstrip()), width)]


def _integers(path: Path, number: int, line: str, width: int) -> list[int]:
    try:
        return [int(w) for w in _fields(line, width) if w.strip()]
    except ValueError:
        raise InputError(
            f"{path}, line {number}: '{shown(line.strip())}' holds something that is not a whole "
            "number: cut off or damaged"
        ) from None


def _counted(path: Path, number: int, words: Sequence[str], column: int) -> int | None:
    """The count that a block's head states, or None."""
    text = words[column].split("!")[0].strip() if len(words) > column else ""
    count = _whole(text, path, number) if text else None
    if count is not None and count < 0:
        raise InputError(
            f"{path}, line {number}: {words[0]} says {count} entries; a count must not be negative"
        )
    return count


def _etblock(path: Path, lines: Sequence[str], place: int, routines: dict[int, int]) -> int:
    """Number and routine of each element type; key options behind them are not read. The first two
    stand apart in Ansys' columns, and mapdl-archive puts blanks between where its format line says
    columns."""
    _format(path, lines, place, "ETBLOCK")
    place += 1
    while place < len(lines) and not lines[place].strip().startswith("-1"):
        words = lines[place].split()
        place += 1
        if len(words) < 2:
            raise InputError(
                f"{path}, line {place}: '{shown(lines[place - 1].strip())}' must be the number "
                "and the routine of an element type: cut off or damaged"
            )
        routines[_whole(words[0], path, place)] = _whole(words[1], path, place)
    _closed(path, lines, place, "ETBLOCK", r"\s*-1")
    return place + 1


def _nblock(
    path: Path, lines: Sequence[str], place: int, words: Sequence[str], content: Content
) -> int:
    count = _counted(path, place, words, 4)
    per, width, real = _format(path, lines, place, "NBLOCK")
    found, xyz, place = [], [], place + 1
    while (
        place < len(lines)
        and re.match(r"\s*\d", lines[place])
        and not lines[place].lstrip().startswith("-1")
    ):
        line = lines[place]
        start = per * width
        coordinates = [
            line[start + k * real : start + (k + 1) * real].strip() or "0" for k in range(3)
        ]
        try:
            found.append(int(line[:width]))
            xyz.append([float(c) for c in coordinates])
        except ValueError:
            raise InputError(
                f"{path}, line {place + 1}: node line '{shown(line.strip())}' is cut off or damaged"
            ) from None
        if len(line.rstrip()) < start:
            raise InputError(
                f"{path}, line {place + 1}: node line '{shown(line.strip())}' is cut off"
            )
        place += 1
    _closed(path, lines, place, "NBLOCK", r"\s*(N,|-1)")
    if count is not None and count != len(found):
        raise InputError(
            f"{path}: NBLOCK says {count} nodes and holds {len(found)}: cut off or damaged"
        )
    content.add_nodes(found, xyz)
    return place + 1


def _closed(path: Path, lines: Sequence[str], place: int, what: str, pattern: str) -> None:
    if place >= len(lines) or not re.match(pattern, lines[place]):
        where = (
            f"before '{shown(lines[place].strip())}'"
            if place < len(lines)
            else "at the end of the file"
        )
        raise InputError(f"{path}, line {place + 1}: {what} is cut off: it is not closed {where}")


def _eblock(
    path: Path, lines: Sequence[str], place: int, words: Sequence[str], elements: list
) -> int:
    """(element, type, material, nodes) of each element of a solid block; other blocks hold contact
    elements."""
    solid = len(words) > 2 and words[2].upper() == "SOLID"
    count = _counted(path, place, words, 4)
    _, width, _ = _format(path, lines, place, "EBLOCK")
    place, seen = place + 1, 0
    while place < len(lines) and not lines[place].strip().startswith("-1"):
        values = _integers(path, place + 1, lines[place], width)
        place += 1
        if not solid:
            if not values:
                break
            elements.append(
                (values[0], values[1], 0, tuple(values[5:])) if len(values) > 5 else (0, 0, 0, ())
            )
            continue
        if len(values) < 12:
            raise InputError(
                f"{path}, line {place}: element line '{shown(lines[place - 1].strip())}' is cut "
                "off or damaged"
            )
        nodes, wanted = values[11:], values[8]
        while (
            len(nodes) < wanted and place < len(lines) and not lines[place].strip().startswith("-1")
        ):
            nodes += _integers(path, place + 1, lines[place], width)
            place += 1
        if len(nodes) != wanted:
            raise InputError(
                f"{path}, line {place}: element {values[10]} has {len(nodes)} of its {wanted} "
                "nodes: cut off or damaged"
            )
        elements.append((values[10], values[1], values[0], tuple(nodes)))
        seen += 1
    _closed(path, lines, place, "EBLOCK", r"\s*-1")
    if solid and count and seen != count:
        raise InputError(
            f"{path}: EBLOCK says {count} elements and holds {seen}: cut off or damaged"
        )
    return place + 1


def _cmblock(
    path: Path,
    lines: Sequence[str],
    place: int,
    words: Sequence[str],
    content: Content,
    elements: Sequence[int],
) -> int:
    """A component: numbers, where a negative one ends a range that the number before it began."""
    if len(words) < 3:
        raise InputError(f"{path}, line {place}: '{shown(','.join(words))}' is cut off")
    name, kind = words[1], words[2].upper()[:4]
    count = _counted(path, place, words, 3)
    _, width, _ = _format(path, lines, place, "CMBLOCK")
    values: list[int] = []
    place += 1
    while place < len(lines) and (count is None or len(values) < count):
        if not re.match(r"[\s\d-]", lines[place]):
            break
        values += _integers(path, place + 1, lines[place], width)
        place += 1
    if count is not None and len(values) != count:
        raise InputError(
            f"{path}: component '{shown(name)}' has {len(values)} of its {count} entries: cut off "
            "or damaged"
        )
    members: list[int] = []
    known = content.node_numbers() if kind == "NODE" else elements
    for value in values:
        found = (
            span(members[-1] + 1, -value, 1, known, f"{path}, line {place}")
            if value < 0 and members
            else [value]
        )
        members += list(found)
    if kind == "NODE":
        content.add_group(name, members)
    else:
        content.add_cell_group(name, members)
    return place


def _elements(
    path: Path,
    content: Content,
    elements: Sequence[tuple[int, int, int, tuple[int, ...]]],
    routines: dict[int, int],
) -> None:
    """Sort the elements by what they are and add them as blocks of cells."""
    found: dict[Any, Any] = {}
    other: dict[Any, Any] = {}
    without = 0
    for number, kind, material, nodes in elements:
        routine = routines.get(kind)
        if routine in BRICKS or routine in TETRAHEDRA:
            name, columns = _shape(path, number, routine, nodes)
            without += len(nodes) < (BRICKS.get(routine) or TETRAHEDRA[routine])
            found.setdefault((name, tuple(columns)), []).append((number, nodes))
            content.cell_groups.setdefault(f"mat_{material}", []).append(np.array([number]))
            content.cell_groups.setdefault(f"type_{kind}", []).append(np.array([number]))
        else:
            other[routine] = other.get(routine, 0) + 1
    for (name, columns), rows in found.items():
        table = np.array([n for _, n in rows])[:, list(columns)]
        if (table == 0).any():
            lost = [number for number, n in rows if 0 in n]
            raise InputError(
                f"{path}: elements {some(lost)} lack middle nodes; keep them (EMID) or make the "
                "elements linear"
            )
        order = CELLS[name].columns(_ORDER[name]) if name in _ORDER else None
        content.add_cells(name, [number for number, _ in rows], table, order)
    if without:
        content.warnings.append(
            f"{without} elements of quadratic types have no middle nodes: assembled as linear ones"
        )
    for routine, count in other.items():
        content.unused.append(
            f"{count} elements of type {'not stated (no ET)' if routine is None else routine}"
        )


def _shape(
    path: Path, number: int, routine: int, nodes: tuple[int, ...]
) -> tuple[str, Sequence[int]]:
    """Our cell type and the columns of its nodes; repeated corners make a brick a wedge, a
    tetrahedron or a pyramid."""
    per = BRICKS.get(routine) or TETRAHEDRA[routine]
    corners = 8 if routine in BRICKS else 4
    if len(nodes) not in (per, corners):
        raise InputError(
            f"{path}: element {number} of type {routine} has {len(nodes)} nodes, must have {per}"
        )
    if routine in TETRAHEDRA:
        return ("tetra10" if len(nodes) == 10 else "tetra"), range(len(nodes))
    quadratic = len(nodes) == 20
    i, j, k, l, m, n, o, p = nodes[:8]  # noqa: E741
    if k == l and m == n == o == p:
        return ("tetra10", _TET10) if quadratic else ("tetra", _TET4)
    if m == n == o == p:
        raise InputError(
            f"{path}: element {number} is a pyramid (SOLID{routine} with M = N = O = P); pyramids "
            "cannot be assembled; allowed: hexahedra, wedges, tetrahedra"
        )
    if k == l and o == p:
        return ("wedge15", _WEDGE15) if quadratic else ("wedge", _WEDGE6)
    return ("hexahedron20" if quadratic else "hexahedron"), range(len(nodes))


def _components(
    content: Content, elements: Sequence[tuple[int, int, int, tuple[int, ...]]]
) -> None:
    """Element components also name the nodes of their elements; of surface elements alone, their
    faces."""
    nodes = {number: own for number, _, _, own in elements}
    solid = {int(n) for blocks in content.cells.values() for numbers, _ in blocks for n in numbers}
    for name, parts in list(content.cell_groups.items()):
        members = np.unique(np.concatenate(parts))
        found = [node for e in members.tolist() for node in nodes.get(e, ()) if node > 0]
        if name not in content.groups:
            flat = not solid & set(members.tolist())
            content.add_group(name, found, 2 if flat else 3)
            for e in members.tolist() if flat else ():
                corners = tuple(dict.fromkeys(nodes.get(e, ())[:4]))  # K = L makes a triangle
                if len(corners) > 2:
                    content.add_faces(name, [corners])


READER = Reader(
    "Ansys archive", (".cdb", ".dat"), read, claims=lambda data: b"NBLOCK" in data.upper()
)
