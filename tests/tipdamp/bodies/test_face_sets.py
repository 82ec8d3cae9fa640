"""Surfaces that a file lists face by face are those faces in every format, also where their nodes
alone hold more."""

import numpy as np
import pytest

from tests.modal.blocks import HEIGHT, LENGTH, WIDTH, block
from tests.tipdamp import gmsh_files, mesh_texts
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.faces import boundary_faces, face_keys, group_faces
from tipdamp.modal.loads import pressure, traction
from tipdamp.readers.abaqus_sets import SOLID
from tipdamp.readers.dispatch import read_mesh

STEEL = Material(E=207e9, nu=0.3, density=7850.0)
SOLIDS = {own: (nodes, faces) for nodes, (own, _, faces) in SOLID.items()}
FIRST = 900  # number of the first added element


def above_and_below(mesh):
    """Node numbers (f, k) of the faces at z = 0 and z = HEIGHT; in a block one cell high their
    nodes are all nodes."""
    z = mesh.position[:, 2]
    (faces,) = boundary_faces(mesh)
    flat = [np.abs(z[faces] - level).max(axis=1) < 1e-9 for level in (0.0, HEIGHT)]
    return mesh.node[faces[flat[0] | flat[1]]]


def abaqus(mesh, faces):
    """*SURFACE of element faces S1, S2, ..."""
    (kind,) = mesh.cells
    wanted, lines = {tuple(k) for k in face_keys(faces).tolist()}, []
    for number, cell in zip(mesh.number[kind], mesh.node[mesh.cells[kind]], strict=True):
        for i, corners in enumerate(SOLIDS[kind][1], start=1):
            if tuple(face_keys(cell[None, list(corners)])[0].tolist()) in wanted:
                lines.append(f"{number}, S{i}")
    assert len(lines) == len(faces)
    return mesh_texts.plain(mesh) + "\n".join(["*SURFACE, NAME=skin", *lines, ""])


def gmsh(mesh, faces):
    """Elements of a physical surface."""
    text = gmsh_files.text(mesh).replace("$PhysicalNames\n5", '$PhysicalNames\n6\n2 7 "skin"')
    head, solids = text.split("$Elements\n")
    count, body = solids.split("\n", 1)
    kind = {3: 2, 4: 3, 6: 9, 8: 16}[faces.shape[1]]
    added = [
        f"{FIRST + i} {kind} 2 7 7 {' '.join(map(str, face))}\n" for i, face in enumerate(faces)
    ]
    return f"{head}$Elements\n{int(count) + len(faces)}\n{''.join(added)}{body}"


def ansys(mesh, faces):
    """SURF154 with its corners, K = L on triangles, in a component."""
    count = sum(map(len, mesh.cells.values()))
    text = mesh_texts.ansys(mesh).replace("NBLOCK", "ET,        9,154\nNBLOCK", 1)
    text = text.replace(
        f"SOLID,{count:10d},{count:10d}", f"SOLID,{count + len(faces):10d},{count + len(faces):10d}"
    )
    rows = [
        [
            1,
            9,
            1,
            1,
            0,
            0,
            0,
            0,
            4,
            0,
            FIRST + i,
            *(*face[:3], face[2 if len(face) in (3, 6) else 3]),
        ]
        for i, face in enumerate(faces)
    ]
    block = "".join("".join(f"{v:9d}" for v in row) + "\n" for row in rows)
    end = f"{-1:9d}\nCMBLOCK"
    component = f"CMBLOCK,skin,ELEM,2\n(8i10)\n{FIRST:10d}{-(FIRST + len(faces) - 1):10d}\n"
    return text.replace(end, f"{block}{-1:9d}\n{component}CMBLOCK", 1)


def nastran(mesh, faces):
    """Shells of a property of their own."""
    card = {3: "CTRIA3", 4: "CQUAD4", 6: "CTRIA6", 8: "CQUAD8"}[faces.shape[1]]
    cards = [mesh_texts._card([card, FIRST + i, 99, *face], "free") for i, face in enumerate(faces)]
    return mesh_texts.nastran(mesh, "free").replace("ENDDATA", "\n".join([*cards, "ENDDATA"]))


FORMATS = {
    "abaqus": (abaqus, ".inp", "skin"),
    "gmsh": (gmsh, ".msh", "skin"),
    "ansys": (ansys, ".cdb", "skin"),
    "nastran": (nastran, ".bdf", "pid_99"),
}


@pytest.mark.parametrize("style", FORMATS)
@pytest.mark.parametrize("kind", ["hexahedron", "hexahedron20", "tetra10"])
def test_faces_of_a_surface(tmp_path, kind, style):
    """The faces themselves, and the load of a pressure on them: none on what lies between them."""
    mesh = block(kind, (4, 2, 1))
    faces = above_and_below(mesh)
    write, end, name = FORMATS[style]
    (tmp_path / f"b{end}").write_text(write(mesh, faces))
    other = read_mesh(tmp_path / f"b{end}")
    assert other.dimension[name] == 2 and len(other.face_groups[name]) == len(faces)
    (found,) = group_faces(other, name)
    assert {tuple(k) for k in face_keys(other.node[found]).tolist()} == {
        tuple(k) for k in face_keys(faces).tolist()
    }
    body = elastic_body(other, STEEL, "b", free=True)
    area = LENGTH * WIDTH
    assert pressure(body, other, name, 5.0).reshape(-1, 3).sum(axis=0) == pytest.approx(
        [0, 0, 0], abs=1e-12
    )
    assert traction(body, other, name, [1.0, 0, 0]).sum() == pytest.approx(2 * area, rel=1e-9)


def test_nodes_without_faces_keep_their_meaning(tmp_path):
    """A group of nodes alone: the faces whose nodes all belong to it."""
    mesh = block("hexahedron20")
    (tmp_path / "b.inp").write_text(mesh_texts.plain(mesh))
    other = read_mesh(tmp_path / "b.inp")
    (found,) = group_faces(other, "tip")
    assert len(found) == 4 and "tip" not in other.face_groups
    assert (
        np.abs(other.position[found][..., 0] - LENGTH).max() < 1e-9
        and CELLS["hexahedron20"].nodes == 20
    )
