"""Meshes without a study: the proposed study has the bodies, sides and directions, and runs once it
is filled in."""

import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.bodies.test_split import joined
from tests.tipdamp.corner_study import A
from tests.tipdamp.rig_study import read
from tipdamp.bodies.pair import matched
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.split import cut
from tipdamp.bodies.surfaces import surface_points
from tipdamp.cli import main
from tipdamp.hbm.errors import InputError
from tipdamp.meshes.rig import Rig
from tipdamp.meshes.two_blade_rig import generate
from tipdamp.modal.faces import boundary_faces, face_keys
from tipdamp.proposal.patches import Patch, _Faces, _patch, group_of, within_group
from tipdamp.proposal.propose import propose
from tipdamp.proposal.study_text import study_text
from tipdamp.readers.dispatch import read_mesh
from tipdamp.study.study import load_study

WEDGE = Path(__file__).parents[2] / "reference" / "platform-wedge"
STEEL = {"E": "205e9", "nu": "0.3", "density": "7850", "pull": "10", "mu": "0.3"}


def filled(path, **values):
    """The proposed study with what only a person knows."""
    text = path.read_text()
    for key, value in {**STEEL, **values}.items():
        assert text.count(f'\n{key} = "?"') == 1
        text = text.replace(f'\n{key} = "?"', f"\n{key} = {value}")
    assert '\nclamp = "?"' not in text and '\nload_points = "?"' not in text
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("one_file", [False, True])
def test_from_meshes_to_a_preload(tmp_path, capsys, one_file):
    """Two files or one; the sides by the groups of the files, the pull into both of them: 10 N /
    sqrt(2) on each."""
    corner_study.write(tmp_path)
    mesh, _ = joined()
    (tmp_path / "all.inp").write_text(mesh_texts.plain(mesh))
    names = ["all.inp"] if one_file else ["damper.inp", "blades.inp"]
    assert main(["inspect", *(str(tmp_path / name) for name in names)]) == 0
    said = capsys.readouterr().out
    assert "meet 4 of the blades (touch_one)" in said and "nodes match" in said
    assert "clamp: clamp_one, clamp_two" in said
    study = filled((tmp_path / names[0]).with_suffix(".toml"))
    text = Path(study).read_text()
    assert "axis = [0, 1, 0]" in text and "pull_direction = [0.707107, 0, 0.707107]" in text
    assert 'load_points = "load"' in text
    assert ('cells = "pin"' in text) == one_file and 'length = "m"' in text
    for verb in ("inspect", "reduce", "preload"):
        assert main([verb, study, "--quiet"]) == 0
    sides = read(tmp_path / "results" / Path(study).stem, "preload.json")["sides"]
    assert [s["sum_N"] for s in sides.values()] == pytest.approx([10 / np.sqrt(2)] * 2, rel=1e-4)
    assert main(["inspect", *(str(tmp_path / name) for name in names)]) == 2
    assert "is there already and stays as it is" in capsys.readouterr().err


MATERIALS = """*MATERIAL, NAME=X22
*ELASTIC, TYPE=ISOTROPIC
{E}, 0.3
*DENSITY
7700.,
*Material, name=Co
*Elastic
232e9, 0.31
*Density
8980.
"""
SECTIONS = """*SOLID SECTION, ELSET=OTHERS, MATERIAL=x22
*SOLID SECTION, ELSET=PIN, MATERIAL=Co
"""


def of_two_materials(folder, E="210e9", sections=SECTIONS, more=""):
    """Path of a proposed study: one file with two sections."""
    mesh, _ = joined()
    pin = mesh.cell_groups["pin"]
    rest = np.setdiff1d(np.concatenate(list(mesh.number.values())), pin)
    mesh = replace(mesh, cell_groups={"pin": pin, "others": rest})
    text = mesh_texts.plain(mesh) + MATERIALS.format(E=E) + sections + more
    (folder / "all.inp").write_text(text)
    assert main(["inspect", str(folder / "all.inp"), "--quiet"]) == 0
    return folder / "all.toml"


