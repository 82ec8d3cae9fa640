"""Doubts about pairs: none of sound tables, whatever their meshes, units and place; all of what is
mixed up."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.contact_tables import contact_table, frames
from tests.hbm.small_rig import small_rig
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.contact_doubts import misplaced, mixed_partners, node_places, opposed_normals
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.model import ReducedModel

TURN = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
UNITS = (1.0, 1000.0)  # m, and a model that is in mm throughout


def grid(along, across, y=0.0):
    """(n, 3) m of a face 40 mm long and 6 mm wide."""
    x, z = np.meshgrid(np.linspace(0, 0.04, along), np.linspace(0, 0.006, across), indexing="ij")
    return np.stack([x.ravel(), np.full(x.size, y), z.ravel()], axis=1)


def nearest(places, others):
    return others[np.linalg.norm(places[:, None] - others, axis=2).argmin(axis=1)]


def crown(places, radius=0.05):
    return places - [0, 1, 0] * ((places[:, :1] - 0.02) ** 2 / (2 * radius))


BLADE = grid(9, 3)
FAN = np.repeat(grid(4, 2), 2, axis=0)
SOUND = {
    "matching nodes": (BLADE, BLADE, BLADE),
    "an initial gap": (grid(9, 3, 2e-4), BLADE, BLADE),
    "a crown of 4 mm": (BLADE, crown(BLADE), crown(BLADE)),
    "a gap wider than the cells": (grid(9, 3, 8e-3), BLADE, grid(9, 3, 4e-3)),
    "unlike meshes, the nearest blade node": (
        nearest(grid(14, 4), BLADE),
        grid(14, 4),
        grid(14, 4),
    ),
    "two blade nodes to each node of the damper": (
        FAN + np.tile([[2e-3, 0, 0], [-2e-3, 0, 0]], (8, 1)),
        FAN,
        FAN,
    ),
    "a damper of one node": (
        BLADE + [0, 3e-3, 0],
        np.tile([0.02, 0, 0.003], (27, 1)),
        BLADE + [0, 3e-3, 0],
    ),
    "contact between nodes that lie apart": (
        grid(5, 1, 3e-3),
        grid(5, 1),
        grid(5, 1, 1.5e-3) + [0, 0, 1e-3],
    ),
    "the ground": (np.full((27, 3), np.nan), BLADE, BLADE),
    "one pair": (BLADE[:1], BLADE[:1], BLADE[:1]),
    "nothing known": (np.full((27, 3), np.nan), np.full((27, 3), np.nan), BLADE),
}


def table(position, normals=None):
    return contact_table(
        frames(np.tile([0.0, 0, 1], (len(position), 1)) if normals is None else normals),
        position=position,
        blade_body="blades",
    )


def moved(places, unit):
    return unit * (places @ TURN.T + [0.2, -3.0, 0.1])


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("name", SOUND)
def test_sound_tables(name, unit):
    blade, damper, position = (moved(places, unit) for places in SOUND[name])
    pairs = table(position)
    assert not mixed_partners(pairs, blade, damper)
    assert not misplaced(pairs, blade, damper, 1e-9 * unit)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize(
    "name",
    [
        "matching nodes",
        "an initial gap",
        "a crown of 4 mm",
        "unlike meshes, the nearest blade node",
    ],
)
def test_what_is_mixed_up(name, unit):
    blade, damper, position = (moved(places, unit) for places in SOUND[name])
    pairs, count = table(position), len(position)
    swapped = np.r_[12, 1:12, 0, 13:count]
    for order in (np.arange(count)[::-1], swapped):
        assert "partners mixed up" in mixed_partners(pairs, blade[order], damper)
    off = moved(SOUND[name][2] + [0, 0, 3e-3], unit)
    assert "m off its nodes" in misplaced(table(off), blade, damper)
    assert "given in mm" in misplaced(table(1e3 * position), blade, damper)
    assert not misplaced(table(off), blade, damper, 4e-3 * unit)


def test_one_reversed_normal_is_named():
    """On a plane and on a half of a cylinder, where normals turn by half a turn from end to end."""
    angle = np.linspace(0, np.pi, 19)
    round_side = np.stack([np.cos(angle), np.zeros(19), np.sin(angle)], axis=1)
    for normals, places in (
        (np.tile([0.0, 0, 1], (27, 1)), BLADE),
        (round_side, 5e-3 * round_side),
    ):
        assert not opposed_normals(table(places, normals))
        wrong = normals.copy()
        wrong[4] *= -1
        assert opposed_normals(table(places, wrong)).startswith("pair 5 ")


def test_normals_at_one_place_do_not_count():
    """A corner, where a node touches two faces; places that nobody stated."""
    normals = np.array([[1.0, 0, 0], [-1, 0, 0]])
    assert not opposed_normals(table(np.zeros((2, 3)), normals))


def test_places_of_a_model():
    """The ground and a node that the model does not have are not known."""
    model = ReducedModel.from_matrices(
        np.eye(6),
        np.eye(6),
        body=["damper"] * 6,
        node=[1] * 3 + [2] * 3,
        direction=["x", "y", "z"] * 2,
        position=np.repeat([[1.0, 2, 3], [4, 5, 6]], 3, axis=0),
    )
    blade, damper = node_places(model, contact_table(frames(np.tile([0.0, 0, 1], (3, 1)))))
    assert np.isnan(blade).all() and np.isnan(damper[2]).all()
    assert damper[:2].tolist() == [[1, 2, 3], [4, 5, 6]]


EDITED = {
    "a row twice": (lambda t: t.select(np.r_[np.arange(len(t)), 3]), "their contact counts twice"),
    "mu in percent": (lambda t: t.replace(mu=100 * t.mu), "is it mu, or in percent"),
    "places in mm": (lambda t: t.replace(position=1e3 * t.position), "given in mm"),
    "places 3 mm off": (lambda t: t.replace(position=t.position + [0, 0, 3e-3]), "off its nodes"),
    "kn and kt in N/mm": (lambda t: t.replace(kn=1e-3 * t.kn, kt=1e-3 * t.kt), "kn too small"),
    "kt in N/mm": (lambda t: t.replace(kt=1e-3 * t.kt), "in the same unit"),
    "kn of one pair": (
        lambda t: t.replace(kn=np.where(np.arange(len(t)) == 2, 1e3, 1.0) * t.kn),
        "1e.03 times the median of its side",
    ),
    "kn in N/mm": (lambda t: t.replace(kn=1e-3 * t.kn), "in the same unit"),
}


@pytest.mark.parametrize("name", EDITED)
def test_an_edited_table_is_told_with_the_curve(name):
    model, pairs, row = small_rig()
    edit, said = EDITED[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.01)
    with pytest.warns(UserWarning, match=said):
        contact_problem(model, edit(pairs), DryFriction2T(), damping_ratio=0.01)
