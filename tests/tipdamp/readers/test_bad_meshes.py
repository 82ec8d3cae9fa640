"""Damaged files and numbers, by the rows of the catalogue of bad inputs (a01, a02, ...): each has
its one answer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.modal.blocks import block
from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.bad_meshes import WRITERS, every_format, inspect, refused, rewritten, write
from tipdamp.hbm.errors import InputError
from tipdamp.readers.dispatch import FORMATS, read_mesh

# ---- the file itself -----------------------------------------------------------------------------


def test_a01_missing_folder_unreadable(tmp_path, monkeypatch, capsys):
    message = refused(tmp_path / "none.msh", "no such file")
    assert str(tmp_path) in message
    (tmp_path / "folder.msh").mkdir()
    refused(tmp_path / "folder.msh", "is a folder")
    (tmp_path / "mesh.stl").write_text("solid")
    refused(tmp_path / "mesh.stl", "type '.stl' are not read; .*valid: .msh, .inp, .cdb")
    path = corner_study.write(tmp_path, change=[('"blades.inp"', '"blade.inp"')])
    code, error, _ = inspect(path, capsys)
    assert (
        code == 2
        and "[blades] mesh = 'blade.inp'" in error
        and f"looked for in {tmp_path}" in error
    )
    (tmp_path / "locked.msh").write_text("x")

    def locked(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", locked)
    refused(tmp_path / "locked.msh", "cannot be read: Permission denied")


@pytest.mark.parametrize("end", FORMATS)
@pytest.mark.parametrize("text", ["", "\n \n"])
def test_a02_empty_file(tmp_path, end, text):
    path = tmp_path / f"empty{end}"
    path.write_text(text)
    refused(path, "is empty: it holds no nodes")


@every_format
def test_a03_cut_off_anywhere(tmp_path, end):
    """Cut at 60 places. Only a cut that takes nothing away is read, except that Abaqus' flat form
    and Ansys' archive have no end mark: there a cut right at a line's end, behind the cells, leaves
    whole cells."""
    mesh = block("hexahedron20", (2, 1, 1)) if "msh" not in end else block("hexahedron", (2, 2, 1))
    whole = write(tmp_path, end, mesh).read_bytes()
    path = tmp_path / f"cut{end}"
    refusals = 0
    for cut in np.linspace(1, len(whole.rstrip()) - 1, 60).astype(int):
        path.write_bytes(whole[:cut])
        try:
            found = read_mesh(path)
        except InputError as error:
            refusals += 1
            assert "\n" not in str(error)
            continue
        line_end = (
            whole[cut - 1 : cut + 1].count(b"\n") > 0 or b"*" in whole[:cut].rpartition(b"\n")[2]
        )
        behind = cut > whole.rfind(b"C3D" if end == ".inp" else b"EBLOCK")
        assert end in (".inp", ".cdb") and (line_end or end == ".cdb") and behind, whole[
            max(0, cut - 60) : cut
        ]
        assert all(np.array_equal(found.cells[k], c) for k, c in mesh.cells.items())
        assert end != ".cdb" or any("FINISH" in w for w in found.warnings)
    assert refusals >= (45 if end in (".inp", ".cdb") else 60)


def test_a03_binary_gmsh_cut_off(tmp_path):
    gmsh = pytest.importorskip("gmsh")
    source, path = tmp_path / "text.msh", tmp_path / "cut.msh"
    source.write_text(mesh_texts.gmsh_text(block("hexahedron")))
    for version in (2.2, 4.1):
        whole = rewritten(gmsh, source, tmp_path / "whole.msh", version, 1)
        for cut in np.linspace(1, len(whole.rstrip()) - 1, 40).astype(int):
            path.write_bytes(whole[:cut])
            refused(path, "cut off|not a gmsh file|does not begin|no nodes|empty|binary")


# ---- numbers -------------------------------------------------------------------------------------


@every_format
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a04_coordinate_that_is_not_finite(tmp_path, end, value):
    mesh = block("hexahedron")
    mesh.position[7, 2] = value
    refused(
        write(tmp_path, end, mesh),
        f"node {mesh.node[7]} has a coordinate that is not a finite number",
    )


@every_format
def test_a05_absent_node(tmp_path, end):
    """The last node's line names another number: the elements that use it point to nothing."""
    mesh = block("hexahedron")
    gone = int(mesh.node[-1])
    path = write(
        tmp_path,
        end,
        replace(mesh, groups={"clamp": mesh.groups["clamp"], "tip": mesh.groups["clamp"]}),
    )
    renamed = replace(
        mesh,
        node=np.append(mesh.node[:-1], gone + 1),
        groups={"clamp": mesh.groups["clamp"], "tip": mesh.groups["clamp"]},
    )
    good, bad = path.read_text(), WRITERS[end](renamed)
    # nodes of the renamed mesh, elements of the first
    cut = {
        ".msh": "$Elements",
        ".2.msh": "$Elements",
        ".inp": "*ELEMENT",
        ".cae.inp": "*Element",
        ".cdb": "EBLOCK",
        ".bdf": "CHEXA",
        ".free.bdf": "CHEXA",
    }[end]
    path.write_text(bad[: bad.index(cut)] + good[good.index(cut) :])
    element = mesh.number["hexahedron"][-1]
    refused(path, f"element {element} refers to node {gone}, which does not exist")


