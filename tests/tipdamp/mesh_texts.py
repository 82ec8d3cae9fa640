"""Meshes written the way pre-processors write them, from meshes of tests/modal/blocks.py.

Each writer sets the same groups: 'clamp' and 'tip' nodes of the block's ends, 'late' nodes above
the median number, 'lateral' a surface, 'all_cells', and 'some cells' an element set.
"""

import numpy as np

from tipdamp.modal.elements.cells import CELLS
from tipdamp.readers.content import HEX20, HEX20_NASTRAN, TET10, WEDGE15, WEDGE15_NASTRAN

# Abaqus' S1 to S6
_HEX_FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
# Abaqus' C3D27: the 20 nodes, the middle of the cell, the middles of S1 to S6 [Analysis User's
# Guide, 28.1.4]
ORDERS = {
    "hexahedron20": HEX20,
    "wedge15": WEDGE15,
    "tetra10": TET10,
    "hexahedron27": [*HEX20, tuple(range(8)), *_HEX_FACES],
}
ABAQUS = {
    "tetra": "C3D4",
    "tetra10": "C3D10",
    "hexahedron": "C3D8R",
    "hexahedron20": "C3D20R",
    "wedge": "C3D6",
    "wedge15": "C3D15",
    "hexahedron27": "C3D27",
}


def theirs(mesh, kind, orders=ORDERS):
    """Node numbers of the cells of a type in the other program's order."""
    cells = mesh.node[mesh.cells[kind]]
    if kind not in orders:
        return cells
    out = np.empty_like(cells)
    out[:, CELLS[kind].columns(orders[kind])] = cells
    return out


def rows(values, per, width=None):
    """Lines of so many values; comma-separated, or in fields of a width."""
    values = list(values)
    lines = [values[i : i + per] for i in range(0, len(values), per)]
    if width:
        return ["".join(f"{v:{width}d}" for v in line) for line in lines]
    return [", ".join(map(str, line)) + ("," if line is not lines[-1] else "") for line in lines]


