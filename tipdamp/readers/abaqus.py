"""Abaqus and CalculiX input files (.inp): nodes, solid elements, sets and sets of sets, surfaces, parts, includes."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hbm.errors import InputError, shown
from modal.elements.cells import CELLS
from tipdamp.readers.content import FULL_INTEGRATION, HEX20, TET10, WEDGE15, Content, decode, numbers, whole

_HEX_FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
_TET_FACES = [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]
_WEDGE_FACES = [(0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
# nodes of C3D...: our type, the order of the nodes between corners, the corners of faces S1, S2, ...
SOLID = {4: ("tetra", None, _TET_FACES), 10: ("tetra10", TET10, _TET_FACES),
         8: ("hexahedron", None, _HEX_FACES), 20: ("hexahedron20", HEX20, _HEX_FACES),
         27: ("hexahedron27", [*HEX20, tuple(range(8)), *_HEX_FACES], _HEX_FACES),
         6: ("wedge", None, _WEDGE_FACES), 15: ("wedge15", WEDGE15, _WEDGE_FACES)}
# shells, membranes and plane elements: no cells of ours, but pre-processors mark surfaces with them
_SHEET = re.compile(r"(?:CPS|CPE|CAX|S|M3D|SFM3D|R3D|DS|STRI)([34689])[A-Z]*")
# keywords that make nodes or elements, or move them: a mesh read without them would be another one
_REFUSED = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")
_NESTED = {"PART": "END PART", "ASSEMBLY": "END ASSEMBLY", "INSTANCE": "END INSTANCE", "STEP": "END STEP"}


@dataclass
class _Scope:
    """A part, or the model: what it defines, sets not yet resolved. Names are kept by their upper-case form."""

    nodes: list = field(default_factory=list)     # (numbers, xyz)
    elements: list = field(default_factory=list)  # (nodes of a solid element or 0, numbers, connectivity)
    sets: dict = field(default_factory=dict)      # ("NSET" | "ELSET" | "SURFACE", UPPER): [items]
    names: dict = field(default_factory=dict)     # same key: name as written

    def add(self, kind, name, *items):
        key = kind, name.upper()
        self.names.setdefault(key, name)
        self.sets.setdefault(key, []).extend(items)


@dataclass
class _File:
    path: Path
    content: Content
    model: _Scope = field(default_factory=_Scope)
    parts: dict = field(default_factory=dict)
    scope: _Scope | None = None
    open: list = field(default_factory=list)
    skipped: dict = field(default_factory=dict)
    integration: set = field(default_factory=set)
    qualified: dict = field(default_factory=dict)  # key of 'Instance.Set' in the model: key of 'Set'
    owners: dict = field(default_factory=dict)     # key of 'Set': instances, and "the assembly", that define it


def read(path, data: bytes) -> Content:
    """Content of an .inp file. Sets and surfaces become groups; element sets also become groups of cells."""
    content = Content()
    f = _File(Path(path), content)
    f.scope = f.model
    _blocks(f, _lines(f, data, Path(path)))
    if f.open:
        raise InputError(f"{path}: is cut off: *{f.open[-1]} is not closed by *{_NESTED[f.open[-1]]}")
    _collect(f)
    if f.integration:
        content.unused.append(f"element types {', '.join(sorted(f.integration))}: {FULL_INTEGRATION}")
    if f.skipped:
        content.unused.append("keywords " + ", ".join(f"*{k} ({n})" for k, n in sorted(f.skipped.items())))
    return content


# ---- lines and keywords ----------------------------------------------------------------------------------------

def _lines(f, data, path):
    text = decode(data, f.content)
    if not text.endswith(("\n", "\r")) and not text.rstrip().rpartition("\n")[2].startswith("*"):
        raise InputError(f"{path}: is cut off: its last line '{shown(text.rpartition(chr(10))[2])}' has no line end")
    return [(i, line) for i, line in enumerate(text.splitlines(), start=1)
            if line.strip() and not line.startswith("**")]


def _blocks(f, lines):
    """Each keyword with its data lines, in the order of the file."""
    place = 0
    while place < len(lines):
        number, head = lines[place]
        place += 1
        while head.rstrip().endswith(",") and place < len(lines) and head.startswith("*"):
            head, place = head.rstrip() + lines[place][1], place + 1
        first = place
        while place < len(lines) and not lines[place][1].startswith("*"):
            place += 1
        if not head.startswith("*"):
            raise InputError(f"{f.path}, line {number}: '{shown(head)}' belongs to no keyword")
        keyword, options = _keyword(head)
        where = f"{f.path}, line {number}: *{keyword}"
        _block(f, keyword, options, [line for _, line in lines[first:place]], where)


def _keyword(head):
    """('NODE', {'NSET': 'all'}) of '*NODE, NSET=all'."""
    words = re.findall(r'(?:"[^"]*"|[^,])+', head[1:]) or [""]
    options = {}
    for word in words[1:]:
        name, _, value = word.partition("=")
        options[name.strip().upper()] = value.strip().strip('"')
    return " ".join(words[0].upper().split()), options


def _block(f, keyword, options, data, where):
    if keyword in _REFUSED:
        raise InputError(f"{where} is not read, and the mesh is not the same without it; write all nodes and elements "
                         "out in the global system")
    if keyword in _NESTED:
        f.open.append(keyword)
    elif keyword.startswith("END "):
        if not f.open or _NESTED[f.open.pop()] != keyword:
            raise InputError(f"{where} closes nothing that is open")
    if keyword == "INCLUDE" or "INPUT" in options and keyword in ("NODE", "ELEMENT", "NSET", "ELSET"):
        included = _included(f, options.get("INPUT", ""), where)
        if keyword == "INCLUDE":
            return _blocks(f, included)
        data = [*data, *(line for _, line in included)]
    read = _READ.get(keyword)
    if read:
        read(f, options, data, where)
    elif keyword not in ("HEADING", "PREPRINT", "END PART", "END INSTANCE", "END ASSEMBLY", "ASSEMBLY", "INCLUDE"):
        f.skipped[keyword] = f.skipped.get(keyword, 0) + 1
    if keyword in ("END PART", "END INSTANCE"):
        f.scope = f.model


def _included(f, name, where):
    path = (f.path.parent / name).resolve()
    if not path.is_relative_to(f.path.parent.resolve()):
        raise InputError(f"{where}: {shown(name)} lies outside the folder of the mesh file")
    if not name or not path.is_file():
        raise InputError(f"{where}: file '{shown(name)}' not found beside the mesh file")
    return _lines(f, path.read_bytes(), path)


def _name(options, key, where):
    if not options.get(key):
        raise InputError(f"{where} without {key}=")
    return options[key]


def _nodes(f, options, data, where):
    if f.open and f.open[-1] == "ASSEMBLY":
        f.content.unused.append(f"{len(data)} reference points of the assembly")
        return
    if options.get("SYSTEM", "R").upper() != "R":
        raise InputError(f"{where}: SYSTEM={options['SYSTEM']} is not read; write the nodes in the global system")
    flat = numbers(" ".join(data), where)
    if len(flat) != 4 * len(data) or any(line.count(",") != 3 for line in data[:1]):
        flat = np.array([_node(line, where) for line in data]).ravel()
    rows = flat.reshape(-1, 4)
    number = whole(rows[:, 0], where)
    f.scope.nodes.append((number, rows[:, 1:]))
    if "NSET" in options:
        f.scope.add("NSET", options["NSET"], number)


def _node(line, where):
    """Number and coordinates of one line; direction cosines behind them are not ours, blanks are zeros."""
    words = [w.strip() for w in line.split(",")]
    if len(words) < 4:
        raise InputError(f"{where}: node line '{shown(line)}' has fewer than three coordinates")
    found = numbers(" ".join(w or "0" for w in words[:4]), where)
    if len(found) != 4:
        raise InputError(f"{where}: node line '{shown(line)}' is damaged")
    return found


def _elements(f, options, data, where):
    kind = _name(options, "TYPE", where).upper()
    solid = re.fullmatch(r"C3D(\d+)([A-Z]*)", kind)
    flat = _SHEET.fullmatch(kind)
    if not solid and not flat:
        f.content.unused.append(f"{len(data)} lines of elements of type {shown(kind)}")
        return
    if solid and int(solid[1]) not in SOLID:
        raise InputError(f"{where}: cells of type {shown(kind)} cannot be assembled; allowed: "
                         f"{', '.join(f'C3D{n}' for n in SOLID)}")
    if solid and solid[2]:
        f.integration.add(kind)
    per = int((solid or flat)[1])
    found = numbers(" ".join(data), where)
    if len(found) % (per + 1):
        raise InputError(f"{where}: {len(found)} numbers are no whole number of {kind} elements ({per + 1} each): "
                         "cut off or damaged")
    rows = whole(found, where).reshape(-1, per + 1)
    f.scope.elements.append((per if solid else 0, rows[:, 0], rows[:, 1:]))
    if flat:
        f.content.unused.append(f"{len(rows)} elements of type {shown(kind)} (their sets are kept as groups of nodes)")
    if "ELSET" in options:
        f.scope.add("ELSET", options["ELSET"], rows[:, 0])


def _set(kind):
    def read(f, options, data, where):
        name = _name(options, kind, where)
        outside = f.open and f.open[-1] == "ASSEMBLY" and "INSTANCE" not in options
        if outside and re.match(r"\s*\d+\s*(,|$)", "".join(data[:1])):
            f.content.unused.append(f"set '{shown(name)}' of reference points of the assembly")
            return
        f.scope.add(kind, name)
        _owned_by_assembly(f, kind, name)
        if kind == "NSET" and "ELSET" in options:
            f.scope.add(kind, name, ("ELSET", options["ELSET"]))
        words = [w.strip().strip('"') for line in data for w in line.split(",") if w.strip()]
        if "GENERATE" in options:
            f.scope.add(kind, name, *[_generated(line, where) for line in data])
            return
        whole = [w for w in words if re.fullmatch(r"\d+", w)]
        others = [w for w in words if not re.fullmatch(r"\d+", w)]
        f.scope.add(kind, name, np.array(whole, dtype=np.int64), *((kind, w) for w in others))
    return read


def _generated(line, where):
    limits = whole(numbers(line, where), where)
    if len(limits) not in (2, 3) or (len(limits) == 3 and limits[2] < 1):
        raise InputError(f"{where}: '{shown(line)}' must be first, last and step")
    return np.arange(limits[0], limits[1] + 1, limits[2] if len(limits) == 3 else 1)


def _surface(f, options, data, where):
    name, kind = _name(options, "NAME", where), options.get("TYPE", "ELEMENT").upper()
    if kind not in ("ELEMENT", "NODE"):
        f.content.unused.append(f"surface '{shown(name)}' of type {shown(kind)}")
        return
    f.scope.add("SURFACE", name)
    _owned_by_assembly(f, "SURFACE", name)
    for line in data:
        words = [w.strip().strip('"') for w in line.split(",")]
        item = np.array([int(words[0])]) if words[0].isdigit() else ("NSET" if kind == "NODE" else "ELSET", words[0])
        f.scope.add("SURFACE", name, ("NODES", item) if kind == "NODE"
                    else ("FACE", item, words[1].upper() if len(words) > 1 else ""))


def _part(f, options, data, where):
    f.scope = f.parts.setdefault(_name(options, "NAME", where).upper(), _Scope())


def _instance(f, options, data, where):
    """The part's nodes, moved to their place, with its sets; what follows up to *END INSTANCE adds to it."""
    part = f.parts.get(_name(options, "PART", where).upper())
    if part is None:
        raise InputError(f"{where}: there is no part '{shown(options['PART'])}'")
    used = np.concatenate([n for n, _ in f.model.nodes]) if f.model.nodes else np.empty(0, int)
    own = np.concatenate([n for n, _ in part.nodes]) if part.nodes else np.empty(0, int)
    if np.isin(own, used).any():
        raise InputError(f"{where}: a second instance uses node {own[np.isin(own, used)][0]} again; numbers must be "
                         "unique: write each body into a file of its own, or renumber the parts")
    for n, xyz in part.nodes:
        f.model.nodes.append((n, _moved(xyz, data, where)))
    f.model.elements += part.elements
    instance = options.get("NAME") or options["PART"]
    for key, items in part.sets.items():
        own, name = [_within(part, instance, item) for item in items], part.names[key]
        f.model.add(key[0], name, *own)
        f.model.add(key[0], f"{instance}.{name}", *own)
        f.qualified[key[0], f"{instance}.{name}".upper()] = key
        f.owners.setdefault(key, []).append(instance)


