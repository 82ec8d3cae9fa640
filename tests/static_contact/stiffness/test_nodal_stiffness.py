"""Nodal values of both sides from the three models and as given; what a result carries, what is
refused."""

import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair
from tipdamp.static_contact.stiffness.flat_punch import ellipse_stiffness, rectangle_stiffness
from tipdamp.static_contact.stiffness.load_displacement import approach
from tipdamp.static_contact.stiffness.nodal_stiffness import (
    StiffnessModel,
    given_stiffness,
    nodal_stiffness,
)
from tipdamp.static_contact.stiffness.nodal_weights import (
    calibrate_scale,
    nodal_values,
    tributary_weights,
)
from tipdamp.static_contact.stiffness.plane_strain import plane_stiffness
from tipdamp.static_contact.stiffness.rough_surfaces import Roughness, rough_stiffness
from tipdamp.static_contact.stiffness.rounded_punch import hertz_half_width, hertz_stiffness
from tipdamp.static_contact.stiffness.side_stiffness import (
    ContactSide,
    side_compliance,
    side_stiffness,
)

PAIR = MaterialPair(207e9, 0.3, 207e9, 0.3)
UNLIKE = MaterialPair(210e9, 0.3, 114e9, 0.342)
# the rig's damper: diameter 4 mm, 70 mm long
ROUND = ContactSide("cylinder", 0.07, PAIR, radius=2e-3)
FLAT = ContactSide("flat", 0.07, PAIR, width=1.6e-3)
ROUNDED = ContactSide("rounded", 0.07, PAIR, width=1.6e-3, radius=1e-3)
FORCE = 79.9  # N on each side: 113 N / (2 sin 45 deg)


def test_round_side_has_the_hertz_stiffness():
    found = nodal_stiffness(ROUND, FORCE, 31)
    a = hertz_half_width(FORCE / 0.07, 2e-3, PAIR.E_star)
    assert found.size == a
    assert found.total == pytest.approx(rectangle_stiffness(PAIR, 0.07, 2 * a), rel=1e-14)
    assert found.total == pytest.approx(hertz_stiffness(PAIR, 0.07, 2e-3, FORCE), rel=1e-14)
    assert found.kt == (found.kt_along + found.kt_across) / 2
    assert (found.model, found.kind, found.load, found.length, found.n_nodes) == (
        "halfspace_3d",
        "tangent",
        FORCE,
        0.07,
        31,
    )
    assert (found.depth, found.roughness, found.pair, found.scale) == (None, None, PAIR, 1.0)


def test_flat_side_does_not_depend_on_the_force():
    found = [
        nodal_stiffness(FLAT, force, 62, StiffnessModel(kind=kind))
        for force in (1.0, 100.0)
        for kind in ("tangent", "secant")
    ]
    for one in found:
        assert one.total == pytest.approx(rectangle_stiffness(PAIR, 0.07, 1.6e-3), rel=1e-12)
        assert one.size == 0.8e-3


def test_smooth_theory_is_far_stiffer_than_the_paper():
    """Paper, section 7.1: 31 nodes of 3.32e6 N/m on the round side; smooth half-spaces give 1.3e9
    N/m."""
    ratio = nodal_stiffness(
        ContactSide("cylinder", 0.07, MaterialPair(210e9, 0.3, 210e9, 0.3), radius=5e-3), 80.0, 31
    ).total.normal / (31 * 3.32e6)
    assert 12 < ratio < 14


@pytest.mark.parametrize("side", [ROUND, ROUNDED])
@pytest.mark.parametrize("depth", [None, (5e-3, 1e-3)])
def test_tangent_is_slope_and_secant_chord(side, depth):
    """dP/d(delta) = K(a) to 1e-10 in three dimensions too, by an eighth-order difference."""

    def displacement(load):
        return approach(lambda p: side_compliance(side, p, depth), load)

    step = 0.02 * FORCE
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    change = sum(
        w * (displacement(FORCE + k * step) - displacement(FORCE - k * step))
        for k, w in weights.items()
    )
    tangent, chord = (
        nodal_stiffness(
            side, FORCE, 31, StiffnessModel("plane_depth" if depth else "halfspace_3d", kind, depth)
        ).total
        for kind in ("tangent", "secant")
    )
    assert step / change == pytest.approx(tangent, rel=1e-10)
    assert FORCE / displacement(FORCE) == pytest.approx(chord, rel=1e-12)
    assert all(c < t for c, t in zip(chord, tangent, strict=True))


