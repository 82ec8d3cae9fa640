"""A round pin between flat flanks of unlike meshes: place, normal and gap of a point belong
together, and a pin of tetrahedra lies as one of hexahedra does."""

import re
import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.modal.blocks import block
from tests.static_contact.surfaces.test_contact_points import bodies_of
from tests.static_contact.test_round_sides import elastic_bodies, shell, sides_of, together
from tipdamp.hbm.contact import relative_motion
from tipdamp.modal.elasticity import Material
from tipdamp.static_contact.bodies.sparse_bodies import (
    AssembledBodies,
    SparseCompliance,
)
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.surfaces.points import surface_contact

RADIUS, LENGTH, ANGLE, PULL, PER_AREA = 4e-3, 6e-3, 40.0, 100.0, 1.7e13  # m, m, deg, N, N/m3


def flank(angle, first, length=8.1e-3):
    """A block on the tangent plane of the pin at an angle from x; groups "inner" and "outer"."""
    flat = block("hexahedron20", (3, 5, 1), size=(3.3e-3, length, 2e-3))
    x, y, z = (flat.position - [1.65e-3, (length - LENGTH) / 2, 0]).T
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    place = np.column_stack([(RADIUS + z) * c + x * s, (RADIUS + z) * s - x * c, -y])
    groups = {"inner": np.abs(z) < 1e-9, "outer": np.abs(z - 2e-3) < 1e-9}
    return replace(
        flat,
        node=first + np.arange(len(flat.node)),
        position=place + [0, 0, LENGTH],
        groups={name: first + np.flatnonzero(there) for name, there in groups.items()},
    )


@cache
def case(kind, cells=(16, 1, 4), length=8.1e-3):
    """(meshes, table, points on either) of a half-pin of 10 to 170 degrees, which has nodes where
    it touches."""
    pin = shell(kind, cells, 0.4 * RADIUS, RADIUS, (10, 170))
    blades = together(flank(ANGLE, 10_000, length), flank(180 - ANGLE, 20_000, length))
    return pin, blades, *surface_contact(sides_of(pin, blades), axis=(0, 0, 1), pull=(0, 1, 0))


def turned(pairs, direction):
    """(P,) rad: angles of directions (P, 3) from the normal of their flank."""
    middle = np.radians(np.where(pairs.side == "right", ANGLE, 180 - ANGLE))
    return np.arctan2(direction[:, 1], direction[:, 0]) - middle


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge15", "hexahedron20"])
def test_the_gap_is_that_of_the_place(kind):
    """R (1 / cos - 1) of the angle from the contact line, to a hundredth of it and a nanometre
    on the line, and the normal has that angle; on the line are as many points as corners."""
    *_, pairs, _, _ = case(kind)
    angle = turned(pairs, pairs.normal)
    near = np.abs(angle) < np.radians(15)
    assert turned(pairs, pairs.position) == pytest.approx(angle, abs=1e-12)
    fitting = RADIUS * (1 / np.cos(angle) - 1)
    assert pairs.gap[near] == pytest.approx(fitting[near], rel=0.01, abs=1e-9)
    on_line = np.abs(angle) < np.radians(0.1)
    assert on_line.sum() == 2 * 5


