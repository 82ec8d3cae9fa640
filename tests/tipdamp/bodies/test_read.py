"""Meshes of a study and the groups that it names."""

from dataclasses import replace

import numpy as np
import pytest

from tests.modal.blocks import block
from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.bad_meshes import every_format, inspect, write
from tipdamp.bodies.read import read_meshes
from tipdamp.hbm.errors import InputError
from tipdamp.modal.mesh import Mesh
from tipdamp.readers.dispatch import read_mesh
from tipdamp.study.study import load_study

TITANIUM = (
    '[material.titanium]\ngroup = "blade two"\nE = 110e9\nnu = 0.31\ndensity = 4430\n[blades]'
)


def test_material_of_a_group_that_no_mesh_has(tmp_path):
    study = load_study(
        corner_study.write(
            tmp_path, change=[("[blades]", TITANIUM.replace("blade two", "blade 2"))]
        )
    )
    with pytest.raises(
        InputError,
        match=r"\[material.titanium\] group: no mesh has a group of cells 'blade 2'; "
        "did you mean 'blade two'",
    ):
        read_meshes(study)


def test_dat_files_of_ansys_and_of_nastran(tmp_path):
    mesh = corner_study.cube()
    mesh = replace(mesh, groups={"clamp": mesh.node[:4], "tip": mesh.node[4:8]})
    for text, expected in ((mesh_texts.ansys, "Ansys archive"), (mesh_texts.nastran, "Nastran")):
        (tmp_path / "b.dat").write_text(text(mesh))
        assert read_mesh(tmp_path / "b.dat").format == expected


def test_group_misspelt(tmp_path, capsys):
    path = corner_study.write(tmp_path, change=[('damper = "face_x"', 'damper = "facex"')])
    code, error, _ = inspect(path, capsys)
    assert code == 2
    assert (
        "[contact.one] damper: damper.inp: no group 'facex'; did you mean 'face_x'? valid: "
        "face_x, face_z, load" in error
    )


def test_group_empty_or_of_the_wrong_dimension(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    text = (tmp_path / "damper.inp").read_text()
    (tmp_path / "damper.inp").write_text(
        text.replace('*NSET, NSET="load"', '*NSET, NSET="load"\n*NSET, NSET=other')
    )
    code, error, _ = inspect(path, capsys)
    assert code == 2 and "group 'load' is empty: it holds nodes (dimension 0) with 0 nodes" in error
    whole = replace(corner_study.damper(), cell_groups={"everything": np.arange(1, 9)})
    path = corner_study.write(
        tmp_path, damper_mesh=whole, change=[('damper = "face_x"', 'damper = "everything"')]
    )
    code, error, _ = inspect(path, capsys)
    assert code == 2 and (
        "group 'everything' holds a volume (dimension 3) with 27 nodes; wanted: nodes or a surface"
        in error
    )


def test_line_instead_of_a_surface():
    mesh = replace(block("hexahedron"), dimension={"tip": 1})
    with pytest.raises(
        InputError, match=r"'tip' holds a curve \(dimension 1\) with 9 nodes; wanted: nodes or a"
    ):
        mesh.group("tip", (0, 2))


@every_format
def test_hanging_nodes_are_dropped(tmp_path, end):
    """Nodes without a cell make K singular: they are left out and counted, in groups too."""
    mesh = block("hexahedron")
    more = replace(
        mesh,
        node=np.append(mesh.node, [9001, 9002]),
        position=np.vstack([mesh.position, np.ones((2, 3))]),
        groups={**mesh.groups, "tip": np.append(mesh.groups["tip"], 9001)},
    )
    found = read_mesh(write(tmp_path, end, more))
    assert np.array_equal(found.node, mesh.node)
    assert "2 nodes that no solid cell uses" in found.unused
    assert len(next(v for k, v in found.groups.items() if k.lower() == "tip")) == len(
        mesh.groups["tip"]
    )


def test_an_empty_group_is_named(tmp_path):
    mesh = Mesh(
        np.arange(3), np.zeros((3, 3)), {}, groups={"clamp": np.empty(0, int)}, source="m.msh"
    )
    with pytest.raises(InputError, match="m.msh: group 'clamp' is empty"):
        mesh.group("clamp")