def _within(part, instance, item):
    """An item of a part's set in the model: sets of the part that it names are those of this instance."""
    if not isinstance(item, tuple):
        return item
    if item[0] in ("NODES", "FACE"):
        return item[0], _within(part, instance, item[1]), *item[2:]
    kind, name = item
    return (kind, f"{instance}.{name}") if (kind, name.upper()) in part.sets else item


def _owned_by_assembly(f, kind, name):
    owners = f.owners.setdefault((kind, name.upper()), []) if f.open and f.open[-1] == "ASSEMBLY" else None
    if owners is not None and "the assembly" not in owners:
        owners.append("the assembly")


def _moved(xyz, data, where):
    """Translation of the first line, then rotation about the axis of the second (two points, degrees)."""
    if data:
        xyz = xyz + numbers(data[0], where)[:3]
    if len(data) > 1:
        from scipy.spatial.transform import Rotation

        a, b, angle = np.split(numbers(data[1], where), [3, 6])
        axis = (b - a) / np.linalg.norm(b - a)
        xyz = Rotation.from_rotvec(np.radians(angle[0]) * axis).apply(xyz - a) + a
    return xyz


_READ = {"NODE": _nodes, "ELEMENT": _elements, "NSET": _set("NSET"), "ELSET": _set("ELSET"), "SURFACE": _surface,
         "PART": _part, "INSTANCE": _instance}


