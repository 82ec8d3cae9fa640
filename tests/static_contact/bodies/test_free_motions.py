"""Motions that no contact resists, where the nodes of a body lie exactly on one line: any
direction, size and place."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
from scipy.spatial.transform import Rotation

from tests.contact_tables import contact_table, frames
from tests.static_contact.beams import beam, supports
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.rigid_motions import RigidMotionSettings, floating, rigid_motions
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.contact.preload import StaticContact, StaticSettings
from tipdamp.static_contact.surfaces.pairing import join

S = np.sqrt(0.5)
LOWER = StaticSettings(rigid=RigidMotionSettings(facing=1e-3))
V = frames([[0, -S, S], [0, S, S]], t1=[1.0, 0, 0])
STATION = np.tile(np.arange(7), 2)
ALONG = np.linspace(0.0, 1.0, 7)
TURNS = (np.eye(3), *Rotation.random(3, random_state=5).as_matrix())


def line_body(size, turn, place, held=0.0):
    """K (21, 21) N/m and positions of a straight beam: bending in two planes, an axial spring, none
    against torsion.

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
    """(model, table): a beam pulled along its third direction into a V of two held beams; all nodes
    on one line."""
    made = {
        "damper": line_body(size, turn, place),
        **{s: line_body(size, turn, place, 1e7) for s in ("left", "right")},
    }
    K = sl.block_diag(*(K for K, _ in made.values()))
    model = ReducedModel.from_matrices(
        np.eye(63),
        K,
        body=np.repeat(list(made), 21),
        node=np.tile(np.repeat(np.arange(7), 3), 3),
        direction=np.tile(list("xyz"), 21),
        position=np.vstack([np.repeat(p, 3, axis=0) for _, p in made.values()]),
    )
    table = contact_table(
        np.repeat(V @ turn.T, 7, axis=0),
        side=np.repeat(["left", "right"], 7),
        damper_node=STATION,
        station=STATION,
        blade_body=np.repeat(["left", "right"], 7),
        blade_node=STATION,
        position=np.tile(made["damper"][1], (2, 1)),
    )
    return model, table


@pytest.mark.parametrize("place", [0.0, 3.0])
@pytest.mark.parametrize("size", [1e-3, 0.07, 2.0])
@pytest.mark.parametrize("turn", TURNS)
def test_nodes_on_one_line(size, turn, place):
    """A turn about the line moves no node and counts neither as free nor as loaded; the slide along
    it is free, named after the axis nearest to it, and refused when loaded, but for what inexact
    coordinates could make, which is taken up and reported. The pull of 40 N: 40 / (2 sin 45) on
    each side."""
    model, table = damper_on_two_lines(size, turn, place)
    statics = StaticContact(model, table)
    assert [name for name, _ in statics.motions.names] == [
        f"slide along {'xyz'[np.abs(turn[:, 0]).argmax()]}"
    ]
    load = np.zeros((63, 3))
    load[:21] = np.tile(turn / 7, (7, 1))  # columns: 1 N along the line, across it, into the V
    found = statics.solve(load @ [0, 0, 40.0])
    for side in ("left", "right"):
        assert found.force[table.side == side].sum() == pytest.approx(20 / S, rel=1e-9)
    assert found.residual < 1e-9 and not found.reactions
    amount = 2.0 / np.abs(turn[:, 0]).max()  # per unit along the axis that names it
    with pytest.raises(InputError, match=f"slide along . is loaded: {amount:.3g} N"):
        statics.solve(load @ [2.0, 0, 40.0])
    (held,) = statics.solve(load @ [1e-4, 0, 40.0]).reactions.values()
    # small, not rounding
    assert abs(held) == pytest.approx(1e-4 / np.abs(turn[:, 0]).max(), rel=1e-6)


def test_large_loads_elsewhere_hide_nothing():
    """What counts is the load on the bodies that move: a million newtons on a blade make 0.1 N
    along the slide of the damper no rounding."""
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
    model = ReducedModel.from_matrices(
        np.eye(3),
        np.zeros((3, 3)),
        body="damper",
        node=[1, 1, 1],
        direction=["x", "y", "z"],
        position=np.tile(place, (3, 1)),
    )
    table = contact_table(V, side=["a", "b"], station=0, damper_node=1, position=place)
    statics = StaticContact(model, table)
    assert statics.motions.names == [("slide along x", "N")]
    assert statics.solve(np.array([0, 0, 10.0])).force == pytest.approx(5 / S, rel=1e-12)


