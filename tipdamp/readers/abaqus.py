"""Abaqus and CalculiX input files (.inp): nodes, solid elements, sets and sets of sets, surfaces,
parts, includes."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.mesh import GivenMaterial
from tipdamp.readers.abaqus_sets import SOLID, AbaqusFile, Scope, collect
from tipdamp.readers.content import FULL_INTEGRATION, Content, Reader, decode, numbers, span, whole

# shells, membranes and plane elements: no cells of ours, but pre-processors mark surfaces with them
# reads the data lines of a keyword with its options; at last where they stand
_Read = Callable[[AbaqusFile, dict[str, str], Sequence[str], str], None]
_SHEET = re.compile(r"(?:CPS|CPE|CAX|S|M3D|SFM3D|R3D|DS|STRI)([34689])[A-Z]*")
_LINE = re.compile(r"T[23]D([23])[A-Z]*")  # trusses: gmsh writes physical curves with them
# keywords that make nodes or elements, or move them: a mesh read without them would be another one
_REFUSED = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")
_NESTED = {
    "PART": "END PART",
    "ASSEMBLY": "END ASSEMBLY",
    "INSTANCE": "END INSTANCE",
    "STEP": "END STEP",
}


def read(path: Path, data: bytes) -> Content:
    """Content of an .inp file. Sets and surfaces become groups; element sets also become groups of
    cells."""
    content = Content()
    f = AbaqusFile(path, content)
    _blocks(f, _lines(f, data, path))
    if f.open:
        raise InputError(
            f"{path}: is cut off: *{f.open[-1]} is not closed by *{_NESTED[f.open[-1]]}"
        )
    collect(f)
    content.materials = _materials(f)
    content.unused += _left_out(f)
    return content


def _left_out(f: AbaqusFile) -> Iterator[str]:
    """What is not read of a file."""
    for kind, count in f.sheets.items():
        yield f"{count} elements of type {shown(kind)} (their sets are kept as groups of nodes)"
    if f.integration:
        yield f"element types {', '.join(sorted(f.integration))}: {FULL_INTEGRATION}"
    offered = _OFFERED if f.content.materials else ()  # whether a study has them is seen there
    if skipped := {k: n for k, n in f.skipped.items() if k not in offered}:
        yield "keywords " + ", ".join(f"*{k} ({n})" for k, n in sorted(skipped.items()))


# ---- lines and keywords --------------------------------------------------------------------------


def _lines(f: AbaqusFile, data: bytes, path: Path) -> list[tuple[int, str]]:
    text = decode(data, f.content)
    if not text.endswith(("\n", "\r")) and not text.rstrip().rpartition("\n")[2].startswith("*"):
        raise InputError(
            f"{path}: is cut off: its last line '{shown(text.rpartition(chr(10))[2])}' has no "
            "line end"
        )
    return [
        (i, line)
        for i, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.startswith("**")
    ]


def _blocks(f: AbaqusFile, lines: Sequence[tuple[int, str]]) -> None:
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


def _keyword(head: str) -> tuple[str, dict[str, str]]:
    """('NODE', {'NSET': 'all'}) of '*NODE, NSET=all'."""
    words = re.findall(r'(?:"[^"]*"|[^,])+', head[1:]) or [""]
    options = {}
    for word in words[1:]:
        name, _, value = word.partition("=")
        options[name.strip().upper()] = value.strip().strip('"')
    return " ".join(words[0].upper().split()), options


def _block(
    f: AbaqusFile, keyword: str, options: dict[str, str], data: Sequence[str], where: str
) -> None:
    if keyword in _REFUSED:
        raise InputError(
            f"{where} is not read, and the mesh is not the same without it; write all nodes and "
            "elements out in the global system"
        )
    if keyword in _NESTED:
        f.open.append(keyword)
    elif keyword.startswith("END "):
        if not f.open or _NESTED[f.open.pop()] != keyword:
            raise InputError(f"{where} closes nothing that is open")
    if (
        keyword == "INCLUDE"
        or "INPUT" in options
        and keyword in ("NODE", "ELEMENT", "NSET", "ELSET")
    ):
        included = _included(f, options.get("INPUT", ""), where)
        if keyword == "INCLUDE":
            _blocks(f, included)
            return
        data = [*data, *(line for _, line in included)]
    read = _READ.get(keyword)
    if keyword in _OFFERED:
        _OFFERED[keyword](f, options, data)
    if read:
        read(f, options, data, where)
    elif keyword not in (
        "HEADING",
        "PREPRINT",
        "END PART",
        "END INSTANCE",
        "END ASSEMBLY",
        "ASSEMBLY",
        "INCLUDE",
    ):
        f.skipped[keyword] = f.skipped.get(keyword, 0) + 1
    if keyword in ("END PART", "END INSTANCE"):
        f.scope = f.model


def _included(f: AbaqusFile, name: str, where: str) -> list[tuple[int, str]]:
    path = f.content.included(f.path.parent, name, where)
    return _lines(f, path.read_bytes(), path)


def _name(options: dict[str, str], key: str, where: str) -> str:
    if not options.get(key):
        raise InputError(f"{where} without {key}=")
    return options[key]


def _nodes(f: AbaqusFile, options: dict, data: Sequence[str], where: str) -> None:
    if f.in_assembly:
        f.content.unused.append(f"{len(data)} reference points of the assembly")
        return
    if options.get("SYSTEM", "R").upper() != "R":
        raise InputError(
            f"{where}: SYSTEM={options['SYSTEM']} is not read; write the nodes in the global system"
        )
    flat = numbers(" ".join(data), where)
    if len(flat) != 4 * len(data) or any(line.count(",") != 3 for line in data[:1]):
        flat = np.array([_node(line, where) for line in data]).ravel()
    rows = flat.reshape(-1, 4)
    number = whole(rows[:, 0], where)
    f.scope.nodes.append((number, rows[:, 1:]))
    if "NSET" in options:
        f.scope.add("NSET", options["NSET"], number)


def _node(line: str, where: str) -> np.ndarray:
    """Number and coordinates of one line; direction cosines behind them are not ours, blanks are
    zeros."""
    words = [w.strip() for w in line.split(",")]
    if len(words) < 4:
        raise InputError(f"{where}: node line '{shown(line)}' has fewer than three coordinates")
    found = numbers(" ".join(w or "0" for w in words[:4]), where)
    if len(found) != 4:
        raise InputError(f"{where}: node line '{shown(line)}' is damaged")
    return found


def _elements(f: AbaqusFile, options: dict[str, str], data: Sequence[str], where: str) -> None:
    kind = _name(options, "TYPE", where).upper()
    solid = re.fullmatch(r"C3D(\d+)([A-Z]*)", kind)
    flat, line = _SHEET.fullmatch(kind), _LINE.fullmatch(kind)
    element = solid or flat or line
    if element is None:
        f.content.unused.append(f"{len(data)} lines of elements of type {shown(kind)}")
        return
    if solid and int(solid[1]) not in SOLID:
        raise InputError(
            f"{where}: cells of type {shown(kind)} cannot be assembled; allowed: "
            f"{', '.join(f'C3D{n}' for n in SOLID)}"
        )
    if solid and solid[2]:
        f.integration.add(kind)
    per = int(element[1])
    found = numbers(" ".join(data), where)
    if len(found) % (per + 1):
        raise InputError(
            f"{where}: {len(found)} numbers are no whole number of {kind} elements ({per + 1} "
            "each): cut off or damaged"
        )
    rows = whole(found, where).reshape(-1, per + 1)
    mark = per
    if not solid:
        mark = -1 if line else 0
        f.sheets[kind] = f.sheets.get(kind, 0) + len(rows)
    f.scope.elements.append((mark, rows[:, 0], rows[:, 1:]))
    if "ELSET" in options:
        f.scope.add("ELSET", options["ELSET"], rows[:, 0])


def _set(kind: str) -> _Read:
    def read(f: AbaqusFile, options: dict[str, str], data: Sequence[str], where: str) -> None:
        name = _name(options, kind, where)
        outside = f.in_assembly and "INSTANCE" not in options
        if outside and re.match(r"\s*\d+\s*(,|$)", "".join(data[:1])):
            f.content.unused.append(f"set '{shown(name)}' of reference points of the assembly")
            return
        f.scope.add(kind, name)
        _owned_by_assembly(f, kind, name)
        if kind == "NSET" and "ELSET" in options:
            f.scope.add(kind, name, ("ELSET", options["ELSET"]))
        if "GENERATE" in options:
            known = f.scope.known(kind)
            f.scope.add(kind, name, *[_generated(line, where, known) for line in data])
        else:
            f.scope.add(kind, name, *_listed(kind, data))

    return read


def _listed(kind: str, data: Sequence[str]) -> list[Any]:
    """The numbers of a set, and the sets that it names."""
    words = [w.strip().strip('"') for line in data for w in line.split(",") if w.strip()]
    numbers = [w for w in words if re.fullmatch(r"\d+", w)]
    others = [(kind, w) for w in words if not re.fullmatch(r"\d+", w)]
    return [np.array(numbers, dtype=np.int64), *others]


def _generated(line: str, where: str, known: np.ndarray) -> np.ndarray:
    limits = whole(numbers(line, where), where)
    if len(limits) not in (2, 3) or (len(limits) == 3 and limits[2] < 1):
        raise InputError(f"{where}: '{shown(line)}' must be first, last and step")
    first, last, step = limits if len(limits) == 3 else (*limits, 1)
    return span(first, last, step, known, where)


def _surface(f: AbaqusFile, options: dict[str, str], data: Sequence[str], where: str) -> None:
    name, kind = _name(options, "NAME", where), options.get("TYPE", "ELEMENT").upper()
    if kind not in ("ELEMENT", "NODE"):
        f.content.unused.append(f"surface '{shown(name)}' of type {shown(kind)}")
        return
    f.scope.add("SURFACE", name)
    _owned_by_assembly(f, "SURFACE", name)
    sets = "NSET" if kind == "NODE" else "ELSET"
    for line in data:
        first, *label = [w.strip().strip('"') for w in line.split(",")]
        item = np.array([int(first)]) if first.isdigit() else (sets, first)
        face = "FACE", item, label[0].upper() if label else ""
        f.scope.add("SURFACE", name, ("NODES", item) if kind == "NODE" else face)


def _part(f: AbaqusFile, options: dict[str, str], data: Sequence[str], where: str) -> None:
    f.scope = f.parts.setdefault(_name(options, "NAME", where).upper(), Scope())


def _instance(f: AbaqusFile, options: dict[str, str], data: Sequence[str], where: str) -> None:
    """The part's nodes, moved to their place, with its sets; what follows up to *END INSTANCE adds
    to it."""
    part = f.parts.get(_name(options, "PART", where).upper())
    if part is None:
        raise InputError(f"{where}: there is no part '{shown(options['PART'])}'")
    own = part.known("NSET")
    again = own[np.isin(own, f.model.known("NSET"))]
    if len(again):
        raise InputError(
            f"{where}: a second instance uses node {again[0]} again; numbers must be unique: write "
            "each body into a file of its own, or renumber the parts"
        )
    for n, xyz in part.nodes:
        f.model.nodes.append((n, _moved(xyz, data, where)))
    f.model.elements += part.elements
    instance = options.get("NAME") or options["PART"]
    for key, items in part.sets.items():
        mine, name = [_within(part, instance, item) for item in items], part.names[key]
        f.model.add(key[0], name, *mine)
        f.model.add(key[0], f"{instance}.{name}", *mine)
        f.qualified[key[0], f"{instance}.{name}".upper()] = key
        f.owners.setdefault(key, []).append(instance)


def _within(part: Scope, instance: str, item: Any) -> Any:
    """An item of a part's set in the model: sets of the part that it names are those of this
    instance."""
    if not isinstance(item, tuple):
        return item
    if item[0] in ("NODES", "FACE"):
        return item[0], _within(part, instance, item[1]), *item[2:]
    kind, name = item
    return (kind, f"{instance}.{name}") if (kind, name.upper()) in part.sets else item


def _owned_by_assembly(f: AbaqusFile, kind: str, name: str) -> None:
    if f.in_assembly:
        owners = f.owners.setdefault((kind, name.upper()), [])
        if "the assembly" not in owners:
            owners.append("the assembly")


def _moved(xyz: np.ndarray, data: Sequence[str], where: str) -> np.ndarray:
    """Translation of the first line, then rotation about the axis of the second (two points,
    degrees)."""
    if data:
        xyz = xyz + numbers(data[0], where)[:3]
    if len(data) > 1:
        from scipy.spatial.transform import Rotation

        a, b, angle = np.split(numbers(data[1], where), [3, 6])
        axis = (b - a) / np.linalg.norm(b - a)
        xyz = Rotation.from_rotvec(np.radians(angle[0]) * axis).apply(xyz - a) + a
    return xyz


# ---- materials, which a proposed study takes over ------------------------------------------------


def _material(f: AbaqusFile, options: dict[str, str], data: Sequence[str]) -> None:
    f.material = options.get("NAME", "")
    f.materials.setdefault(f.material.upper(), {})


def _elastic(f: AbaqusFile, options: dict[str, str], data: Sequence[str]) -> None:
    isotropic = options.get("TYPE", "ISOTROPIC").upper().startswith("ISO")
    _constant(f, "elastic", data if isotropic else (), 2)


def _density(f: AbaqusFile, options: dict[str, str], data: Sequence[str]) -> None:
    _constant(f, "density", data, 1)


def _constant(f: AbaqusFile, what: str, data: Sequence[str], count: int) -> None:
    """Of one line; what depends on the temperature is not taken over."""
    try:
        lines = [[float(word) for word in line.split(",") if word.strip()] for line in data]
    except ValueError:
        lines = []
    if len(lines) == 1 and len(lines[0]) >= count:
        f.materials.setdefault(f.material.upper(), {})[what] = tuple(lines[0][:count])


def _section(f: AbaqusFile, options: dict[str, str], data: Sequence[str]) -> None:
    f.sections.append((options.get("ELSET", ""), options.get("MATERIAL", "")))


def _materials(f: AbaqusFile) -> dict[str, GivenMaterial]:
    """{group of cells: its material}; none where a section has one that is not known, or two
    speak of one group."""
    names = {name.upper(): name for name in f.content.cell_groups}
    found: dict[str, GivenMaterial] = {}
    for group, material in f.sections:
        known = f.materials.get(material.upper(), {})
        if group.upper() not in names or not {"elastic", "density"} <= set(known):
            return {}
        one = GivenMaterial(material.upper(), *known["elastic"], *known["density"])
        if found.setdefault(names[group.upper()], one) != one:
            return {}
    return found


_OFFERED: dict[str, Callable[[AbaqusFile, dict[str, str], Sequence[str]], None]] = {
    "MATERIAL": _material,
    "ELASTIC": _elastic,
    "DENSITY": _density,
    "SOLID SECTION": _section,
}
_READ: dict[str, _Read] = {
    "NODE": _nodes,
    "ELEMENT": _elements,
    "NSET": _set("NSET"),
    "ELSET": _set("ELSET"),
    "SURFACE": _surface,
    "PART": _part,
    "INSTANCE": _instance,
}


READER = Reader("Abaqus or CalculiX", (".inp",), read)
