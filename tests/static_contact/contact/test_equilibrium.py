"""Side forces before the preload: of a round side by the normal where it touches, not by the mean
of its arc."""

import numpy as np
import pytest

from tipdamp.hbm.contact import ContactTable
from tipdamp.static_contact.contact.equilibrium import side_forces, side_normals

RADIUS, FLANK = 6e-3, np.radians(60)  # m; of the flanks' normals from the horizontal


def pin(low, high, points=9, crown=0.0):
    """A pin of two arcs, each from low to high degrees about the line where it meets a flat flank,
    whose distances from it are gaps; crown : m, by which the ends stand off."""
    stations = 6
    turned = np.tile(np.radians(np.linspace(low, high, points)), stations)
    y = np.repeat(np.linspace(0.0, 0.03, stations), points)
    gap = RADIUS * (1 - np.cos(turned)) + crown * (y / 0.015 - 1) ** 2
    along = np.array([0.0, 1.0, 0.0])
    normals = []
    for out, sign in ((FLANK, 1), (np.pi - FLANK, -1)):
        angle = out + sign * turned
        normals.append(np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)]))
    normal = np.concatenate(normals)
    P = len(normal)
    t1 = np.tile(along, (P, 1))
    each = np.arange(P)
    station = np.tile(np.repeat(np.arange(stations), points), 2)
    return ContactTable(
        side=np.repeat(["right", "left"], P // 2),
        station=station,
        row=np.tile(np.arange(points), 2 * stations),
        blade_body=["blades"] * P,
        blade_node=each,
        damper_body=["damper"] * P,
        damper_node=each,
        position=RADIUS * normal + np.tile(y, 2)[:, None] * along,
        frame=np.stack([t1, np.cross(normal, t1), normal], axis=1),
        gap=np.tile(gap, 2),
        kn=np.ones(P),
        kt=np.ones(P),
        mu=np.ones(P),
        preload=np.zeros(P),
        weight=np.ones(P),
    )


@pytest.mark.parametrize("crown", [0.0, 2e-6])
@pytest.mark.parametrize("low, high", [(-20, 20), (-10, 30), (-7, 21), (-3, 25)])
def test_the_line_of_contact_decides(low, high, crown):
    """Two flanks share a pull: N = 1 / (2 sin 60 deg), wherever the arcs end."""
    pairs = pin(low, high, crown=crown)
    forces = side_forces(side_normals(pairs), [0.0, 0.0, 1.0])
    assert forces == pytest.approx(dict.fromkeys(("right", "left"), 0.57735), rel=2e-3)


def test_an_arc_that_ends_before_the_flank_touches_at_its_end():
    pairs = pin(5, 25)
    angle = FLANK + np.radians(5)
    expected = [np.cos(angle), 0.0, np.sin(angle)]
    assert side_normals(pairs)["right"] == pytest.approx(expected, abs=2e-2)


def test_sides_without_gaps_have_the_mean():
    """Nodes that match count as closed; a flat has one normal, whatever its gaps."""
    pairs = pin(-10, 30)
    closed = side_normals(pairs.replace(gap=0 * pairs.gap))["right"]
    mean = pairs.normal[pairs.side == "right"].mean(axis=0)
    assert closed == pytest.approx(mean / np.linalg.norm(mean), abs=1e-14)
    flat = pin(0, 0)
    wedge = flat.replace(gap=1e-6 * np.arange(len(flat)))
    assert side_normals(wedge)["right"] == pytest.approx(flat.normal[0], abs=1e-14)
