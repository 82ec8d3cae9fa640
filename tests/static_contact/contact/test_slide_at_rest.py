"""A rigid pin that slides along soft flanks until it rests: the side forces and the rows that carry
of finite motions, which know neither pairs nor gaps."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.contact_tables import contact_table, frames
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.friction import resultant_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.points import ContactPoints
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.contact.slide_at_rest import RoundSides, SlideSettings, settled

R, ARM, FLANK, PULL = 4e-3, 0.1, np.radians(45), 40.0  # m, m, rad, N
ROWS, ARC, LENGTH, SOFT = 41, np.radians(20), 0.02, 2e11  # SOFT : N/m3, a bed of springs
SIDES = {"right": 1.0, "left": -1.0}


class Pin(NamedTuple):
    """Model, pairs, load; the flanks turn about hinges, or move along x."""

    model: ReducedModel
    pairs: object
    load: np.ndarray


def moved(arm, axes):
    """(3n, 6): motions of places `arm` (n, 3) from a point by its slides and turns."""
    turns = np.cross(np.eye(3)[:, None], arm)
    return (
        np.concatenate([np.broadcast_to(np.eye(3)[:, None], turns.shape), turns])[axes]
        .transpose(1, 2, 0)
        .reshape(-1, len(axes))
    )


@cache
def pin(stiffness, hinged, pocket=np.inf, mu=0.0):
    """A pin between two flanks of such stiffness along x, N/m at the height of the pin, which turn
    about hinges ARM below it or slide; flat or of the radius `pocket`."""
    angle = np.tile(np.linspace(-ARC, ARC, ROWS), 2)
    along = np.repeat([0.0, LENGTH], ROWS)
    P = 2 * len(angle)
    normal = []
    for sign in SIDES.values():
        out = FLANK + angle
        normal.append(np.column_stack([sign * np.cos(out), 0 * angle, np.sin(out)]))
    normal = np.concatenate(normal)
    place = R * normal + np.tile(along, 2)[:, None] * [0, 1, 0]
    step = R * 2 * ARC / (ROWS - 1) * LENGTH / 2
    share = np.where(np.abs(angle) < ARC - 1e-9, 1.0, 0.5)
    pairs = contact_table(
        frames(normal),
        side=np.repeat(list(SIDES), P // 2),
        station=np.tile(np.repeat([0, 1], ROWS), 2),
        row=np.tile(np.arange(ROWS), 4),
        blade_body="blades",
        blade_node=1000 + np.arange(P),
        damper_node=1000 + np.arange(P),
        position=place,
        gap=np.tile(open_by(angle, pocket), 2),
        kn=SOFT * step * np.tile(share, 2),
        kt=SOFT * step * np.tile(share, 2),
        mu=mu,
        area=step * np.tile(share, 2),
    )
    blades = np.zeros((3 * P, 8))
    for k, sign in enumerate(SIDES.values()):
        mine = np.repeat(pairs.side == list(SIDES)[k], 3)
        hinge = np.array([sign * R, 0.0, -ARM])
        turn = moved(place - hinge, [4]).ravel() / ARM
        blades[mine, k] = (turn if hinged else moved(place, [0]).ravel())[mine]
    damper = np.hstack([np.zeros((3 * P, 2)), moved(place, range(6))])
    numbers = 1000 + np.arange(P)
    model = ReducedModel.from_matrices(
        np.eye(8),
        np.diag([stiffness] * 2 + [0.0] * 6),
        body=["blades"] * 2 + ["damper"] * 6,
        node=[1, 2] + [3] * 6,
        direction=["x"] * 2 + ["x", "y", "z", "rx", "ry", "rz"],
        position=np.zeros((8, 3)),
        rigid={"damper": np.eye(6)},
        points={
            "blades": ContactPoints(numbers, place, blades),
            "damper": ContactPoints(numbers, place, damper),
        },
    )
    middle = LENGTH / 2
    return Pin(model, pairs, PULL * np.array([0, 0, 0, 0, 1, middle, 0, 0]))


def open_by(angle, pocket=np.inf):
    """m along the radius of the pin: to a flank, or a pocket, that it touches at the angle 0."""
    if np.isinf(pocket):
        return R * (1 / np.cos(angle) - 1)
    off = pocket - R
    return -off * np.cos(angle) + np.sqrt(pocket**2 - (off * np.sin(angle)) ** 2) - R


def exact(stiffness, hinged, pocket=np.inf, mu=0.0):
    """(N of a side, angle of its direction to x) of finite motions: a flank stays where the force
    along its normal at this angle, and friction as it slips, hold pin and flank."""
    d = np.cbrt((PULL / 2 / np.sin(FLANK) / (4 / 3 * SOFT * LENGTH)) ** 2 / (2 * R))  # overlap

    def force(angle):
        N = PULL / 2 / (np.sin(angle) + mu * np.cos(angle))
        return N, N * np.cos(angle) - mu * N * np.sin(angle), PULL / 2  # along the normal, x, z

    def turned(angle):
        """Moment about the hinge over its stiffness, less the turn of the flank."""
        n, n0 = (np.array([np.cos(a), np.sin(a)]) for a in (angle, FLANK))
        hinge = np.array([R, -ARM])
        z = (d + n0 @ (R * n0 - hinge) + n @ hinge - R) / n[1]
        arm = np.array([0.0, z]) + R * n - hinge
        _, x, up = force(angle)
        return (arm[1] * x - arm[0] * up) / (stiffness * ARM**2) - (FLANK - angle)

    def across(angle):
        """x of the pin, on the line of centres, beside the pocket that its force has moved."""
        off = pocket - R
        return force(angle)[1] / stiffness - off * np.cos(FLANK) + (off + d) * np.cos(angle)

    if not hinged and np.isinf(pocket):
        return force(FLANK)[0], FLANK
    angle = brentq(turned if hinged else across, 0.5 * FLANK, 1.5 * FLANK)
    return force(angle)[0], angle


def at_rest(case, names=SIDES):
    """The solution with the gaps of the position reached, and its RoundSides."""
    contact, sides = (
        StaticContact(case.model, case.pairs),
        RoundSides(case.model, case.pairs, names),
    )
    [found] = settled(lambda gaps: [contact.solve(case.load, gap=gaps[-1])], sides)
    return found, sides


FLANKS = {
    "on hinges": (7e4, True),
    "on soft hinges": (3e4, True),
    "straight": (1e5, False),
    "straight and soft": (3e4, False),
    "a wide pocket": (1e5, False, 3 * R),
    "a pocket": (3e4, False, 2 * R),
}


@pytest.mark.parametrize("given", FLANKS.values(), ids=FLANKS)
def test_a_pin_between_soft_flanks(given):
    """Side force and direction to a few percent of the slide over the radius; with the gaps of the
    unloaded position they are off by nearly all of it, and other rows are closed."""
    case, (N, angle) = pin(*given), exact(*given)
    found, sides = at_rest(case)
    reached = sides.slides(found.displacement, found.force)
    plain = StaticContact(case.model, case.pairs).solve(case.load)
    for name, sign in SIDES.items():
        mine, here = case.pairs.side == name, reached[name]
        moved = abs(here.slide) / R
        assert moved > 0.05 and here.radius == pytest.approx(R, rel=1e-3)
        force = found.force[mine] @ case.pairs.normal[mine]
        assert np.arctan2(force[2], sign * force[0]) == pytest.approx(angle, abs=0.05 * moved)
        assert np.arccos(here.normal @ [sign * np.cos(angle), 0, np.sin(angle)]) < 0.05 * moved
        assert found.force[mine].sum() == pytest.approx(N, rel=0.05 * moved)
        assert here.off < 0.01
        assert N - plain.force[mine].sum() > 0.2 * moved * N
        rows = [case.pairs.row[mine][x.force[mine] > 0].mean() for x in (found, plain)]
        assert rows[1] - rows[0] > 0.2 * moved * (ROWS - 1) / (2 * ARC)


def test_a_roll_is_no_slide():
    case = pin(1e5, False)
    found, sides = at_rest(case)
    roll = np.zeros(8)
    roll[6] = 0.05
    assert sides.slide(found.displacement + roll) == pytest.approx(
        sides.slide(found.displacement), abs=1e-12
    )


def test_a_pin_that_rubs_along_its_flanks():
    """Both sides slip: N = Fc / (2 (sin 45 + mu cos 45)), wherever the pin has slid to."""
    mu = 0.3
    case, (N, _) = pin(3e4, False, mu=mu), exact(3e4, False, mu=mu)
    contact = FrictionalContact(case.model, case.pairs, friction=resultant_limited)
    sides = RoundSides(case.model, case.pairs, SIDES)
    [found] = settled(lambda gaps: contact.solve([case.load], steps=5, gap=gaps)[-1:], sides)
    plain = contact.solve([case.load], steps=5)[-1]
    assert found.converged and abs(sides.slide(found.displacement)).max() > 0.05 * R
    for name in SIDES:
        mine = case.pairs.side == name
        assert found.force[mine].sum() == pytest.approx(N, rel=5e-3)
        assert plain.force[mine].sum() < 0.96 * N


def test_gaps_of_a_history():
    case = pin(1e5, False, mu=0.3)
    contact = FrictionalContact(case.model, case.pairs)
    with pytest.raises(InputError, match="gap: 3 rows; allowed are one, or 2 for the start and"):
        contact.solve([case.load], gap=np.zeros((3, len(case.pairs))))


@pytest.mark.parametrize("column", ["area", "gap"])
def test_what_keeps_its_gaps(column):
    """Pairs of nodes, which have no area and the normals of the blade, and surfaces without gaps,
    which count as touching wherever they are."""
    case = pin(1e5, False)
    pairs = case.pairs.replace(**{column: np.zeros(len(case.pairs))})
    sides, solved = RoundSides(case.model, pairs, SIDES), []

    def solve(gaps):
        solved.append(gaps)
        return [StaticContact(case.model, pairs).solve(case.load, gap=gaps[-1])]

    [found] = settled(solve, sides)
    assert not sides.names and len(solved) == 1
    assert (solved[0] == pairs.gap).all() and (found.pairs.gap == pairs.gap).all()


def test_no_position_at_rest():
    """Fewer solutions than the gaps take to settle: an error that says how far the pin slides."""
    case = pin(3e4, False)
    contact, sides = (
        StaticContact(case.model, case.pairs),
        RoundSides(case.model, case.pairs, SIDES),
    )
    with pytest.raises(InputError, match="right, left: the damper slides by 0.* radius of 4 mm"):
        settled(
            lambda gaps: [contact.solve(case.load, gap=gaps[-1])],
            sides,
            settings=SlideSettings(most=2),
        )
