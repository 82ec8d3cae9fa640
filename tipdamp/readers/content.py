"""What a mesh file says, in the file's own numbers, and how it becomes a Mesh. Each format's reader
fills a Content."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, shown
from tipdamp.hbm.io.array_files import check_size
from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.faces import face_keys
from tipdamp.modal.mesh import GivenMaterial, Mesh
from tipdamp.modal.mesh_checks import checked, some

# orders in which formats list the nodes between corners (corner numbers from 0)
_HEX_BOTTOM = [(0, 1), (1, 2), (2, 3), (3, 0)]
_HEX_TOP = [(4, 5), (5, 6), (6, 7), (7, 4)]
_HEX_SIDES = [(0, 4), (1, 5), (2, 6), (3, 7)]
_WEDGE_BOTTOM = [(0, 1), (1, 2), (2, 0)]
_WEDGE_TOP = [(3, 4), (4, 5), (5, 3)]
_WEDGE_SIDES = [(0, 3), (1, 4), (2, 5)]
TET10 = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]  # Abaqus, Ansys and Nastran
# Abaqus and Ansys
HEX20, WEDGE15 = _HEX_BOTTOM + _HEX_TOP + _HEX_SIDES, _WEDGE_BOTTOM + _WEDGE_TOP + _WEDGE_SIDES
HEX20_NASTRAN = _HEX_BOTTOM + _HEX_SIDES + _HEX_TOP
WEDGE15_NASTRAN = _WEDGE_BOTTOM + _WEDGE_SIDES + _WEDGE_TOP

MOST_INCLUDES = 500
SHORT_SPAN = 100_000  # numbers of a set that any line may make

FULL_INTEGRATION = (
    "all cells are assembled with full integration and no added modes: elements that the file "
    "asks to be reduced, incompatible or hybrid come out a little stiffer here"
)


@dataclass
class Content:
    """Filled piece by piece by a reader.

    nodes : [(numbers (n,), coordinates (n, 3))]; cells : {type: [(element numbers (c,), node
    numbers (c, k))]} with nodes in gmsh's order; groups : {name: [node numbers]}; cell_groups :
    {name: [element numbers]};
    faces : {name: [corners of faces (f, 4)]}, see Mesh.face_groups; dimension : {group: 0..3};
    materials : {group of cells: its material};
    unused : what was not read; warnings : what looks wrong; includes : bytes of each file that was
    included
    """

    nodes: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    cells: dict[str, list[tuple[np.ndarray, np.ndarray]]] = field(default_factory=dict)
    groups: dict[str, list[np.ndarray]] = field(default_factory=dict)
    cell_groups: dict[str, list[np.ndarray]] = field(default_factory=dict)
    faces: dict[str, list[np.ndarray]] = field(default_factory=dict)
    dimension: dict[str, int] = field(default_factory=dict)
    materials: dict[str, GivenMaterial] = field(default_factory=dict)
    unused: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    includes: list[int] = field(default_factory=list)

    def add_nodes(self, numbers: ArrayLike, coordinates: ArrayLike) -> None:
        """numbers (n,), coordinates (n, 3) in the unit of the file."""
        self.nodes.append(
            (
                np.asarray(numbers, dtype=np.int64),
                np.asarray(coordinates, dtype=float).reshape(-1, 3),
            )
        )

    def included(self, folder: Path, name: str, where: str) -> Path:
        """The file beside the mesh file that an INCLUDE names; of files that name one another there
        may be thousands."""
        path = (folder / name).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise InputError(f"{where}: {shown(name)} lies outside the folder of the mesh file")
        if not name or not path.is_file():
            raise InputError(f"{where}: file '{shown(name)}' not found beside the mesh file")
        self.includes.append(path.stat().st_size)
        if len(self.includes) > MOST_INCLUDES:
            raise InputError(
                f"{where}: more than {MOST_INCLUDES} files are included; do they name one another?"
            )
        check_size(path, sum(self.includes[:-1]))
        return path

    def node_numbers(self) -> np.ndarray:
        """(n,) of all nodes so far."""
        return joined(numbers for numbers, _ in self.nodes)

    def add_cells(
        self,
        kind: str,
        numbers: ArrayLike,
        nodes: ArrayLike,
        between: Sequence[tuple[int, ...]] | None = None,
    ) -> None:
        """Cells of one type: numbers (c,), nodes (c, k).

        between : corners around each middle node, in the file's order, see Cell.columns; None: the
        order is gmsh's
        """
        rows = np.asarray(nodes, dtype=np.int64).reshape(-1, CELLS[kind].nodes)
        rows = rows[:, CELLS[kind].columns(between)] if between else rows
        self.cells.setdefault(kind, []).append((np.asarray(numbers, dtype=np.int64), rows))

    def add_group(self, name: str, numbers: ArrayLike, dimension: int = 0) -> None:
        """Numbers join those of a group of the same name."""
        self.groups.setdefault(name, []).append(np.asarray(numbers, dtype=np.int64).ravel())
        self.dimension[name] = max(dimension, self.dimension.get(name, 0))

    def add_cell_group(self, name: str, numbers: ArrayLike) -> None:
        """Element numbers; they join those of a group of the same name."""
        self.cell_groups.setdefault(name, []).append(np.asarray(numbers, dtype=np.int64).ravel())

    def add_faces(self, name: str, nodes: ArrayLike) -> None:
        """Faces (f, k) by all their nodes, corners first; they join those of a surface of the same
        name."""
        self.faces.setdefault(name, []).append(face_keys(np.asarray(nodes, dtype=np.int64)))


def _any(data: bytes) -> bool:
    return True


@dataclass(frozen=True)
class Reader:
    """A format: what it is called, the ends of its file names, how bytes become a Content.

    claims : of several formats with the same end, the first in the list whose `claims(data)` is
    true reads the file"""

    name: str
    ends: tuple[str, ...]
    read: Callable[[Path, bytes], Content]
    claims: Callable[[bytes], bool] = _any


def to_mesh(content: Content, source: str, kind: str, length_unit: float) -> Mesh:
    """Renumbered from 0, without nodes that no solid cell uses, and checked."""
    number, position = _nodes(content, source)
    blocks = _cells(content, len(number), source)
    cells = {k: _lookup(number, nodes, elements, source) for k, (elements, nodes) in blocks.items()}
    used = np.isin(np.arange(len(number)), np.concatenate([c.ravel() for c in cells.values()]))
    unused, warnings = list(content.unused), list(content.warnings)
    _tell_of_lost(used, unused, warnings)
    groups, dimension = _groups(content, number, used, unused)
    renumber = np.cumsum(used) - 1
    mesh = Mesh(
        number[used],
        position[used] * length_unit,
        {k: renumber[c] for k, c in cells.items()},
        groups,
        tuple(unused),
        source,
        {k: e for k, (e, _) in blocks.items()},
        _cell_groups(content, blocks),
        dimension,
        tuple(warnings),
        kind,
        _face_groups(content),
        dict(content.materials),
    )
    return checked(mesh)


def _tell_of_lost(used: np.ndarray, unused: list[str], warnings: list[str]) -> None:
    """Of nodes that no solid cell uses."""
    lost = int((~used).sum())
    if lost:
        unused.append(f"{lost} nodes that no solid cell uses")
    if lost > 0.2 * len(used):
        warnings.append(
            f"{lost} of {len(used)} nodes belong to no solid cell and were left out: is the file "
            "whole?"
        )


def _nodes(content: Content, source: str) -> tuple[np.ndarray, np.ndarray]:
    if not sum(len(n) for n, _ in content.nodes):
        raise InputError(f"{source}: holds no nodes")
    number, position = (np.concatenate(part) for part in zip(*content.nodes, strict=True))
    if number.min() < 1:
        raise InputError(f"{source}: node number {number.min()}; node numbers begin at 1")
    number, first, inverse = np.unique(number, return_index=True, return_inverse=True)
    moved = (position[first][inverse] != position).any(axis=1) & np.isfinite(position).all(axis=1)
    if moved.any():
        raise InputError(
            f"{source}: node {number[inverse[moved][0]]} is given twice, at different places"
        )
    return number, position[first]


def _cells(content: Content, nodes: int, source: str) -> dict[str, tuple[np.ndarray, ...]]:
    """{type: (element numbers (c,), node numbers (c, k))} of a file of so many nodes."""
    blocks: dict[str, tuple[np.ndarray, ...]] = {
        k: tuple(np.concatenate(part) for part in zip(*b, strict=True))
        for k, b in content.cells.items()
    }
    blocks = {k: b for k, b in blocks.items() if len(b[0])}
    if not blocks:
        found = f" (found: {'; '.join(content.unused[:6])})" if content.unused else ""
        raise InputError(f"{source}: holds {nodes} nodes and no solid cells{found}")
    numbers = np.concatenate([e for e, _ in blocks.values()])
    unique, count = np.unique(numbers, return_counts=True)
    if (count > 1).any():
        raise InputError(
            f"{source}: {int((count > 1).sum())} element numbers are used twice: "
            f"{some(unique[count > 1])}"
        )
    return blocks


def _lookup(number: np.ndarray, nodes: np.ndarray, elements: np.ndarray, source: str) -> np.ndarray:
    place = np.minimum(np.searchsorted(number, nodes), len(number) - 1)
    absent = number[place] != nodes
    if absent.any():
        row, column = np.argwhere(absent)[0]
        raise InputError(
            f"{source}: element {elements[row]} refers to node {nodes[row, column]}, which does "
            f"not exist ({int(absent.any(axis=1).sum())} such elements)"
        )
    return place


def _groups(
    content: Content, number: np.ndarray, used: np.ndarray, unused: list[str]
) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    groups, dimension = {}, {}
    for name, found in content.groups.items():
        members = np.unique(joined(found))
        absent = len(members) - int(np.isin(members, number).sum())
        kept = members[np.isin(members, number[used])]
        if absent:
            unused.append(f"{absent} nodes of group '{shown(name)}' that do not exist")
        if len(members) - absent > len(kept):
            unused.append(
                f"{len(members) - absent - len(kept)} nodes of group '{shown(name)}' that no "
                "solid cell uses"
            )
        groups[name], dimension[name] = kept, content.dimension.get(name, 0)
    return groups, dimension


def _cell_groups(
    content: Content, blocks: dict[str, tuple[np.ndarray, ...]]
) -> dict[str, np.ndarray]:
    """Groups of solid cells; a group of shells or points alone is none."""
    solid = np.concatenate([e for e, _ in blocks.values()])
    found = {name: np.unique(np.concatenate(parts)) for name, parts in content.cell_groups.items()}
    found = {name: numbers[np.isin(numbers, solid)] for name, numbers in found.items()}
    return {name: numbers for name, numbers in found.items() if len(numbers)}


def _face_groups(content: Content) -> dict[str, np.ndarray]:
    """Face sets of the groups that hold faces alone: a name that also means single nodes stays a
    group of nodes."""
    return {
        name: np.unique(np.concatenate(parts), axis=0)
        for name, parts in content.faces.items()
        if content.dimension.get(name) == 2
    }


def decode(data: bytes, content: Content | None = None) -> str:
    """UTF-8, or Latin-1 where it is not, which is said; a byte-order mark is dropped."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if content is not None:
            content.warnings.append(
                f"the text is not UTF-8 (byte {error.start}); names were read as Latin-1"
            )
        return data.decode("latin-1")