def test_rigid_motions_with_rotations():
    """A beam of two elements, EI = L = 1, with x, y and rz at each node: x, y and the turn with rz
    = 1 are free."""
    K = np.zeros((9, 9))
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
    for e in (0, 3):
        K[np.ix_([e, e + 3], [e, e + 3])] += 1e3 * np.array([[1, -1], [-1, 1]])
        K[np.ix_([e + 1, e + 2, e + 4, e + 5], [e + 1, e + 2, e + 4, e + 5])] += k
    x = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    model = ReducedModel.from_matrices(
        np.eye(9),
        K,
        body="pin",
        node=np.repeat([1, 2, 3], 3),
        direction=["x", "y", "rz"] * 3,
        position=np.repeat(x, 3, axis=0),
    )
    rigid = rigid_motions(model)
    energy = np.abs(K @ rigid).max(axis=0)
    assert (energy < 1e-12).all() and np.linalg.matrix_rank(rigid) == 3


@pytest.mark.parametrize("soft", [1e-9, 1e-8, 1e-7, 1e-6])
@pytest.mark.parametrize("turn", TURNS[:2])
def test_soft_springs_to_ground_hold(turn, soft):
    """Springs k at all seven nodes, `soft` of the body's stiffness, carry 2 N along the slide: by 2
    / 7k. K holds 1e-16 / soft digits of them."""
    model, table = damper_on_two_lines(0.07, turn, 3.0)
    k = soft * model.K.diagonal()[:21].max()
    statics = StaticContact(
        replace(model, K=model.K + sl.block_diag(k * np.eye(21), np.zeros((42, 42)))), table
    )
    assert statics.motions.names == []
    load = np.zeros((63, 3))
    load[:21] = np.tile(turn / 7, (7, 1))
    found = statics.solve(load @ [2.0, 0, 40.0])
    slide = np.tile(turn[:, 0], 7) / 7 @ found.displacement[:21]
    assert slide == pytest.approx(2 / (7 * k), rel=1e-15 / soft + 1e-8) and not found.reactions
    for side in ("left", "right"):  # 3e-5 of the pull goes into springs of 1e-6
        assert found.force[table.side == side].sum() == pytest.approx(20 / S, rel=30 * soft)


@pytest.mark.parametrize("kn", [1.0, 1e3, 1e6])
def test_soft_pairs_hold_what_they_face(kn):
    """Two supports 2.3 mm apart under a beam of 70 mm hold its roll however soft they are, down to
    1e-10 of its stiffness: 30 N and 20 N above them, and nothing left of the balance."""
    x = np.linspace(0, 0.07, 31)
    table = supports(x, np.full(31, kn), np.zeros(31)).select([15, 16])
    load = np.zeros(31)
    load[[15, 16]] = 30.0, 20.0
    statics = StaticContact(beam(x, 10.0), table)
    assert statics.motions.names == []
    found = statics.solve(load)
    assert found.force == pytest.approx([30.0, 20.0], rel=1e-12) and found.residual < 1e-12


def test_a_slender_damper_is_one_body():
    """70 mm long and 0.07 mm thick, bent 1e6 times as easily as pulled: only its slide is free,
    whatever holds it."""
    model, table = damper_on_two_lines(0.07, np.eye(3), 0.0)
    K = model.K.copy()
    bends = np.flatnonzero((model.body == "damper") & (model.direction != "x"))
    K[np.ix_(bends, bends)] *= 1e-6
    statics = StaticContact(replace(model, K=K), table)
    assert statics.motions.names == [("slide along x", "N")]
    load = np.zeros(63)
    load[2:21:3] = 40 / 7
    assert statics.solve(load).force[:7].sum() == pytest.approx(20 / S, rel=1e-9)


def test_normals_that_hardly_face_a_motion():
    """Normals turned by 2e-3 to and fro along the line face the slide by 2e-3 sin 45: that may be
    the errors of coordinates, and does not hold it unless the caller says so; then 0.06 N of slide
    are in balance. 1e-2 holds."""
    model, table = damper_on_two_lines(0.07, np.eye(3), 0.0)
    to_and_fro = np.where(table.station % 2, 1.0, -1.0)
    load = np.zeros(63)
    load[2:21:3] = 40 / 7
    load[:21:3] = 0.06 / 7

    def turned(by):
        turn = Rotation.from_rotvec(np.outer(to_and_fro, [0, by, 0])).as_matrix()
        return table.replace(frame=table.frame @ turn.transpose(0, 2, 1))

    with pytest.raises(
        InputError, match=r"slide along x is loaded: 0.07.* N, .*by 1..e-03.*above facing = 0.003"
    ):
        StaticContact(model, turned(2e-3)).solve(load)
    for statics in (StaticContact(model, turned(2e-3), LOWER), StaticContact(model, turned(1e-2))):
        found = statics.solve(load)
        assert statics.motions.names == [] and not found.reactions and found.residual < 1e-9
        assert found.force @ statics.pairs.normal[:, 0] == pytest.approx(0.06, rel=1e-6)


