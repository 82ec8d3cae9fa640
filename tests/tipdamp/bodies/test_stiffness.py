"""Stiffness and gaps of the pairs: given, from a model, by weights."""

import shutil

import numpy as np
import pytest

from tests.conftest import STUDY, changed
from tests.contact_tables import contact_table
from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import write_chain
from tipdamp.bodies import stiffness
from tipdamp.bodies.pair import matched
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.stiffness import side_materials, with_values
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair
from tipdamp.static_contact.stiffness.nodal_stiffness import (
    StiffnessModel,
    given_stiffness,
    nodal_stiffness,
)
from tipdamp.static_contact.stiffness.rough_surfaces import Roughness
from tipdamp.static_contact.stiffness.side_stiffness import ContactSide
from tipdamp.study.study import load_study

STEEL = (207e9, 0.3, 207e9, 0.3)
EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))  # N, frictionless balance between faces at 45 degrees
RADIUS = ('shape = "cylinder"', 'shape = "cylinder"\nradius = 2e-3')
NO_LEFT = ("kn = 3.32e6\nkt = 3.02e6\n", "")
NO_RIGHT = ("kn = 1.03e6\nkt = 0.94e6\n", "")


def stiffness_of(rig_results, tmp_path, *changes):
    """(pairs with their stiffness, what each side's was made from) of the rig's study with
    changes."""
    (tmp_path / "s.toml").write_text(changed(STUDY, *changes))
    study = load_study(tmp_path / "s.toml")
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    materials = dict.fromkeys(pairs.sides, STEEL)
    return (
        stiffness.with_values(study, pairs, materials),
        stiffness.facts(study, pairs, stiffness.side_stiffness(study, pairs, materials), materials),
    )


@pytest.mark.parametrize(
    "words, left, right, how",
    [
        ('stiffness = "halfspace"', "", "", {}),
        (
            'stiffness = "halfspace"\nkind = "secant"\nscale = 0.1',
            "",
            "",
            {"kind": "secant", "scale": 0.1},
        ),
        (
            'stiffness = "plane_depth"',
            "depth = [5e-3, 1e-3]",
            "depth = [5e-3, 1e-3]",
            {"name": "plane_depth", "depth": (5e-3, 1e-3)},
        ),
        (
            'stiffness = "rough_series"',
            "h_rms = 1e-6\ngamma = 0.5",
            "h_rms = 1e-6\ngamma = 0.5",
            {"name": "rough_series", "roughness": Roughness(1e-6, 0.5)},
        ),
    ],
)
def test_stiffness_from_a_model_is_the_modules_own(rig_results, tmp_path, words, left, right, how):
    """Every model, kind and factor of the half-space stiffness can be asked for in a study, and
    says what it is."""
    pairs, facts = stiffness_of(
        rig_results,
        tmp_path,
        NO_LEFT,
        NO_RIGHT,
        ("mu = 0.6", f"mu = 0.6\n{words}"),
        (RADIUS[0], f"{RADIUS[1]}\n{left}"),
        ("width = 1.6e-3", f"width = 1.6e-3\n{right}"),
    )
    steel = MaterialPair(*STEEL)
    for name, side, nodes in (
        ("left", ContactSide("cylinder", 0.07, steel, radius=2e-3), 31),
        ("right", ContactSide("flat", 0.07, steel, width=1.6e-3), 62),
    ):
        own = nodal_stiffness(side, EACH_SIDE, nodes, StiffnessModel(**how))
        made = facts[name]
        assert pairs.kn[pairs.side == name] == pytest.approx(np.full(nodes, own.kn), rel=1e-6)
        assert pairs.kt[pairs.side == name] == pytest.approx(np.full(nodes, own.kt), rel=1e-6)
        assert (made.model, made.kind, made.scale, made.nodes) == (
            own.model,
            own.kind,
            own.scale,
            nodes,
        )
        assert made.depth_m == own.depth and (made.h_rms_m is None) == (own.roughness is None)
        assert (made.load_N, made.half_width_m, made.length_m, made.E_star_Pa) == pytest.approx(
            (EACH_SIDE, own.size, 0.07, steel.E_star), rel=1e-6
        )


def test_rounded_side(rig_results, tmp_path):
    pairs, facts = stiffness_of(
        rig_results,
        tmp_path,
        NO_RIGHT,
        ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"'),
        ('shape = "flat"', 'shape = "rounded"\nradius = 1e-3'),
    )
    own = nodal_stiffness(
        ContactSide("rounded", 0.07, MaterialPair(*STEEL), width=1.6e-3, radius=1e-3), EACH_SIDE, 62
    )
    assert pairs.kn[pairs.side == "right"] == pytest.approx(np.full(62, own.kn), rel=1e-6)
    assert facts["right"].half_width_m == pytest.approx(own.size, rel=1e-6) and own.size > 0.8e-3