def test_rounded_side_joins_cylinder_and_flat():
    nearly_round = ContactSide("rounded", 0.07, PAIR, width=1e-14, radius=2e-3)
    nearly_flat = ContactSide("rounded", 0.07, PAIR, width=1.6e-3, radius=1e-12)
    for limit, side in ((ROUND, nearly_round), (FLAT, nearly_flat)):
        for kind in ("tangent", "secant"):
            assert nodal_stiffness(
                side, FORCE, 31, StiffnessModel(kind=kind)
            ).total == pytest.approx(
                nodal_stiffness(limit, FORCE, 31, StiffnessModel(kind=kind)).total, rel=1e-6
            )


def test_plane_model_takes_its_depths():
    found = nodal_stiffness(ROUND, FORCE, 31, StiffnessModel("plane_depth", depth=(5e-3, 1e-3)))
    assert found.depth == (5e-3, 1e-3)
    assert found.total == pytest.approx(
        plane_stiffness(PAIR, found.size, 5e-3, 1e-3).scaled(0.07), rel=1e-14
    )
    with pytest.raises(InputError, match="depth = None.*d1, d2"):
        StiffnessModel("plane_depth")


def test_roughness_acts_in_series():
    rough = Roughness(h_rms=1e-6, gamma=0.5)
    side = ContactSide("flat", 0.07, UNLIKE, width=1e-3)
    alone, smooth = rough_stiffness(UNLIKE, FORCE, rough), side_stiffness(side, FORCE)
    assert alone.normal == pytest.approx(FORCE / 0.5e-6)
    circle = ellipse_stiffness(UNLIKE, 1.0, 1.0)
    assert alone.along / alone.normal == pytest.approx(circle.along / circle.normal, rel=1e-14)
    assert rough_stiffness(PAIR, FORCE, rough).across == pytest.approx(
        FORCE / 0.5e-6 * 2 * 0.7 / 1.7, rel=1e-14
    )
    found = nodal_stiffness(side, FORCE, 31, StiffnessModel("rough_series", roughness=rough))
    assert 1 / np.array(found.total) == pytest.approx(
        1 / np.array(alone) + 1 / np.array(smooth), rel=1e-13
    )
    polished = nodal_stiffness(
        FLAT, FORCE, 31, StiffnessModel("rough_series", roughness=Roughness(1e-16, 0.5))
    )
    assert polished.total == pytest.approx(nodal_stiffness(FLAT, FORCE, 31).total, rel=1e-6)
    with pytest.raises(
        InputError, match="no defined onset of contact, so a secant stiffness does not exist"
    ):
        StiffnessModel("rough_series", "secant", roughness=rough)
    with pytest.raises(InputError, match="Roughness"):
        StiffnessModel("rough_series")


def test_given_values():
    """The paper's nodal values of the round side (section 7.1)."""
    found = given_stiffness((3.32e6, 3.02e6), 31, FORCE, 0.07)
    assert (found.kn, found.kt, found.kt_along, found.kt_across) == pytest.approx(
        (3.32e6, 3.02e6, 3.02e6, 3.02e6)
    )
    assert (found.model, found.depth, found.size, found.load, found.scale) == (
        "given",
        None,
        None,
        FORCE,
        1.0,
    )
    assert given_stiffness((4.0, 1.0, 2.0), 31, FORCE, 0.07).kt == pytest.approx(1.5)
    for wrong in ((1.0,), (1.0, -1.0), (np.nan, 1.0), "ab", None):
        with pytest.raises(InputError, match="given"):
            given_stiffness(wrong, 31, FORCE, 0.07)
    # they are taken as they are
    with pytest.raises(InputError, match="model = 'given': valid: halfspace_3d"):
        StiffnessModel("given", scale=0.5)


def test_one_scale_multiplies_everything():
    plain = nodal_stiffness(ROUND, FORCE, 31)
    scaled = nodal_stiffness(ROUND, FORCE, 31, StiffnessModel(scale=0.08))
    assert scaled.total == pytest.approx(plain.total.scaled(0.08), rel=1e-14)
    assert scaled.scale == 0.08


def test_scale_is_calibrated_to_a_frequency():
    """A mass on the scaled spring in series with another: f(s) known, its inverse by hand."""

    def frequency(scale):
        return np.sqrt(1 / (1 / (2e6 * scale) + 1 / 5e6)) / (2 * np.pi)

    assert calibrate_scale(frequency, frequency(0.37)) == pytest.approx(0.37, rel=1e-10)
    with pytest.raises(InputError, match="not reachable: .*Hz"):
        calibrate_scale(frequency, 1e6)


@pytest.mark.parametrize("size", [1e-4, 0.3, 1.0, 1e5])
@pytest.mark.parametrize("scale", [1.1e-3, 0.4, 900.0])
def test_calibration_in_closed_form_at_any_frequency(size, scale):
    """Of size times the root of the scale, however low a body sways; 0 Hz calibrates nothing."""

    def frequency(scale):
        return size * np.sqrt(scale)

    assert calibrate_scale(frequency, frequency(scale)) == pytest.approx(scale, rel=1e-9)
    for target in (0.0, -size, 1.01 * frequency(1e3), 0.99 * frequency(1e-3)):
        with pytest.raises(InputError, match="target"):
            calibrate_scale(frequency, target)


