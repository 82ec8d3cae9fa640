"""Damaged and doubtful meshes, by the rows of the catalogue of bad inputs (a01, a02, ...): each has its one answer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hbm.errors import InputError
from modal import memory
from modal.mesh import Mesh
from tests.modal.blocks import block, mixture
from tests.tipdamp import corner_study, mesh_texts
from tipdamp.cli import main
from tipdamp.readers.dispatch import FORMATS, read_mesh

WRITERS = {".msh": mesh_texts.gmsh_text, ".2.msh": lambda m: mesh_texts.gmsh_text(m, "2.2"),
           ".inp": mesh_texts.abaqus_flat, ".cae.inp": mesh_texts.abaqus_cae, ".cdb": mesh_texts.ansys,
           ".bdf": mesh_texts.nastran, ".free.bdf": lambda m: mesh_texts.nastran(m, "free")}
every_format = pytest.mark.parametrize("end", WRITERS)


def write(tmp_path, end, mesh):
    path = tmp_path / f"b{end}"
    path.write_text(WRITERS[end](mesh))
    return path


def refused(path, pattern):
    with pytest.raises(InputError, match=pattern) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value) and path.name in str(caught.value)
    return str(caught.value)


def inspect(path, capsys):
    """Exit code, standard error, and the warnings that are printed, at least those of inspect.json (None when it
    failed)."""
    code = main(["inspect", str(path), "--quiet"])
    out, error = capsys.readouterr()
    result = path.parent / "results" / "corner" / "inspect.json"
    if code:
        assert not result.exists() and error.count("\n") == 1
        return code, error, None
    printed = [line.removeprefix("warning: ") for line in out.splitlines() if line.startswith("warning: ")]
    kept = json.loads(result.read_text())["warnings"]
    assert [w[:60] for w in printed[:len(kept)]] == [w[:60] for w in kept]
    return code, error, printed


# ---- the file itself -------------------------------------------------------------------------------------------

def test_a01_missing_folder_unreadable(tmp_path, monkeypatch, capsys):
    message = refused(tmp_path / "none.msh", "no such file")
    assert str(tmp_path) in message
    (tmp_path / "folder.msh").mkdir()
    refused(tmp_path / "folder.msh", "is a folder")
    (tmp_path / "mesh.stl").write_text("solid")
    refused(tmp_path / "mesh.stl", "type '.stl' are not read; .*valid: .msh, .inp, .cdb")
    path = corner_study.write(tmp_path, change=[('"blades.inp"', '"blade.inp"')])
    code, error, _ = inspect(path, capsys)
    assert code == 2 and "[blades] mesh = 'blade.inp'" in error and f"looked for in {tmp_path}" in error
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
    """Cut at 60 places. Only a cut that takes nothing away is read, except that Abaqus' flat form and Ansys' archive
    have no end mark: there a cut right at a line's end, behind the cells, leaves whole cells."""
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
        line_end = whole[cut - 1:cut + 1].count(b"\n") > 0 or b"*" in whole[:cut].rpartition(b"\n")[2]
        behind = cut > whole.rfind(b"C3D" if end == ".inp" else b"EBLOCK")
        assert end in (".inp", ".cdb") and (line_end or end == ".cdb") and behind, whole[max(0, cut - 60):cut]
        assert all(np.array_equal(found.cells[k], c) for k, c in mesh.cells.items())
        assert end != ".cdb" or any("FINISH" in w for w in found.warnings)
    assert refusals >= (45 if end in (".inp", ".cdb") else 60)


def test_a03_binary_gmsh_cut_off(tmp_path):
    gmsh = pytest.importorskip("gmsh")
    source, path = tmp_path / "text.msh", tmp_path / "cut.msh"
    source.write_text(mesh_texts.gmsh_text(block("hexahedron")))
    for version in (2.2, 4.1):
        whole = _rewritten(gmsh, source, tmp_path / "whole.msh", version, 1)
        for cut in np.linspace(1, len(whole.rstrip()) - 1, 40).astype(int):
            path.write_bytes(whole[:cut])
            refused(path, "cut off|not a gmsh file|does not begin|no nodes|empty|binary")


