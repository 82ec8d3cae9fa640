"""A free pin that touches two blocks on a short piece of its length: the sides carry what statics
says, to rounding."""

import warnings

import numpy as np
import pytest

from tests.static_contact.pin_pocket import PULL, SIDE, bodies, case, nodal_pull, pairs
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.spring import Hold, held_motions
from tipdamp.hbm.laws.friction import each_limited, resultant_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.compliance import Compliance
from tipdamp.static_contact.bodies.sparse_bodies import (
    SparseBodies,
    SparseCompliance,
    sparse_stuck_bodies,
)
from tipdamp.static_contact.bodies.stuck_bodies import stuck_bodies
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.normal.complementarity import NoEquilibrium

pytest.importorskip("dolfinx")
FREE = ["roll about z", "slide along z"]


def on_both(stations):
    return {"right": stations, "left": stations}


@pytest.mark.parametrize(
    "stations", [(0, 1), (0, 1, 2), (14, 15), range(5), (14, 15, 16), (29, 30)]
)
def test_a_short_piece_carries_the_pull(stations):
    """Half of 113 N at the first and at the last station: 113 / sqrt(2) on each side; roll and
    slide are free."""
    model, table, load = case(on_both(tuple(stations)))
    found = StaticContact(model, table).solve(load)
    for side in ("right", "left"):
        assert found.force[table.side == side].sum() == pytest.approx(SIDE, rel=1e-9)
    assert sorted(m.name for m in found.motions) == FREE and not found.reactions
    assert max(abs(m.load) for m in found.motions) < 1e-10
    assert found.balance < 1e-9 and found.residual < 1e-9


def test_a_pull_beyond_the_contact_tips_the_pin():
    """All of it at z = 30 mm, contact at 0 and 2 mm: the pin turns about x, across the pull."""
    with pytest.raises(NoEquilibrium, match="free to move: roll about x"):
        StaticContact(*(made := case(on_both((0, 1)), pulled=(15, 15)))[:2]).solve(made[2])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("number", [2, 3, 5, 31])
def test_stations_of_either_side_anywhere(number, seed):
    """Other stations on either side, turned at random, in mm, N and t. Each side has its force's
    line of action where the pull is, so that statics allows it where that lies between its first
    and its last station; otherwise it tips."""
    random = np.random.default_rng(100 * number + seed)
    stations = {
        side: tuple(sorted(random.choice(31, number, replace=False).tolist()))
        for side in ("right", "left")
    }
    pulled = random.integers(0, 31, 2)
    turn = tuple(random.normal(0, 2, 3))
    model, table, load = case(stations, tuple(pulled.tolist()), turn, unit=1e3)
    ends = [(min(one), max(one)) for one in stations.values()]
    allowed = all(low <= pulled.mean() <= high for low, high in ends)
    statics = StaticContact(model, table)
    if not allowed:
        with pytest.raises(NoEquilibrium):
            statics.solve(load)
        return
    found = statics.solve(load)
    for side in ("right", "left"):
        assert found.force[table.side == side].sum() == pytest.approx(SIDE, rel=1e-9)
    assert found.balance < 1e-9 and not found.reactions


@pytest.mark.parametrize(
    "stations, turn, unit", [((0, 1), None, 1.0), ((29, 30), (1.0, -2.0, 0.5), 1e3)]
)
def test_the_unreduced_pin_on_a_short_piece(stations, turn, unit):
    """The sides carry what statics says; and a pull beyond the contact tips the pin."""
    whole = SparseBodies.of(list(bodies(turn, unit).values()))
    table = pairs(on_both(stations), turn, unit)
    statics = StaticContact(whole, table, compliance=SparseCompliance)
    found = statics.solve(nodal_pull(whole, stations, turn))
    for side in ("right", "left"):
        assert found.force[table.side == side].sum() == pytest.approx(SIDE, rel=1e-9)
    assert found.balance < 1e-9 and found.residual < 1e-9 and not found.reactions
    with pytest.raises(NoEquilibrium, match="free to move: roll"):
        statics.solve(nodal_pull(whole, (15, 15), turn))


def test_the_unreduced_bodies_carry_the_same():
    """Their compliance at the pairs against the condensed route, 62 pairs; a second pull from the
    first one's pairs."""
    stations = on_both(tuple(range(31)))
    model, table, load = case(stations)
    whole = SparseBodies.of(list(bodies().values()))
    statics = StaticContact(whole, table, compliance=SparseCompliance)
    found, before = {}, None
    for pulled in ((0, 30), (4, 29)):
        model, _, load = case(stations, pulled)
        f = nodal_pull(whole, pulled)
        before = found[pulled] = statics.solve(f, near=before)
        other = StaticContact(model, table).solve(load)
        assert before.pairs.preload == pytest.approx(
            other.pairs.preload, abs=1e-10 * other.force.max()
        )
        assert before.balance < 1e-12 and before.residual < 1e-10
        alone = statics.forces(f)
        assert alone.pairs.preload == pytest.approx(
            other.pairs.preload, abs=1e-10 * other.force.max()
        )
        assert alone.balance < 1e-12
    again = statics.solve(f)
    assert again.pairs.preload == pytest.approx(
        before.pairs.preload, abs=1e-11 * before.force.max()
    )


