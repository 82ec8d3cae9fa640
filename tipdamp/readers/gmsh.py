"""gmsh .msh files, versions 2.2 and 4.1, text or binary. A node that belongs to several groups
stays in all of them."""

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.readers.content import Content, Reader, whole

# element number -> (name, dimension, nodes)            [gmsh manual, file format MSH]
ELEMENTS = {
    1: ("line", 1, 2),
    2: ("triangle", 2, 3),
    3: ("quadrangle", 2, 4),
    4: ("tetra", 3, 4),
    5: ("hexahedron", 3, 8),
    6: ("wedge", 3, 6),
    7: ("pyramid", 3, 5),
    8: ("line3", 1, 3),
    9: ("triangle6", 2, 6),
    10: ("quadrangle9", 2, 9),
    11: ("tetra10", 3, 10),
    12: ("hexahedron27", 3, 27),
    13: ("wedge18", 3, 18),
    14: ("pyramid14", 3, 14),
    15: ("point", 0, 1),
    16: ("quadrangle8", 2, 8),
    17: ("hexahedron20", 3, 20),
    18: ("wedge15", 3, 15),
    19: ("pyramid13", 3, 13),
}
SOLID = tuple(
    name for name, dimension, _ in ELEMENTS.values() if dimension == 3 and "pyramid" not in name
)
_DEFAULT = ("point", "curve", "surface", "volume")


def read(path: Path, data: bytes) -> Content:
    """Content of a .msh file; a group is the nodes of its elements, whatever their dimension."""
    head = re.match(rb"\s*\$MeshFormat\s+([\d.]+)\s+([01])\s+(\d+)\r?\n", data)
    if not head:
        raise InputError(f"{path}: is not a gmsh file (it does not begin with $MeshFormat)")
    version, binary = head[1].decode(), head[2] == b"1"
    if version not in ("2.2", "4.1"):
        raise InputError(f"{path}: is of MSH version {version}; write it as 4.1 or 2.2")
    if binary and np.frombuffer(data[head.end() : head.end() + 4].ljust(4, b"\0"), "<i4")[0] != 1:
        raise InputError(f"{path}: is binary in another byte order; write it as text")
    content = Content()
    sections = _sections(path, data, head.end(), binary)
    names = _names(path, sections, content)
    if "PartitionedEntities" in sections:
        raise InputError(f"{path}: is partitioned; write it in one piece")
    for needed in ("Nodes", "Elements"):
        if needed not in sections:
            raise InputError(
                f"{path}: is cut off or damaged: it has no ${needed} section, so it holds no "
                f"{'nodes' if needed == 'Nodes' else 'cells'}"
            )
    (_read_4 if version == "4.1" else _read_2)(path, sections, binary, names, content)
    other = sorted(set(sections) - {"MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements"})
    if other:
        content.unused.append(f"sections {', '.join('$' + shown(o) for o in other)}")
    return content


def _sections(path: Path, data: bytes, start: int, binary: bool) -> dict[str, bytes]:
    """{name: bytes between $Name and $EndName}; every section must be closed."""
    found: dict[str, Any] = {}
    place = start
    opening = re.compile(rb"\$([A-Za-z]\w*)[ \t]*\r?\n")
    while match := opening.search(data, place):
        name = match[1].decode()
        if name.startswith("End"):
            place = match.end()
            continue
        end = _end(data, match.end(), match[1])
        if end < 0:
            raise InputError(f"{path}: is cut off: the section ${name} is not closed by $End{name}")
        found[name] = found.get(name, b"") + data[match.end() : end]
        place = end + len(name) + 4
    rest = data[place:].strip()
    if rest and not rest.startswith(b"$End"):
        raise InputError(
            f"{path}: is cut off or damaged after its last section ({len(rest)} bytes that belong "
            "to none)"
        )
    return found


def _end(data: bytes, start: int, name: bytes) -> int:
    """Where $EndName stands at the start of a line (in binary: right after the data)."""
    tag = b"$End" + name
    end = data.find(tag, start)
    while end >= 0 and data[end + len(tag) : end + len(tag) + 1] not in (b"", b"\n", b"\r", b" "):
        end = data.find(tag, end + 1)
    return end


def _names(path: Path, sections: dict[str, bytes], content: Content) -> dict[tuple[int, int], str]:
    """{(dimension, tag): name}; names may hold anything but the end of their line's pattern."""
    given = sections.get("PhysicalNames", b"")
    try:
        text = given.decode("utf-8")
    except UnicodeDecodeError as error:
        content.warnings.append(
            f"a group's name is not UTF-8 (byte {error.start} of $PhysicalNames); "
            "names were read as Latin-1"
        )
        text = given.decode("latin-1")
    pattern = re.compile(
        r'^[ \t]*(\d+)[ \t]+(-?\d+)[ \t]+"(.*?)"[ \t]*\r?\n(?=[ \t]*\d+[ \t]+-?\d+[ \t]+"|\s*\Z)',
        re.DOTALL | re.MULTILINE,
    )
    return {(int(d), abs(int(tag))): name for d, tag, name in pattern.findall(text)}