# ---- numbers ---------------------------------------------------------------------------------------------------

@every_format
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a04_coordinate_that_is_not_finite(tmp_path, end, value):
    mesh = block("hexahedron")
    mesh.position[7, 2] = value
    refused(write(tmp_path, end, mesh), f"node {mesh.node[7]} has a coordinate that is not a finite number")


@every_format
def test_a05_absent_node(tmp_path, end):
    """The last node's line names another number: the elements that use it point to nothing."""
    mesh = block("hexahedron")
    gone = int(mesh.node[-1])
    path = write(tmp_path, end, replace(mesh, groups={"clamp": mesh.groups["clamp"], "tip": mesh.groups["clamp"]}))
    renamed = replace(mesh, node=np.append(mesh.node[:-1], gone + 1),
                      groups={"clamp": mesh.groups["clamp"], "tip": mesh.groups["clamp"]})
    good, bad = path.read_text(), WRITERS[end](renamed)
    # nodes of the renamed mesh, elements of the first
    cut = {".msh": "$Elements", ".2.msh": "$Elements", ".inp": "*ELEMENT", ".cae.inp": "*Element", ".cdb": "EBLOCK",
           ".bdf": "CHEXA", ".free.bdf": "CHEXA"}[end]
    path.write_text(bad[:bad.index(cut)] + good[good.index(cut):])
    element = mesh.number["hexahedron"][-1]
    refused(path, f"element {element} refers to node {gone}, which does not exist")


@every_format
def test_a06_inside_out_cells_are_turned_around(tmp_path, end):
    mesh = block("hexahedron")
    wrong = replace(mesh, cells={"hexahedron": mesh.cells["hexahedron"].copy()})
    wrong.cells["hexahedron"][3] = wrong.cells["hexahedron"][3][[4, 5, 6, 7, 0, 1, 2, 3]]
    found = read_mesh(write(tmp_path, end, wrong))
    number = mesh.number["hexahedron"][3]
    assert any(f"1 hexahedron cells were numbered inside out (negative volume) and turned around: elements "
               f"{number}" in w
               for w in found.warnings)
    from modal.cells import smallest_jacobians

    assert smallest_jacobians("hexahedron", found.position, found.cells["hexahedron"])[:, 0].min() > 0


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron20", "wedge", "wedge15"])
def test_a06_all_types_are_turned_around(tmp_path, kind):
    """A mirrored mesh has only inside-out cells; turned around it has the same volume."""
    mesh = block(kind, (2, 1, 1))
    mirrored = replace(mesh, position=mesh.position * [1, 1, -1])
    found = read_mesh(write(tmp_path, ".inp", mirrored))
    assert any(f"{len(mesh.cells[kind])} {kind} cells were numbered inside out" in w for w in found.warnings)
    from modal.isoparametric import stiffness_and_mass

    M = stiffness_and_mass(found.position, kind, found.cells[kind], 1.0, 1.0, 1.0)[1]
    assert M.sum() / 3 == pytest.approx(0.1 * 0.02 * 0.01, rel=1e-9)


def test_a06_folded_cell(tmp_path):
    """Two corners exchanged: neither orientation is right everywhere."""
    mesh = block("hexahedron")
    mesh.cells["hexahedron"][5, :2] = mesh.cells["hexahedron"][5, 1::-1]
    refused(write(tmp_path, ".inp", mesh), r"1 hexahedron cells are inverted or flat .*Jacobian -.*elements 6,")


@every_format
def test_a07_flat_cell(tmp_path, end):
    mesh = block("hexahedron", (2, 1, 1))
    mesh.position[:, 2] = np.where(mesh.position[:, 0] < 0.06, 0.0, mesh.position[:, 2])
    refused(write(tmp_path, end, mesh), r"cells are inverted or flat \(smallest Jacobian .*elements 1,")