def test_materials_of_the_file(tmp_path):
    """Of most cells in [material], of others by their group; names in any case; the study runs with
    them."""
    path = of_two_materials(tmp_path)
    text = path.read_text()
    study = tomllib.loads(text)
    assert study["material"]["E"] == 210e9 and study["material"]["density"] == 7700
    assert study["material"]["pin"] == {
        "group": "pin",
        "E": 232e9,
        "nu": 0.31,
        "density": 8980,
    }
    path.write_text(text.replace('pull = "?"', "pull = 10").replace('mu = "?"', "mu = 0.3"))
    assert main(["inspect", str(path), "--quiet"]) == 0
    other = load_study(path).materials["pin"]
    assert other.E == 232e9 and other.group == "pin"


@pytest.mark.parametrize(
    "old, new, left",
    [
        ("", "", {}),
        ("E = 2.32e+11", "E = 2.321e11", {}),  # rounded
        ("E = 2.32e+11", "E = 200e9", {"damper": "Co"}),
        ("nu = 0.3\n", "nu = 0.28\n", {"blades": "X22"}),
    ],
)
def test_materials_are_left_out_only_where_the_study_has_others(tmp_path, old, new, left):
    """Other keywords are named as ever."""
    path = of_two_materials(tmp_path, more="*BOUNDARY\nclamp_one, 1, 3\n")
    text = path.read_text().replace('pull = "?"', "pull = 10").replace('mu = "?"', "mu = 0.3")
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert main(["inspect", str(path), "--quiet"]) == 0
    bodies = read(tmp_path / "results" / "all", "inspect.json")["bodies"]
    for name, body in bodies.items():
        said = "; ".join(body["not_read"])
        assert "keywords *BOUNDARY (1)" in said
        assert not any(word in said for word in ("*MATERIAL", "*ELASTIC", "*SOLID", "*DENSITY"))
        assert (f"material {left.get(name, '').upper()} of '" in said) == (name in left)
        assert said.count("material ") == (name in left)


@pytest.mark.parametrize(
    "change",
    [
        dict(E="210e3"),  # MPa in a file in m
        dict(E="210e9, 0.3, 20.\n200e9"),  # by temperature
        dict(E="1,0"),
        dict(more="*SOLID SECTION, ELSET=OTHERS, MATERIAL=Co\n"),  # two of one group
        dict(more="*SOLID SECTION, ELSET=OTHERS, MATERIAL=Ti\n"),  # unknown
        dict(sections="*SOLID SECTION, ELSET=OTHERS, MATERIAL=x22\n"),  # the pin has none
    ],
)
def test_materials_that_are_not_clear_are_asked_for(tmp_path, change):
    """All of them: the others would else stand for these too."""
    study = tomllib.loads(of_two_materials(tmp_path, **change).read_text())
    assert study["material"] == {"E": "?", "nu": "?", "density": "?"}


def test_what_is_not_filled_in_is_named(tmp_path, capsys):
    corner_study.write(tmp_path)
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    assert main(["inspect", str(tmp_path / "damper.toml")]) == 2
    assert "[material] E = '?'" in capsys.readouterr().err


@pytest.mark.parametrize("nodes, line", [(6, "share_force = true"), (1, "direction = ")])
def test_a_set_of_several_nodes_shares_its_force(tmp_path, monkeypatch, nodes, line):
    monkeypatch.setattr("tipdamp.proposal.trial.LONGEST", 0.0)
    blades = corner_study.blades()
    blades.groups["N_EXC"] = blades.groups["touch_one"][:nodes]
    corner_study.write(tmp_path, blades)
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    lines = (tmp_path / "damper.toml").read_text().splitlines()
    at = next(i for i, text in enumerate(lines) if text.startswith('# excitation = "N_EXC"'))
    assert lines[at + 1].startswith(f"# {line}")
    assert nodes == 1 or lines[at + 1].endswith("# equally, among the 6 nodes of that set")


