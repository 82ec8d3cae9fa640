"""One mesh in every format and style comes out as the same nodes, cells, sets, K and M, with the
user's numbers."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.modal.blocks import block, mixture
from tests.tipdamp import gmsh_files, mesh_texts
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.readers.dispatch import read_mesh
from tipdamp.readers.includes import included_files

REAL = Path(__file__).parents[2] / "reference" / "meshes"
STEEL = Material(E=207e9, nu=0.3, density=7850.0)
MESHES = {
    "hex8": lambda: block("hexahedron"),
    "hex20": lambda: block("hexahedron20", distort=0.1),
    "tet10": lambda: block("tetra10", (2, 1, 1)),
    "wedge15": lambda: block("wedge15", (2, 1, 1)),
    "hex27": lambda: block("hexahedron27", (2, 1, 1), distort=0.1),
    "mixture, linear": lambda: mixture(1),
    "mixture, quadratic": lambda: mixture(2),
}
# style: (writer, end of the name, relative precision of coordinates as written)
STYLES = {
    "abaqus flat": (mesh_texts.abaqus_flat, ".inp", 1e-15),
    "abaqus cae": (mesh_texts.abaqus_cae, ".inp", 1e-15),
    "ansys": (mesh_texts.ansys, ".cdb", 1e-13),
    "ansys etblock": (lambda m: mesh_texts.ansys(m, etblock="columns"), ".cdb", 1e-13),
    "ansys etblock, blanks": (lambda m: mesh_texts.ansys(m, etblock="blanks"), ".cdb", 1e-13),
    "nastran small": (mesh_texts.nastran, ".bdf", 2e-4),
    "nastran large": (lambda m: mesh_texts.nastran(m, "large"), ".bdf", 1e-9),
    "nastran free": (lambda m: mesh_texts.nastran(m, "free"), ".bdf", 1e-15),
    "gmsh 2.2": (gmsh_files.text, ".msh", 1e-15),
    "gmsh 4.1": (lambda m: gmsh_files.rewritten(m, 4.1, 0), ".msh", 1e-14),
    "gmsh 4.1 binary": (lambda m: gmsh_files.rewritten(m, 4.1, 1), ".msh", 1e-15),
}
NO_27 = ("ansys", "nastran")  # these programs have no such cell


@pytest.mark.parametrize(
    "style, made",
    [
        (style, made)
        for made in MESHES
        for style in STYLES
        if not (made == "hex27" and style.startswith(NO_27))
    ],
)
def test_every_format_gives_the_same_mesh(tmp_path, made, style):
    write, end, precision = STYLES[style]
    if "gmsh" in style and style != "gmsh 2.2":
        pytest.importorskip("gmsh")
    mesh = MESHES[made]()
    path = tmp_path / f"block{end}"
    content = write(mesh)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    other = read_mesh(path)
    assert np.array_equal(other.node, mesh.node)
    assert other.position == pytest.approx(mesh.position, rel=precision, abs=1e-12)
    assert {k: len(v) for k, v in other.cells.items()} == {k: len(v) for k, v in mesh.cells.items()}
    for kind, cells in mesh.cells.items():
        order = np.argsort(other.number[kind])
        assert np.array_equal(other.number[kind][order], mesh.number[kind])
        assert np.array_equal(other.cells[kind][order], cells)
    groups = {k.lower(): v for k, v in other.groups.items()}
    assert np.array_equal(groups["clamp"], mesh.groups["clamp"])
    assert np.array_equal(groups["tip"], mesh.groups["tip"])
    late = groups["set_3" if end == ".bdf" else "late"]
    assert np.array_equal(late, mesh.node[len(mesh.node) // 2 :])
    cells = {k.lower().replace(" ", "_"): v for k, v in other.cell_groups.items()}
    assert np.array_equal(
        cells["pid_7" if end == ".bdf" else "some_cells"], mesh_texts.first_cells(mesh)
    )
    if precision < 1e-12:
        a, b = (elastic_body(m, STEEL, "b", free=True) for m in (mesh, other))
        assert (
            abs(a.K - b.K).max() < 1e-11 * abs(a.K).max()
            and abs(a.M - b.M).max() < 1e-11 * abs(a.M).max()
        )


@pytest.mark.parametrize("made", ["hex20", "hex27", "mixture, linear", "mixture, quadratic"])
def test_binary_gmsh_2_is_the_same_body(tmp_path, made):
    """gmsh numbers nodes and cells anew when it writes version 2.2: the same body with numbers 1,
    2, 3, ..."""
    pytest.importorskip("gmsh")
    mesh, path = MESHES[made](), tmp_path / "block.msh"
    path.write_bytes(gmsh_files.rewritten(mesh, 2.2, 1))
    other = read_mesh(path)
    assert np.array_equal(other.node, np.arange(1, len(mesh.node) + 1))
    place = cKDTree(mesh.position).query(other.position, distance_upper_bound=1e-12)[1]
    a, b = (elastic_body(m, STEEL, "b", free=True).K for m in (mesh, other))
    dof = (3 * place[:, None] + np.arange(3)).ravel()
    assert abs(a[dof][:, dof] - b).max() < 1e-11 * abs(a).max()
    assert np.array_equal(
        np.sort(mesh.node[place[other.index(other.group("tip"))]]), mesh.groups["tip"]
    )


def test_abaqus_sets(tmp_path):
    """Sets of sets, on the *NODE line, generated, of the nodes of elements; a surface by its
    element faces."""
    mesh = block("hexahedron20")
    path = tmp_path / "b.inp"
    path.write_text(mesh_texts.abaqus_flat(mesh))
    other = read_mesh(path)
    assert np.array_equal(other.group("early"), mesh.node[: len(mesh.node) // 2])
    assert np.array_equal(other.group("every"), np.arange(mesh.node[0], mesh.node[-1] + 1, 3))
    members = np.isin(mesh.number["hexahedron20"], mesh_texts.first_cells(mesh))
    assert np.array_equal(
        other.group("of_cells"), np.unique(mesh.node[mesh.cells["hexahedron20"][members]])
    )
    # S1 of every cell: its bottom face with the middle nodes, at z = 0 and at half height
    z = mesh.position[:, 2]
    layers = (np.abs(z) < 1e-9) | (np.abs(z - 0.005) < 1e-9)
    assert np.array_equal(other.group("below"), mesh.node[layers]) and other.dimension["below"] == 2
    assert other.dimension["E_hexahedron20"] == 3 and len(other.cell_groups["all_cells"]) == 16
    assert any("C3D20R" in u and "full integration" in u for u in other.unused)
    assert any("*BOUNDARY (1), *ELASTIC (1), *MATERIAL (1)" in u for u in other.unused)


def test_abaqus_curves(tmp_path):
    """Trusses with which gmsh writes physical curves: their nodes are a group."""
    mesh = block("hexahedron20")
    a, b, c, d, e = map(int, mesh.node[:5])
    (tmp_path / "b.inp").write_text(
        mesh_texts.plain(mesh) + f"*ELEMENT, TYPE=T3D3, ELSET=Line1\n9001, {a}, {b}, {c}\n"
        f"9002, {c}, {d}, {e}\n*ELEMENT, TYPE=T3D2, ELSET=Line2\n9003, {a}, {e}\n"
        f"*ELEMENT, TYPE=T3D3, ELSET=Line3\n9004, {a}, {c}, {e}\n"
        "*ELSET, ELSET=pull\n9001, 9002\n*ELSET, ELSET=ends\nLine2\n"
    )
    other = read_mesh(tmp_path / "b.inp")
    assert np.array_equal(other.group("pull"), mesh.node[:5]) and np.array_equal(
        other.group("ends"), [a, e]
    )
    assert other.dimension["pull"] == other.dimension["ends"] == 1
    assert not other.face_groups and len(other.node) == len(mesh.node)
    assert ["T3D3" in u and u.startswith("3 elements") for u in other.unused if "T3D" in u] == [
        True,
        False,
    ]


def test_abaqus_instance_is_moved_to_its_place(tmp_path):
    mesh = block("hexahedron")
    path = tmp_path / "b.inp"
    text = mesh_texts.abaqus_cae(mesh, shift=(1.0, 2.0, -3.0))
    path.write_text(text)
    assert read_mesh(path).position == pytest.approx(mesh.position, abs=1e-14)
    # and turned by 90 degrees about the z axis through the origin: x, y -> -y, x
    path.write_text(text.replace("1.0, 2.0, -3.0", "1.0, 2.0, -3.0\n0, 0, 0, 0, 0, 1, 90"))
    expected = mesh.position[:, [1, 0, 2]] * [-1, 1, 1]
    assert read_mesh(path).position == pytest.approx(expected, abs=1e-12)
    assert np.array_equal(read_mesh(path).group("tip_nodes"), mesh.node[len(mesh.node) // 2 :])


def two_instances():
    """Two cubes, x in 0..1 and 5..6, from two parts that name their sets alike."""
    lines = []
    for part, first, shift, contact in (("A", 1, 0, "1, 2"), ("B", 101, 5, "105, 106")):
        # fmt: off
        corners = [
            (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
            (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
        ]
        # fmt: on
        lines += [
            f"*PART, NAME={part}",
            "*NODE",
            *(f"{first + i}, {x + shift}., {y}., {z}." for i, (x, y, z) in enumerate(corners)),
            "*ELEMENT, TYPE=C3D8, ELSET=All",
            ", ".join(str(n) for n in [first, *range(first, first + 8)]),
            "*NSET, NSET=Contact",
            contact,
            "*NSET, NSET=whole, ELSET=All",
            f"*NSET, NSET=only_{part}",
            f"{first}",
            "*SURFACE, NAME=top",
            "All, S2",
            "*END PART",
        ]
    return "\n".join(
        [
            *lines,
            "*ASSEMBLY, NAME=X",
            "*INSTANCE, NAME=A-1, PART=A",
            "*END INSTANCE",
            "*INSTANCE, NAME=B-1, PART=B",
            "*END INSTANCE",
            "*NSET, NSET=of_b",
            "B-1.Contact",
            "*NSET, NSET=only_A, INSTANCE=A-1",
            "8",
            "*NSET, NSET=apart, INSTANCE=A-1",
            "7, 8",
            "*SURFACE, NAME=side_b",
            "B-1.All, S1",
            "*END ASSEMBLY",
            "",
        ]
    )


def test_abaqus_sets_of_one_name_in_two_instances(tmp_path):
    """Joined under the name, which is said; 'Instance.Set' is each alone; what a part names stays
    in its instance."""
    (tmp_path / "b.inp").write_text(two_instances())
    mesh = read_mesh(tmp_path / "b.inp")
    groups = {name: found.tolist() for name, found in mesh.groups.items()}
    assert groups["Contact"] == [1, 2, 105, 106] and groups["of_b"] == [105, 106]
    assert groups["A-1.Contact"] == [1, 2] and groups["B-1.Contact"] == [105, 106]
    assert groups["A-1.whole"] == list(range(1, 9)) and groups["B-1.whole"] == list(range(101, 109))
    assert groups["A-1.top"] == [5, 6, 7, 8] and groups["B-1.top"] == [105, 106, 107, 108]
    assert (
        groups["side_b"] == [101, 102, 103, 104]
        and groups["only_B"] == [101]
        and groups["apart"] == [7, 8]
    )
    assert groups["A-1.only_A"] == [1] and groups["only_A"] == [1, 8]
    assert not {"B-1.only_B", "A-1.apart"} & set(groups)  # no second name where one is enough
    assert {name: found.tolist() for name, found in mesh.cell_groups.items()} == {
        "All": [1, 101],
        "A-1.All": [1],
        "B-1.All": [101],
    }
    assert any(
        "'Contact' joins the sets of that name of A-1, B-1; one alone is 'A-1.Contact' or "
        "'B-1.Contact'" in w
        for w in mesh.warnings
    )
    assert any(
        "'only_A' joins the sets of that name of A-1, the assembly; one alone is 'A-1.only_A'" in w
        for w in mesh.warnings
    )
    assert not any(name in w for w in mesh.warnings for name in ("only_B", "apart", "side_b"))


def test_abaqus_include(tmp_path):
    mesh = block("hexahedron")
    whole = mesh_texts.abaqus_flat(mesh)
    cut = whole.index("*NSET")
    (tmp_path / "sets.inc").write_text(whole[cut:])
    (tmp_path / "b.inp").write_text(whole[:cut] + "*INCLUDE, INPUT=sets.inc\n")
    assert np.array_equal(read_mesh(tmp_path / "b.inp").group("clamp"), mesh.groups["clamp"])


def test_included_files_are_those_that_the_reader_opens(tmp_path):
    """One names another, and itself; a comment and what does not exist are none."""
    (tmp_path / "nodes.dat").write_text("GRID,1,,0.,0.,0.\n  include 'more.dat'\n")
    (tmp_path / "more.dat").write_text("$ INCLUDE none.dat\nINCLUDE b.bdf\n")
    (tmp_path / "b.bdf").write_text("BEGIN BULK\nINCLUDE nodes.dat\nINCLUDE away.dat\nENDDATA\n")
    assert [f.name for f in included_files(tmp_path / "b.bdf")] == ["more.dat", "nodes.dat"]
    (tmp_path / "b.msh").write_text("INCLUDE nodes.dat\n")
    assert included_files(tmp_path / "b.msh") == []


def test_nastran_clamp_from_single_point_constraints(tmp_path):
    mesh = block("wedge15", (2, 1, 1))
    (tmp_path / "b.bdf").write_text(mesh_texts.nastran(mesh))
    assert np.array_equal(read_mesh(tmp_path / "b.bdf").group("spc_5"), mesh.groups["clamp"])


def test_length_unit(tmp_path):
    mesh = block("hexahedron")
    (tmp_path / "b.inp").write_text(mesh_texts.abaqus_flat(mesh))
    assert read_mesh(tmp_path / "b.inp", 1e-3).position == pytest.approx(1e-3 * mesh.position)


def test_abaqus_reference_points_are_left_out(tmp_path):
    (tmp_path / "b.inp").write_text(mesh_texts.abaqus_cae(block("hexahedron")))
    mesh = read_mesh(tmp_path / "b.inp")
    assert "RP-1" not in mesh.groups and "1 reference points of the assembly" in mesh.unused


# ---- files that other programs wrote: see tests/reference/meshes/README.md -----------------------


def test_file_of_ansys_and_its_copy_by_pynastran():
    """321 nodes, 40 SOLID186 of a 1 x 1 x 5 beam; the numbers of nodes in the components as
    mapdl-archive 0.4.2 counts them (98, 164 and 22 elements); the same beam written by pyNastran
    gives the same K and M."""
    ansys = read_mesh(REAL / "hex_beam.cdb")
    nastran = read_mesh(REAL / "hex_beam_pynastran.bdf")
    assert len(ansys.node) == 321 and len(ansys.cells["hexahedron20"]) == 40
    assert len(ansys.group("NCOMP2")) == 98 and len(ansys.group("NODE_SELECTION")) == 164
    assert len(ansys.cell_groups["ECOMP1"]) == len(ansys.cell_groups["ECOMP2"]) == 22
    assert np.array_equal(ansys.group("NCOMP2"), nastran.group("set_11"))
    assert np.array_equal(
        nastran.group("spc_4"), nastran.node[np.abs(nastran.position[:, 2]) < 1e-9]
    )
    bodies = [elastic_body(m, STEEL, "beam", free=True) for m in (ansys, nastran)]
    assert bodies[0].mass() == pytest.approx(np.full(3, 7850 * 5.0), rel=1e-9)
    assert abs(bodies[0].K - bodies[1].K).max() < 1e-9 * abs(bodies[0].K).max()


def test_files_of_gmsh():
    """One bar of 20-node hexahedra, written by gmsh as .msh, .inp and .bdf: the same nodes, cells
    and groups."""
    msh, inp, bdf = (read_mesh(REAL / f"bar_gmsh.{end}") for end in ("msh", "inp", "bdf"))
    for other in (inp, bdf):
        assert np.array_equal(other.node, msh.node) and other.position == pytest.approx(
            msh.position, abs=1e-12
        )
        assert np.array_equal(other.cells["hexahedron20"], msh.cells["hexahedron20"])
    for name in ("clamp", "tip", "bar"):
        assert np.array_equal(inp.group(name), msh.group(name))
    assert np.array_equal(bdf.group("pid_2"), msh.group("clamp"))


@pytest.mark.parametrize("kind", ["hexahedron", "hexahedron20"])
def test_frequencies_of_calculix_on_the_same_file(tmp_path, kind):
    """Full integration in both (C3D8, C3D20): the five lowest frequencies agree to the seven digits
    it prints."""
    ccx = shutil.which("ccx")
    if not ccx:
        pytest.skip("CalculiX (ccx) is not installed")
    from tipdamp.modal.eigen import Factor

    text = (
        mesh_texts.abaqus_flat(block(kind, distort=0.2)).replace("0R,", "0,").replace("8R,", "8,")
    )
    text = text[: text.index("*MATERIAL")] + CALCULIX
    (tmp_path / "job.inp").write_text(text)
    subprocess.run([ccx, "job"], cwd=tmp_path, capture_output=True, check=True)
    theirs = [
        float(line.split()[3])
        for line in (tmp_path / "job.dat").read_text().splitlines()
        if re.match(r"\s+\d+\s+\d\.\d+E", line)
    ][:5]
    body = elastic_body(read_mesh(tmp_path / "job.inp"), STEEL, "job", clamp="clamp")
    assert Factor(body.K).lowest_modes(body.M, 5)[0] / (2 * np.pi) == pytest.approx(
        np.array(theirs), rel=1e-6
    )


CALCULIX = """*MATERIAL, NAME=steel
*ELASTIC
207e9, 0.3
*DENSITY
7850.
*SOLID SECTION, ELSET=all_cells, MATERIAL=steel
*BOUNDARY
clamp, 1, 3
*STEP
*FREQUENCY
5
*END STEP
"""