@pytest.mark.parametrize("end", [".msh", ".2.msh", ".inp", ".bdf"])
def test_a07_node_twice_in_a_cell(tmp_path, end):
    mesh = block("hexahedron")
    mesh.cells["hexahedron"][2, 0] = mesh.cells["hexahedron"][2, 1]
    refused(write(tmp_path, end, mesh), "1 hexahedron cells name a node twice .*: elements 3")


def test_a07_cell_twice(tmp_path):
    """Twice the same nodes would count twice in K and M: taken once, and said."""
    mesh = block("hexahedron")
    cells = mesh.cells["hexahedron"]
    double = replace(mesh, cells={"hexahedron": np.vstack([cells, cells[:2]])},
                     number={"hexahedron": np.append(mesh.number["hexahedron"], [900, 901])})
    found = read_mesh(write(tmp_path, ".inp", double))
    assert len(found.cells["hexahedron"]) == len(cells) and any("2 hexahedron cells are in the file twice" in w
                                                                for w in found.warnings)


@pytest.mark.parametrize("end, old, new, message", [
    (".2.msh", "$Nodes\n45", "$Nodes\n-45", "a count must not be negative"),
    (".2.msh", "$Elements\n", "$Elements\n-", "says that it holds -"),
    (".msh", "3 1 0 45", "3 1 0 -45", "a count must not be negative|more entries than it says"),
    (".cdb", "SOLID,       142,        45", "SOLID,       142,       -45", "NBLOCK says -45 entries"),
])
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


# ---- groups ----------------------------------------------------------------------------------------------------

def test_a10_group_misspelt(tmp_path, capsys):
    path = corner_study.write(tmp_path, change=[('damper = "face_x"', 'damper = "facex"')])
    code, error, _ = inspect(path, capsys)
    assert code == 2
    assert ("[contact.one] damper: damper.inp: no group 'facex'; did you mean 'face_x'? valid: face_x, face_z, load"
            in error)


