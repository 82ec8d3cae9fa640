"""Contact pairs: matched between the meshes, or a table of the user's own."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.bad_meshes import inspect
from tests.tipdamp.rig_study import own_pairs, read
from tipdamp.bodies.pair import matched
from tipdamp.bodies.read import read_meshes
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.study.study import load_study


def test_faces_of_20_node_hexahedra_are_paired(tmp_path):
    """Stations through the middles of edges have fewer rows (0, 2, 4 of 5): the lowest row is there
    at each."""
    path = corner_study.write(
        tmp_path, corner_study.blades("hexahedron20"), corner_study.damper("hexahedron20")
    )
    study = load_study(path)
    pairs = matched(study, read_meshes(study)).pairs
    one = pairs.select(pairs.side == "one")
    found = [one.row[one.station == s].tolist() for s in range(5)]
    assert found == [[0, 1, 2, 3, 4], [0, 2, 4], [0, 1, 2, 3, 4], [0, 2, 4], [0, 1, 2, 3, 4]]
    assert one.position[:, 2] == pytest.approx(one.row * 2.5e-3)
    assert one.position[:, 1] == pytest.approx(one.station * 2.5e-3)


@pytest.mark.parametrize(
    "change, message",
    [
        (
            lambda p: p.replace(station=p.station + 1),
            "stations must count from 0 without a gap, found 1..31",
        ),
        (lambda p: p.replace(station=30 - p.station), "does not lie further along the axis"),
        (
            lambda p: p.replace(damper_body=np.full(len(p), "pin")),
            "damper_body 'pin' must be 'damper'",
        ),
    ],
)
def test_own_tables_are_checked(variant, tmp_path, capsys, change, message):
    variant("inspect")
    change(ContactTable.load(tmp_path / "pairs.csv")).save(tmp_path / "pairs.csv")
    assert main(["reduce", str(tmp_path / "rig.toml"), "--quiet"]) == 2
    assert message in capsys.readouterr().err


def test_warning_of_friction_above_two(variant, tmp_path):
    variant("inspect")
    pairs = ContactTable.load(tmp_path / "pairs.csv")
    pairs.replace(mu=np.where(np.arange(len(pairs)) == 4, 60.0, pairs.mu)).save(
        tmp_path / "pairs.csv"
    )
    warnings = read(variant("inspect"), "inspect.json")["warnings"]
    assert [
        w
        for w in warnings
        if "1 of 93 pairs have a friction coefficient above 2, pair 5 (side 'left') 60" in w
    ]


@pytest.mark.slow
def test_own_table_of_pairs(copy):
    """Half the stiffness on all pairs, from a CSV: the same sum of preloads, lower stuck
    frequencies."""
    store_before = json.loads((copy / "results" / "rig" / "tune.json").read_text())["stuck_hz"]
    pairs = ContactTable.load(copy / "results" / "rig" / "preload.csv")
    pairs.replace(kn=pairs.kn / 2, kt=pairs.kt / 2).save(copy / "mine.csv")
    text = (copy / "mine.csv").read_bytes()
    path = own_pairs(copy)
    for verb in ("reduce", "preload", "tune"):
        assert main([verb, path, "--quiet"]) == 0
    assert (copy / "mine.csv").read_bytes() == text
    after = json.loads((copy / "results" / "rig" / "tune.json").read_text())["stuck_hz"]
    assert all(after[k] < store_before[k] for k in after)


def test_unmatched_surfaces(tmp_path, capsys, nothing_is_assembled):
    shifted = corner_study.damper(at=(0.0, 3e-4, 0.0))
    code, error, _ = inspect(corner_study.write(tmp_path, damper_mesh=shifted), capsys)
    assert code == 2 and "18 without a partner within 1e-06 m (largest distance 0.0003 m)" in error
    assert "tolerance = 0.00033 m would match them" in error


def test_normals_that_point_the_same_way(tmp_path, capsys, nothing_is_assembled):
    """The damper lies inside blade one: its face x = A is blade one's own."""
    inside = corner_study.cube(at=(corner_study.A, 0, 0))
    groups = {
        "face_x": corner_study.on(inside, 0, corner_study.A),
        "face_z": corner_study.on(inside, 2, corner_study.A),
        "load": inside.node[:3],
    }
    code, error, _ = inspect(
        corner_study.write(tmp_path, damper_mesh=replace(inside, groups=groups)), capsys
    )
    assert code == 2 and "normals of the two faces must oppose each other" in error


def test_overlap_larger_than_the_elements(tmp_path, capsys):
    deep = corner_study.damper()
    deep.position[np.isin(deep.node, deep.groups["face_x"]), 0] += 6e-3
    change = [("[contact]", "[contact]\ntolerance = 8e-3")]
    code, error, _ = inspect(corner_study.write(tmp_path, damper_mesh=deep, change=change), capsys)
    assert (
        code == 2
        and "3 share their nearest partner with another: the two surfaces need the same nodes"
        in error
    )


def test_overlap_nearly_as_large_as_the_elements(tmp_path, capsys):
    """4 mm on nodes 5 mm apart: touching by default, and said; or taken as a (negative) gap when
    the study asks."""
    deep = corner_study.damper()
    deep.position[np.isin(deep.node, deep.groups["face_x"]), 0] += 4e-3
    change = [("[contact]", "[contact]\ntolerance = 4.5e-3")]
    code, _, warnings = inspect(
        corner_study.write(tmp_path, damper_mesh=deep, change=change), capsys
    )
    found = [w for w in warnings if w.startswith("side 'one'")]
    assert code == 0 and len(found) == 1 and not [w for w in warnings if w.startswith("side 'two'")]
    assert "9 pairs overlap, most at blade node" in found[0]
    assert (
        "-0.004 m, 0.8 of the distance of neighbouring nodes; they count as touching (shifted"
        in found[0]
    )
    change.append(("mu = 0.3", 'mu = 0.3\ndistance = "gap"'))
    from tipdamp.bodies.pair import matched
    from tipdamp.bodies.read import read_meshes
    from tipdamp.study.study import load_study

    study = load_study(corner_study.write(tmp_path, damper_mesh=deep, change=change))
    pairs = matched(study, read_meshes(study)).pairs
    assert pairs.gap[pairs.side == "one"] == pytest.approx(-4e-3)
    assert pairs.gap[pairs.side == "two"] == pytest.approx(0.0)