def test_weights_of_the_nodes():
    line = np.array([0.0, 1.0, 3.0, 4.0])
    assert tributary_weights(line) == pytest.approx(np.array([0.5, 1.5, 1.5, 0.5]) / 4)
    axial, across = (grid.ravel() for grid in np.meshgrid(line, [0.0, 1.0, 2.0]))
    weights = tributary_weights(axial, across)
    assert weights.sum() == pytest.approx(1, rel=1e-14)
    assert weights.reshape(3, 4) == pytest.approx(
        np.outer([0.25, 0.5, 0.25], [0.125, 0.375, 0.375, 0.125])
    )
    mixed = np.random.default_rng(1).permutation(12)
    assert tributary_weights(axial[mixed], across[mixed]) == pytest.approx(weights[mixed])
    with pytest.raises(InputError, match="every row"):
        tributary_weights(axial[:-1], across[:-1])
    for name, places in (("axial", ([0, np.nan, 2], None)), ("across", ([0, 1], [0, np.inf]))):
        with pytest.raises(InputError, match=name):
            tributary_weights(*places)


def test_active_nodes_keep_their_weight_or_take_all():
    """Paper, section 7.1: the actual stiffness is proportional to the number of active nodes."""
    active = np.zeros(31, dtype=bool)
    active[:5] = active[-4:] = True
    equal = np.full(31, 1 / 31)
    kept = nodal_values(31 * 3.32e6, equal, active)
    assert kept[active] == pytest.approx(3.32e6, rel=1e-14)
    assert kept.sum() == pytest.approx(9 * 3.32e6) and np.all(kept[~active] == 0)
    assert nodal_values(
        1e8, tributary_weights(np.arange(31.0)), active, conserve=True
    ).sum() == pytest.approx(1e8)
    for wrong in (
        {"active": np.ones(30, dtype=bool)},
        {"active": np.arange(31)},
        {"active": np.zeros(31, dtype=bool), "conserve": True},
    ):
        with pytest.raises(InputError, match="active"):
            nodal_values(1e8, equal, **wrong)
    with pytest.raises(InputError, match="add up"):
        nodal_values(1e8, np.ones(31))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"force": 0.0}, "force = 0.0.*> 0 N"),
        ({"force": -5.0}, "force"),
        ({"force": np.inf}, "force"),
        ({"n_nodes": 0}, "n_nodes = 0"),
        ({"n_nodes": 2.5}, "n_nodes"),
        ({"n_nodes": True}, "n_nodes"),
        ({"name": "halfspace"}, "did you mean 'halfspace_3d'"),
        ({"kind": "tangents"}, "did you mean 'tangent'"),
        ({"scale": 0.0}, "scale"),
        ({"force": 1e9}, "into an edge of radius"),
        (
            {"roughness": Roughness(1e-6, 0.5)},
            "roughness = .*no meaning for model = 'halfspace_3d': leave it out, or set "
            "model = 'rough_series'",
        ),
        (
            {"name": "rough_series", "roughness": Roughness(1e-6, 0.5), "depth": (1e-3, 1e-3)},
            "depth = .*no meaning",
        ),
        ({"name": "plane_depth", "depth": (1e-3, 0.0)}, "depth"),
        ({"name": "plane_depth", "depth": 1e-3}, "depth"),
    ],
)
def test_bad_values_are_named(change, message):
    arguments = {"force": FORCE, "n_nodes": 31} | {
        k: v for k, v in change.items() if k in ("force", "n_nodes")
    }
    model = {k: v for k, v in change.items() if k not in arguments}
    with pytest.raises(InputError, match=message):
        nodal_stiffness(ROUND, **arguments, model=StiffnessModel(**model))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"shape": "cylindre", "radius": 1e-3}, "did you mean 'cylinder'"),
        ({"shape": "cylinder"}, "radius is missing"),
        ({"shape": "cylinder", "radius": 0.0}, "radius = 0.0"),
        ({"shape": "flat", "width": -1.0}, "width"),
        ({"shape": "flat", "width": 1e-3, "radius": 1e-3}, "no meaning"),
        ({"shape": "flat", "width": "1e-3"}, "not a number"),
        ({"shape": "flat", "width": 1e-3, "length": 0.0}, "length"),
        ({"shape": "flat", "width": 1e-3, "pair": 2e11}, "pair"),
    ],
)
def test_bad_sides_are_named(fields, message):
    with pytest.raises(InputError, match=message):
        ContactSide(**{"length": 0.07, "pair": PAIR} | fields)
