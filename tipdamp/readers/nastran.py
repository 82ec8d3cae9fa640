"""Nastran bulk data (.bdf, .nas, .fem): GRID, CHEXA, CPENTA, CTETRA, SET1, SPC1, in small, large
and free fields."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tipdamp.hbm.errors import InputError, shown
from tipdamp.readers.content import (
    FULL_INTEGRATION,
    HEX20_NASTRAN,
    TET10,
    WEDGE15_NASTRAN,
    Content,
    Reader,
    decode,
    span,
)

if TYPE_CHECKING:
    import numpy as np

# card -> {nodes: (our type, order of the nodes between corners)}
SOLID = {
    "CHEXA": {8: ("hexahedron", None), 20: ("hexahedron20", HEX20_NASTRAN)},
    "CPENTA": {6: ("wedge", None), 15: ("wedge15", WEDGE15_NASTRAN)},
    "CTETRA": {4: ("tetra", None), 10: ("tetra10", TET10)},
}
SHEETS = {"CQUAD4": 4, "CTRIA3": 3, "CQUAD8": 8, "CTRIA6": 6}
_PYRAMIDS = ("CPYRAM", "CPYRA")
_SILENT = ("ENDDATA", "BEGIN", "CEND", "")


def read(path: Path, data: bytes) -> Content:
    """Content of a bulk data file. SET1 and SPC1 become groups 'set_N' and 'spc_N', or what the
    pre-processor called them ($HMSET); the cells of a property become the group 'pid_N'."""
    content = Content()
    names: dict[int, str] = {}
    cards: dict[str, list] = {}
    for card, fields, where in _cards(Path(path), decode(data, content), names, content):
        if card not in _SILENT:
            cards.setdefault(card, []).append((fields, where))
    if "GRDSET" in cards and any(_integer(f, 1, w) for f, w in cards["GRDSET"]):
        raise InputError(
            f"{path}: GRDSET names a coordinate system; write the grid points in the basic system"
        )
    for card in _PYRAMIDS:
        if card in cards:
            raise InputError(
                f"{path}: {len(cards[card])} cells of type {card} cannot be assembled; allowed: "
                f"{', '.join(SOLID)}"
            )
    _grid(content, cards.pop("GRID", []))
    _solids(content, path, cards)
    _sheets(content, cards)
    known = content.node_numbers()
    for fields, where in cards.pop("SET1", []):
        _set1(content, fields, where, names, known)
    for fields, where in cards.pop("SPC1", []):
        _spc1(content, fields, where, known)
    if cards:
        content.unused.append(
            "cards " + ", ".join(f"{shown(k)} ({len(v)})" for k, v in sorted(cards.items()))
        )
    if content.cells:
        content.unused.append(f"PSOLID: {FULL_INTEGRATION}")
    return content


# ---- cards and fields ----------------------------------------------------------------------------


def _cards(
    path: Path, text: str, names: dict[int, str], content: Content
) -> Iterator[tuple[str, list[str], str]]:
    """(name, fields behind it, where) of every card of the bulk data, continuations joined."""
    lines = _bulk(path, text)
    pending = None
    for number, line in lines:
        if line.startswith("$"):
            _comment(line, names)
            continue
        fields = _split(line)
        where = f"{path}, line {number}"
        if fields[0] == "" or fields[0][0] in "+*":
            if pending is None:
                raise InputError(f"{where}: continues no card: '{shown(line)}'")
            pending[1].extend(fields[1:])
            continue
        if pending:
            yield pending
        name = fields[0].rstrip("*").upper()
        if name == "INCLUDE":
            yield from _include(path, line, where, names, content)
            pending = None
            continue
        pending = (name, fields[1:], f"{where}: {name}")
    if pending:
        yield pending


def _include(
    path: Path, line: str, where: str, names: dict[int, str], content: Content
) -> Iterator[tuple[str, list[str], str]]:
    target = line.split(None, 1)[1].strip().strip("'\"") if " " in line.strip() else ""
    found = content.included(path.parent, target, where)
    yield from _cards(found, decode(found.read_bytes()), names, content)


def _bulk(path: Path, text: str) -> list[tuple[int, str]]:
    """Numbered lines of the bulk data: behind BEGIN BULK where there is one, up to ENDDATA."""
    lines = [
        (i, line.rstrip()) for i, line in enumerate(text.splitlines(), start=1) if line.strip()
    ]
    begin = [
        k
        for k, (_, line) in enumerate(lines)
        if re.match(r"BEGIN(\s|,)*(BULK)?\b", line, re.IGNORECASE)
    ]
    if begin:
        lines = lines[begin[0] + 1 :]
    end = [k for k, (_, line) in enumerate(lines) if line.upper().startswith("ENDDATA")]
    if begin and not end:
        raise InputError(f"{path}: is cut off: BEGIN BULK is not followed by ENDDATA")
    if not end and not text.endswith(("\n", "\r")):
        raise InputError(
            f"{path}: is cut off: it ends in the middle of '{shown(lines[-1][1])}', without ENDDATA"
        )
    return lines[: end[0]] if end else lines


def _split(line: str) -> list[str]:
    """Fields of a line: the name, then the four or eight of data; the one for continuation marks is
    dropped."""
    line = line.split("$")[0].rstrip()
    if "," in line:
        fields = [w.strip() for w in line.split(",")]
        wide = fields[0].endswith("*") or fields[0].startswith("*")
        return (fields + [""] * 9)[: 5 if wide else 9]
    line = line.expandtabs(8)
    name = line[:8].strip()
    width, count = (16, 4) if name.endswith("*") or name.startswith("*") else (8, 8)
    return [name] + [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]


def _comment(line: str, names: dict[int, str]) -> None:
    """Names that HyperMesh writes as comments: $HMSET, set number, 1 for nodes, name in quotes."""
    found = re.match(r'\$HMSET\s+(\d+)\s+1\s+"([^"]+)"', line)
    if found:
        names[int(found[1])] = found[2]


def _integer(fields: Sequence[str], place: int, where: str, default: int | None = None) -> int:
    text = fields[place] if place < len(fields) else ""
    if not text and default is not None or not text and place == 1:
        return default or 0
    try:
        return int(text)
    except ValueError:
        raise InputError(
            f"{where}: '{shown(text)}' in field {place + 2} must be a whole number: cut off or "
            "damaged"
        ) from None


def _real(text: str, where: str) -> float:
    """Nastran's reals: 1.5, 1.5E3, 1.5D3, 1.5+3, -2.-4; blank is zero."""
    text = text.upper().replace("D", "E")
    text = re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", text) if "E" not in text else text
    try:
        return float(text or 0)
    except ValueError:
        raise InputError(f"{where}: '{shown(text)}' is not a number: cut off or damaged") from None