def with_load_set(folder, name):
    """Both meshes, the load points of the damper under another name; their paths."""
    damper = corner_study.damper()
    damper.groups[name] = damper.groups.pop("load")
    corner_study.write(folder, None, damper)
    return [str(folder / file) for file in ("damper.inp", "blades.inp")]


@pytest.mark.parametrize("name", ["N_CF", "CF_NODES", "cf", "Centrifugal_set"])
def test_a_set_of_the_centrifugal_force_is_that_of_the_pull(tmp_path, name):
    found = propose([Path(file) for file in with_load_set(tmp_path, name)])
    assert found.groups["load_points"] == [name]


@pytest.mark.parametrize("name", ["scfold", "CFRP", "back"])
def test_parts_of_words_are_no_centrifugal_force(tmp_path, name):
    found = propose([Path(file) for file in with_load_set(tmp_path, name)])
    assert found.groups["load_points"] == []


def test_load_points_that_are_named(tmp_path, capsys, monkeypatch):
    """Unknown, the proposal says the command that names them; with it the study has them."""
    monkeypatch.setattr("tipdamp.proposal.trial.LONGEST", 0.0)
    meshes, study = with_load_set(tmp_path, "back"), tmp_path / "damper.toml"
    assert main(["inspect", *meshes, "--pull", "10"]) == 0
    said = capsys.readouterr().out
    assert "no group of nodes has a name that tells load_points" in said
    assert f"move {study} away, then tipdamp inspect {' '.join(meshes)} --pull 10 " in said
    assert "--load-points NAME, which is one of back, face_x, face_z" in said
    text = study.read_text()
    again = "#   tipdamp inspect damper.inp blades.inp --pull 10 --load-points NAME\n"
    assert again + 'load_points = "?"' in text
    study.unlink()
    assert main(["inspect", *meshes, "--load-points", "bakc"]) == 2
    error = capsys.readouterr().err
    assert "--load-points: damper.inp: no group 'bakc'; did you mean 'back'" in error
    assert main(["inspect", *meshes, "--load-points", "back"]) == 0
    assert '\nload_points = "back"' in study.read_text() and again not in study.read_text()
    assert main(["inspect", str(study), "--load-points", "back"]) == 2
    assert "this one has its own load_points" in capsys.readouterr().err


def test_named_load_points_tell_the_damper_of_one_file(tmp_path):
    """The larger body is the damper where the set lies on it, and its name tells nothing."""
    mesh, _ = joined()
    (tmp_path / "all.inp").write_text(mesh_texts.plain(mesh))
    whole = read_mesh(tmp_path / "all.inp")
    found = propose([tmp_path / "all.inp"], "load")
    assert np.isin(whole.groups["load"], found.meshes["damper"].node).all()
    found = propose([tmp_path / "all.inp"], "clamp_one")
    assert np.isin(whole.groups["clamp_one"], found.meshes["damper"].node).all()


def test_wedge_under_platforms():
    """Sides of 30 and 45 degrees, in mm, by surfaces that go on beyond the damper; pairs that
    match."""
    found = propose([WEDGE / "coarse_damper.msh", WEDGE / "coarse_blades.msh"])
    assert [(s.name, s.blade, s.damper, s.matching) for s in found.sides] == [
        ("left", "pf_L", "wd_L", True),
        ("right", "pf_R", "wd_R", True),
    ]
    assert (
        found.length == "mm"
        and found.axis.tolist() == [0, 1, 0]
        and found.pull.tolist() == [0, 0, 1]
    )
    angles = [
        np.degrees(np.arctan2(abs(s.patch.normal[0]), s.patch.normal[2])) for s in found.sides
    ]
    assert angles == pytest.approx([30, 45], abs=0.1) and all(s.patch.flat for s in found.sides)
    assert found.groups == {
        "clamp": ["Fixed"],
        "load_points": ["pullpts"],
        "excitation": ["shaker"],
        "patches": ["tipL", "tipR"],
    }
    text = study_text(found, {"blades": "b.msh", "damper": "d.msh"})
    assert "# direction = [1, 0, 0] " in text and '\nhold = { motion = "y", mean = true }\n' in text