@pytest.mark.parametrize("kind", ["tetra10", "wedge15"])
def test_forces_of_the_moved_points_are_in_balance(kind):
    """Random normal forces on the points: their sum and moments vanish over both bodies."""
    pin, blades, pairs, on_blades, on_pin = case(kind)
    points = [
        replace(body, points=one.on(body))
        for body, one in zip(bodies_of(pin, blades), (on_pin, on_blades), strict=True)
    ]
    force = np.zeros((len(pairs), 3))
    force[:, 2] = np.random.default_rng(0).standard_normal(len(pairs))
    load = (relative_motion(AssembledBodies(points), pairs).T @ force.ravel()).reshape(-1, 3)
    place = np.vstack([pin.position, blades.position])
    moment = np.cross(place, load).sum(axis=0)
    assert np.abs(load.sum(axis=0)).max() < 1e-12
    assert np.abs(moment).max() < 1e-3 * RADIUS * np.abs(force).sum()
    for one in (on_blades, on_pin):
        assert np.allclose(one.weight.sum(axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("length", [5.9e-3, 5.6e-3, 5e-3, 4.6e-3, 3.3e-3])
def test_flanks_that_end_inside_of_faces(length):
    """What is left of the last faces is on the line to half a degree and 50 nm; no node counts for
    more than once."""
    *_, pairs, on_blades, on_pin = case("tetra10", length=length)
    angle = turned(pairs, pairs.normal)
    on_line = np.abs(angle) < np.radians(0.5)
    assert on_line.sum() == 2 * 5 and np.abs(pairs.gap[on_line]).max() < 5e-8
    assert max(np.abs(one.weight).max() for one in (on_blades, on_pin)) < 1.1


def beside(turn, cells=(16, 1, 4), unit=1.0):
    """Warnings of the pairing of a half-pin whose rows lie `turn` degrees off the lines of
    contact."""
    pin = shell("hexahedron20", cells, 0.4 * RADIUS, RADIUS, (10 + turn, 170 + turn))
    blades = together(flank(ANGLE, 10_000), flank(180 - ANGLE, 20_000))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        surface_contact(
            sides_of(pin, blades),
            axis=(0, 0, 1),
            pull=(0, 1, 0),
            shown=lambda metres: f"{1e3 * metres:.3g} mm",
        )
    return [str(one.message) for one in told]


@pytest.mark.parametrize("turn, off", [(0.0, 0.0), (0.9, 0.9), (2.0, 2.0), (5.0, 5.0), (8.0, 2.0)])
def test_no_points_on_the_line_of_contact(turn, off):
    """Both sides say how far the nearest lie from it, in the unit of the model, where that is more
    than a degree around the pin."""
    told = beside(turn)
    assert len(told) == (2 if off > 1 else 0)
    for name, one in zip(("right", "left"), told, strict=False):
        assert one.startswith(f"side '{name}': the nearest contact points lie ")
        distance, wide = (float(x) for x in re.findall(r"(\S+) mm", one))
        assert distance == pytest.approx(1e3 * RADIUS * np.radians(off), rel=0.01)
        assert wide == pytest.approx(2e3 * RADIUS * np.radians(1), rel=0.01)
        assert f", {off:.2g} degrees around the damper" in one


def test_faces_as_narrow_as_told_are_enough():
    """Then one corner lies near enough, wherever the line is."""
    assert not any(beside(turn, cells=(80, 1, 2)) for turn in (0.5, 1.0))


def loads(kind, cells):
    """(force of the right side, its moment about y, forces of its points along the axis) N."""
    pin, blades, pairs, on_blades, on_pin = case(kind, cells)
    steel = Material(E=205e9, nu=0.29, density=7800)
    whole = elastic_bodies(pin, blades, steel, (on_blades, on_pin))
    k = PER_AREA * pairs.area
    problem = StaticContact(whole, pairs.replace(kn=k, kt=k), compliance=SparseCompliance)
    model = problem.model
    mine = np.flatnonzero((model.body == "damper") & (model.direction == "y") & model.moves)
    place = model.position[mine] - [0, 0, LENGTH / 2]
    load = np.zeros(model.size)
    load[mine] = np.linalg.lstsq(
        np.column_stack([np.ones(len(mine)), place]).T, [PULL, 0, 0, 0], rcond=None
    )[0]
    force = np.maximum(problem.solve(load).force, 0)
    right = pairs.side == "right"
    order = np.argsort(pairs.position[right, 2])
    carried = force[right][order]
    arm = pairs.position[right][order, 2] - LENGTH / 2
    return carried.sum(), arm @ carried, carried[carried > 0]


@pytest.mark.slow
def test_a_pin_of_tetrahedra_between_flanks():
    """Each side carries F / (2 sin) and no moment; along it the forces are symmetric, and those of
    hexahedra, within 2 %."""
    pytest.importorskip("dolfinx")
    _, _, wanted = loads("hexahedron20", (16, 2, 4))
    total, moment, found = loads("tetra10", (16, 2, 4))
    assert total == pytest.approx(PULL / (2 * np.sin(np.radians(ANGLE))), rel=1e-5)
    assert abs(moment) < 1e-4 * total * LENGTH
    assert len(found) == 5 and found == pytest.approx(found[::-1], rel=0.02)
    assert found == pytest.approx(wanted, rel=0.02)