# ---- from the file's terms to groups ---------------------------------------------------------------------------

def _collect(f):
    content, model = f.content, f.model
    for n, xyz in model.nodes:
        content.add_nodes(n, xyz)
    for per, n, nodes in [e for e in model.elements if e[0]]:
        kind, between, _ = SOLID[per]
        content.add_cells(kind, n, nodes, CELLS[kind].columns(between) if between else None)
    shared = {key for key, owners in f.owners.items() if len(owners) > 1}
    wanted = [key for key in model.sets if f.qualified.get(key) in shared or key not in f.qualified]
    _warn_of_shared(f, shared)
    for key in wanted:
        if key[0] == "ELSET":
            content.add_cell_group(model.names[key], _members(f, *key))
    for kind, dimension in (("NSET", 0), ("SURFACE", 2), ("ELSET", 3)):  # a name twice: the first kind is the group
        for key in [k for k in wanted if k[0] == kind]:
            name = model.names[key]
            taken = next((g for g in content.groups if g.upper() == key[1]), None)
            if taken is not None:
                if kind == "SURFACE":
                    content.unused.append(f"surface '{shown(name)}': a node set has the same name and is used")
                continue
            nodes, dimension_found = _nodes_of(f, key, dimension)
            content.add_group(name, nodes, dimension_found)


