"""Meshes of any cell types, mixed as well, in the formats of gmsh: by our own hand, and as gmsh
writes them again."""

import tempfile
from pathlib import Path

from tests.tipdamp.mesh_texts import first_cells

GMSH = {
    "tetra": 4,
    "hexahedron": 5,
    "wedge": 6,
    "tetra10": 11,
    "hexahedron27": 12,
    "hexahedron20": 17,
    "wedge15": 18,
}


def text(mesh):
    """Version 2.2: node groups as points, every cell in one of two groups. The node order is our
    own."""
    some = first_cells(mesh)
    groups = {
        "clamp": mesh.groups["clamp"],
        "tip": mesh.groups["tip"],
        "late": mesh.node[len(mesh.node) // 2 :],
    }
    lines = [
        "$MeshFormat",
        "2.2 0 8",
        "$EndMeshFormat",
        "$PhysicalNames",
        "5",
        '3 8 "some cells"',
        '3 9 "other cells"',
        *(f'0 {i} "{name}"' for i, name in enumerate(groups, 1)),
        "$EndPhysicalNames",
        "$Nodes",
        str(len(mesh.node)),
        *(
            f"{n} {x:.17g} {y:.17g} {z:.17g}"
            for n, (x, y, z) in zip(mesh.node, mesh.position, strict=True)
        ),
        "$EndNodes",
        "$Elements",
    ]
    elements = [
        f"{e} {GMSH[kind]} 2 {8 if e in some else 9} {8 if e in some else 9} "
        f"{' '.join(map(str, nodes))}"
        for kind in mesh.cells
        for e, nodes in zip(mesh.number[kind], mesh.node[mesh.cells[kind]], strict=True)
    ]
    last = max(v.max() for v in mesh.number.values())
    for i, nodes in enumerate(groups.values(), 1):
        elements += [f"{last + k} 15 2 {i} {i} {n}" for k, n in enumerate(nodes, 1)]
        last += len(nodes)
    return "\n".join([*lines, str(len(elements)), *elements, "$EndElements", ""])


def rewritten(mesh, version, binary):
    """The same as gmsh itself writes it, bytes."""
    import gmsh

    with tempfile.TemporaryDirectory() as folder:
        one, two = (str(Path(folder, name)) for name in ("one.msh", "two.msh"))
        Path(one).write_text(text(mesh))
        gmsh.initialize(readConfigFiles=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.open(one)
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(two)
        finally:
            gmsh.finalize()
        return Path(two).read_bytes()