def test_pairs_beyond_double_precision():
    """Pairs of 1e-16 of the body's stiffness: with friction one line says so, no failed
    factorisation."""
    model, table = damper_on_two_lines(0.07, np.eye(3), 0.0)
    table = table.replace(kn=np.full(14, 1e-9), kt=np.full(14, 1e-9), mu=np.full(14, 0.3))
    with pytest.raises(
        InputError, match="too little beside that of the bodies for double precision"
    ):
        FrictionalContact(model, table)


def two_dampers(turns, sizes=(0.07, 0.05), link=0.0):
    """(model, table): two dampers in V's of their own; link: N/m, springs between their nodes
    across both."""
    parts = [
        damper_on_two_lines(size, turn, 3.0 * i)
        for i, (turn, size) in enumerate(zip(turns, sizes, strict=True))
    ]
    own = [np.char.add(model.body, str(i)) for i, (model, _) in enumerate(parts)]
    K = sl.block_diag(*(model.K for model, _ in parts))
    across = np.cross(turns[0][:, 0], turns[1][:, 0])
    across = across / np.linalg.norm(across) if across.any() else turns[0][:, 2]
    tie = np.kron(np.eye(7), across)
    tie = np.hstack([tie, np.zeros((7, 42)), -tie, np.zeros((7, 42))])
    K += link * tie.T @ tie
    model = ReducedModel.from_matrices(
        np.eye(126),
        K,
        body=np.concatenate(own),
        **{
            name: np.concatenate([getattr(model, name) for model, _ in parts])
            for name in ("node", "direction", "position")
        },
    )
    return model, join(
        *(
            table.replace(
                **{
                    name: np.char.add(getattr(table, name), str(i))
                    for name in ("side", "blade_body", "damper_body")
                }
            )
            for i, (_, table) in enumerate(parts)
        )
    )


@pytest.mark.parametrize("link", [0.0, 1e3])
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("other", TURNS[:2])
def test_rounding_is_no_load(turn, other, link):
    """A load on one of two dampers does nothing along the slide of the other but rounding, also
    where K couples them: taken, and nothing of it reported. 0.1 N along that slide are refused."""
    model, table = two_dampers((turn, other), link=link)
    statics = StaticContact(model, table)
    assert len(statics.motions.names) == 2
    if not link:  # one damper in each of them, to the last bit
        assert [
            np.unique(model.body[shape != 0]).tolist() for shape in statics.motions.shape.T
        ] in ([["damper0"], ["damper1"]], [["damper1"], ["damper0"]])
    load = np.zeros(126)
    load[:21] = np.tile(turn @ [0, 0, 40 / 7], 7)
    statics.motions.refuse(statics.motions.shape.T @ load, load)
    assert not statics.motions.reactions(statics.motions.shape.T @ load, load, 1e-10)
    if link:
        load[63:84] = np.tile(other @ [0, 0, 1e-3 / 7], 7)  # keeps the second where it is
    found = statics.solve(load)
    assert not found.reactions and found.residual < 1e-8
    load[63:84] += np.tile(other @ [0.1 / 7, 0, 0], 7)
    with pytest.raises(InputError, match="slide along . is loaded"):
        statics.solve(load)


@pytest.mark.parametrize("soft, error", [(1e-9, 1e-6), (1e-7, 1e-5), (1e-9, 1e-4)])
def test_soft_springs_beside_inexact_positions(soft, error):
    """Springs that hold the slide, softer than what positions with `error` of the size make of a
    turn, hold it all the same: what is free are the other slides and the turns, and a blade on such
    springs does not float."""
    random = np.random.default_rng(0)
    noise = error * 0.07 * np.repeat(random.uniform(-1, 1, (7, 3)), 3, axis=0)
    model, table = damper_on_two_lines(0.07, np.eye(3), 0.0)
    position = model.position.copy()
    position[:21] += noise
    along, blade = (np.diag(np.tile(on, 21)) for on in ([1.0, 0, 0], [1.0, 1, 1]))
    K = model.K.copy()
    k = soft * K.diagonal()[:21].max()
    K[:21, :21] += k * along[:21, :21]
    rigid = rigid_motions(replace(model, position=position))
    shapes = rigid @ floating(rigid, K)
    slide = np.tile([1.0, 0, 0], 7) / np.sqrt(7)
    assert shapes.shape[1] == 4
    assert np.linalg.norm(slide @ np.linalg.qr(shapes)[0][:21]) < 1e-3
    statics = StaticContact(replace(model, K=K, position=position), table)
    assert statics.motions.names == []
    K = model.K.copy()
    K[21:42, 21:42] += (k - 1e7) * blade[:21, :21]
    statics = StaticContact(replace(model, K=K, position=position), table)
    assert statics.motions.names == [("slide along x", "N")]
    load = np.zeros(63)
    load[2:21:3] = 40 / 7
    assert statics.solve(load).force[:7].sum() == pytest.approx(20 / S, rel=1e-6)
