"""Ansys archive files (.cdb of CDWRITE, and the .dat of Workbench): NBLOCK, EBLOCK and CMBLOCK
components.

Solid elements with repeated nodes are what Ansys makes of wedges and tetrahedra: they are read as
such.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, shown
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
NODES = BRICKS | TETRAHEDRA

# columns of a brick that are the corners and edges of what it stands for (I J K L M N O P, then the
# 12 middles)
_WEDGE6 = [0, 1, 2, 4, 5, 6]
_WEDGE15 = [0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18]
_TET4, _TET10 = [0, 1, 2, 4], [0, 1, 2, 4, 8, 9, 11, 16, 17, 18]
_NOT_READ = ("D", "F", "CE", "CP", "CEINTF", "RBE3", "SFE", "MPDATA", "/UNITS", "TBDATA")
_ORDER = {"hexahedron20": HEX20, "wedge15": WEDGE15, "tetra10": TET10}


Element = tuple[int, int, int, tuple[int, ...]]  # number, type, material, nodes


@dataclass
class _Archive:
    """An archive while it is read: `place` lines of it have been taken.

    routines {type: element routine}; skipped {command that is not read: count}"""

    path: Path
    lines: Sequence[str]
    content: Content
    place: int = 0
    routines: dict[int, int] = field(default_factory=dict)
    elements: list[Element] = field(default_factory=list)
    skipped: dict[str, int] = field(default_factory=dict)

    def next_is(self, pattern: str) -> bool:
        """Whether there is a next line that begins so."""
        return self.place < len(self.lines) and bool(re.match(pattern, self.lines[self.place]))

    def inside(self) -> bool:
        """Whether the next line belongs to a block that -1 ends."""
        return self.place < len(self.lines) and not self.next_is(r"\s*-1")

    def take(self) -> str:
        """The next line, '' behind the last."""
        self.place += 1
        return self.lines[self.place - 1] if self.place <= len(self.lines) else ""

    def wrong(self, what: str) -> InputError:
        """Of the line that was taken last."""
        return InputError(f"{self.path}, line {self.place}: {what}")

    def whole(self, text: str) -> int:
        """A number of the line that was taken last."""
        try:
            return int(text)
        except ValueError:
            raise self.wrong(f"'{shown(text)}' must be a whole number") from None

    def formatted(self, what: str) -> tuple[int, int, int]:
        """Takes a Fortran format line, such as (3i9,6e21.13e3): count and width of the integers,
        width of the reals."""
        line = self.take().strip()
        integers = re.match(r"\((\d*)i(\d+)", line, re.IGNORECASE)
        if not integers:
            raise self.wrong(f"'{shown(line)}' is not the format of {what}")
        real = re.search(r"(\d*)[ef](\d+)\.", line, re.IGNORECASE)
        return int(integers[1] or 1), int(integers[2]), (int(real[2]) if real else 0)

    def integers(self, width: int) -> list[int]:
        """Those of the next line, in fields of that width."""
        line = self.take().rstrip()
        try:
            fields = [line[i : i + width] for i in range(0, len(line), width)]
            return [int(w) for w in fields if w.strip()]
        except ValueError:
            raise self.wrong(
                f"'{shown(line.strip())}' holds something that is not a whole number: cut off or "
                "damaged"
            ) from None

    def counted(self, words: Sequence[str], column: int) -> int | None:
        """The count that a block's head, taken last, states, or None."""
        text = words[column].split("!")[0].strip() if len(words) > column else ""
        count = self.whole(text) if text else None
        if count is not None and count < 0:
            raise self.wrong(f"{words[0]} says {count} entries; a count must not be negative")
        return count

    def close(self, what: str, pattern: str = r"\s*-1") -> None:
        """Takes the line that closes a block."""
        closed, line = self.next_is(pattern), self.take()
        if not closed:
            where = (
                f"before '{shown(line.strip())}'"
                if self.place <= len(self.lines)
                else "at the end of the file"
            )
            raise self.wrong(f"{what} is cut off: it is not closed {where}")


