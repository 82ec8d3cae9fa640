"""From the study to bodies: materials by group, what inspect tells, and the same bodies without the Debian packages."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hbm.errors import InputError
from hbm.model import ReducedModel
from tests.tipdamp import corner_study, mesh_texts
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.pair import matched_pairs
from tipdamp.bodies.read import read_meshes
from tipdamp.cli import main
from tipdamp.readers.dispatch import read_mesh
from tipdamp.stiffness import side_materials, with_values
from tipdamp.study.study import load_study

TITANIUM = '[material.titanium]\ngroup = "blade two"\nE = 110e9\nnu = 0.31\ndensity = 4430\n[blades]'
CUBE = corner_study.A**3


def test_materials_by_group(tmp_path):
    """Blade two of titanium: the mass of the free blades is that of one cube of each."""
    study = load_study(corner_study.write(tmp_path, change=[("[blades]", TITANIUM)]))
    meshes = read_meshes(study)
    blades, damper = assemble_bodies(study, meshes, lambda *_: None)
    held = np.union1d(blades.groups["clamp_one"], blades.groups["clamp_two"])
    assert len(np.setdiff1d(blades.node, held)) * 3 == blades.dofs  # both clamps hold
    # a unit motion of the free nodes falls linearly to zero over the layer at the clamp, half the length: 1/3 of its
    # mass moves, and all of the other half
    moving = (1 / 3 + 1) / 2
    assert blades.mass() == pytest.approx(np.full(3, moving * (7850 + 4430) * CUBE), rel=1e-9)
    assert damper.mass() == pytest.approx(np.full(3, 7850 * CUBE), rel=1e-9)


def test_half_space_stiffness_of_each_sides_own_materials(tmp_path):
    """Side two touches titanium: E* of steel on titanium, not of steel on steel."""
    change = [("[blades]", TITANIUM), ("mu = 0.3", 'mu = 0.3\nstiffness = "halfspace"'),
              *[("kn = 1e6\nkt = 1e6\nwidth = 0.01\n", "width = 0.002\n")] * 2]
    study = load_study(corner_study.write(tmp_path, change=change))
    meshes = read_meshes(study)
    pairs = matched_pairs(study, meshes)
    kn = with_values(study, pairs, side_materials(study, meshes, pairs)).kn
    assert kn[0] > 1.15 * kn[-1]
    steel = load_study(corner_study.write(tmp_path, change=change[1:]))
    kn_steel = with_values(steel, pairs, side_materials(steel, meshes, pairs)).kn
    assert kn_steel[0] == pytest.approx(kn[0]) and kn_steel[-1] == pytest.approx(kn_steel[0])


def test_material_of_a_group_that_no_mesh_has(tmp_path):
    study = load_study(corner_study.write(tmp_path, change=[("[blades]", TITANIUM.replace("blade two", "blade 2"))]))
    with pytest.raises(InputError, match=r"\[material.titanium\] group: no mesh has a group of cells 'blade 2'; "
                                         "did you mean 'blade two'"):
        read_meshes(study)


def test_inspection_of_groups_read_and_unread(tmp_path, capsys):
    mesh = corner_study.blades("hexahedron20")
    path = corner_study.write(tmp_path, mesh, corner_study.damper("hexahedron20"))
    with open(tmp_path / "blades.inp", "a") as f:
        f.write("*NODE\n9999, 0, 0, 0\n*BOUNDARY\nclamp_one, 1, 3\n")
    assert main(["inspect", str(path), "--quiet"]) == 0
    found = json.loads((tmp_path / "results" / "corner" / "inspect.json").read_text())["bodies"]["blades"]
    assert found["format"] == "Abaqus or CalculiX" and found["cells"] == {"hexahedron20": 16}
    assert found["groups"]["touch_one"] == 21 and found["groups_are"]["touch_one"] == "nodes"
    assert found["cell_groups"] == {"blade two": 8} and found["groups_are"]["blade two"] == "a volume"
    assert "1 nodes that no solid cell uses" in found["not_read"] and "keywords *BOUNDARY (1)" in found["not_read"]
    assert any("C3D20R" in line and "full integration" in line for line in found["not_read"])


def test_the_same_model_without_dolfinx_petsc_and_gmsh(tmp_path):
    """Cells assembled by our own code and factorised by scipy: the same reduced matrices."""
    for name in ("with", "without"):
        (tmp_path / name).mkdir()
        corner_study.write(tmp_path / name, change=[("modes = 5", "modes = 0"), ("modes = 3", "modes = 0")])
    assert main(["reduce", str(tmp_path / "with" / "corner.toml"), "--quiet"]) == 0
    program = ("import sys\n"
               "for name in ('dolfinx', 'petsc4py', 'slepc4py', 'gmsh', 'mpi4py'): sys.modules[name] = None\n"
               "from tipdamp.cli import main\n"
               "sys.exit(main(['reduce', 'corner.toml', '--quiet']))\n")
    child = subprocess.run([sys.executable, "-c", program], cwd=tmp_path / "without", capture_output=True, text=True,
                           env={"PYTHONPATH": str(Path(__file__).parents[2]), "PATH": "/usr/bin:/bin"})
    assert child.returncode == 0, child.stderr
    one, two = (ReducedModel.load(tmp_path / name / "results" / "corner" / "model.npz") for name in ("with", "without"))
    for A, B in ((one.K, two.K), (one.M, two.M)):
        assert np.abs(A - B).max() < 1e-9 * np.abs(A).max()


def test_dat_files_of_ansys_and_of_nastran(tmp_path):
    mesh = corner_study.cube()
    mesh = replace(mesh, groups={"clamp": mesh.node[:4], "tip": mesh.node[4:8]})
    for write, expected in ((mesh_texts.ansys, "Ansys archive"), (mesh_texts.nastran, "Nastran")):
        (tmp_path / "b.dat").write_text(write(mesh))
        assert read_mesh(tmp_path / "b.dat").format == expected


def test_faces_of_20_node_hexahedra_are_paired(tmp_path):
    """Stations through the middles of edges have fewer rows (0, 2, 4 of 5): the lowest row is there at each."""
    path = corner_study.write(tmp_path, corner_study.blades("hexahedron20"), corner_study.damper("hexahedron20"))
    study = load_study(path)
    pairs = matched_pairs(study, read_meshes(study))
    one = pairs.select(pairs.side == "one")
    found = [one.row[one.station == s].tolist() for s in range(5)]
    assert found == [[0, 1, 2, 3, 4], [0, 2, 4], [0, 1, 2, 3, 4], [0, 2, 4], [0, 1, 2, 3, 4]]
    assert one.position[:, 2] == pytest.approx(one.row * 2.5e-3)
    assert one.position[:, 1] == pytest.approx(one.station * 2.5e-3)