def test_given_values_win_over_the_model(rig_results, tmp_path):
    """Of the side that has them, and untouched by the factor on what the model gives; they need no
    radius."""
    pairs, facts = stiffness_of(
        rig_results,
        tmp_path,
        NO_RIGHT,
        ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nscale = 0.5'),
    )
    left = pairs.side == "left"
    assert (pairs.kn[left] == 3.32e6).all() and (pairs.kt[left] == 3.02e6).all()
    assert facts["left"].model == "given" and facts["left"].half_width_m is None
    own = nodal_stiffness(
        ContactSide("flat", 0.07, MaterialPair(*STEEL), width=1.6e-3),
        EACH_SIDE,
        62,
        StiffnessModel(scale=0.5),
    )
    assert pairs.kn[~left] == pytest.approx(np.full(62, own.kn), rel=1e-6)


def test_shares_by_tributary_area(rig_results, tmp_path):
    """The total stays; a node at the end of the line, or at a corner of the flat, has half or a
    quarter of the most."""
    words = ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nshares = "tributary"')
    pairs, _ = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, RADIUS, words)
    equal, _ = stiffness_of(
        rig_results, tmp_path, NO_LEFT, NO_RIGHT, RADIUS, (words[0], words[1].rpartition("\n")[0])
    )
    for side in pairs.sides:
        mine = pairs.side == side
        end = mine & (pairs.station == 0)
        inner = mine & (pairs.station == 3)
        assert pairs.kn[mine].sum() == pytest.approx(equal.kn[mine].sum())
        assert pairs.kn[end].sum() == pytest.approx(pairs.kn[inner].sum() / 2, rel=0.02)


GIVEN = ("kn = 1.03e6\nkt = 0.94e6\n", "")
AREA = 0.07 * 1.6e-3  # m2 of the flat: 31 stations on 70 mm, two rows 1.6 mm apart


def test_stiffness_per_area(rig_results, tmp_path):
    """A node has the stiffness of its tributary area: a quarter of an inner cell at a corner,
    whatever shares says."""
    pairs, facts = stiffness_of(
        rig_results, tmp_path, (GIVEN[0], "kn_per_area = 6e11\nkt_per_area = 5e11\n")
    )
    flat = pairs.select(pairs.side == "right")
    assert flat.kn.sum() == pytest.approx(
        6e11 * AREA, rel=1e-6
    ) and flat.kt / flat.kn == pytest.approx(5 / 6)
    end = flat.station == 0
    assert flat.kn[end] == pytest.approx(6e11 * 0.07 / 60 * 0.8e-3, rel=1e-6)
    assert flat.kn[flat.station == 3] == pytest.approx(6e11 * 0.07 / 30 * 0.8e-3, rel=1e-6)
    made = facts["right"]
    assert (
        made.kn_N_per_m == pytest.approx(6e11 * AREA / 62, rel=1e-6) and made.shares == "tributary"
    )
    # smooth half-spaces of a side whose sizes are known stand beside what is given; the left side
    # has no radius
    assert [w.way for w in made.ways] == ["smooth half-spaces", "given per area"] and made.ways[
        1
    ].in_use
    assert [w.way for w in facts["left"].ways] == ["given per node"]


def test_stiffness_per_area_of_a_line(rig_results, tmp_path):
    """A line has an area only with a width."""
    given = ("kn = 3.32e6\nkt = 3.02e6\n", "kn_per_area = 6e11\nkt_per_area = 5e11\n")
    with pytest.raises(
        InputError, match=r"\[contact.left\] kn_per_area: the pairs form a line, .* state its width"
    ):
        stiffness_of(rig_results, tmp_path, given)
    pairs, _ = stiffness_of(rig_results, tmp_path, (given[0], given[1] + "width = 1e-3\n"))
    assert pairs.kn[pairs.side == "left"].sum() == pytest.approx(6e11 * 0.07 * 1e-3, rel=1e-6)