def read(path: Path, data: bytes) -> Content:
    """Content of an archive. Components become groups; cells also form groups 'mat_N' and
    'type_N'."""
    content = Content()
    archive = _Archive(path, decode(data, content).splitlines(), content)
    _blocks(archive)
    skipped = archive.skipped
    for command in ("N", "E", "EN"):
        if skipped.get(command):
            raise InputError(
                f"{path}: {skipped[command]} nodes or elements are defined by single commands "
                f"({command}); write the archive with CDWRITE in blocked format"
            )
    _elements(archive)
    _components(content, archive.elements)
    if not any(line.strip().upper() in ("FINISH", "/EOF") for line in archive.lines):
        content.warnings.append("the archive does not end with FINISH: is it whole?")
    if skipped:
        content.unused.append(
            "commands " + ", ".join(f"{k} ({n})" for k, n in sorted(skipped.items()))
        )
    if archive.elements:
        content.unused.append(f"KEYOPTs: {FULL_INTEGRATION}")
    return content


def _blocks(f: _Archive) -> None:
    """Everything but what follows from it: nodes, components, elements, routines, skipped."""
    while f.place < len(f.lines):
        words = [w.strip() for w in f.take().split(",")]
        name = words[0].upper()
        if name == "ET" and len(words) > 2:
            f.routines[f.whole(words[1])] = f.whole(re.sub(r"^[A-Za-z]+", "", words[2]))
        elif name in _BLOCKS:
            _BLOCKS[name](f, words)
        elif (
            name in _NOT_READ
            or name in ("N", "E", "EN")
            and len(words) > 1
            and words[1][:1].isdigit()
        ):
            f.skipped[name] = f.skipped.get(name, 0) + 1


def _etblock(f: _Archive, words: Sequence[str]) -> None:
    """Number and routine of each element type; key options behind them are not read. The first two
    stand apart in Ansys' columns, and mapdl-archive puts blanks between where its format line says
    columns."""
    f.formatted("ETBLOCK")
    while f.inside():
        line = f.take()
        words = line.split()
        if len(words) < 2:
            raise f.wrong(
                f"'{shown(line.strip())}' must be the number and the routine of an element type: "
                "cut off or damaged"
            )
        f.routines[f.whole(words[0])] = f.whole(words[1])
    f.close("ETBLOCK")


def _nblock(f: _Archive, words: Sequence[str]) -> None:
    count = f.counted(words, 4)
    per, width, real = f.formatted("NBLOCK")
    start, found, xyz = per * width, [], []
    while f.inside() and f.next_is(r"\s*\d"):
        line = f.take()
        place = [line[start + k * real : start + (k + 1) * real].strip() or "0" for k in range(3)]
        try:
            found.append(int(line[:width]))
            xyz.append([float(c) for c in place])
        except ValueError:
            raise f.wrong(f"node line '{shown(line.strip())}' is cut off or damaged") from None
        if len(line.rstrip()) < start:
            raise f.wrong(f"node line '{shown(line.strip())}' is cut off")
    f.close("NBLOCK", r"\s*(N,|-1)")
    if count is not None and count != len(found):
        raise InputError(
            f"{f.path}: NBLOCK says {count} nodes and holds {len(found)}: cut off or damaged"
        )
    f.content.add_nodes(found, xyz)


def _eblock(f: _Archive, words: Sequence[str]) -> None:
    """The elements of a solid block; other blocks hold contact elements."""
    solid = len(words) > 2 and words[2].upper() == "SOLID"
    count = f.counted(words, 4)
    _, width, _ = f.formatted("EBLOCK")
    before = len(f.elements)
    while f.inside():
        values = f.integers(width)
        if not solid and not values:
            break
        f.elements.append(_solid(f, values, width) if solid else _surface(values))
    f.close("EBLOCK")
    seen = len(f.elements) - before
    if solid and count and seen != count:
        raise InputError(
            f"{f.path}: EBLOCK says {count} elements and holds {seen}: cut off or damaged"
        )