def test_a_tip_that_is_excited_is_no_patch(tmp_path):
    """'exc_tip' is the excitation, and groups that are called a response come before other tips."""
    blades = corner_study.blades()
    first = next(iter(blades.groups.values()))
    names = ("exc_tip", "resp_left", "resp_right", "tip_A")
    blades = replace(blades, groups={name: first for name in names})
    corner_study.write(tmp_path, blades, corner_study.damper())
    groups = propose([tmp_path / "damper.inp", tmp_path / "blades.inp"]).groups
    assert groups["excitation"][0] == "exc_tip"
    assert groups["patches"] == ["resp_left", "resp_right", "tip_A"]


@pytest.mark.parametrize(
    "damper, keys",
    [
        (corner_study.damper, {"stations": "all"}),
        (corner_study.unlike, {"by": "area", "kept_share": 1}),
    ],
)
def test_points_of_unlike_meshes_are_tuned_by_area(tmp_path, damper, keys):
    corner_study.write(tmp_path, corner_study.blades(), damper())
    found = propose([tmp_path / "damper.inp", tmp_path / "blades.inp"])
    text = study_text(found, {"blades": "b.inp", "damper": "d.inp"})
    lines = [
        line.removeprefix("# ") for line in text.split("# [tune]\n")[1].split("#\n")[0].splitlines()
    ]
    assert tomllib.loads("\n".join(lines)) == keys


def test_without_any_group_it_is_said_what_is_needed(tmp_path, capsys):
    """The bodies and sides are found all the same."""
    bare = [
        replace(mesh, groups={}, cell_groups={})
        for mesh in (corner_study.blades(), corner_study.damper())
    ]
    corner_study.write(tmp_path, *bare)
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    said = capsys.readouterr().out
    assert (
        "clamp, load_points, excitation and patches are groups of nodes, and there are none" in said
    )
    assert said.count("faces of the damper meet") == 2


def test_faces_of_the_blades_that_go_on_beyond_the_damper(tmp_path, capsys):
    """No group names the sides, and faces of the blades lie half beside the damper: all that it
    meets is picked."""
    blades, damper = corner_study.blades(), corner_study.damper(at=(0, 0.3 * A, 0))
    blades = replace(
        blades, groups={k: v for k, v in blades.groups.items() if k.startswith("clamp")}
    )
    damper = replace(damper, groups={"load": damper.groups["load"]})
    corner_study.write(tmp_path, blades, damper)
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    assert "are groups of nodes" not in capsys.readouterr().out
    study = load_study(filled(tmp_path / "damper.toml"))
    points = surface_points(study, read_meshes(study))
    assert points.pairs.area.sum() == pytest.approx(2 * 0.7 * A**2)


def test_a_damper_along_no_coordinate(tmp_path):
    """Both bodies turned by 12 degrees about x: the axis lies along both sides, the pull across it,
    into both."""
    c, s = np.cos(np.radians(12)), np.sin(np.radians(12))
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    corner_study.write(
        tmp_path,
        *(
            replace(mesh, position=mesh.position @ turn.T)
            for mesh in (corner_study.blades(), corner_study.damper())
        ),
    )
    found = propose([tmp_path / "damper.inp", tmp_path / "blades.inp"])
    assert found.axis == pytest.approx(turn @ [0, 1, 0], abs=1e-5)
    assert found.pull == pytest.approx(turn @ np.array([1, 0, 1]) / np.sqrt(2), abs=1e-5)
    study = tomllib.loads(study_text(found, {"blades": "b.inp", "damper": "d.inp"}))
    assert [
        side["width"] for side in study["contact"].values() if isinstance(side, dict)
    ] == pytest.approx([A, A])


