"""Doubtful groups, units, pieces and pairs, by the rows of the catalogue of bad inputs (a10 to a19)."""

from dataclasses import replace

import numpy as np
import pytest

from hbm.errors import InputError
from tests.modal.blocks import block
from tests.tipdamp import corner_study
from tests.tipdamp.bad_meshes import every_format, inspect, write
from tipdamp.readers.dispatch import read_mesh

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


def test_range_of_angles_may_be_widened(tmp_path, capsys):
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
    bound = float(found[0].split(" N/m), real")[0].rpartition("(")[2])
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


def test_overlap_larger_than_the_elements(tmp_path, capsys):
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


@pytest.mark.parametrize("old, new, words", [
    ('"clamp_two"]', '"touch_two"]', "[contact.two] the pairs: node 98 of the blades is clamped by group 'touch_two'"),
    ('"touch_two"]', '"clamp_two"]', "[respond] group 'clamp_two': node 104 of the blades is clamped by")])
def test_b32_clamped_nodes_that_must_move(tmp_path, capsys, nothing_is_assembled, old, new, words):
    code, error, _ = inspect(corner_study.write(tmp_path, change=[(old, new)]), capsys)
    assert code == 2 and words in error and "9 such nodes" in error


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
    from tipdamp.bodies.pair import matched_pairs
    from tipdamp.bodies.read import read_meshes
    from tipdamp.study.study import load_study

    study = load_study(corner_study.write(tmp_path, damper_mesh=deep, change=change))
    pairs = matched_pairs(study, read_meshes(study))
    assert pairs.gap[pairs.side == "one"] == pytest.approx(-4e-3)
    assert pairs.gap[pairs.side == "two"] == pytest.approx(0.0)