@pytest.mark.parametrize("shares", ["equal", "tributary"])
def test_total_stiffness_of_a_side(rig_results, tmp_path, shares):
    pairs, facts = stiffness_of(
        rig_results,
        tmp_path,
        (GIVEN[0], "kn_total = 6.4e7\nkt_total = 5.8e7\n"),
        ("mu = 0.6", f'mu = 0.6\nshares = "{shares}"'),
    )
    for side, kn in (("left", 31 * 3.32e6), ("right", 6.4e7)):
        mine = pairs.select(pairs.side == side)
        assert mine.kn.sum() == pytest.approx(kn)
        ratio = mine.kn[mine.station == 0].sum() / mine.kn[mine.station == 3].sum()
        assert ratio == pytest.approx(1.0 if shares == "equal" else 0.5, rel=1e-6)
    assert facts["right"].ways[-1].way == "given in total" and facts[
        "right"
    ].kt_N_per_m == pytest.approx(5.8e7 / 62)


def test_per_area_does_not_depend_on_the_mesh(tmp_path):
    """The same face with 3 x 3 and with 5 x 5 nodes: the same stiffness of the side and per length
    of its lines."""
    sums = []
    for divisions in ((2, 2, 2), (4, 4, 4)):
        x = np.linspace(0, 0.01, divisions[0] + 1)
        place = np.array([[0.0, y, z] for y in x for z in x])
        n = len(place)
        flat = contact_table(
            np.tile([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]], (n, 1, 1)), position=place, side="one"
        )
        study = load_study(
            corner_study.write(
                tmp_path,
                change=[("kn = 1e6\nkt = 1e6\n", "kn_per_area = 1e11\nkt_per_area = 1e11\n")] * 2,
            )
        )
        side = stiffness._per_node(study.sides["one"], "one", flat)
        kn, _ = stiffness.node_stiffness(study, flat, {"one": given_stiffness(side, n, 1.0, 0.01)})
        sums.append(
            (
                kn.sum(),
                kn[place[:, 1] == 0].sum() * divisions[0],
                kn[np.isclose(place[:, 1], 0.005)].sum() * divisions[0],
            )
        )
    assert sums[0] == pytest.approx((1e7, 5e6, 1e7)) and sums[1] == pytest.approx(sums[0])


def test_ways_of_a_model(rig_results, tmp_path):
    """The smooth bodies, the rough interface, the declared factor, the reference: each says what it
    is."""
    rough = (
        "radius = 2e-3\nh_rms = 1.4e-6\ngamma = 0.5\nreference_kn = 3.32e6\nreference_kt = 3.02e6"
    )
    _, facts = stiffness_of(
        rig_results,
        tmp_path,
        NO_LEFT,
        ('shape = "cylinder"', f'shape = "cylinder"\n{rough}'),
        ("mu = 0.6", 'mu = 0.6\nstiffness = "rough_series"\nscale = 0.5'),
    )
    ways = facts["left"].ways
    assert [w.way for w in ways] == [
        "smooth half-spaces",
        "half-spaces and a rough interface in series",
        "declared factor 0.5",
        "reference",
    ]
    assert [w.in_use for w in ways] == [False, False, True, False]
    smooth, series, used, reference = (w.kn_N_per_m for w in ways)
    assert used == pytest.approx(series / 2) == facts["left"].kn_N_per_m and reference == 3.32e6
    # springs in series: 1/(n k) of the whole side, gamma h_rms / N of the interface
    assert 1 / (31 * series) == pytest.approx(
        1 / (31 * smooth) + 0.5 * 1.4e-6 / EACH_SIDE, rel=1e-6
    )


def test_gap_profile_reaches_the_pairs(rig, tmp_path):
    (tmp_path / "s.toml").write_text(
        STUDY.replace(
            'shape = "cylinder"',
            'shape = "cylinder"\ngap = [[0.0, 0.0], [0.035, 60e-6], [0.07, 0]]',
        )
    )
    for mesh in rig.glob("*.msh"):
        shutil.copy(mesh, tmp_path)
    study = load_study(tmp_path / "s.toml")
    pairs = stiffness.with_values(study, matched(study, read_meshes(study)).pairs, {})
    left = pairs.select(pairs.side == "left")
    assert left.gap == pytest.approx(
        60e-6 * (1 - np.abs(left.position[:, 1] / 0.035 - 1)), abs=1e-12
    )
    assert (pairs.gap[pairs.side == "right"] == 0).all()


TITANIUM = (
    '[material.titanium]\ngroup = "blade two"\nE = 110e9\nnu = 0.31\ndensity = 4430\n[blades]'
)