@every_format
def test_a06_inside_out_cells_are_turned_around(tmp_path, end):
    mesh = block("hexahedron")
    wrong = replace(mesh, cells={"hexahedron": mesh.cells["hexahedron"].copy()})
    wrong.cells["hexahedron"][3] = wrong.cells["hexahedron"][3][[4, 5, 6, 7, 0, 1, 2, 3]]
    found = read_mesh(write(tmp_path, end, wrong))
    number = mesh.number["hexahedron"][3]
    assert any(
        "1 hexahedron cells were numbered inside out (negative volume) and turned around: "
        f"elements {number}" in w
        for w in found.warnings
    )
    from tipdamp.modal.elements.cells import smallest_jacobians

    assert (
        smallest_jacobians("hexahedron", found.position, found.cells["hexahedron"])[:, 0].min() > 0
    )


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron20", "wedge", "wedge15"])
def test_a06_all_types_are_turned_around(tmp_path, kind):
    """A mirrored mesh has only inside-out cells; turned around it has the same volume."""
    mesh = block(kind, (2, 1, 1))
    mirrored = replace(mesh, position=mesh.position * [1, 1, -1])
    found = read_mesh(write(tmp_path, ".inp", mirrored))
    assert any(
        f"{len(mesh.cells[kind])} {kind} cells were numbered inside out" in w
        for w in found.warnings
    )
    from tipdamp.modal.elements.isoparametric import stiffness_and_mass

    M = stiffness_and_mass(found.position, kind, found.cells[kind], 1.0, 1.0, 1.0)[1]
    assert M.sum() / 3 == pytest.approx(0.1 * 0.02 * 0.01, rel=1e-9)


def test_a06_folded_cell(tmp_path):
    """Two corners exchanged: neither orientation is right everywhere."""
    mesh = block("hexahedron")
    mesh.cells["hexahedron"][5, :2] = mesh.cells["hexahedron"][5, 1::-1]
    refused(
        write(tmp_path, ".inp", mesh),
        r"1 hexahedron cells are inverted or flat .*Jacobian -.*elements 6,",
    )


@every_format
def test_a07_flat_cell(tmp_path, end):
    mesh = block("hexahedron", (2, 1, 1))
    mesh.position[:, 2] = np.where(mesh.position[:, 0] < 0.06, 0.0, mesh.position[:, 2])
    refused(
        write(tmp_path, end, mesh), r"cells are inverted or flat \(smallest Jacobian .*elements 1,"
    )


@pytest.mark.parametrize("end", [".msh", ".2.msh", ".inp", ".bdf"])
def test_a07_node_twice_in_a_cell(tmp_path, end):
    mesh = block("hexahedron")
    mesh.cells["hexahedron"][2, 0] = mesh.cells["hexahedron"][2, 1]
    refused(write(tmp_path, end, mesh), "1 hexahedron cells name a node twice .*: elements 3")


def test_a07_cell_twice(tmp_path):
    """Twice the same nodes would count twice in K and M: taken once, and said."""
    mesh = block("hexahedron")
    cells = mesh.cells["hexahedron"]
    double = replace(
        mesh,
        cells={"hexahedron": np.vstack([cells, cells[:2]])},
        number={"hexahedron": np.append(mesh.number["hexahedron"], [900, 901])},
    )
    found = read_mesh(write(tmp_path, ".inp", double))
    assert len(found.cells["hexahedron"]) == len(cells) and any(
        "2 hexahedron cells are in the file twice" in w for w in found.warnings
    )


@pytest.mark.parametrize(
    "end, old, new, message",
    [
        (".2.msh", "$Nodes\n45", "$Nodes\n-45", "a count must not be negative"),
        (".2.msh", "$Elements\n", "$Elements\n-", "says that it holds -"),
        (".msh", "3 1 0 45", "3 1 0 -45", "a count must not be negative|more entries than it says"),
        (
            ".cdb",
            "SOLID,       142,        45",
            "SOLID,       142,       -45",
            "NBLOCK says -45 entries",
        ),
    ],
)
def test_a09_negative_count(tmp_path, end, old, new, message):
    path = write(tmp_path, end, block("hexahedron"))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    refused(path, message)


def test_a09_count_larger_than_any_memory(tmp_path):
    path = write(tmp_path, ".2.msh", block("hexahedron"))
    path.write_text(path.read_text().replace("$Nodes\n45", "$Nodes\n4500000000000"))
    refused(path, "ends before all its entries are there")