def _warn_of_shared(f, shared):
    """A name that several instances carry is one group of all their members, and a group of each instance beside it."""
    for key in sorted(k for k in shared if not k[1].startswith("_")):   # Abaqus' own names begin with _
        name = f.model.names[key]
        alone = [f"'{shown(f'{owner}.{name}')}'" for owner in f.owners[key] if owner != "the assembly"]
        f.content.warnings.append(f"group '{shown(name)}' joins the sets of that name of {', '.join(f.owners[key])}; "
                                  f"one alone is {' or '.join(alone)}")


def _nodes_of(f, key, dimension):
    members = _members(f, *key)
    if key[0] == "NSET":
        return members, 0
    if key[0] == "ELSET":
        solid = any(per and np.isin(n, members).any() for per, n, _ in f.model.elements)
        return _element_nodes(f, members), 3 if solid else 2
    nodes, kinds = [np.empty(0, dtype=np.int64)], set()
    for item in f.model.sets[key]:
        kinds.add(item[0])
        found = item[1] if isinstance(item[1], np.ndarray) else _members(f, *_key(f, item[1]))
        nodes.append(found if item[0] == "NODES" else _face_nodes(f, found, item[2], f.model.names[key]))
    return np.concatenate(nodes), 2 if "FACE" in kinds else 0


def _key(f, reference):
    """Of a set that is named: 'Set', or 'Part-1-1.Set' of one instance, which may also stand in the assembly."""
    kind, name = reference[0], reference[1].upper()
    return (kind, name) if (kind, name) in f.model.sets else (kind, name.rpartition(".")[2])


def _members(f, kind, name, within=()):
    """Numbers of a set, with the sets that it names resolved."""
    key = kind, name.upper()
    if kind == "SURFACE":
        return np.empty(0, dtype=np.int64)
    if key in within:
        raise InputError(f"{f.path}: set '{shown(f.model.names[key])}' contains itself")
    if key not in f.model.sets:
        if key[1].isdigit():
            return np.array([int(key[1])])
        raise InputError(f"{f.path}: {'node' if kind == 'NSET' else 'element'} set '{shown(name)}' is used and not "
                         "defined")
    found = [np.empty(0, dtype=np.int64)]
    for item in f.model.sets[key]:
        if isinstance(item, np.ndarray):
            found.append(item)
        else:
            numbers_ = _members(f, *_key(f, item), within=(*within, key))
            found.append(_element_nodes(f, numbers_) if kind == "NSET" and item[0] == "ELSET" else numbers_)
    return np.unique(np.concatenate(found))


def _element_nodes(f, members):
    found = [nodes[np.isin(n, members)].ravel() for _, n, nodes in f.model.elements]
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=np.int64)


def _face_nodes(f, members, label, surface):
    """Nodes, middle ones included, of face S1, S2, ... of the elements."""
    out = [np.empty(0, dtype=np.int64)]
    for per, n, nodes in [e for e in f.model.elements if e[0]]:
        kind, between, faces = SOLID[per]
        mine = np.isin(n, members)
        if not mine.any():
            continue
        if not re.fullmatch(r"S[1-6]", label) or int(label[1]) > len(faces):
            raise InputError(f"{f.path}: surface '{shown(surface)}': face '{shown(label)}' of a {kind} is not read; "
                             f"allowed: S1 to S{len(faces)}")
        corners = faces[int(label[1]) - 1]
        ours = next(face for face in CELLS[kind].faces if set(corners) <= set(face))
        columns = CELLS[kind].columns(between) if between else np.arange(per)
        out.append(nodes[mine][:, columns[list(ours)]].ravel())
    return np.concatenate(out)