def numbers(text: str, where: str) -> np.ndarray:
    """Numbers separated by blanks or commas, as floats; InputError at the first word that is not a
    number."""
    words = text.replace(",", " ").split()
    try:
        return np.array(words, dtype=float)
    except ValueError:
        for word in words:
            try:
                float(word)
            except ValueError:
                raise InputError(f"{where}: '{shown(word)}' is not a number") from None
        raise


def joined(parts: Iterable[np.ndarray]) -> np.ndarray:
    """(n,) the numbers of all parts, of which there may be none."""
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def span(first: int, last: int, step: int, known: ArrayLike, where: str) -> np.ndarray:
    """first, first + step, ... up to last; of a long span those alone that are `known`: a line may
    claim any number."""
    known = np.asarray(known, dtype=np.int64)
    size = (last - first) // step + 1
    if size <= max(SHORT_SPAN, 10 * len(known)):
        return np.arange(first, last + 1, step)
    if not len(known):
        raise InputError(
            f"{where}: a range of {size} numbers stands before the nodes or elements that it is "
            "of; put it behind them"
        )
    return known[(known >= first) & (known <= last) & ((known - first) % step == 0)]


def whole(values: ArrayLike, where: str) -> np.ndarray:
    """Numbers of nodes, elements or counts as integers; InputError at the first that is not
    whole."""
    values = np.asarray(values)
    with np.errstate(invalid="ignore"):
        found = values.astype(np.int64)
    wrong = found != values
    if wrong.any():
        raise InputError(
            f"{where}: {values[wrong].flat[0]:g} stands where a whole number must: cut off or "
            "damaged"
        )
    return found