def test_a11_group_empty_or_of_the_wrong_dimension(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    text = (tmp_path / "damper.inp").read_text()
    (tmp_path / "damper.inp").write_text(text.replace('*NSET, NSET="load"', '*NSET, NSET="load"\n*NSET, NSET=other'))
    code, error, _ = inspect(path, capsys)
    assert code == 2 and "group 'load' is empty: it holds nodes (dimension 0) with 0 nodes" in error
    whole = replace(corner_study.damper(), cell_groups={"everything": np.arange(1, 9)})
    path = corner_study.write(tmp_path, damper_mesh=whole, change=[('damper = "face_x"', 'damper = "everything"')])
    code, error, _ = inspect(path, capsys)
    assert code == 2 and ("group 'everything' holds a volume (dimension 3) with 27 nodes; wanted: nodes or a surface"
                          in error)


def test_a11_line_instead_of_a_surface():
    mesh = replace(block("hexahedron"), dimension={"tip": 1})
    with pytest.raises(InputError, match=r"'tip' holds a curve \(dimension 1\) with 9 nodes; wanted: nodes or a"):
        mesh.group("tip", (0, 2))


# ---- units, pieces, pairs --------------------------------------------------------------------------------------

@pytest.mark.parametrize("factor, unit, phrases", [
    (1e3, "m", ("mesh is 20 m in size", "blades: its mass is 1.05e+07 kg", "first natural frequency between")),
    (1.0, "mm", ("blades: the mesh is 2e-05 m in size", "damper: its mass is 7.85e-12 kg",
                 "first natural frequency between")),
])
def test_a13_mesh_in_another_unit(tmp_path, capsys, factor, unit, phrases):
    """Coordinates in mm with a study in m, and the reverse: size, mass and frequency all say the factor 1000."""
    meshes = [replace(m, position=m.position * factor) for m in (corner_study.blades(), corner_study.damper())]
    change = [("[material]", f'[units]\nlength = "{unit}"\n[material]')]
    if factor > 1:  # the study is in m; a tolerance that suits its mesh
        change.append(("[contact]", "[contact]\ntolerance = 1e-3"))
    code, _, warnings = inspect(corner_study.write(tmp_path, *meshes, change), capsys)
    assert code == 0
    for phrase in phrases:
        found = [w for w in warnings if phrase in w]
        assert found and "factor of 1000" in found[0]


@pytest.mark.parametrize("old, new", [("density = 7850", "density = 7.85e-9"), ("E = 207e9", "E = 207e3")])
def test_a13_material_in_another_unit(tmp_path, capsys, old, new):
    code, _, warnings = inspect(corner_study.write(tmp_path, change=[(old, new)]), capsys)
    assert code == 0 and any("sqrt(E/density)" in w and "factor of 1000" in w for w in warnings)


def test_a13_nothing_to_warn_of_and_the_study_may_widen_the_range(tmp_path, capsys):
    _, _, warnings = inspect(corner_study.write(tmp_path), capsys)
    assert len(warnings) == 1 and "2 pieces" in warnings[0]  # two blades without a common foot
    soft = [("E = 207e9", "E = 3e9\nwave_speed = [500, 7000]"), ("density = 7850", "density = 1200"),
            ("band = [20000, 40000]", "band = [2000, 4000]")]
    _, _, warnings = inspect(corner_study.write(tmp_path, change=soft), capsys)
    assert len(warnings) == 1


def test_a13_contact_stiffer_than_two_half_spaces(tmp_path, capsys):
    """kn in N/mm where N/m is meant, or the other way: above the smooth half-spaces of that side. Steel, the flat 10 mm
    square of the corner: a circle of the same area, a = 5.64 mm, has 2 a E* = 1.28e9 N/m, a square 1 % more."""
    _, _, warnings = inspect(corner_study.write(tmp_path, change=[("kn = 1e6", "kn = 1e9")]), capsys)
    found = [w for w in warnings if "half-spaces" in w]
    assert len(found) == 1 and found[0].startswith("[contact.one] kn = 1e+09 N/m on 9 nodes is 9e+09 N/m")
    bound = float(found[0].split(" N/m), and real")[0].rpartition("(")[2])
    assert 1.28e9 < bound < 1.32e9


def test_a14_pull_direction_turned_round(tmp_path, capsys):
    code, _, warnings = inspect(corner_study.write(tmp_path, change=[("[1, 0, 1]", "[-1, 0, -1]")]), capsys)
    assert code == 0 and any(w.startswith("pull_direction = [-0.7071, 0.0, -0.7071]: side 'one' would have to pull the "
                                          "damper") for w in warnings)


def test_a14_two_pieces(tmp_path, capsys):
    code, _, warnings = inspect(corner_study.write(tmp_path), capsys)
    assert code == 0 and "blades: the mesh consists of 2 pieces that share no node (of 27, 27 nodes)" in warnings[0]
    (tmp_path / "results" / "corner" / "inspect.json").unlink()
    path = corner_study.write(tmp_path, change=[('["clamp_one", "clamp_two"]', '"clamp_one"')])
    code, error, _ = inspect(path, capsys)
    assert code == 2 and "6 rigid motions are free" in error and "consists of 2 pieces that share no node" in error


@every_format
def test_a15_hanging_nodes_are_dropped(tmp_path, end):
    """Nodes without a cell make K singular: they are left out and counted, in groups too."""
    mesh = block("hexahedron")
    more = replace(mesh, node=np.append(mesh.node, [9001, 9002]), position=np.vstack([mesh.position, np.ones((2, 3))]),
                   groups={**mesh.groups, "tip": np.append(mesh.groups["tip"], 9001)})
    found = read_mesh(write(tmp_path, end, more))
    assert np.array_equal(found.node, mesh.node)
    assert "2 nodes that no solid cell uses" in found.unused
    assert len(next(v for k, v in found.groups.items() if k.lower() == "tip")) == len(mesh.groups["tip"])


def test_a19_overlap_larger_than_the_elements_is_no_match(tmp_path, capsys):
    deep = corner_study.damper()
    deep.position[np.isin(deep.node, deep.groups["face_x"]), 0] += 6e-3
    change = [("[contact]", "[contact]\ntolerance = 8e-3")]
    code, error, _ = inspect(corner_study.write(tmp_path, damper_mesh=deep, change=change), capsys)
    assert code == 2 and "3 share their nearest partner with another: the two surfaces need the same nodes" in error


@pytest.fixture
def nothing_is_assembled(monkeypatch):
    """What is wrong with pairs and loads is answered before anything heavy is done."""
    def heavy(*_, **__):
        raise AssertionError("a body was assembled")

    monkeypatch.setattr("modal.elasticity.elastic_body", heavy)


def test_load_cases_are_checked_by_inspect(tmp_path, capsys, nothing_is_assembled):
    change = [("[respond]", '[loads.gas]\nforces = [["blades", "touch_on", 1, 0, 0]]\n[respond]')]
    code, error, _ = inspect(corner_study.write(tmp_path, change=change), capsys)
    assert code == 2 and "[loads.gas] forces" in error and "did you mean 'touch_one'" in error


def test_a16_surfaces_that_do_not_match(tmp_path, capsys, nothing_is_assembled):
    shifted = corner_study.damper(at=(0.0, 3e-4, 0.0))
    code, error, _ = inspect(corner_study.write(tmp_path, damper_mesh=shifted), capsys)
    assert code == 2 and "18 without a partner within 1e-06 m (largest distance 0.0003 m)" in error
    assert "tolerance = 0.00033 m would match them" in error


def test_a18_normals_that_point_the_same_way(tmp_path, capsys, nothing_is_assembled):
    """The damper lies inside blade one: its face x = A is blade one's own."""
    inside = corner_study.cube(at=(corner_study.A, 0, 0))
    groups = {"face_x": corner_study.on(inside, 0, corner_study.A),
              "face_z": corner_study.on(inside, 2, corner_study.A), "load": inside.node[:3]}
    code, error, _ = inspect(corner_study.write(tmp_path, damper_mesh=replace(inside, groups=groups)), capsys)
    assert code == 2 and "normals of the two faces must oppose each other" in error


def test_a19_overlap_nearly_as_large_as_the_elements(tmp_path, capsys):
    """4 mm on nodes 5 mm apart: touching by default, and said; or taken as a (negative) gap when the study asks."""
    deep = corner_study.damper()
    deep.position[np.isin(deep.node, deep.groups["face_x"]), 0] += 4e-3
    change = [("[contact]", "[contact]\ntolerance = 4.5e-3")]
    code, _, warnings = inspect(corner_study.write(tmp_path, damper_mesh=deep, change=change), capsys)
    found = [w for w in warnings if w.startswith("side 'one'")]
    assert code == 0 and len(found) == 1 and not [w for w in warnings if w.startswith("side 'two'")]
    assert "9 pairs overlap, most at blade node" in found[0]
    assert "-0.004 m, 0.8 of the distance of neighbouring nodes; they count as touching (shifted" in found[0]
    change.append(("mu = 0.3", 'mu = 0.3\ndistance = "gap"'))
    from tipdamp.bodies import matched_pairs, read_meshes
    from tipdamp.study import load_study

    study = load_study(corner_study.write(tmp_path, damper_mesh=deep, change=change))
    pairs = matched_pairs(study, read_meshes(study))
    assert pairs.gap[pairs.side == "one"] == pytest.approx(-4e-3)
    assert pairs.gap[pairs.side == "two"] == pytest.approx(0.0)


# ---- cell types, formats, names --------------------------------------------------------------------------------

@pytest.mark.parametrize("end, text, message", [
    (".inp", "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D5\n1,1,1,1,1,1\n", "type C3D5 cannot be assembled; allowed: C3D4"),
    (".bdf", "GRID,1,,0.,0.,0.\nCPYRAM,1,1,1,2,3,4,5\nENDDATA\n", "1 cells of type CPYRAM cannot be assembled"),
    (".msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n5 7 2 1 1 1 2 3 4 5\n"
             "$EndElements\n", r"1 cells of type 'pyramid' \(first: element 5\) cannot be assembled; allowed: tetra"),
    (".msh", "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", "MSH version 4.0; write it as 4.1 or 2.2"),
])
def test_a20_unsupported(tmp_path, end, text, message):
    path = tmp_path / f"b{end}"
    path.write_text(text)
    refused(path, message)


def test_a20_pyramid_among_bricks_of_ansys(tmp_path):
    mesh = block("hexahedron")
    mesh.cells["hexahedron"][4, 4:] = mesh.cells["hexahedron"][4, 4]
    refused(write(tmp_path, ".cdb", mesh), "element 5 is a pyramid")


def test_a20_linear_beside_quadratic(tmp_path):
    """Hexahedra with 8 nodes on wedges with 15: they share corners and not the nodes between."""
    linear, quadratic = mixture(1, (2, 1, 2)), mixture(2, (2, 1, 2))
    corners = {tuple(np.round(p, 9)): n for p, n in zip(quadratic.position, quadratic.node, strict=True)}
    node = np.array([corners[tuple(np.round(p, 9))] for p in linear.position])
    hexahedra = np.searchsorted(quadratic.node, node[linear.cells["hexahedron"]])
    mixed = Mesh(quadratic.node, quadratic.position,
                 {"hexahedron": hexahedra, "wedge15": quadratic.cells["wedge15"]}, quadratic.groups,
                 number={"hexahedron": linear.number["hexahedron"], "wedge15": quadratic.number["wedge15"]},
                 cell_groups=quadratic.cell_groups)
    found = read_mesh(write(tmp_path, ".inp", mixed))
    assert any("1 faces are shared by cells with different numbers of nodes" in w for w in found.warnings)


def _rewritten(gmsh, source, path, version, binary, save_all=0):
    gmsh.initialize(readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(source))
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("Mesh.SaveAll", save_all)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path.read_bytes()


def test_a21_all_gmsh_variants_read_the_same(tmp_path):
    """2.2 and 4.1, text and binary, with and without 'save all'; a volume in two groups is written twice in 2.2."""
    gmsh = pytest.importorskip("gmsh")
    from tests.modal.conftest import make_bar

    bar = make_bar(tmp_path / "bar.msh")
    gmsh.initialize(readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(bar))
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [1]), "also")
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.write(str(tmp_path / "two.msh"))
    gmsh.finalize()
    first = read_mesh(tmp_path / "two.msh")
    assert set(first.groups) == {"bar", "also", "clamp", "tip"}
    for version, binary, save_all in ((2.2, 0, 0), (2.2, 1, 0), (4.1, 1, 0), (4.1, 0, 1), (4.1, 1, 1)):
        path = tmp_path / "other.msh"
        _rewritten(gmsh, tmp_path / "two.msh", path, version, binary, save_all)
        other = read_mesh(path)
        assert np.array_equal(other.node, first.node) and np.allclose(other.position, first.position, atol=1e-15)
        assert {k: v.tolist() for k, v in other.groups.items()} == {k: v.tolist() for k, v in first.groups.items()}
        assert np.array_equal(other.cells["hexahedron27"], first.cells["hexahedron27"])
        assert {k: len(v) for k, v in other.cell_groups.items()} == {"bar": 24, "also": 24}
        assert other.warnings == ()
    _rewritten(gmsh, tmp_path / "two.msh", tmp_path / "lost.msh", 2.2, 0, 1)
    refused(tmp_path / "lost.msh", "version 2.2 saved with 'save all' loses the groups")