class _Stream:
    """The numbers of a section one after the other, text or binary alike."""

    def __init__(self, path: Path, section: str, data: bytes, binary: bool) -> None:
        self.where, self.binary, self.place = f"{path}: ${section}", binary, 0
        self.data: Any = data if binary else self._numbers(data)

    def _numbers(self, data: bytes) -> np.ndarray:
        with warnings.catch_warnings():
            # text that is no number ends the reading with a warning only
            warnings.simplefilter("error")
            try:
                return np.fromstring(data.decode("latin-1"), sep=" ")
            except (DeprecationWarning, ValueError):
                raise InputError(
                    f"{self.where}: holds something that is not a number: cut off or damaged"
                ) from None

    def take(self, count: int, kind: str | np.dtype = "<i4") -> np.ndarray:
        """(count,) numbers of a binary kind."""
        count = int(count)
        if count < 0:
            raise InputError(
                f"{self.where}: says that it holds {count} entries; a count must not be negative"
            )
        size = count * np.dtype(kind).itemsize if self.binary else count
        if self.place + size > len(self.data):
            raise InputError(
                f"{self.where}: ends before all its entries are there: cut off or damaged"
            )
        part = self.data[self.place : self.place + size]
        self.place += size
        if self.binary:
            return np.frombuffer(part, kind)
        return part if kind == "<f8" else whole(part, self.where)

    def line(self) -> int:
        """A count that stands in a line of its own, as text also in binary files of version 2."""
        if not self.binary:
            return int(self.take(1)[0])
        end = self.data.find(b"\n", self.place)
        text, self.place = self.data[self.place : end], end + 1
        try:
            return int(text)
        except ValueError:
            raise InputError(
                f"{self.where}: begins with '{shown(text[:20].decode('latin-1'))}', not a count"
            ) from None

    def done(self) -> None:
        rest = len(self.data) - self.place
        if rest > (2 if self.binary else 0):
            raise InputError(f"{self.where}: holds more entries than it says: damaged")


def _group_name(names: dict[tuple[int, int], str], dimension: int, tag: int) -> str:
    return names.get((dimension, tag)) or f"{_DEFAULT[dimension]}_{tag}"


def _add(
    content: Content,
    path: Path,
    kind: int,
    numbers: np.ndarray,
    nodes: np.ndarray,
    group_names: Sequence[str],
    new: np.ndarray | slice = slice(None),
) -> None:
    """Elements of one type that belong to the same groups; solid ones that are `new` are kept as
    cells."""
    name, dimension, _ = ELEMENTS[kind]
    for group in group_names:
        content.add_group(group, nodes, dimension)
        if dimension == 3:
            content.add_cell_group(group, numbers)
        if dimension == 2:
            content.add_faces(group, nodes)
    if dimension == 3:
        if name not in SOLID:
            raise InputError(
                f"{path}: {len(numbers)} cells of type '{name}' (first: element {numbers[0]}) "
                f"cannot be assembled; allowed: {', '.join(SOLID)}"
            )
        content.add_cells(name, numbers[new], nodes[new])


def _known(path: Path, kind: int) -> tuple[str, int, int]:
    if kind not in ELEMENTS:
        raise InputError(
            f"{path}: elements of gmsh type {kind} are not read; of the solid ones: "
            f"{', '.join(SOLID)}"
        )
    return ELEMENTS[kind]


# ---- version 4.1 ---------------------------------------------------------------------------------


def _read_4(
    path: Path,
    sections: dict[str, bytes],
    binary: bool,
    names: dict[tuple[int, int], str],
    content: Content,
) -> None:
    physical = (
        _entities(_Stream(path, "Entities", sections["Entities"], binary))
        if "Entities" in sections
        else {}
    )
    for dimension, tag in dict.fromkeys(
        [*names, *(k for held in physical.items() for k in _keys(*held))]
    ):
        content.add_group(_group_name(names, dimension, tag), [], dimension)
    s = _Stream(path, "Nodes", sections["Nodes"], binary)
    blocks, total, *_ = s.take(4, "<u8")
    seen = 0
    for _ in range(_count(s, blocks)):
        dimension, _, parametric = s.take(3)
        count = int(s.take(1, "<u8")[0])
        numbers = s.take(count, "<u8")
        width = 3 + (int(dimension) if parametric else 0)
        content.add_nodes(numbers, s.take(count * width, "<f8").reshape(count, width)[:, :3])
        seen += count
    _all_there(s, seen, total)
    s = _Stream(path, "Elements", sections["Elements"], binary)
    blocks, total, *_ = s.take(4, "<u8")
    seen = 0
    for _ in range(_count(s, blocks)):
        dimension, tag, kind = (int(v) for v in s.take(3))
        count = int(s.take(1, "<u8")[0])
        per = _known(path, kind)[2]
        rows = s.take(count * (per + 1), "<u8").astype(np.int64).reshape(count, per + 1)
        seen += count
        if count:
            groups = [
                _group_name(names, *k)
                for k in _keys((dimension, tag), physical.get((dimension, tag), []))
            ]
            _add(content, path, kind, rows[:, 0], rows[:, 1:], groups)
    _all_there(s, seen, total)


