"""What contact sections and pair tables may hold: lands, gap profiles, groups of the wrong side,
rows that repeat."""

from dataclasses import replace

import numpy as np
import pytest

from tests.static_contact.beams import beam, supports
from tests.tipdamp import corner_study
from tests.tipdamp.corner_study import A
from tests.tipdamp.rig_study import write_chain
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.contact.preload import StaticContact

LANDS = (
    "".join(
        f'[contact.{name}b]\nblade = "touch_{name}b"\ndamper = "face_{axis}b"\nshape = "flat"\n'
        "kn = 1e6\nkt = 1e6\nwidth = 0.01\n"
        for name, axis in (("one", "x"), ("two", "z"))
    )
    + "[respond]"
)


def with_lands(mesh, **across):
    """The mesh with the last row of nodes of each group split off as a group of its own: {group:
    axis across}."""
    groups = dict(mesh.groups)
    for name, axis in across.items():
        nodes = groups[name]
        last = np.isclose(mesh.position[mesh.index(nodes), axis], A)
        groups[name], groups[f"{name}b"] = nodes[~last], nodes[last]
    return replace(mesh, groups=groups)


def preload(path, capsys):
    """(exit code, errors, results) of the stages up to the preload."""
    code = main(["reduce", str(path), "--quiet"]) or main(["preload", str(path), "--quiet"])
    return code, capsys.readouterr().err, Store(path.parent / "results" / path.stem)


def test_two_lands_on_each_side(tmp_path, capsys):
    """The same pairs as one land a side: the map is the same, and the lands share what the side
    carries."""
    whole = tmp_path / "whole"
    whole.mkdir()
    assert preload(corner_study.write(whole), capsys)[0] == 0
    path = corner_study.write(
        tmp_path,
        with_lands(corner_study.blades(), touch_one=2, touch_two=0),
        with_lands(corner_study.damper(), face_x=2, face_z=0),
        [("[respond]", LANDS)],
    )
    code, error, store = preload(path, capsys)
    assert code == 0, error
    one = ContactTable.load(whole / "results" / "corner" / "preload.csv")
    lands = ContactTable.load(store.path("preload.csv"))
    sides = store.read_json("preload.json")["sides"]
    assert lands.sides == ["one", "two", "oneb", "twob"]
    for side in ("one", "two"):
        mine, parts = one.side == side, np.char.startswith(lands.side, side)
        given = {
            node: force
            for node, force in zip(lands.blade_node[parts], lands.preload[parts], strict=True)
        }
        assert [given[n] for n in one.blade_node[mine]] == pytest.approx(
            one.preload[mine], rel=1e-9
        )
        assert sides[side]["sum_N"] + sides[f"{side}b"]["sum_N"] == pytest.approx(
            10 / np.sqrt(2), rel=1e-6
        )


def test_lands_whose_stiffness_depends_on_their_force(tmp_path, capsys):
    """Half-space theory needs the force of a side, which elasticity decides: said, with what can be
    given."""
    land = LANDS.replace("kn = 1e6\nkt = 1e6\n", "").split("[contact.twob]")[0]
    path = corner_study.write(
        tmp_path,
        with_lands(corner_study.blades(), touch_one=2),
        with_lands(corner_study.damper(), face_x=2),
        [("mu = 0.3\n", 'mu = 0.3\nstiffness = "halfspace"\n'), ("[respond]", land + "[respond]")],
    )
    code, error, _ = preload(path, capsys)
    assert code == 2 and "[contact.oneb]: elasticity decides how its force is shared" in error
    assert "give it: kn_per_area and kt_per_area" in error


@pytest.mark.parametrize(
    "gap, message",
    [
        (
            "[[0, 0], [0.005, 3], [0.01, 0]]",
            "[contact.one] gap = 3 m: larger than a tenth of the damper, which is 0.01 m",
        ),
        (
            "[[0, 0], [0.008, 1e-6]]",
            "[contact.one] gap: the profile reaches from 0 m to 0.008 m along the axis, the pairs "
            "of the side from 0 m to 0.01 m; give rows up to both ends",
        ),
        ("[[0, 0], [0.005, 1e-6], [0.01, 0]]", None),
    ],
)
def test_gap_profiles(tmp_path, capsys, gap, message):
    """Three metres in the middle; a profile that ends before the side does; one of a micrometre."""
    path = corner_study.write(
        tmp_path, change=[('shape = "flat"\n', f'shape = "flat"\ngap = {gap}\n')]
    )
    code = main(["inspect", str(path), "--quiet"])
    assert code == (2 if message else 0) and (message or "") in capsys.readouterr().err
    code, error, _ = preload(path, capsys)
    assert code == (2 if message else 0) and (message or "") in error


def test_swapped_groups(tmp_path, capsys):
    path = corner_study.write(
        tmp_path,
        change=[
            ('damper = "face_x"', 'damper = "face_q"'),
            ("face_z", "face_x"),
            ("face_q", "face_z"),
        ],
    )
    assert main(["inspect", str(path), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert (
        "[contact.one]: the nodes of blade group 'touch_one' lie on those of damper group "
        "'face_x', which [contact.two] names: the groups are swapped"
        in error
        and "would match them" not in error
    )


@pytest.mark.parametrize(
    "column, value, message",
    [
        ("row", -1, "pair 3: station 2, row -1: must be 0 or more"),
        ("station", -2, "pair 3: station -2, row 0: must be 0 or more"),
        ("station", 0, "station 0, row 0 is there twice (pairs 1 and 3; 1 such)"),
    ],
)
def test_rows_of_a_table(tmp_path, capsys, column, value, message):
    path = write_chain(tmp_path)
    pairs = ContactTable.load(tmp_path / "pairs.csv")
    changed = vars(pairs)[column].copy()
    changed[2] = value
    pairs.replace(**{column: changed}).save(tmp_path / "pairs.csv")
    assert main(["reduce", str(path), "--quiet"]) == 2
    assert message in capsys.readouterr().err


def test_a_pair_on_two_sides():
    """Its stiffness would count twice; the same nodes with another normal, on an edge, are another
    pair."""
    x = np.linspace(0, 0.07, 3)
    table = supports(x, np.full(3, 1e6), np.zeros(3))
    twice = table.select([0, 1, 2, 1]).replace(side=np.array(["a", "a", "a", "b"]))
    with pytest.raises(
        InputError,
        match="blade node 1 and damper node 2 is there twice .pairs 2 and 4, on the sides "
        "'a' and 'b'; 1 such.; its stiffness would count twice",
    ):
        StaticContact(beam(x, 5.0), twice)
    StaticContact(beam(x, 5.0), twice.replace(weight=np.array([1.0, 1, 1, 0])))
    turned = twice.frame.copy()
    turned[3] = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    StaticContact(beam(x, 5.0), twice.replace(frame=turned))


def test_overlaps_without_load():
    """2 mm of overlap and no load: the beam backs off, and no force is left."""
    x = np.linspace(0, 0.07, 31)
    statics = StaticContact(beam(x, 1e6), supports(x, np.full(31, 1e6), np.zeros(31)))
    load = np.linspace(1.0, 2.0, 31)
    found = statics.solve(0 * load, gap=np.full(31, -2e-3))
    assert (found.force == 0).all() and found.residual == 0 and found.opening.min() > -1e-12