@every_format
def test_a22_name_that_is_not_utf_8(tmp_path, end):
    """Latin-1 is read, and said, with the place of the first such byte."""
    path = write(tmp_path, end, block("hexahedron"))
    if end == ".bdf":
        path.write_bytes(path.read_bytes().replace(b'"tip"', b'"t\xefp"'))
    else:
        data = path.read_bytes()
        for old, new in ((b"tip", b"t\xefp"), (b"TIP ", b"t\xefp "), (b"TIP,", b"t\xefp,")):
            data = data.replace(old, new)
        path.write_bytes(data)
    found = read_mesh(path)
    assert any("not UTF-8 "
               "(byte" in w for w in found.warnings)
    assert "tïp" in found.groups


HOSTILE = ["<script>alert(1)</script>", 'say "hello"', "two\nlines", "../../etc/passwd", "x" * 10000, "a:b;c,d", "=1+1"]


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("name", HOSTILE, ids=lambda n: n[:12])
def test_a23_hostile_names_are_kept(tmp_path, name, version):
    mesh = block("hexahedron")
    path = tmp_path / "b.msh"
    path.write_text(mesh_texts.gmsh_text(mesh, version, {"clamp": "clamp", "tip": name}))
    found = read_mesh(path)
    assert np.array_equal(found.groups[name], mesh.groups["tip"])
    with pytest.raises(InputError) as caught:
        found.group("tipp")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