def test_half_space_stiffness_of_each_sides_own_materials(tmp_path):
    """Side two touches titanium: E* of steel on titanium, not of steel on steel."""
    change = [
        ("[blades]", TITANIUM),
        ("mu = 0.3", 'mu = 0.3\nstiffness = "halfspace"'),
        *[("kn = 1e6\nkt = 1e6\nwidth = 0.01\n", "width = 0.002\n")] * 2,
    ]
    study = load_study(corner_study.write(tmp_path, change=change))
    meshes = read_meshes(study)
    pairs = matched(study, meshes).pairs
    kn = with_values(study, pairs, side_materials(study, meshes, pairs)).kn
    assert kn[0] > 1.15 * kn[-1]
    steel = load_study(corner_study.write(tmp_path, change=change[1:]))
    kn_steel = with_values(steel, pairs, side_materials(steel, meshes, pairs)).kn
    assert kn_steel[0] == pytest.approx(kn[0]) and kn_steel[-1] == pytest.approx(kn_steel[0])


@pytest.mark.parametrize("lines", [5, 21, 201])
def test_a_round_side_shares_its_total_over_what_can_touch(tmp_path, lines):
    """A cylinder of 2 mm on a plane, pressed by 80 N: whatever the mesh across it, the points that
    the force closes (found by bisection, both bodies rigid) have the total together. One line of
    points, or many."""
    across = np.linspace(-0.5e-3, 0.5e-3, lines)
    place = np.array([[0.0, y, z] for y in np.linspace(0, 0.01, 4) for z in across])
    n = len(place)
    area = np.outer([0.5, 1, 1, 0.5], np.r_[0.5, np.ones(lines - 2), 0.5]).ravel()
    gap = 1e-6 + place[:, 2] ** 2 / (2 * 2e-3)
    pairs = contact_table(
        np.tile([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]], (n, 1, 1)),
        position=place,
        side="one",
        gap=gap,
        station=np.repeat(np.arange(4), lines),
        row=np.tile(np.arange(lines), 4),
        area=area * 1e-8,
    )
    study = load_study(
        corner_study.write(
            tmp_path,
            change=[
                (
                    'shape = "flat"\nkn = 1e6\nkt = 1e6\nwidth = 0.01\n',
                    'shape = "cylinder"\nkn_total = 2e7\nkt_total = 1e7\n',
                ),
                ("kn = 1e6\nkt = 1e6\n", "kn_total = 2e7\nkt_total = 2e7\n"),
            ],
        )
    )
    one = given_stiffness(stiffness._per_node(study.sides["one"], "one", pairs), n, 80.0, 0.01)
    kn, kt = stiffness.node_stiffness(study, pairs, {"one": one})
    low, high = 0.0, 1e-3
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if kn @ np.maximum(middle - gap, 0) < 80 else (low, middle)
    closed = gap < low
    assert kn[closed].sum() == pytest.approx(2e7, rel=1e-9) and kt[closed].sum() == pytest.approx(
        1e7, rel=1e-9
    )
    half = np.sqrt(2 * 2e-3 * 1.5 * 80 / 2e7)  # a parabola cut off at its approach
    assert closed.sum() / 4 * across[-1] * 2 / (lines - 1) == pytest.approx(
        2 * half, abs=1.5e-3 / (lines - 1)
    )
    assert np.ptp(kn / pairs.area) < 1e-9 * kn.max() / pairs.area.min()


@pytest.mark.parametrize("sides", [(), ("left",), ("left", "right")])
def test_mu_of_the_study_is_that_of_every_side_of_a_table(tmp_path, sides):
    """Whether a side has a section or not."""
    path = write_chain(tmp_path)
    text = path.read_text()
    for name in {"left", "right"} - set(sides):
        text = text.replace(f'[contact.{name}]\nshape = "cylinder"\n', "")
    table = ContactTable.load(tmp_path / "pairs.csv")
    path.write_text(text.replace("[contact]\n", "[contact]\nmu = 0.123\n"))
    study = load_study(path)
    assert set(study.sides) == set(sides) and not (table.mu == 0.123).any()
    assert (with_values(study, table, {}).mu == 0.123).all()


def test_stops_of_a_table_keep_their_friction(tmp_path):
    """A stop beside the damper is no side of it: without friction it stays so."""
    path = write_chain(tmp_path)
    path.write_text(path.read_text().replace("[contact]\n", "[contact]\nmu = 0.123\n"))
    table = contact_table(
        np.tile(np.eye(3), (5, 1, 1)),
        side=np.array(["left", "left", "right", "right", "stop"]),
        blade_body=np.array(["blades"] * 4 + ["ground"]),
        station=np.array([0, 1, 0, 1, 0]),
    )
    found = with_values(load_study(path), table, {})
    assert found.mu.tolist() == [0.123] * 4 + [0.0]
