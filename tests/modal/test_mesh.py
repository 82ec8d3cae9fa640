"""Reading gmsh files: what is there is kept, what is broken is refused."""

import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.modal.faces import boundary_faces, node_normals
from tipdamp.readers.dispatch import read_mesh

from .conftest import HEIGHT, LENGTH, WIDTH, make_bar

pytest.importorskip("gmsh")


@pytest.mark.parametrize("order, hexahedra", [(1, True), (2, True), (1, False), (2, False)])
def test_boundary_normals_point_outwards(tmp_path, order, hexahedra):
    """On every cell type: at a node inside a flat face all normals are the face's own, outward."""
    mesh = read_mesh(make_bar(tmp_path / "b.msh", order, hexahedra))
    faces = boundary_faces(mesh)
    area = sum(len(f) for f in faces)
    assert area > 0
    for direction, value in ((0, LENGTH), (1, WIDTH), (2, 0.0)):
        expected = np.eye(3)[direction] * (1 if value else -1)
        on = np.abs(mesh.position[:, direction] - value) < 1e-12
        inside = on & (np.abs(mesh.position / [LENGTH, WIDTH, HEIGHT] - 0.5) < 0.499).sum(
            axis=1
        ).__eq__(2)
        index = np.flatnonzero(inside)[0]
        normals = node_normals(mesh, index, faces)
        assert len(normals) and np.allclose(normals, expected)


def test_groups_keep_node_numbers(bar):
    tip = bar.group("tip")
    assert np.allclose(bar.position[bar.index(tip), 0], LENGTH)
    assert len(tip) == 25  # 2 x 2 quadratic faces


def test_binary_and_older_formats_read_the_same(tmp_path, bar_file, bar):
    import gmsh

    for version, binary in ((2.2, 0), (2.2, 1), (4.1, 1)):
        path = tmp_path / f"{version}_{binary}.msh"
        gmsh.initialize(readConfigFiles=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(bar_file))
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(path))
        gmsh.finalize()
        other = read_mesh(path)
        assert np.array_equal(other.node, bar.node) and np.allclose(
            other.position, bar.position, atol=1e-15
        )
        assert {k: v.tolist() for k, v in other.groups.items()} == {
            k: v.tolist() for k, v in bar.groups.items()
        }


def test_missing_group_names_the_nearest(bar):
    with pytest.raises(InputError, match="no group 'tipp'; did you mean 'tip'"):
        bar.group("tipp")


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_mesh(tmp_path / "none.msh")


def test_cut_off_file(tmp_path, bar_file):
    whole = bar_file.read_bytes()
    cut = tmp_path / "cut.msh"
    cut.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.raises(InputError, match="is cut off"):
        read_mesh(cut)


def _bar_text(bar_file, change):
    lines = bar_file.read_text().split("\n")
    return "\n".join(change(lines))


def test_coordinate_that_is_not_a_number(tmp_path, bar_file):
    def spoil(lines):
        start = lines.index("$Nodes")
        row = next(
            i for i in range(start + 2, len(lines)) if lines[i].count(" ") == 2 and "." in lines[i]
        )
        lines[row] = "nan 0 0"
        return lines

    path = tmp_path / "nan.msh"
    path.write_text(_bar_text(bar_file, spoil))
    with pytest.raises(InputError, match="not a finite number"):
        read_mesh(path)


def test_inverted_cell(tmp_path, bar_file):
    """Swap two nodes of one hexahedron."""

    def spoil(lines):
        row = max(i for i, line in enumerate(lines) if line.count(" ") >= 27)
        words = lines[row].split()
        words[1], words[2] = words[2], words[1]
        lines[row] = " ".join(words)
        return lines

    path = tmp_path / "flip.msh"
    path.write_text(_bar_text(bar_file, spoil))
    with pytest.raises(InputError, match="1 hexahedron27 cells are inverted or flat"):
        read_mesh(path)