def test_a23_hostile_names_through_a_study(tmp_path, capsys):
    """From inspect to the tuned pairs: results are found under the name, no file is named after it."""
    name = "../<b>&, x:y"
    mesh = corner_study.blades()
    mesh.groups[name] = mesh.groups["touch_one"][:2]
    path = corner_study.write(tmp_path, mesh, change=[('patches = ["touch_one"', f"patches = ['{name}'")])
    assert inspect(path, capsys)[0] == 0
    for verb in ("reduce", "preload"):
        assert main([verb, str(path), "--quiet"]) == 0
    found = json.loads((tmp_path / "results" / "corner" / "inspect.json").read_text())
    assert name in found["bodies"]["blades"]["groups"]
    assert {p.suffix for p in (tmp_path / "results").rglob("*") if p.is_file()} <= {".json", ".csv", ".npz", ".vtu",
                                                                                          ".html"}
    page = (tmp_path / "results" / "corner" / "inspect.html").read_text(encoding="utf-8")
    assert name not in page and "x:y" in page
    assert sorted(p.name for p in tmp_path.iterdir()) == ["blades.inp", "corner.toml", "damper.inp", "results"]


def test_a24_mesh_too_large_for_the_memory(tmp_path, capsys, monkeypatch):
    """5e6 nodes need hundreds of GB; and whatever is there, more is refused before assembly."""
    assert 100e9 < memory.predicted_bytes(5_000_000) < 2000e9
    with pytest.raises(InputError, match=r"5000000 nodes \(15000000 dofs\) are predicted to need \d+ GB"):
        monkeypatch.setattr(memory, "available_bytes", lambda: 64e9)
        memory.check_memory((5_000_000, 0, "big.msh"))
    monkeypatch.setattr(memory, "available_bytes", lambda: 1e5)
    code, error, _ = inspect(corner_study.write(tmp_path), capsys)
    assert code == 2 and "blades.inp: 54 nodes (162 dofs, 18 master nodes); " in error
    assert "damper.inp: 27 nodes (81 dofs, 15 master nodes) are predicted to need" in error
    # each fits alone, both do not
    monkeypatch.setattr(memory, "available_bytes", lambda: 1.2 * memory.predicted_bytes(54, 18))
    code, error, _ = inspect(corner_study.write(tmp_path), capsys)
    assert code == 2 and "are predicted to need" in error


@every_format
def test_damage_of_any_kind_is_one_line(tmp_path, end):
    """150 files with bytes changed, lost or added at random: read, or refused in one line; never anything else."""
    whole = write(tmp_path, end, block("hexahedron", (2, 1, 1))).read_bytes()
    path, rng = tmp_path / f"damaged{end}", np.random.default_rng(3)
    refusals = 0
    for _ in range(150):
        data = bytearray(whole)
        for place in rng.integers(len(data) - 50, size=rng.choice([1, 2, 5])):
            new = bytes(rng.choice(list(b"0123456789,-*$.\n eE")) for _ in range(3))
            data[place:place + rng.choice([0, 3, 40])] = new[:rng.choice([0, 1, 3])]
        path.write_bytes(data)
        try:
            assert np.isfinite(read_mesh(path).position).all()
        except InputError as error:
            refusals += 1
            assert "\n" not in str(error) and "cannot be made sense of" not in str(error)
    assert refusals > 50