def _surface(values: Sequence[int]) -> Element:
    return (values[0], values[1], 0, tuple(values[5:])) if len(values) > 5 else (0, 0, 0, ())


def _solid(f: _Archive, values: list[int], width: int) -> Element:
    """Of the numbers of a line, and of those that go on with its nodes."""
    if len(values) < 12:
        line = f.lines[f.place - 1].strip()
        raise f.wrong(f"element line '{shown(line)}' is cut off or damaged")
    nodes, wanted = values[11:], values[8]
    while len(nodes) < wanted and f.inside():
        nodes += f.integers(width)
    if len(nodes) != wanted:
        raise f.wrong(
            f"element {values[10]} has {len(nodes)} of its {wanted} nodes: cut off or damaged"
        )
    return values[10], values[1], values[0], tuple(nodes)


def _cmblock(f: _Archive, words: Sequence[str]) -> None:
    """A component: numbers, where a negative one ends a range that the number before it began."""
    if len(words) < 3:
        raise f.wrong(f"'{shown(','.join(words))}' is cut off")
    name, nodal = words[1], words[2].upper()[:4] == "NODE"
    count = f.counted(words, 3)
    _, width, _ = f.formatted("CMBLOCK")
    values: list[int] = []
    while (count is None or len(values) < count) and f.next_is(r"[\s\d-]"):
        values += f.integers(width)
    if count is not None and len(values) != count:
        raise InputError(
            f"{f.path}: component '{shown(name)}' has {len(values)} of its {count} entries: cut "
            "off or damaged"
        )
    members: list[int] = []
    known = f.content.node_numbers() if nodal else [number for number, *_ in f.elements]
    for value in values:
        members += (
            span(members[-1] + 1, -value, 1, known, f"{f.path}, line {f.place}").tolist()
            if value < 0 and members
            else [value]
        )
    (f.content.add_group if nodal else f.content.add_cell_group)(name, members)


_BLOCKS = {"ETBLOCK": _etblock, "NBLOCK": _nblock, "EBLOCK": _eblock, "CMBLOCK": _cmblock}


def _elements(f: _Archive) -> None:
    """Sort the elements by what they are and add them as blocks of cells."""
    found: dict[Any, Any] = {}
    other: dict[Any, Any] = {}
    content, without = f.content, 0
    for number, kind, material, nodes in f.elements:
        routine = f.routines.get(kind)
        if routine in NODES:
            name, columns = _shape(f.path, number, routine, nodes)
            without += len(nodes) < NODES[routine]
            found.setdefault((name, tuple(columns)), []).append((number, nodes))
            for group in (f"mat_{material}", f"type_{kind}"):
                content.add_cell_group(group, [number])
        else:
            other[routine] = other.get(routine, 0) + 1
    for (name, columns), rows in found.items():
        _add_cells(f, name, columns, rows)
    if without:
        content.warnings.append(
            f"{without} elements of quadratic types have no middle nodes: assembled as linear ones"
        )
    for routine, count in other.items():
        content.unused.append(
            f"{count} elements of type {'not stated (no ET)' if routine is None else routine}"
        )


def _add_cells(
    f: _Archive, name: str, columns: Sequence[int], rows: Sequence[tuple[int, tuple[int, ...]]]
) -> None:
    """Cells of one type from those columns of their (number, nodes)."""
    table = np.array([n for _, n in rows])[:, list(columns)]
    if (table == 0).any():
        lost = [number for number, n in rows if 0 in n]
        raise InputError(
            f"{f.path}: elements {some(lost)} lack middle nodes; keep them (EMID) or make the "
            "elements linear"
        )
    f.content.add_cells(name, [number for number, _ in rows], table, _ORDER.get(name))


def _shape(
    path: Path, number: int, routine: int, nodes: tuple[int, ...]
) -> tuple[str, Sequence[int]]:
    """Our cell type and the columns of its nodes; repeated corners make a brick a wedge, a
    tetrahedron or a pyramid."""
    per = NODES[routine]
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


def _components(content: Content, elements: Sequence[Element]) -> None:
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
