"""Sides whose nodes do not match meet as surfaces: named, or picked by geometry; what does not fit
is refused."""

import json
import re

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.bad_meshes import inspect
from tests.tipdamp.corner_study import A, unlike
from tipdamp.bodies.pair import matched, places_on
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.surfaces import surface_points
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.statics.model_inputs import line_of
from tipdamp.study.study import load_study

TOTAL = [("kn = 1e6\nkt = 1e6", "kn_total = 9e6\nkt_total = 9e6")] * 2


def read(path):
    study = load_study(path)
    return study, read_meshes(study)


@pytest.mark.slow
def test_unlike_sides_from_files_to_a_preload(tmp_path, capsys):
    """Areas and stiffness of the faces, sums of the balance, as on the matching meshes; the stuck
    frequency too."""
    hz = {}
    for name, mesh in (("unlike", unlike()), ("alike", None)):
        folder = tmp_path / name
        folder.mkdir()
        path = corner_study.write(
            folder,
            damper_mesh=mesh,
            change=[*TOTAL, ("[respond]", '[tune]\nstations = "all"\n[respond]')],
        )
        for verb in ("inspect", "reduce", "preload", "tune"):
            assert main([verb, str(path), "--quiet"]) == 0, capsys.readouterr().err
        results = folder / "results" / "corner"
        pairs = ContactTable.load(results / "preload.csv")
        for side in ("one", "two"):
            mine = pairs.select(pairs.side == side)
            assert mine.preload.sum() == pytest.approx(10 / np.sqrt(2), rel=1e-9)
            assert mine.kn.sum() == pytest.approx(9e6) and mine.on_surface.all() == (
                name == "unlike"
            )
        hz[name] = json.loads((results / "tune.json").read_text())["stuck_hz"]["full_area"]
        if name == "unlike":
            assert pairs.area.sum() == pytest.approx(
                2 * A**2
            ) and pairs.kn / pairs.area == pytest.approx(np.full(len(pairs), 9e6 / A**2))
            assert np.array_equal(np.unique(pairs.station[pairs.side == "one"]), [0, 1, 2])
    assert hz["unlike"] == pytest.approx(hz["alike"], rel=0.03)


def test_picked_by_geometry(tmp_path):
    """Plane, distance of the other body and box find what the groups name; picked faces are groups
    of the meshes."""
    named = corner_study.write(tmp_path, damper_mesh=unlike(), change=TOTAL)
    wanted = matched(*read(named)).pairs
    picked = corner_study.write(
        tmp_path,
        damper_mesh=unlike(),
        change=[
            *TOTAL,
            ('"touch_one"', "{ within = 1e-4 , box = [[0.009, 0, 0], [0.011, 1, 1]] }"),
            ('"face_x"', "{ plane = [1, 0, 0], point = [0.01, 0, 0] }"),
            (
                '"touch_two"',
                "{ plane = [0, 0, -2], point = [5, 5, 0.01], box = [[0, 0, 0], [0.01, 1, 1]] }",
            ),
            ('"face_z"', '{ within = 1e-4, group = "face_z" }'),
        ],
    )
    study, meshes = read(picked)
    found = matched(study, meshes).pairs
    assert len(found) == len(wanted) and np.allclose(found.position, wanted.position)
    assert found.area == pytest.approx(wanted.area)
    assert len(meshes["damper"].group("[contact.one] damper")) == len(
        meshes["damper"].group("face_x")
    )