def test_round_side(rig):
    """The asymmetric rig: a flat and a round side."""
    found = propose([rig / "asymmetric_blades.msh", rig / "asymmetric_damper.msh"])
    shapes = {s.patch.flat for s in found.sides}
    assert len(found.sides) == 2 and shapes == {True, False} and found.length == "m"


def on_arc(z, radius):
    return np.sqrt(radius**2 - z**2) - radius


def arched(radius, rows=6, height=on_arc, kind="hexahedron"):
    """(mesh, its faces, mask of those towards x): a cube whose face x = A is a cylinder along y."""
    x, y, z = (mesh := corner_study.cube(kind, divisions=(2, 2, rows))).position.T
    top = np.where(x > 0.9 * A, height(z - A / 2, radius), 0.0)
    mesh = replace(mesh, position=np.column_stack([x + top, y, z]))
    mine = _Faces(mesh, boundary_faces(mesh))
    return mesh, mine, mine.normal[:, 0] > 0.9


@pytest.mark.parametrize("rows", [3, 4, 12])
def test_normals_that_turn_in_proportion_are_a_radius(rows):
    """Within 5.8 degrees of their mean at most, as on a flat side: R by the place of the faces."""
    radius = A / 2 / np.sin(np.radians(5.8))
    mesh, mine, facing = arched(radius, rows)
    patch = _patch(mesh, mine, facing, np.empty((0, 4), int))
    assert patch.spread < 6 and not patch.flat
    assert patch.radius == pytest.approx(radius, rel=2e-3)


@pytest.mark.parametrize("kind", ["hexahedron20", "hexahedron27", "tetra10", "wedge15"])
@pytest.mark.parametrize("rows", [1, 2, 5])
def test_curved_faces_hold_their_radius(kind, rows):
    """Inside of them normals turn: one or two across a side tell the cylinder, one of a few degrees
    and one of 15 to either edge."""
    for degrees in (2.0, 15.0):
        radius = A / 2 / np.sin(np.radians(degrees))
        mesh, mine, facing = arched(radius, rows, kind=kind)
        patch = _patch(mesh, mine, facing, np.empty((0, 4), int))
        assert not patch.flat
        assert patch.radius == pytest.approx(radius, rel=4e-3)


@pytest.mark.parametrize(
    "height, rows",
    [
        (lambda z: 0 * z, 1),
        (lambda z: 1e-4 * A * np.random.default_rng(3).uniform(-1, 1, z.shape), 1),  # few digits
        (lambda z: 1e-4 * A * np.random.default_rng(3).uniform(-1, 1, z.shape), 2),
        (lambda z: -0.03 * np.abs(z), 2),  # a roof
        (lambda z: 1e-3 * A * np.sin(900 * z / A), 8),  # uneven
    ],
)
def test_flats_of_quadratic_cells_stay_flat(height, rows):
    mesh, mine, facing = arched(1.0, rows, lambda z, _: height(z), "hexahedron27")
    assert _patch(mesh, mine, facing, np.empty((0, 4), int)).flat


def test_straight_quadratic_faces_of_an_arc_have_one_normal_each():
    """Their middle nodes lie on the chords, as where cells became quadratic after meshing."""

    def chords(z, radius):
        ends = np.linspace(-A / 2, A / 2, 7)
        return np.interp(z, ends, on_arc(ends, radius))

    mesh, mine, facing = arched(4 * A, 6, chords, "hexahedron20")
    found = _patch(mesh, mine, facing, np.empty((0, 4), int))
    assert found.radius == pytest.approx(4 * A, rel=2e-3)


def test_two_curved_faces_across_a_flank_of_the_rig_are_round(tmp_path):
    """30 faces with radius 6 mm whose mean normals lie within 4 degrees; the set of each whole
    side."""
    pytest.importorskip("gmsh")
    paths = generate(Rig(damper_radius=0.006, pitch=0.026), "cylindrical", 0.5, tmp_path)
    found = propose(list(paths.values()))
    assert [side.damper for side in found.sides] == ["side_left", "side_right"]
    for side in found.sides:
        assert side.patch.spread < 4 and not side.patch.flat
        assert side.patch.radius == pytest.approx(0.006, rel=1e-3)


