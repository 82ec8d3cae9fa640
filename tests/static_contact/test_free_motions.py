"""Motions that no contact resists, where the nodes of a body lie exactly on one line: any direction, size and place."""

import numpy as np
import pytest
import scipy.linalg as sl
from scipy.spatial.transform import Rotation

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from static_contact.free_motions import rigid_motions
from static_contact.preload import StaticContact
from tests.static_contact.beams import beam

S = np.sqrt(0.5)
ALONG = np.linspace(0.0, 1.0, 7)
TURNS = (np.eye(3), *Rotation.random(3, random_state=5).as_matrix())


def line_body(size, turn, place, held=0.0):
    """K (21, 21) N/m and positions of a straight beam: bending in two planes, an axial spring, none against torsion.

    held : N/m, springs of every node to the ground
    """
    bending = beam(size * ALONG, 50.0 * size**3).K
    axial = 1e7 * (np.diag([1.0, 2, 2, 2, 2, 2, 1]) - np.eye(7, k=1) - np.eye(7, k=-1))
    K = np.zeros((7, 3, 7, 3))
    for d, one in enumerate((axial, bending, bending)):
        K[:, d, :, d] = one + held * np.eye(7)
    K = np.einsum("xd,adbe,ye->axby", turn, K, turn).reshape(21, 21)
    return (K + K.T) / 2, (np.outer(size * ALONG, [1.0, 0, 0])) @ turn.T + place


def damper_on_two_lines(size, turn, place):
    """(model, table): a beam pulled along its third direction into a V of two held beams; all nodes on one line."""
    made = {"damper": line_body(size, turn, place), **{s: line_body(size, turn, place, 1e7) for s in ("left", "right")}}
    K = sl.block_diag(*(K for K, _ in made.values()))
    model = ReducedModel.from_matrices(np.eye(63), K, body=np.repeat(list(made), 21), node=np.tile(np.repeat(
        np.arange(7), 3), 3), direction=np.tile(list("xyz"), 21), position=np.vstack([np.repeat(p, 3, axis=0) for _, p
                                                                                     in made.values()]))
    frame = [np.array([[1, 0, 0], np.cross([0, s * S, S], [1, 0, 0]), [0, s * S, S]]) @ turn.T for s in (-1, 1)]
    full, P = np.full, 14
    table = ContactTable(side=np.repeat(["left", "right"], 7), station=np.tile(np.arange(7), 2), row=np.zeros(P),
                         blade_body=np.repeat(["left", "right"], 7), blade_node=np.tile(np.arange(7), 2),
                         damper_body=full(P, "damper"), damper_node=np.tile(np.arange(7), 2),
                         position=np.tile(made["damper"][1], (2, 1)), frame=np.repeat(frame, 7, axis=0),
                         gap=np.zeros(P), kn=full(P, 1e6), kt=full(P, 1e6), mu=np.zeros(P), preload=np.zeros(P),
                         weight=np.ones(P))
    return model, table


@pytest.mark.parametrize("place", [0.0, 3.0])
@pytest.mark.parametrize("size", [1e-3, 0.07, 2.0])
@pytest.mark.parametrize("turn", TURNS)
def test_nodes_on_one_line(size, turn, place):
    """A turn about the line moves no node and counts neither as free nor as loaded; the slide along it is free, named
    after the axis nearest to it, and refused when loaded, but for what inexact coordinates could make, which is taken
    up and reported. The pull of 40 N: 40 / (2 sin 45) on each side."""
    model, table = damper_on_two_lines(size, turn, place)
    statics = StaticContact(model, table)
    assert [name for name, _ in statics.names] == [f"slide along {'xyz'[np.abs(turn[:, 0]).argmax()]}"]
    load = np.zeros((63, 3))
    load[:21] = np.tile(turn / 7, (7, 1))                     # columns: 1 N along the line, across it, into the V
    found = statics.solve(load @ [0, 0, 40.0])
    for side in ("left", "right"):
        assert found.force[table.side == side].sum() == pytest.approx(20 / S, rel=1e-9)
    assert found.residual < 1e-9 and not found.held
    amount = 2.0 / np.abs(turn[:, 0]).max()                   # per unit along the axis that names it
    with pytest.raises(InputError, match=f"slide along . is loaded: {amount:.3g} N"):
        statics.solve(load @ [2.0, 0, 40.0])
    (held,) = statics.solve(load @ [1e-4, 0, 40.0]).held.values()
    assert abs(held) == pytest.approx(1e-4 / np.abs(turn[:, 0]).max(), rel=1e-6)      # small, not rounding


def test_large_loads_elsewhere_hide_nothing():
    """What counts is the load on the bodies that move: a million newtons on a blade make 0.1 N along the slide of
    the damper no rounding."""
    model, table = damper_on_two_lines(0.07, np.eye(3), 0.0)
    load = np.zeros(63)
    load[[2, 5, 8, 11, 14, 17, 20]] = 40 / 7
    load[21 + 1] = 1e6
    StaticContact(model, table).solve(load)
    load[0] = 0.1
    with pytest.raises(InputError, match="slide along x is loaded: 0.1 N"):
        StaticContact(model, table).solve(load)


def test_single_nodes_do_not_turn():
    """A body of one node, far from the origin, has three slides and nothing that rolls."""
    turn = TURNS[1]
    place = 3 + turn[0]
    model = ReducedModel.from_matrices(np.eye(3), np.zeros((3, 3)), body="damper", node=[1, 1, 1],
                                       direction=["x", "y", "z"], position=np.tile(place, (3, 1)))
    full, P = np.full, 2
    frame = np.array([np.array([[1, 0, 0], np.cross([0, s * S, S], [1, 0, 0]), [0, s * S, S]]) for s in (-1, 1)])
    table = ContactTable(side=["a", "b"], station=[0, 0], row=[0, 0], blade_body=full(P, "ground"),
                         blade_node=[1, 1], damper_body=full(P, "damper"), damper_node=[1, 1],
                         position=np.tile(place, (2, 1)), frame=frame, gap=np.zeros(P), kn=full(P, 1e6),
                         kt=full(P, 1e6), mu=np.zeros(P), preload=np.zeros(P), weight=np.ones(P))
    statics = StaticContact(model, table)
    assert statics.names == [("slide along x", "N")]
    assert statics.solve(np.array([0, 0, 10.0])).force == pytest.approx(5 / S, rel=1e-12)


def test_a_free_body_with_rotations_has_its_rigid_motions():
    """A beam of two elements, EI = L = 1, with x, y and rz at each node: x, y and the turn with rz = 1 are free."""
    K = np.zeros((9, 9))
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
    for e in (0, 3):
        K[np.ix_([e, e + 3], [e, e + 3])] += 1e3 * np.array([[1, -1], [-1, 1]])
        K[np.ix_([e + 1, e + 2, e + 4, e + 5], [e + 1, e + 2, e + 4, e + 5])] += k
    x = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    model = ReducedModel.from_matrices(np.eye(9), K, body="pin", node=np.repeat([1, 2, 3], 3),
                                       direction=["x", "y", "rz"] * 3, position=np.repeat(x, 3, axis=0))
    rigid = rigid_motions(model)
    energy = np.abs(K @ rigid).max(axis=0)
    assert (energy < 1e-12).all() and np.linalg.matrix_rank(rigid) == 3
