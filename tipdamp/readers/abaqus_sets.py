"""Sets, surfaces and instances of an Abaqus file as groups of nodes and of cells."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.elements.cells import CELLS
from tipdamp.readers.content import HEX20, TET10, WEDGE15, Content, joined

_HEX_FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
_TET_FACES = [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]
_WEDGE_FACES = [(0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
# nodes of C3D...: our type, the order of the nodes between corners, the corners of faces S1, S2,
# ...
SOLID: dict[int, tuple[str, Any, Any]] = {
    4: ("tetra", None, _TET_FACES),
    10: ("tetra10", TET10, _TET_FACES),
    8: ("hexahedron", None, _HEX_FACES),
    20: ("hexahedron20", HEX20, _HEX_FACES),
    27: ("hexahedron27", [*HEX20, tuple(range(8)), *_HEX_FACES], _HEX_FACES),
    6: ("wedge", None, _WEDGE_FACES),
    15: ("wedge15", WEDGE15, _WEDGE_FACES),
}


Key = tuple[str, str]  # ("NSET" | "ELSET" | "SURFACE", name in upper case)


@dataclass
class Scope:
    """A part, or the model: what it defines, sets not yet resolved. Names are kept by their
    upper-case form."""

    nodes: list[tuple] = field(default_factory=list)  # (numbers, xyz)
    # (nodes of a solid; 0: face, -1: curve; numbers, nodes)
    elements: list[tuple] = field(default_factory=list)
    # items of each set: numbers, or references to other sets
    sets: dict[Key, list] = field(default_factory=dict)
    names: dict[Key, str] = field(default_factory=dict)  # name as written

    def known(self, kind: str) -> np.ndarray:
        """(n,) numbers of the nodes, or for an ELSET of the elements, so far."""
        found = [n for n, _ in self.nodes] if kind == "NSET" else [n for _, n, _ in self.elements]
        return joined(found)

    def add(self, kind: str, name: str, *items: object) -> None:
        """Items of a set; they join those of the same name."""
        key = kind, name.upper()
        self.names.setdefault(key, name)
        self.sets.setdefault(key, []).extend(items)


@dataclass
class AbaqusFile:
    """A file while its keywords are read."""

    path: Path
    content: Content
    model: Scope = field(default_factory=Scope)
    parts: dict[str, Scope] = field(default_factory=dict)
    scope: Scope = field(init=False)  # that the next keyword adds to: the model, or a part
    open: list[str] = field(default_factory=list)  # keywords waiting for their *END
    skipped: dict[str, int] = field(default_factory=dict)
    # faces and lines given as elements, by their type
    sheets: dict[str, int] = field(default_factory=dict)
    # element types with another integration than ours
    integration: set[str] = field(default_factory=set)
    # key of 'Instance.Set' in the model: key of 'Set'
    qualified: dict[Key, Key] = field(default_factory=dict)
    # material that is being read, what is known of each, and of which one a section is made
    material: str = ""
    materials: dict[str, dict[str, tuple[float, ...]]] = field(default_factory=dict)
    sections: list[tuple[str, str]] = field(default_factory=list)
    # instances, and "the assembly", that define a set
    owners: dict[Key, list[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.scope = self.model

    @property
    def in_assembly(self) -> bool:
        """Whether a keyword stands in *ASSEMBLY itself."""
        return self.open[-1:] == ["ASSEMBLY"]


def collect(f: AbaqusFile) -> None:
    """Nodes, cells and groups of the model into f.content."""
    content, model = f.content, f.model
    for n, xyz in model.nodes:
        content.add_nodes(n, xyz)
    for per, n, nodes in [e for e in model.elements if e[0] > 0]:
        kind, between, _ = SOLID[per]
        content.add_cells(kind, n, nodes, between)
    shared = {key for key, owners in f.owners.items() if len(owners) > 1}
    wanted = [key for key in model.sets if f.qualified.get(key) in shared or key not in f.qualified]
    _warn_of_shared(f, shared)
    for key in wanted:
        if key[0] == "ELSET":
            content.add_cell_group(model.names[key], _members(f, *key))
    taken: set[str] = set()
    # a name twice: the first kind is the group
    for key in (k for kind in ("NSET", "SURFACE", "ELSET") for k in wanted if k[0] == kind):
        if key[1] not in taken:
            content.add_group(model.names[key], *_nodes_of(f, key))
            taken.add(key[1])
        elif key[0] == "SURFACE":
            content.unused.append(
                f"surface '{shown(model.names[key])}': a node set has the same name and is used"
            )


def _warn_of_shared(f: AbaqusFile, shared: set) -> None:
    """A name that several instances carry is one group of all their members, and a group of each
    instance beside it."""
    # Abaqus' own names begin with _
    for key in sorted(k for k in shared if not k[1].startswith("_")):
        name = f.model.names[key]
        alone = [
            f"'{shown(f'{owner}.{name}')}'" for owner in f.owners[key] if owner != "the assembly"
        ]
        f.content.warnings.append(
            f"group '{shown(name)}' joins the sets of that name of {', '.join(f.owners[key])}; "
            f"one alone is {' or '.join(alone)}"
        )


def _nodes_of(f: AbaqusFile, key: Key) -> tuple[np.ndarray, int]:
    """Nodes and dimension of a set, whose faces become those of the group."""
    if key[0] == "SURFACE":
        return _surface_nodes(f, key)
    members = _members(f, *key)
    if key[0] == "NSET":
        return members, 0
    nodes, found = _element_nodes(f, members), []
    for per, n, own in f.model.elements:
        mine = np.isin(n, members)
        if mine.any():
            found.append((per, own[mine]))
    if any(per > 0 for per, _ in found):
        return nodes, 3
    sheets = [own for per, own in found if not per]
    for faces in sheets:
        f.content.add_faces(f.model.names[key], faces)
    return nodes, 2 if sheets or not found else 1


def _surface_nodes(f: AbaqusFile, key: Key) -> tuple[np.ndarray, int]:
    """As `_nodes_of`, of nodes and of faces of elements."""
    nodes, dimension, name = [], 0, f.model.names[key]
    for kind, item, *label in f.model.sets[key]:
        members = item if isinstance(item, np.ndarray) else _members(f, *_key(f, item))
        if kind != "FACE":
            nodes.append(members)
            continue
        dimension = 2
        for block in _faces(f, members, "".join(label), name):
            f.content.add_faces(name, block)
            nodes.append(block.ravel())
    return joined(nodes), dimension


def _key(f: AbaqusFile, reference: Key) -> Key:
    """Of a set that is named: 'Set', or 'Part-1-1.Set' of one instance, which may also stand in the
    assembly."""
    kind, name = reference[0], reference[1].upper()
    return (kind, name) if (kind, name) in f.model.sets else (kind, name.rpartition(".")[2])


def _members(f: AbaqusFile, kind: str, name: str, within: tuple[Key, ...] = ()) -> np.ndarray:
    """Numbers of a set, with the sets that it names resolved."""
    key = kind, name.upper()
    if key in within:
        raise InputError(f"{f.path}: set '{shown(f.model.names[key])}' contains itself")
    if key not in f.model.sets:
        if key[1].isdigit():
            return np.array([int(key[1])])
        raise InputError(
            f"{f.path}: {'node' if kind == 'NSET' else 'element'} set '{shown(name)}' is used and "
            "not defined"
        )
    found = []
    for item in f.model.sets[key]:
        if not isinstance(item, np.ndarray):
            nodes_wanted = kind == "NSET" and item[0] == "ELSET"
            item = _members(f, *_key(f, item), within=(*within, key))
            item = _element_nodes(f, item) if nodes_wanted else item
        found.append(item)
    return np.unique(joined(found))


def _element_nodes(f: AbaqusFile, members: np.ndarray) -> np.ndarray:
    return np.unique(joined(nodes[np.isin(n, members)].ravel() for _, n, nodes in f.model.elements))


def _faces(f: AbaqusFile, members: np.ndarray, label: str, surface: str) -> list[np.ndarray]:
    """Nodes (f, k), middle ones included, of face S1, S2, ... of the elements, block by block."""
    out = []
    for per, n, nodes in [e for e in f.model.elements if e[0] > 0]:
        kind, between, faces = SOLID[per]
        mine = np.isin(n, members)
        if not mine.any():
            continue
        if not re.fullmatch(r"S[1-6]", label) or int(label[1]) > len(faces):
            raise InputError(
                f"{f.path}: surface '{shown(surface)}': face '{shown(label)}' of a {kind} is not "
                f"read; allowed: S1 to S{len(faces)}"
            )
        corners = faces[int(label[1]) - 1]
        ours = next(face for face in CELLS[kind].faces if set(corners) <= set(face))
        columns = CELLS[kind].columns(between) if between else np.arange(per)
        out.append(nodes[mine][:, columns[list(ours)]])
    return out
