"""gmsh .msh files, versions 2.2 and 4.1, text or binary. A node that belongs to several groups
stays in all of them."""

import re
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

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
    sections = _sections(path, data, head.end())
    names = _names(sections, content)
    if "PartitionedEntities" in sections:
        raise InputError(f"{path}: is partitioned; write it in one piece")
    for needed in ("Nodes", "Elements"):
        if needed not in sections:
            raise InputError(
                f"{path}: is cut off or damaged: it has no ${needed} section, so it holds no "
                f"{'nodes' if needed == 'Nodes' else 'cells'}"
            )
    (_read_4 if version == "4.1" else _read_2)(_File(path, binary, sections, names, content))
    other = sorted(set(sections) - {"MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements"})
    if other:
        content.unused.append(f"sections {', '.join('$' + shown(o) for o in other)}")
    return content


def _sections(path: Path, data: bytes, start: int) -> dict[str, bytes]:
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


def _names(sections: dict[str, bytes], content: Content) -> dict[tuple[int, int], str]:
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

    def __init__(self, where: str, data: bytes, binary: bool) -> None:
        self.where, self.binary, self.place = where, binary, 0
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

    def counted(self, value: int) -> int:
        """A number of blocks that may be one."""
        if not 0 <= int(value) < 1e9:
            raise InputError(f"{self.where}: says that it holds {int(value)} blocks; damaged")
        return int(value)

    def blocks(self) -> Iterator[tuple[np.ndarray, int]]:
        """Of each block of a section of version 4.1 its head (3,) and the number of its entries,
        which are taken before the next; all that the section says must be there."""
        blocks, total, *_ = self.take(4, "<u8")
        seen = 0
        for _ in range(self.counted(blocks)):
            head, count = self.take(3), int(self.take(1, "<u8")[0])
            yield head, count
            seen += count
        self.done()
        if seen != int(total):
            raise InputError(
                f"{self.where}: holds {seen} entries and says {int(total)}: cut off or damaged"
            )

    def done(self) -> None:
        """Nothing may be left."""
        rest = len(self.data) - self.place
        if rest > (2 if self.binary else 0):
            raise InputError(f"{self.where}: holds more entries than it says: damaged")


class _File(NamedTuple):
    """A file while it is read. sections {name: bytes}; names {(dimension, tag): name} of groups."""

    path: Path
    binary: bool
    sections: dict[str, bytes]
    names: dict[tuple[int, int], str]
    content: Content

    def stream(self, section: str) -> _Stream:
        """The numbers of a section."""
        return _Stream(f"{self.path}: ${section}", self.sections[section], self.binary)

    def group_name(self, dimension: int, tag: int) -> str:
        """Of a physical group."""
        return self.names.get((dimension, tag)) or f"{_DEFAULT[dimension]}_{tag}"

    def name_groups(self, keys: Iterable[tuple[int, int]]) -> None:
        """Groups (dimension, tag), as yet without nodes."""
        for dimension, tag in dict.fromkeys(keys):
            self.content.add_group(self.group_name(dimension, tag), [], dimension)

    def nodes_of(self, kind: int) -> int:
        """Nodes of an element of this type."""
        if kind not in ELEMENTS:
            raise InputError(
                f"{self.path}: elements of gmsh type {kind} are not read; of the solid ones: "
                f"{', '.join(SOLID)}"
            )
        return ELEMENTS[kind][2]

    def add(
        self,
        kind: int,
        tags: Iterable[int],
        numbers: np.ndarray,
        nodes: np.ndarray,
        new: np.ndarray | slice = slice(None),
    ) -> None:
        """Elements of one type that belong to the same groups; solid ones that are `new` are kept
        as cells."""
        name, dimension, _ = ELEMENTS[kind]
        for tag in tags:
            group = self.group_name(dimension, tag)
            self.content.add_group(group, nodes, dimension)
            if dimension == 3:
                self.content.add_cell_group(group, numbers)
            if dimension == 2:
                self.content.add_faces(group, nodes)
        if dimension == 3:
            if name not in SOLID:
                raise InputError(
                    f"{self.path}: {len(numbers)} cells of type '{name}' (first: element "
                    f"{numbers[0]}) cannot be assembled; allowed: {', '.join(SOLID)}"
                )
            self.content.add_cells(name, numbers[new], nodes[new])