def test_the_unreduced_bodies_are_held_the_same():
    """A slide along the pin on a spring, and a roll on a soft one, with loads along both: the
    springs take these up."""
    stations = on_both((3, 9, 17, 28))
    model, table, load = case(stations, (0, 30))
    whole, found = SparseBodies.of(list(bodies().values())), []
    nodal = nodal_pull(whole, (0, 30))
    holds = [Hold("z", 3e4, body="pin"), Hold("about z", 0.2, body="pin")]
    for body, pull, kind in ((model, load, Compliance), (whole, nodal, SparseCompliance)):
        held = held_motions(body, table, holds)
        f = pull + sum(a * one.row for a, one in zip((7.0, -1e-3), held, strict=True))
        contact = StaticContact(body, table, held=held, compliance=kind)
        found += [contact.solve(f), contact.forces(f)]
        assert found[-2].residual < 1e-10
    for one in found:
        assert (
            list(one.held.values()) == pytest.approx([7.0, -1e-3], rel=1e-8) and one.balance < 1e-9
        )
        assert (
            one.force == pytest.approx(found[0].force, abs=1e-9 * PULL)
            and not one.reactions
            and not one.motions
        )


@pytest.mark.parametrize("friction", [each_limited, resultant_limited])
def test_the_unreduced_bodies_slip_the_same(friction):
    """Pulled, then pushed along the pin until pairs slip: friction history against the condensed
    route."""
    stations = on_both((3, 9, 17, 28))
    model, table, load = case(stations, (0, 30))
    table = table.replace(mu=np.linspace(0.5, 1.2, len(table)))
    whole, states = SparseBodies.of(list(bodies().values())), []
    nodal = nodal_pull(whole, (0, 30))
    for body, pull, kind in ((model, load, stuck_bodies), (whole, nodal, sparse_stuck_bodies)):
        (push,) = held_motions(body, table, [Hold("z", body="pin")])
        states.append(
            FrictionalContact(body, table, friction=friction, stuck=kind).solve(
                [pull, pull + 60 * push.row], steps=3
            )
        )
    assert states[0][-1].converged and states[0][-1].slips.any() and not states[0][-1].slips.all()
    for one, other in zip(*states, strict=True):
        assert other.pairs.preload == pytest.approx(one.pairs.preload, abs=1e-9 * PULL)
        assert other.tangential == pytest.approx(one.tangential, abs=1e-8 * PULL)
        assert (
            other.slider == pytest.approx(one.slider, abs=1e-8 * PULL / table.kt.min())
            and other.residual < 1e-9
        )


def test_rounding_that_holds_what_floats_is_warned_of():
    """Matrices that do not say that the pin floats, and resist it all ways by 2e-10 of the
    stiffness of their dofs, as condensing to a few masters may leave it."""
    model, table, load = case(on_both((0, 1, 2)))
    K = model.K + 2e-10 * np.diag(np.where(model.body == "pin", model.K.diagonal(), 0.0))
    with pytest.warns(
        UserWarning, match="rigid motions of bodies by less than 1e-09 .* name its motions"
    ):
        StaticContact(model.with_stiffness(K), table)
    known = ReducedModel.from_matrices(
        model.M,
        model.K,
        body=model.body,
        node=model.node,
        position=model.position,
        direction=model.direction,
        rigid=model.rigid,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = StaticContact(known, table).solve(load)
    assert found.force[table.side == "right"].sum() == pytest.approx(SIDE, rel=1e-9)


def test_what_floats_travels_with_the_model(tmp_path):
    """Through assembly, a file and a part; another stiffness, and matrices that resist what is
    called rigid, end it."""
    model, *_ = case(on_both((0, 1)))
    model.save(tmp_path / "model.npz")
    for one in (model, ReducedModel.load(tmp_path / "model.npz"), model.part("pin", "left")):
        assert one.rigid["pin"].shape == (12, 6) and one.rigid["left"].shape == (6, 0)
        own = one.body == "pin"
        assert (
            np.abs(one.K[np.ix_(own, own)] @ one.rigid["pin"]).max() < 1e-14 * np.abs(model.K).max()
        )
    assert model.with_stiffness(model.K).rigid == {} and "pin" not in model.part("left").rigid
    with pytest.raises(InputError, match="rigid motions of body 'pin': K resists them"):
        ReducedModel.from_matrices(
            model.M,
            model.K + 1e-6 * np.abs(model.K).max() * np.eye(model.size),
            body=model.body,
            rigid=model.rigid,
        )
    with pytest.raises(InputError, match=r"shape \(3, 6\), must be \(12, 6\) where it floats"):
        ReducedModel.from_matrices(
            model.M, model.K, body=model.body, rigid={"pin": np.ones((3, 6))}
        )