# ---- what the cards say --------------------------------------------------------------------------


def _grid(content: Content, cards: Sequence[tuple[list[str], str]]) -> None:
    numbers, xyz = [], []
    for fields, where in cards:
        if _integer(fields, 1, where):
            raise InputError(
                f"{where}: grid point {fields[0]} is in coordinate system {fields[1]}; write the "
                "grid points in the basic system"
            )
        numbers.append(_integer(fields, 0, where))
        xyz.append([_real(fields[k] if k < len(fields) else "", where) for k in (2, 3, 4)])
    content.add_nodes(numbers, xyz)


def _nodes(fields: Sequence[str], where: str) -> list[int]:
    """Node numbers behind element and property number; blanks at the end do not count."""
    words = list(fields[2:])
    while words and not words[-1]:
        words.pop()
    return [_integer(words, k, where, default=0) for k in range(len(words))]


def _solids(content: Content, path: Path, cards: dict[str, list[tuple]]) -> None:
    groups: dict[str, Any] = {}
    cell_nodes: dict[str, Any] = {}
    for card, sizes in SOLID.items():
        blocks: dict[int, Any] = {}
        for fields, where in cards.pop(card, []):
            nodes = _nodes(fields, where)
            if len(nodes) not in sizes or 0 in nodes:
                raise InputError(
                    f"{where} {fields[0]} has {sum(n > 0 for n in nodes)} nodes; must be "
                    f"{' or '.join(map(str, sizes))} (cut off, or middle nodes are left out)"
                )
            number, pid = _integer(fields, 0, where), _integer(fields, 1, where)
            blocks.setdefault(len(nodes), []).append((number, nodes))
            groups.setdefault(f"pid_{pid}", []).append(number)
            cell_nodes.setdefault(f"pid_{pid}", []).extend(nodes)
        for size, rows in blocks.items():
            kind, between = sizes[size]
            content.add_cells(kind, [n for n, _ in rows], [n for _, n in rows], between)
    for name, members in groups.items():
        content.add_cell_group(name, members)
        content.add_group(name, cell_nodes[name], 3)


def _sheets(content: Content, cards: dict[str, list[tuple]]) -> None:
    """Shells mark surfaces: their nodes, by property."""
    for card, count in SHEETS.items():
        found = cards.pop(card, [])
        for fields, where in found:
            nodes = [_integer(fields, 2 + k, where, default=0) for k in range(count)]
            pid = _integer(fields, 1, where)
            if f"pid_{pid}" not in content.cell_groups:
                content.add_group(f"pid_{pid}", [n for n in nodes if n], 2)
                content.add_faces(f"pid_{pid}", [nodes])
        if found:
            content.unused.append(
                f"{len(found)} elements of type {card} (their properties are kept as groups of "
                "nodes)"
            )


def _ranged(words: Sequence[str], where: str, known: "np.ndarray") -> list[int]:
    """1, 2, 5, THRU, 9 -> 1 2 5 6 7 8 9; known - numbers of the grid points."""
    out: list[int] = []
    k = 0
    words = [w for w in words if w]
    while k < len(words):
        if words[k].upper() == "THRU":
            if not out or k + 1 == len(words):
                raise InputError(f"{where}: THRU stands without its two ends: cut off or damaged")
            out += span(
                out[-1] + 1, _integer(words, k + 1, where, default=0), 1, known, where
            ).tolist()
            k += 1
        else:
            out.append(_integer(words, k, where, default=0))
        k += 1
    return out


def _set1(
    content: Content, fields: Sequence[str], where: str, names: dict[int, str], known: "np.ndarray"
) -> None:
    number = _integer(fields, 0, where)
    content.add_group(names.get(number, f"set_{number}"), _ranged(fields[1:], where, known))


def _spc1(content: Content, fields: Sequence[str], where: str, known: "np.ndarray") -> None:
    """Only points held in all three directions: what a clamp of ours does."""
    number = _integer(fields, 0, where)
    if set("123") <= set(fields[1]):
        content.add_group(f"spc_{number}", _ranged(fields[2:], where, known))
    else:
        content.unused.append(f"SPC1 {number} for directions {shown(fields[1])}")


READER = Reader("Nastran", (".bdf", ".nas", ".fem", ".dat"), read)