def test_method_and_matching_nodes(tmp_path):
    """Nodes that match are paired unless the study asks for surfaces; then the gap is that between
    the surfaces."""
    change = [*TOTAL, ("mu = 0.3", 'mu = 0.3\nmethod = "%s"')]
    tables = {}
    for method in ("auto", "nodes", "surfaces"):
        study, meshes = read(
            corner_study.write(
                tmp_path, change=[*change[:2], (change[2][0], change[2][1] % method)]
            )
        )
        tables[method] = matched(study, meshes).pairs
        assert (surface_points(study, meshes) is not None) == (method == "surfaces")
    assert all(
        np.array_equal(one, vars(tables["nodes"])[name])
        for name, one in vars(tables["auto"]).items()
    )
    assert len(tables["surfaces"]) == 18 and tables["surfaces"].on_surface.all()
    apart = corner_study.damper(at=(-1e-4, 0.0, 0.0))
    study, meshes = read(corner_study.write(tmp_path, damper_mesh=apart, change=TOTAL))
    pairs = matched(study, meshes).pairs
    one = pairs.side == "one"
    assert pairs.gap[one] == pytest.approx(1e-4) and pairs.gap[~one] == pytest.approx(0, abs=1e-12)
    places = places_on(meshes, pairs)
    assert (places["blades"] - places["damper"])[one] == pytest.approx(
        np.tile([1e-4, 0, 0], (one.sum(), 1)), abs=1e-12
    )


@pytest.mark.parametrize(
    "change, message",
    [
        ([], "the two surfaces need the same nodes.*kn_per_area, kn_total or a model"),
        (
            [("mu = 0.3", 'mu = 0.3\nmethod = "surfaces"')],
            r"\[contact.one\] kn and kt are per node, which means nothing",
        ),
        (
            [*TOTAL, ('"face_x"', "{ plane = [1, 0, 0], point = [0.02, 0, 0] }")],
            r"\[contact.one\] damper: no face on the surface of damper.inp: "
            "the nearest lies 0.01 m off the plane and its normal 0 degrees; .* state tolerance",
        ),
        (
            [*TOTAL, ('"face_x"', "{ box = [[5, 5, 5], [6, 6, 6]] }")],
            "none has all its nodes in the box; enlarge it",
        ),
        (
            [*TOTAL, ('"face_x"', "{ plane = [1, 0, 0], point = [0, 0, 0], within = 1e-4 }")],
            r"\d+ faces fulfil the rest, but none of them lies within 0.0001 m of a face of "
            r"blades.inp",
        ),
        (
            [
                *TOTAL,
                (
                    '"face_x"',
                    "{ cylinder = [0, 1, 0], point = [0, 0, 0], radius = 0.05, tolerance = 1e-3 }",
                ),
            ],
            r"the nearest lies 0.0\d+ m off the cylinder and its normal \d+ degrees; .* \(now "
            r"0.001 m\)",
        ),
        (
            [*TOTAL, ('"face_x"', '"load"')],
            r"\[contact.one\] damper: no face .* among the \d+ nodes of group 'load'",
        ),
        (
            [*TOTAL, ('"face_x"', '"face_z"')],
            "side 'one': .* damper faces of 'face_z' and 4 blade faces of 'touch_one'",
        ),
        (
            [
                *TOTAL,
                ("[material]", '[units]\nlength = "mm"\n[material]'),
                ('"touch_one"', '"clamp_one"'),
            ],
            "side 'one': .* do not touch: their centres are 0.01.* mm apart at the nearest, and "
            "gaps up to 0.001 mm",
        ),
    ],
)
def test_refused(tmp_path, capsys, nothing_is_assembled, change, message):
    """One line with the file, the side, what was found and what to do, before anything is
    assembled."""
    code, error, _ = inspect(
        corner_study.write(tmp_path, damper_mesh=unlike(), change=change), capsys
    )
    assert code == 2 and re.search(message, error) and "corner.toml: " in error


def test_faces_that_meet_on_two_sides_are_refused(tmp_path, capsys, nothing_is_assembled):
    """Half of the second side is the first one again: its contact would count twice. Faces of one
    body alone do not."""
    more = unlike()
    more.groups["both"] = np.union1d(more.groups["face_x"], more.groups["face_z"])
    blades = corner_study.blades()
    blades.groups["both"] = np.union1d(blades.groups["touch_one"], blades.groups["touch_two"])
    twice = [*TOTAL, ('"touch_two"', '"both"'), ('"face_z"', '"both"')]
    code, error, _ = inspect(corner_study.write(tmp_path, blades, more, change=twice), capsys)
    assert (
        code == 2
        and "corner.toml: sides 'one' and 'two' share" in error
        and "would count twice" in error
    )
    for change in (twice[:3], [*TOTAL, twice[3]]):
        study, meshes = read(corner_study.write(tmp_path, blades, more, change=change))
        assert matched(study, meshes).pairs.area.sum() == pytest.approx(2 * A**2)