# ---- version 4.1 ---------------------------------------------------------------------------------


def _read_4(f: _File) -> None:
    physical = _entities(f.stream("Entities")) if "Entities" in f.sections else {}
    held = ((dimension, tag) for (dimension, _), tags in physical.items() for tag in tags)
    f.name_groups([*f.names, *held])
    s = f.stream("Nodes")
    for (dimension, _, parametric), count in s.blocks():
        numbers = s.take(count, "<u8")
        width = 3 + (int(dimension) if parametric else 0)
        f.content.add_nodes(numbers, s.take(count * width, "<f8").reshape(count, width)[:, :3])
    s = f.stream("Elements")
    for head, count in s.blocks():
        dimension, tag, kind = head.tolist()
        per = f.nodes_of(kind)
        rows = s.take(count * (per + 1), "<u8").astype(np.int64).reshape(count, per + 1)
        if count:
            f.add(kind, physical.get((dimension, tag), ()), rows[:, 0], rows[:, 1:])


def _entities(s: _Stream) -> dict[tuple[int, int], list[int]]:
    """{(dimension, entity): [physical tags]}."""
    counts = s.take(4, "<u8")
    found = {}
    for dimension, count in enumerate(counts):
        for _ in range(s.counted(count)):
            tag = int(s.take(1)[0])
            s.take(3 if dimension == 0 else 6, "<f8")
            found[dimension, tag] = [abs(int(t)) for t in s.take(s.take(1, "<u8")[0])]
            if dimension:
                s.take(s.take(1, "<u8")[0])
    return found


# ---- version 2.2 ---------------------------------------------------------------------------------


def _read_2(f: _File) -> None:
    f.name_groups(f.names)
    _nodes_2(f)
    s = f.stream("Elements")
    count = s.line()
    if count < 0:
        raise InputError(f"{s.where}: says that it holds {count} elements")
    parts = (_binary_elements if f.binary else _text_elements)(f, s, count)
    s.done()
    if f.names and parts and not any(physical for _, physical in parts):
        raise InputError(
            f"{f.path}: names groups, but no element belongs to one: version 2.2 saved with 'save "
            "all' loses the groups; save as 4.1, or without 'save all'"
        )
    # an element in two groups is written twice in this version, under two numbers
    first: dict[Any, Any] = {}
    for (kind, physical), part in parts.items():
        rows = np.concatenate(part)
        kept = np.array([first.setdefault(tuple(r[1:]), r[0]) for r in rows.tolist()])
        tags = [abs(physical)] if physical else []
        f.add(kind, tags, kept, rows[:, 1:], kept == rows[:, 0])


def _nodes_2(f: _File) -> None:
    s = f.stream("Nodes")
    count = s.line()
    if f.binary:
        rows = s.take(count, np.dtype([("n", "<i4"), ("x", "<f8", 3)]))
        f.content.add_nodes(rows["n"], rows["x"])
    else:
        rows = s.take(4 * count, "<f8").reshape(-1, 4)
        f.content.add_nodes(whole(rows[:, 0], s.where), rows[:, 1:])
    s.done()


def _binary_elements(f: _File, s: _Stream, count: int) -> dict[tuple[int, int], list[np.ndarray]]:
    """{(type, physical tag): [rows of number and nodes]}."""
    blocks: dict[Any, Any] = {}
    seen = 0
    while seen < count:
        kind, follow, tags = s.take(3).tolist()
        rows = s.take(follow * (1 + tags + f.nodes_of(kind))).reshape(follow, -1).astype(np.int64)
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


def _text_elements(f: _File, s: _Stream, count: int) -> dict[tuple[int, int], list[np.ndarray]]:
    """As `_binary_elements`."""
    flat = s.take(len(s.data) - s.place).tolist()
    starts: dict[Any, Any] = {}
    place = 0
    for _ in range(count):
        if place + 3 > len(flat):
            raise InputError(
                f"{s.where}: ends before all its {count} elements are there: cut off or damaged"
            )
        kind, tags = flat[place + 1], flat[place + 2]
        size = 3 + tags + f.nodes_of(kind)
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
