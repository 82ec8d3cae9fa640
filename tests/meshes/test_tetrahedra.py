"""The rig with unlike meshes: tetrahedra of the same solid, in one file and in two, and with
matching nodes."""

import numpy as np
import pytest

pytest.importorskip("gmsh")

from tipdamp.meshes.rig import Cells, Rig, contact  # noqa: E402
from tipdamp.meshes.sections import blades_section  # noqa: E402
from tipdamp.meshes.tetrahedra import blades, main, outline  # noqa: E402
from tipdamp.meshes.two_blade_rig import build  # noqa: E402
from tipdamp.modal.elasticity import Material, elastic_body  # noqa: E402
from tipdamp.modal.faces import group_faces  # noqa: E402
from tipdamp.modal.loads import pressure  # noqa: E402
from tipdamp.proposal.propose import propose  # noqa: E402
from tipdamp.readers.dispatch import read_mesh  # noqa: E402

STEEL = Material(E=207e9, nu=0.3, density=7850.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("tet")
    given = "--damper wedge --edge 0.01 --contact-edge 0.003 --axial 15 --across 2 --out"
    assert main([*given.split(), str(out)]) == 0
    return out


def test_same_solid():
    """Groups and box as of the hexahedra; the volume to what chords leave out of it; no flat
    cells."""
    rig = Rig.named("asymmetric")
    hexahedra = build(rig, "wedge", 0.5)[0]
    mesh = blades(rig, contact(rig, "wedge"), 0.006, 0.0015)
    assert set(mesh.surfaces) == set(hexahedra.surfaces)
    assert {"excitation", "patch_1", "patch_2"} == set(mesh.node_sets)
    for name in mesh.node_sets:
        assert mesh.nodes[mesh.node_sets[name]] == pytest.approx(
            hexahedra.nodes[hexahedra.node_sets[name]], abs=1e-9
        )
    low, high = (limit(hexahedra.nodes, axis=0) for limit in (np.min, np.max))
    assert mesh.nodes.min(axis=0) == pytest.approx(low) and mesh.nodes.max(axis=0) == pytest.approx(
        high
    )
    for solid in (blades(rig, contact(rig, "wedge", 3), 0.01, 0.002, 15), mesh):
        p = solid.nodes[solid.cells[:, :4]]
        volume = np.linalg.det(p[:, 1:] - p[:, :1]) / 6
        size = np.sqrt(((p[:, None] - p[:, :, None]) ** 2).sum(axis=3).sum(axis=(1, 2)) / 12)
        assert (volume / size**3).min() > 1e-6, "flat cells"  # 0.118 of a regular tetrahedron
        x = np.abs(solid.nodes[np.unique(solid.surfaces["clamp"]), 0])
        assert x.min() == pytest.approx(rig.free_span / 2) and x.max() == pytest.approx(high[0])
    points, quads = blades_section(rig, contact(rig, "wedge"), Cells.of_size(2.0), 2)
    x, z = points[outline(quads)].T
    exact = abs(np.sum(x * np.roll(z, -1) - z * np.roll(x, -1))) / 2 * rig.length
    assert volume.sum() == pytest.approx(exact, rel=3e-4)


@pytest.mark.slow
def test_one_file_and_two(folder):
    """Element for element the same K, and the same faces."""
    found = propose([folder / "tet_rig.inp"])
    apart = propose([folder / "tet_blades.msh", folder / "tet_damper.msh"])
    assert found.cells == "damper" and not any(side.matching for side in found.sides)
    for body, prefix in (("blades", "blades_"), ("damper", "damper_")):
        one, two = (elastic_body(p.meshes[body], STEEL, body, free=True) for p in (found, apart))
        order = np.lexsort(np.round(one.position, 9).T), np.lexsort(np.round(two.position, 9).T)
        dofs = [(3 * o[:, None] + np.arange(3)).ravel() for o in order]
        off = one.K[dofs[0]][:, dofs[0]] - two.K[dofs[1]][:, dofs[1]]
        assert abs(off).max() < 1e-9 * abs(one.K).max()
        for name in apart.meshes[body].face_groups:
            mine, its = (
                sum(len(b) for b in group_faces(p.meshes[body], n))
                for p, n in ((found, prefix + name), (apart, name))
            )
            assert mine == its > 0, name


def test_pressure_on_triangles(folder):
    """Corners of a straight triangle carry none of it, its middles a third each; all of it is the
    area."""
    mesh = read_mesh(folder / "tet_blades.msh")
    body = elastic_body(mesh, STEEL, "blades", free=True)
    nodal = pressure(body, mesh, "cover_left", 1.0).reshape(-1, 3)
    faces = np.concatenate([b for b in group_faces(mesh, "cover_left") if len(b)])
    corners = np.unique(faces[:, :3])
    total = np.linalg.norm(nodal.sum(axis=0))
    p = mesh.position[faces[:, :3]]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2
    assert total == pytest.approx(area, rel=1e-9) and np.abs(nodal[corners]).max() < 1e-9 * total


def test_matching_nodes(tmp_path, capsys):
    """The covers have the damper's nodes on its flats, at the rig's stations; only flats can."""
    given = "--edge 0.01 --contact-edge 0.002 --axial 15 --matching --out"
    assert main([*given.split(), str(tmp_path)]) == 0
    both = [read_mesh(tmp_path / f"tet_{body}.msh") for body in ("blades", "damper")]
    for side in ("left", "right"):
        one, two = (mesh.position[mesh.index(mesh.groups[f"contact_{side}"])] for mesh in both)
        assert len(one) == 31 * 3 and np.sort(one, axis=0) == pytest.approx(
            np.sort(two, axis=0), abs=1e-12
        )
        assert np.unique(one[:, 1].round(9)) == pytest.approx(np.linspace(0, 0.07, 31))
    assert main(["--damper", "cylindrical", "--matching", "--out", str(tmp_path)]) == 2
    assert "damper 'wedge' has two" in capsys.readouterr().err