@pytest.mark.parametrize(
    "table, message",
    [
        ("{ plane = [1, 0, 0] }", "point is missing: plane needs it"),
        ("{ cylinder = [0, 1, 0], point = [0, 0, 0] }", "radius is missing: cylinder needs it"),
        ("{ sphere = 1 }", "unknown key 'sphere'"),
        ('{ group = "a" }', "one of plane, cylinder, within and box is needed"),
        ("{ within = 0 }", "within must be above 0"),
        ("{ plane = [0, 0, 0], point = [0, 0, 0] }", "must not be zero"),
        ("{ box = [[0, 0, 0]] }", "box must be two corners"),
        ("3", "must be the name of a group, or a table"),
    ],
)
def test_tables_that_mean_nothing(tmp_path, capsys, table, message):
    path = corner_study.write(tmp_path, change=[*TOTAL, ('"face_x"', table)])
    assert main(["inspect", str(path), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert "[contact.one] damper = " in error and message in error


@pytest.mark.parametrize("flat", [True, False])
def test_gaps_of_whole_faces_are_said(tmp_path, capsys, flat):
    """A side that stands off by more than a tenth of its faces: a warning with the count and the
    gap in mm. Points of a round side that cannot touch take no share of its stiffness."""
    shape = () if flat else (('"flat"', '"cylinder"'), ("width = 0.01", "radius = 0.1"))
    apart = corner_study.damper(at=(-6e-4, 0.0, 0.0))
    code, _, warnings = inspect(
        corner_study.write(tmp_path, damper_mesh=apart, change=[*TOTAL, *shape]), capsys
    )
    assert code == 0
    [found] = [w for w in warnings if w.startswith("side 'one'") and "have gaps" in w]
    assert ("take their share" in found) == flat
    checks = json.loads((tmp_path / "results/corner/inspect.json").read_text())["pair_checks"]
    # two: 0.6 mm beside
    assert [checks[s]["area_m2"] / A**2 for s in ("one", "two")] == pytest.approx([1, 0.94])
    assert [checks[s]["faces_m2"] / A**2 for s in ("one", "two")] == pytest.approx([1, 1])
    assert "9 of 9 contact points have gaps" in found and "up to 0.0006 m at point" in found


def test_no_edge_line_without_rows(tmp_path):
    """Faces in no rows have no lower edge line; those of a grid of cells have one."""
    edge = [
        *TOTAL,
        ("width = 0.01", 'width = 0.01\nrows = "edge"'),
        ("mu = 0.3", 'mu = 0.3\nmethod = "surfaces"'),
        ("[respond]", '[tune]\nstations = "all"\n[respond]'),
    ]
    study, meshes = read(corner_study.write(tmp_path, damper_mesh=unlike(), change=edge))
    pairs = matched(study, meshes).pairs
    assert line_of(study, pairs).carrying.sum() == 3 + (pairs.side == "two").sum()
    some = pairs.select(np.arange(len(pairs)) != 1)
    with pytest.raises(
        InputError,
        match=r"\[contact.one\] rows = 'edge': .* hold 4 to 5 contact points; rows = 'all'",
    ):
        line_of(study, some)


def test_nodes_and_surfaces_of_one_contact_are_refused(tmp_path, capsys, nothing_is_assembled):
    """Side one pairs its nodes; a third side takes a part of the same faces as surfaces."""
    third = (
        '[contact.three]\nblade = { group = "touch_one", box = [[0, 0, 0], [1, 0.0051, 1]] '
        '}\ndamper = "face_x"\nshape = "flat"\nkn_total = 1e6\nkt_total = 1e6\nwidth = '
        "0.01\n[respond]"
    )
    path = corner_study.write(tmp_path, change=[("[respond]", third)])
    code, said, _ = inspect(path, capsys)
    assert code == 2 and re.search(
        r"\[contact.one\]: 6 of its 9 pairs of nodes lie within the surfaces of side "
        "'three': their contact would count twice",
        said,
    )