def first_cells(mesh):
    """Element numbers of the first half of the cells."""
    numbers = np.sort(np.concatenate(list(mesh.number.values())))
    return numbers[: len(numbers) // 2]


# ---- Abaqus --------------------------------------------------------------------------------------


def abaqus_flat(mesh):
    """As HyperMesh and CalculiX users write it: sets on the *NODE and *ELEMENT lines, sets of sets,
    GENERATE."""
    middle = len(mesh.node) // 2
    lines = ["** made by a pre-processor", "*HEADING", "a block", "*NODE, NSET=early"]
    lines += [_abaqus_node(mesh, i) for i in range(middle)]
    lines += ["*Node, nset=Late"] + [_abaqus_node(mesh, i) for i in range(middle, len(mesh.node))]
    for kind in mesh.cells:
        lines.append(f"*ELEMENT, TYPE={ABAQUS[kind]}, ELSET=E_{kind}")
        for number, nodes in zip(mesh.number[kind], theirs(mesh, kind), strict=True):
            lines += rows([number, *nodes], 16)
    some = first_cells(mesh)
    clamp = mesh.groups["clamp"]
    lines += [
        "*ELSET, ELSET=all_cells",
        ", ".join(f"E_{k}" for k in mesh.cells),
        '*ELSET, ELSET="some cells", GENERATE',
        f"{some[0]}, {some[-1]}, 1",
        "*NSET, NSET=clamp_a",
        *rows(clamp[::2], 8),
        "*NSET, NSET=clamp_b",
        *rows(clamp[1::2], 8),
        "*NSET, NSET=clamp",
        "clamp_a, CLAMP_B",
        "*NSET, NSET=tip, UNSORTED",
        *rows(mesh.groups["tip"][::-1], 16),
        "*NSET, NSET=every, GENERATE",
        f"{mesh.node[0]}, {mesh.node[-1]}, 3",
        "*NSET, NSET=of_cells, ELSET=some cells",
    ]
    lines += ["*SURFACE, NAME=below, TYPE=ELEMENT", "all_cells, S1"] if len(mesh.cells) == 1 else []
    lines += ["*MATERIAL, NAME=steel", "*ELASTIC", "2.07e5, 0.3", "*BOUNDARY", "clamp, 1, 3", ""]
    return "\n".join(lines)


def _abaqus_node(mesh, i):
    return f"{mesh.node[i]:8d}, {', '.join(f'{x:.17g}' for x in mesh.position[i])}"


def abaqus_cae(mesh, shift=(0.0, 0.0, 0.0)):
    """As Abaqus/CAE writes it: a part, an instance that moves it, sets in the assembly that name
    the instance."""
    lines = [
        "*Heading",
        "** Job name: block",
        "*Preprint, echo=NO, model=NO",
        "*Part, name=Blade",
        "*Node",
    ]
    moved = mesh.position - np.array(shift)
    lines += [
        f"{n:7d}, {', '.join(f'{x:.17g}' for x in p)}"
        for n, p in zip(mesh.node, moved, strict=True)
    ]
    for kind in mesh.cells:
        lines.append(f"*Element, type={ABAQUS[kind]}")
        for number, nodes in zip(mesh.number[kind], theirs(mesh, kind), strict=True):
            lines += rows([number, *nodes], 16)
    lines += [
        "*Nset, nset=Late",
        *rows(mesh.node[len(mesh.node) // 2 :], 16),
        '*Elset, elset="some cells"',
        *rows(first_cells(mesh), 16),
        "*End Part",
        "**",
        "*Assembly, name=Assembly",
        "*Instance, name=Blade-1, part=Blade",
        ", ".join(map(str, shift)),
        "*End Instance",
        "*Node",
        "      1,   9., 9., 9.",
        "*Nset, nset=RP-1",
        " 1,",
        "*Nset, nset=clamp, instance=Blade-1",
        *rows(mesh.groups["clamp"], 16),
        "*Nset, nset=tip, internal, instance=Blade-1",
        *rows(mesh.groups["tip"], 16),
        "*Surface, type=NODE, name=tip_nodes",
        "Blade-1.Late, 1.",
        "*End Assembly",
        "*Step, name=Step-1",
        "*Frequency",
        "10,",
        "*End Step",
        "",
    ]
    return "\n".join(lines)


# ---- Ansys ---------------------------------------------------------------------------------------

# one row of ETBLOCK: in the columns of its format line, and as mapdl-archive 0.4.2 writes it
# (_generate_etblock)
ETBLOCK = {
    "columns": lambda number, routine: f"{number:9d}{routine:9d}" + 18 * f"{0:9d}",
    "blanks": lambda number, routine: f"{number:9d} {routine:3d} " + " ".join(18 * "0") + " 0 0",
}


def ansys(mesh, width=9, etblock=None):
    """As CDWRITE writes it: blocked nodes with trailing zeros left out, SOLID185/186 also for
    wedges and tetrahedra; element types by ET, or in the block that newer releases and
    mapdl-archive write."""
    lines = [
        "/COM,ANSYS RELEASE 2021 R1",
        "/PREP7",
        "/NOPR",
        "*IF,_CDRDOFF,EQ,1,THEN     !if solid model was read in",
        "*ENDIF",
        "ET,        1,185",
        "ET,        2,186",
        "ET,        3,187",
        "KEYOP,     2,  2,        0",
        f"NBLOCK,6,SOLID,{mesh.node[-1]:10d},{len(mesh.node):10d}",
        f"(3i{width},6e21.13e3)",
    ]
    for n, p in zip(mesh.node, mesh.position, strict=True):
        values = [f"{x:21.13E}".replace("E-", "E-0").replace("E+", "E+0") for x in p]
        while values and float(values[-1]) == 0:
            values.pop()
        lines.append(f"{n:{width}d}{0:{width}d}{0:{width}d}" + "".join(v[-21:] for v in values))
    if etblock:
        head = [i for i, line in enumerate(lines) if line.startswith("ET,")]
        types = [
            (int(number), int(routine))
            for _, number, routine in (lines[i].split(",") for i in head)
        ]
        lines[head[0] : head[-1] + 1] = [
            f"ETBLOCK,{len(types):9d},{types[-1][0]:9d}",
            "(2i9,19a9)",
            *(ETBLOCK[etblock](*one) for one in types),
            f"{-1:9d}",
        ]
    count = sum(map(len, mesh.cells.values()))
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{count:10d},{count:10d}", f"(19i{width})"]
    for kind in mesh.cells:
        for number, nodes in zip(mesh.number[kind], theirs(mesh, kind), strict=True):
            routine, nodes = _brick(kind, nodes)
            head = [1 + (kind[:5] == "wedge"), routine, 1, 1, 0, 0, 0, 0, len(nodes), 0, number]
            lines += rows([*head, *nodes[:8]], 19, width) + (
                rows(nodes[8:], 12, width) if len(nodes) > 8 else []
            )
    lines.append(f"{-1:{width}d}")
    for name, kind, members in (
        ("CLAMP", "NODE", mesh.groups["clamp"]),
        ("TIP", "NODE", mesh.groups["tip"]),
        ("LATE", "NODE", mesh.node[len(mesh.node) // 2 :]),
        ("SOME_CELLS", "ELEM", first_cells(mesh)),
    ):
        packed = _ranges(members)
        lines += [
            f"CMBLOCK,{name:8s},{kind},{len(packed):8d}  ! users component definition",
            "(8i10)",
            *rows(packed, 8, 10),
        ]
    lines += [
        "MPDATA,R5.0, 1,EX  ,       1, 1,  207000.000    ,",
        "D,       1,UX,  0.00000000    ,  0.00000000",
        "FINISH",
        "",
    ]
    return "\n".join(lines)


def _brick(kind, n):
    """SOLID186 (or 185) with repeated nodes for wedges; quadratic tetrahedra as SOLID186 too,
    linear ones as 185."""
    if kind == "wedge":
        return 1, [n[0], n[1], n[2], n[2], n[3], n[4], n[5], n[5]]
    if kind == "tetra":
        return 1, [n[0], n[1], n[2], n[2], n[3], n[3], n[3], n[3]]
    if kind == "wedge15":
        i, j, k, m, o, p, ij, jk, ki, mo, op, pm, im, jo, kp = n
        return 2, [i, j, k, k, m, o, p, p, ij, jk, k, ki, mo, op, p, pm, im, jo, kp, kp]
    if kind == "tetra10":
        i, j, k, m, ij, jk, ki, im, jm, km = n
        return 2, [i, j, k, k, m, m, m, m, ij, jk, k, ki, m, m, m, m, im, jm, km, km]
    return (2 if len(n) == 20 else 1), list(n)


def _ranges(members):
    """1 2 3 7 -> 1 -3 7."""
    out = []
    for n in np.sort(members).tolist():
        if len(out) and n == abs(out[-1]) + 1:
            out[-1:] = [-n] if out[-1] < 0 else [out[-1], -n]
        else:
            out.append(n)
    return out


# ---- Nastran -------------------------------------------------------------------------------------

NASTRAN = {"hexahedron20": HEX20_NASTRAN, "wedge15": WEDGE15_NASTRAN, "tetra10": TET10}
CARDS = {
    "tetra": "CTETRA",
    "tetra10": "CTETRA",
    "hexahedron": "CHEXA",
    "hexahedron20": "CHEXA",
    "wedge": "CPENTA",
    "wedge15": "CPENTA",
}


def nastran(mesh, fields="small"):
    """Executive and case control, then bulk data in 'small', 'large' or 'free' fields; sets as
    HyperMesh names them."""
    lines = ["SOL 103", "CEND", "  TITLE = block", "BEGIN BULK", "PARAM,POST,-1"]
    lines += [
        _card(["GRID", n, None, *p.tolist()], fields)
        for n, p in zip(mesh.node, mesh.position, strict=True)
    ]
    chosen = set(first_cells(mesh).tolist())
    for kind in mesh.cells:
        for number, nodes in zip(mesh.number[kind], theirs(mesh, kind, NASTRAN), strict=True):
            card = [CARDS[kind], number, 7 if number in chosen else 8, *nodes]
            lines.append(_card(card, "small" if fields == "large" else fields))
    late = mesh.node[len(mesh.node) // 2 :]
    lines += [
        '$HMSET        1        1 "clamp" 18',
        _card(["SET1", 1, *mesh.groups["clamp"]], "free"),
        '$HMSET        2        1 "tip" 18',
        _card(["SET1", 2, *mesh.groups["tip"]], "small"),
        _card(["SET1", 3, late[0], "THRU", late[-1]], "small"),
        _card(["SPC1", 5, "123456", *mesh.groups["clamp"]], "small"),
        "PSOLID         7       1",
        "MAT1           1  2.07E5             .37.85E-9",
        "ENDDATA",
        "",
    ]
    return "\n".join(lines)


def _card(values, fields):
    """A card with its continuation lines."""
    width, per = {"small": (8, 8), "large": (16, 4), "free": (0, 8)}[fields]
    words = [_field(v, width) for v in values[1:]]
    name = values[0] + ("*" if fields == "large" else "")
    lines = []
    for i in range(0, len(words), per):
        head = name if not i else ("*" if fields == "large" else "+" if i % 16 else "")
        part = words[i : i + per]
        lines.append(
            ",".join([head, *part])
            if fields == "free"
            else f"{head:8s}" + "".join(w.rjust(width) for w in part).rstrip()
        )
    return "\n".join(lines)


def _field(value, width):
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    if not np.isfinite(value):
        return str(value)
    if width == 8:  # Nastran's own short form, 1.25-3
        short = min(
            (f"{value:.{d}e}" for d in range(6, -1, -1)),
            key=lambda t: (len(_short(t)) > 8, -len(t)),
        )
        return _short(short)
    return repr(value) if width != 16 else f"{value:.9E}"


def _short(text):
    mantissa, _, power = text.partition("e")
    mantissa = mantissa if "." in mantissa else mantissa + "."
    return mantissa + (f"{int(power):+d}" if int(power) else "")


# ---- plain, with whatever groups a mesh has ------------------------------------------------------


def plain(mesh):
    """Abaqus text with the mesh's own groups of nodes and cells."""
    lines = ["*NODE", *(_abaqus_node(mesh, i) for i in range(len(mesh.node)))]
    for kind in mesh.cells:
        lines.append(f"*ELEMENT, TYPE={ABAQUS[kind]}")
        for number, nodes in zip(mesh.number[kind], theirs(mesh, kind), strict=True):
            lines += rows([number, *nodes], 16)
    for name, members in mesh.groups.items():
        lines += [f'*NSET, NSET="{name}"', *rows(members, 8)]
    for name, members in mesh.cell_groups.items():
        lines += [f'*ELSET, ELSET="{name}"', *rows(members, 8)]
    return "\n".join([*lines, ""])


def gmsh_text(mesh, version="4.1", names=None):
    """gmsh text of one cell type, groups as points; names {group: name in the file}."""
    ((kind, cells),) = mesh.cells.items()
    types = {
        "tetra": 4,
        "hexahedron": 5,
        "wedge": 6,
        "hexahedron20": 17,
        "hexahedron27": 12,
        "tetra10": 11,
    }
    names = names or {k: k for k in mesh.groups}
    groups = list(mesh.groups)
    head = [f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n$PhysicalNames\n{len(groups) + 1}"]
    head += [f'0 {i} "{names[g]}"' for i, g in enumerate(groups, start=1)] + [
        '3 99 "solid"',
        "$EndPhysicalNames",
    ]
    xyz = [f"{' '.join(f'{x:.17g}' for x in p)}" for p in mesh.position]
    points = [(i, n) for i, g in enumerate(groups, start=1) for n in mesh.groups[g]]
    start = int(max(mesh.number[kind])) + 1
    if version == "2.2":
        body = [
            "$Nodes",
            f"{len(xyz)}",
            *(f"{n} {p}" for n, p in zip(mesh.node, xyz, strict=True)),
            "$EndNodes",
            "$Elements",
            f"{len(cells) + len(points)}",
        ]
        body += [f"{start + k} 15 2 {i} {i} {n}" for k, (i, n) in enumerate(points)]
        body += [
            f"{e} {types[kind]} 2 99 1 {' '.join(map(str, mesh.node[c]))}"
            for e, c in zip(mesh.number[kind], cells, strict=True)
        ]
        return "\n".join([*head, *body, "$EndElements", ""])
    body = [
        "$Entities",
        f"{len(groups)} 0 0 1",
        *(f"{i} 0 0 0 1 {i}" for i in range(1, len(groups) + 1)),
        "1 0 0 0 1 1 1 1 99 0",
        "$EndEntities",
        "$Nodes",
        f"1 {len(xyz)} {mesh.node[0]} {mesh.node[-1]}",
        f"3 1 0 {len(xyz)}",
        *map(str, mesh.node),
        *xyz,
        "$EndNodes",
        "$Elements",
        f"{len(groups) + 1} {len(cells) + len(points)} 1 {start + len(points)}",
    ]
    k = start
    for i, g in enumerate(groups, start=1):
        body.append(f"0 {i} 15 {len(mesh.groups[g])}")
        body += [f"{k + j} {n}" for j, n in enumerate(mesh.groups[g])]
        k += len(mesh.groups[g])
    body.append(f"3 1 {types[kind]} {len(cells)}")
    body += [
        f"{e} {' '.join(map(str, mesh.node[c]))}"
        for e, c in zip(mesh.number[kind], cells, strict=True)
    ]
    return "\n".join([*head, *body, "$EndElements", ""])