def _keys(entity: tuple[int, int], tags: Sequence[int]) -> list[tuple[int, int]]:
    return [(entity[0], t) for t in tags]


def _count(stream: _Stream, value: int) -> int:
    if not 0 <= int(value) < 1e9:
        raise InputError(f"{stream.where}: says that it holds {int(value)} blocks; damaged")
    return int(value)


def _all_there(stream: _Stream, seen: int, total: int) -> None:
    stream.done()
    if seen != int(total):
        raise InputError(
            f"{stream.where}: holds {seen} entries and says {int(total)}: cut off or damaged"
        )


def _entities(s: _Stream) -> dict[tuple[int, int], list[int]]:
    """{(dimension, entity): [physical tags]}."""
    counts = s.take(4, "<u8")
    found = {}
    for dimension, count in enumerate(counts):
        for _ in range(_count(s, count)):
            tag = int(s.take(1)[0])
            s.take(3 if dimension == 0 else 6, "<f8")
            found[dimension, tag] = [abs(int(t)) for t in s.take(s.take(1, "<u8")[0])]
            if dimension:
                s.take(s.take(1, "<u8")[0])
    return found


# ---- version 2.2 ---------------------------------------------------------------------------------


def _read_2(
    path: Path,
    sections: dict[str, bytes],
    binary: bool,
    names: dict[tuple[int, int], str],
    content: Content,
) -> None:
    for dimension, tag in names:
        content.add_group(_group_name(names, dimension, tag), [], dimension)
    s = _Stream(path, "Nodes", sections["Nodes"], binary)
    count = s.line()
    if binary:
        rows = s.take(count, np.dtype([("n", "<i4"), ("x", "<f8", 3)]))
        content.add_nodes(rows["n"], rows["x"])
    else:
        rows = s.take(4 * count, "<f8").reshape(-1, 4)
        content.add_nodes(whole(rows[:, 0], s.where), rows[:, 1:])
    s.done()
    s = _Stream(path, "Elements", sections["Elements"], binary)
    count = s.line()
    if count < 0:
        raise InputError(f"{s.where}: says that it holds {count} elements")
    parts = (_binary_elements if binary else _text_elements)(path, s, count)
    s.done()
    if names and parts and not any(physical for _, physical in parts):
        raise InputError(
            f"{path}: names groups, but no element belongs to one: version 2.2 saved with 'save "
            "all' loses the groups; save as 4.1, or without 'save all'"
        )
    blocks = {key: np.concatenate(part) for key, part in parts.items()}
    # an element in two groups is written twice in this version, under two numbers
    first: dict[Any, Any] = {}
    for (kind, physical), rows in blocks.items():
        groups = [_group_name(names, _known(path, kind)[1], abs(physical))] if physical else []
        kept = np.array([first.setdefault(tuple(r[1:]), r[0]) for r in rows.tolist()])
        new = kept == rows[:, 0]
        _add(content, path, kind, kept, rows[:, 1:], groups, new)


def _binary_elements(path: Path, s: _Stream, count: int) -> dict[tuple[int, int], list[np.ndarray]]:
    blocks: dict[Any, Any] = {}
    seen = 0
    while seen < count:
        kind, follow, tags = (int(v) for v in s.take(3))
        per = _known(path, kind)[2]
        rows = s.take(follow * (1 + tags + per)).reshape(follow, -1).astype(np.int64)
        if follow < 1:
            raise InputError(f"{s.where}: a block of {follow} elements: damaged")
        physical = rows[:, 1] if tags else np.zeros(follow, dtype=np.int64)
        for tag in np.unique(physical):
            part = rows[physical == tag]
            blocks.setdefault((kind, int(tag)), []).append(
                np.delete(part, np.s_[1 : 1 + tags], axis=1)
            )
        seen += follow
    return blocks


def _text_elements(path: Path, s: _Stream, count: int) -> dict[tuple[int, int], list[np.ndarray]]:
    flat = s.take(len(s.data) - s.place).tolist()
    starts: dict[Any, Any] = {}
    place = 0
    for _ in range(count):
        if place + 3 > len(flat):
            raise InputError(
                f"{s.where}: ends before all its {count} elements are there: cut off or damaged"
            )
        kind, tags = flat[place + 1], flat[place + 2]
        size = 3 + tags + _known(path, kind)[2]
        starts.setdefault((kind, tags, flat[place + 3] if tags > 0 else 0), []).append(place)
        place += size
    if place != len(flat):
        raise InputError(
            f"{s.where}: holds {len(flat)} numbers where {count} elements have {place}: cut off or "
            "damaged"
        )
    numbers = np.array(flat)
    blocks: dict[Any, Any] = {}
    for (kind, tags, physical), places in starts.items():
        first = np.array(places)
        nodes = numbers[first[:, None] + 3 + tags + np.arange(ELEMENTS[kind][2])]
        blocks.setdefault((kind, physical), []).append(np.column_stack([numbers[first], nodes]))
    return blocks


READER = Reader("gmsh", (".msh",), read)