@pytest.mark.parametrize(
    "height",
    [
        lambda z, _: 0 * z,
        lambda z, _: -0.05 * np.abs(z),  # a roof
        lambda z, _: 3e-4 * A * np.sin(900 * z / A),  # an uneven flat
    ],
)
def test_normals_that_turn_otherwise_are_none(height):
    mesh, mine, facing = arched(1.0, 12, height)
    assert _patch(mesh, mine, facing, np.empty((0, 4), int)).flat


def test_a_set_of_the_whole_side_beats_one_of_its_part(tmp_path):
    """Surfaces of which an arc is put together are groups, too."""
    mesh, mine, facing = arched(5 * A)
    lower = mine.key[facing & (mine.centre[:, 2] < 0.7 * A)]
    groups = {"surface_7": np.unique(lower), "flank": np.unique(mine.key[facing])}
    assert group_of(replace(mesh, groups=groups), mine.key[facing]) == "flank"


def test_a_boundary_is_a_candidate_of_the_clamp(tmp_path):
    blades = corner_study.blades()
    names = {"clamp_one": "Boundary_1", "clamp_two": "Boundary_2"}
    groups = {names.get(name, name): nodes for name, nodes in blades.groups.items()}
    corner_study.write(tmp_path, replace(blades, groups=groups))
    found = propose([tmp_path / "blades.inp", tmp_path / "damper.inp"])
    assert found.groups["clamp"] == ["Boundary_1", "Boundary_2"]


def with_lands():
    """The cube with a groove along z in its face x = A, which leaves two lands in one group."""
    mesh = corner_study.cube(divisions=(3, 5, 3))
    middle = mesh.position[mesh.cells["hexahedron"]].mean(axis=1)
    groove = (middle[:, 0] > 0.7 * A) & (np.abs(middle[:, 1] - A / 2) < 0.1 * A)
    mesh = cut(mesh, {"hexahedron": ~groove}, "damper")
    return replace(
        mesh,
        groups={
            "lands": corner_study.on(mesh, 0, A),
            "face_z": corner_study.on(mesh, 2, A),
            "load": np.intersect1d(corner_study.on(mesh, 0, 0.0), corner_study.on(mesh, 2, 0.0)),
        },
    )


@pytest.mark.parametrize(
    "blade_group, damper", [("touch_one", ["lands"]), ("touch", ["within", "within"])]
)
def test_lands_of_one_group_touch_once(tmp_path, blade_group, damper):
    """Two lands of a group opposite to one flank are one side; opposite to what may be two blades
    they are picked by geometry. Either way the area of contact is that of the lands, once (the
    groove also cuts the other side)."""
    blades = corner_study.blades()
    if blade_group == "touch":
        blades.groups["touch"] = np.union1d(
            blades.groups.pop("touch_one"), blades.groups.pop("touch_two")
        )
    corner_study.write(tmp_path, blades, with_lands())
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    study = load_study(filled(tmp_path / "damper.toml"))
    met = [
        side
        for name, side in study.sides.items()
        if side.blade == blade_group and side.damper != "face_z"
    ]
    assert ["lands" if s.damper == "lands" else "within" for s in met] == damper
    pairs = matched(study, read_meshes(study)).pairs
    assert pairs.area.sum() == pytest.approx((0.8 + 14 / 15) * A**2)


@pytest.mark.parametrize("angle, flat", [(30, True), (22.5, False)])
def test_edge_or_facet(angle, flat):
    """A wall that turns off the flank by 30 degrees is no part of it; the facets of a pin, 16 a
    turn, are one side."""
    mesh = corner_study.cube(divisions=(1, 1, 4))
    turn, x, y, z = np.radians(angle), *mesh.position.T
    place = np.column_stack(
        [x + np.maximum(z - A / 2, 0) * np.tan(turn) * (-1) * (x > A / 2), y, z]
    )
    mine = _Faces(replace(mesh, position=place), [f for f in boundary_faces(mesh)])
    facing = np.flatnonzero(mine.normal[:, 0] > 0.5)
    assert (len(np.unique(mine.pieces()[facing])) == 1) == (not flat)


