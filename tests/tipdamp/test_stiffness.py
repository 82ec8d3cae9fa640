"""Stiffness and gaps of the pairs: given, from a model, by weights."""

import shutil

import numpy as np
import pytest

from hbm.contact import ContactTable
from static_contact.stiffness.contact_side import ContactSide
from static_contact.stiffness.elastic_constants import MaterialPair
from static_contact.stiffness.nodal_stiffness import StiffnessModel, nodal_stiffness
from static_contact.stiffness.rough_surfaces import Roughness
from tests.conftest import STUDY, changed
from tests.tipdamp import corner_study
from tipdamp import stiffness
from tipdamp.bodies.pair import matched_pairs
from tipdamp.bodies.read import read_meshes
from tipdamp.stiffness import side_materials, with_values
from tipdamp.study.study import load_study

STEEL = (207e9, 0.3, 207e9, 0.3)
EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))  # N, frictionless balance between faces at 45 degrees
RADIUS = ('shape = "cylinder"', 'shape = "cylinder"\nradius = 2e-3')
NO_LEFT, NO_RIGHT = ("kn = 3.32e6\nkt = 3.02e6\n", ""), ("kn = 1.03e6\nkt = 0.94e6\n", "")


def stiffness_of(rig_results, tmp_path, *changes):
    """(pairs with their stiffness, what each side's was made from) of the rig's study with changes."""
    (tmp_path / "s.toml").write_text(changed(STUDY, *changes))
    study, pairs = load_study(tmp_path / "s.toml"), ContactTable.load(rig_results.path("preload.csv"))
    materials = dict.fromkeys(pairs.sides, STEEL)
    return (stiffness.with_values(study, pairs, materials),
            stiffness.facts(study, stiffness.side_stiffness(study, pairs, materials), materials))


@pytest.mark.parametrize("words, left, right, how", [
    ('stiffness = "halfspace"', "", "", {}),
    ('stiffness = "halfspace"\nkind = "secant"\nscale = 0.1', "", "", {"kind": "secant", "scale": 0.1}),
    ('stiffness = "plane_depth"', "depth = [5e-3, 1e-3]", "depth = [5e-3, 1e-3]",
     {"name": "plane_depth", "depth": (5e-3, 1e-3)}),
    ('stiffness = "rough_series"', "h_rms = 1e-6\ngamma = 0.5", "h_rms = 1e-6\ngamma = 0.5",
     {"name": "rough_series", "roughness": Roughness(1e-6, 0.5)}),
])
def test_stiffness_from_a_model_is_the_modules_own(rig_results, tmp_path, words, left, right, how):
    """Every model, kind and factor of the half-space stiffness can be asked for in a study, and says what it is."""
    pairs, facts = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, ("mu = 0.6", f"mu = 0.6\n{words}"),
                                (RADIUS[0], f"{RADIUS[1]}\n{left}"), ("width = 1.6e-3", f"width = 1.6e-3\n{right}"))
    steel = MaterialPair(*STEEL)
    for name, side, nodes in (("left", ContactSide("cylinder", 0.07, steel, radius=2e-3), 31),
                              ("right", ContactSide("flat", 0.07, steel, width=1.6e-3), 62)):
        own, made = nodal_stiffness(side, EACH_SIDE, nodes, StiffnessModel(**how)), facts[name]
        assert pairs.kn[pairs.side == name] == pytest.approx(np.full(nodes, own.kn), rel=1e-6)
        assert pairs.kt[pairs.side == name] == pytest.approx(np.full(nodes, own.kt), rel=1e-6)
        assert (made.model, made.kind, made.scale, made.nodes) == (own.model, own.kind, own.scale, nodes)
        assert made.depth_m == own.depth and (made.h_rms_m is None) == (own.roughness is None)
        assert (made.load_N, made.half_width_m, made.length_m, made.E_star_Pa) == pytest.approx(
            (EACH_SIDE, own.size, 0.07, steel.E_star), rel=1e-6)


def test_rounded_side(rig_results, tmp_path):
    pairs, facts = stiffness_of(rig_results, tmp_path, NO_RIGHT, ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"'),
                                ('shape = "flat"', 'shape = "rounded"\nradius = 1e-3'))
    own = nodal_stiffness(ContactSide("rounded", 0.07, MaterialPair(*STEEL), width=1.6e-3, radius=1e-3), EACH_SIDE, 62)
    assert pairs.kn[pairs.side == "right"] == pytest.approx(np.full(62, own.kn), rel=1e-6)
    assert facts["right"].half_width_m == pytest.approx(own.size, rel=1e-6) and own.size > 0.8e-3


def test_given_values_win_over_the_model(rig_results, tmp_path):
    """Of the side that has them, and untouched by the factor on what the model gives; they need no radius."""
    pairs, facts = stiffness_of(rig_results, tmp_path, NO_RIGHT,
                                ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nscale = 0.5'))
    left = pairs.side == "left"
    assert (pairs.kn[left] == 3.32e6).all() and (pairs.kt[left] == 3.02e6).all()
    assert facts["left"].model == "given" and facts["left"].half_width_m is None
    own = nodal_stiffness(ContactSide("flat", 0.07, MaterialPair(*STEEL), width=1.6e-3), EACH_SIDE, 62,
                          StiffnessModel(scale=0.5))
    assert pairs.kn[~left] == pytest.approx(np.full(62, own.kn), rel=1e-6)


def test_shares_by_tributary_area(rig_results, tmp_path):
    """The total stays; a node at the end of the line, or at a corner of the flat, has half or a quarter of the most."""
    words = ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nshares = "tributary"')
    pairs, _ = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, RADIUS, words)
    equal, _ = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, RADIUS, (words[0], words[1].rpartition("\n")[0]))
    for side in pairs.sides:
        mine = pairs.side == side
        end = mine & (pairs.station == 0)
        inner = mine & (pairs.station == 3)
        assert pairs.kn[mine].sum() == pytest.approx(equal.kn[mine].sum())
        assert pairs.kn[end].sum() == pytest.approx(pairs.kn[inner].sum() / 2, rel=0.02)


def test_gap_profile_reaches_the_pairs(rig, tmp_path):
    (tmp_path / "s.toml").write_text(STUDY.replace('shape = "cylinder"',
                                                   'shape = "cylinder"\ngap = [[0.0, 0.0], [0.035, 60e-6], [0.07, 0]]'))
    for mesh in rig.glob("*.msh"):
        shutil.copy(mesh, tmp_path)
    study = load_study(tmp_path / "s.toml")
    pairs = stiffness.with_values(study, matched_pairs(study, read_meshes(study)), {})
    left = pairs.select(pairs.side == "left")
    assert left.gap == pytest.approx(60e-6 * (1 - np.abs(left.position[:, 1] / 0.035 - 1)), abs=1e-12)
    assert (pairs.gap[pairs.side == "right"] == 0).all()


TITANIUM = '[material.titanium]\ngroup = "blade two"\nE = 110e9\nnu = 0.31\ndensity = 4430\n[blades]'


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
