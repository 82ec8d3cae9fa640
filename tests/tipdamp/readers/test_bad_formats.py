"""Cell types, formats and names, by the rows of the catalogue of bad inputs (a20 to a24); damage of
any kind."""

import json

import numpy as np
import pytest

from tests.modal.blocks import block, mixture
from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.bad_meshes import every_format, inspect, refused, rewritten, write
from tipdamp.cli import main
from tipdamp.hbm.errors import InputError
from tipdamp.modal import memory
from tipdamp.modal.mesh import Mesh
from tipdamp.readers.dispatch import read_mesh

# ---- cell types, formats, names ------------------------------------------------------------------


@pytest.mark.parametrize(
    "end, text, message",
    [
        (
            ".inp",
            "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D5\n1,1,1,1,1,1\n",
            "type C3D5 cannot be assembled; allowed: C3D4",
        ),
        (
            ".bdf",
            "GRID,1,,0.,0.,0.\nCPYRAM,1,1,1,2,3,4,5\nENDDATA\n",
            "1 cells of type CPYRAM cannot be assembled",
        ),
        (
            ".msh",
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 "
            "0\n$EndNodes\n$Elements\n1\n5 7 2 1 1 1 2 3 4 5\n$EndElements\n",
            r"1 cells of type 'pyramid' \(first: element 5\) cannot be assembled; allowed: tetra",
        ),
        (
            ".msh",
            "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n",
            "MSH version 4.0; write it as 4.1 or 2.2",
        ),
    ],
)
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
    corners = {
        tuple(np.round(p, 9)): n for p, n in zip(quadratic.position, quadratic.node, strict=True)
    }
    node = np.array([corners[tuple(np.round(p, 9))] for p in linear.position])
    hexahedra = np.searchsorted(quadratic.node, node[linear.cells["hexahedron"]])
    mixed = Mesh(
        quadratic.node,
        quadratic.position,
        {"hexahedron": hexahedra, "wedge15": quadratic.cells["wedge15"]},
        quadratic.groups,
        number={"hexahedron": linear.number["hexahedron"], "wedge15": quadratic.number["wedge15"]},
        cell_groups=quadratic.cell_groups,
    )
    found = read_mesh(write(tmp_path, ".inp", mixed))
    assert any(
        "1 faces are shared by cells with different numbers of nodes" in w for w in found.warnings
    )


def test_a21_all_gmsh_variants_read_the_same(tmp_path):
    """2.2 and 4.1, text and binary, with and without 'save all'; a volume in two groups is written
    twice in 2.2."""
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
    for version, binary, save_all in (
        (2.2, 0, 0),
        (2.2, 1, 0),
        (4.1, 1, 0),
        (4.1, 0, 1),
        (4.1, 1, 1),
    ):
        path = tmp_path / "other.msh"
        rewritten(gmsh, tmp_path / "two.msh", path, version, binary, save_all)
        other = read_mesh(path)
        assert np.array_equal(other.node, first.node) and np.allclose(
            other.position, first.position, atol=1e-15
        )
        assert {k: v.tolist() for k, v in other.groups.items()} == {
            k: v.tolist() for k, v in first.groups.items()
        }
        assert np.array_equal(other.cells["hexahedron27"], first.cells["hexahedron27"])
        assert {k: len(v) for k, v in other.cell_groups.items()} == {"bar": 24, "also": 24}
        assert other.warnings == ()
    rewritten(gmsh, tmp_path / "two.msh", tmp_path / "lost.msh", 2.2, 0, 1)
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
    assert any("not UTF-8 (byte" in w for w in found.warnings)
    assert "tïp" in found.groups


HOSTILE = [
    "<script>alert(1)</script>",
    'say "hello"',
    "two\nlines",
    "../../etc/passwd",
    "x" * 10000,
    "a:b;c,d",
    "=1+1",
]


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
    """From inspect to the tuned pairs: results are found under the name, no file is named after
    it."""
    name = "../<b>&, x:y"
    mesh = corner_study.blades()
    mesh.groups[name] = mesh.groups["touch_one"][:2]
    path = corner_study.write(
        tmp_path, mesh, change=[('patches = ["touch_one"', f"patches = ['{name}'")]
    )
    assert inspect(path, capsys)[0] == 0
    for verb in ("reduce", "preload"):
        assert main([verb, str(path), "--quiet"]) == 0
    found = json.loads((tmp_path / "results" / "corner" / "inspect.json").read_text())
    assert name in found["bodies"]["blades"]["groups"]
    assert {p.suffix for p in (tmp_path / "results").rglob("[!.]*") if p.is_file()} <= {
        ".json",
        ".receipt",
        ".csv",
        ".npz",
        ".vtu",
        ".from",
        ".html",
    }
    page = (tmp_path / "results" / "corner" / "inspect.html").read_text(encoding="utf-8")
    assert name not in page and "x:y" in page
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "blades.inp",
        "corner.toml",
        "damper.inp",
        "results",
    ]


def test_a24_mesh_too_large_for_the_memory(tmp_path, capsys, monkeypatch):
    """5e6 nodes need hundreds of GB; and whatever is there, more is refused before assembly."""
    assert 100e9 < memory.predicted_bytes(5_000_000) < 2000e9
    with pytest.raises(
        InputError, match=r"5000000 nodes \(15000000 dofs\) are predicted to need \d+ GB"
    ):
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
    """150 files with bytes changed, lost or added at random: read, or refused in one line; never
    anything else."""
    whole = write(tmp_path, end, block("hexahedron", (2, 1, 1))).read_bytes()
    path, rng = tmp_path / f"damaged{end}", np.random.default_rng(3)
    refusals = 0
    for _ in range(150):
        data = bytearray(whole)
        for place in rng.integers(len(data) - 50, size=rng.choice([1, 2, 5])):
            new = bytes(rng.choice(list(b"0123456789,-*$.\n eE")) for _ in range(3))
            data[place : place + rng.choice([0, 3, 40])] = new[: rng.choice([0, 1, 3])]
        path.write_bytes(data)
        try:
            assert np.isfinite(read_mesh(path).position).all()
        except InputError as error:
            refusals += 1
            assert "\n" not in str(error) and "cannot be parsed as" not in str(error)
    assert refusals > 50