def test_shape_from_the_group_of_the_flank(tmp_path):
    """Faces beside a flank that lie within reach do not bend it where a group says which faces it
    has."""
    corner_study.write(tmp_path)
    damper = read_mesh(tmp_path / "damper.inp")
    (block,) = boundary_faces(damper)
    keys = face_keys(damper.node[block])
    own = np.isin(keys, damper.groups["face_x"]).all(axis=1)
    rim = np.flatnonzero(~own)[:1]
    patch = Patch(
        keys[np.concatenate([np.flatnonzero(own), rim])],
        keys[:1],
        np.array([1.0, 0, 0]),
        30.0,
        np.array([[0, 0, 0], [A, A, A]]),
        1.25 * A**2,
    )
    found = within_group(damper, patch, "face_x")
    assert (
        found.spread == pytest.approx(0, abs=1e-5)
        and found.area == pytest.approx(A**2)
        and found.flat
    )
    assert found.box[0][0] == pytest.approx(A)


@pytest.mark.parametrize(
    "names, message",
    [
        (
            ["blades.inp"],
            r"lies within 0.\d+ m of .* the mesh of the damper is missing, name it too",
        ),
        (
            ["damper.inp", "blades.inp", "damper.inp"],
            "3 meshes: one file with all bodies is wanted",
        ),
        (["damper.inp"], "all its cells are connected: blades and damper cannot be told apart"),
        (["far.inp", "blades.inp"], "no face of far.inp .27 nodes. lies within"),
        (["corner.toml", "blades.inp"], "one study at a time, or mesh files alone"),
    ],
)
def test_refusals(tmp_path, capsys, names, message):
    corner_study.write(tmp_path)
    (tmp_path / "far.inp").write_text(mesh_texts.plain(corner_study.damper(at=(0, 0.5, 0))))
    assert main(["inspect", *(str(tmp_path / name) for name in names)]) == 2
    assert re.search(message, capsys.readouterr().err) and not (tmp_path / "damper.toml").exists()


def test_names_with_quotes(tmp_path):
    """Group names are text of the file: they cannot break out of the study."""
    shutil.copy(WEDGE / "coarse_blades.msh", tmp_path)
    text = (
        (WEDGE / "coarse_damper.msh")
        .read_text()
        .replace('"pullpts"', '"pull\\"\\npts"'.replace("\\n", " "))
    )
    (tmp_path / "coarse_damper.msh").write_text(text)
    assert (
        main(["inspect", str(tmp_path / "coarse_damper.msh"), str(tmp_path / "coarse_blades.msh")])
        == 0
    )
    assert (
        tomllib.loads((tmp_path / "coarse_damper.toml").read_text())["damper"]["load_points"]
        == 'pull\\" pts'
    )


def test_internal_sets_are_not_offered(tmp_path, capsys):
    """Those of a pre-processor, by their underscore: neither for a side, though they fit it best,
    nor among the groups to choose from; named by the user they are read."""
    blades, damper = corner_study.blades(), corner_study.damper()
    groups = {"_touch_S1": blades.groups["touch_one"], "_support": blades.groups["clamp_one"]}
    blades = replace(blades, groups={**groups, **blades.groups})
    corner_study.write(tmp_path, blades, damper)
    names = [str(tmp_path / name) for name in ("damper.inp", "blades.inp")]
    assert main(["inspect", *names, "--quiet"]) == 0
    text = (tmp_path / "damper.toml").read_text()
    assert '"touch_one"' in text and "_S1" not in text and "_support" not in text
    assert len(blades.group("_support")) == 9
    with pytest.raises(InputError, match="no group 'nothing'") as refused:
        blades.group("nothing")
    assert "touch_one" in str(refused.value) and "_support" not in str(refused.value)
