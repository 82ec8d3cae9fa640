"""What the kept stations carry of a map with friction: the pull is balanced though some slip and
some stick."""

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.surfaces.pairing import join
from tipdamp.static_contact.tuning.redistribution import (
    balancing_forces,
    redistribute,
    redistribute_friction,
)

S = np.sqrt(0.5)
MU, STATIONS = 0.3, 7


def map_with_friction(random):
    """Two faces at 45 degrees; at one end friction reaches its limit, at the other there is none.
    And the load that the map balances across the axis y."""
    count, station = 2 * STATIONS, np.tile(range(STATIONS), 2)
    pairs = contact_table(
        np.repeat(frames([[S, 0, S], [-S, 0, S]]), STATIONS, axis=0),
        side=np.repeat(["left", "right"], STATIONS),
        station=station,
        blade_body="blades",
        position=np.outer(0.01 * station, [0, 1, 0]),
        mu=MU,
        preload=random.uniform(1, 5, count),
    )
    share = np.tile(np.linspace(0, 1, STATIONS), 2)
    T = np.column_stack([0 * share, share * MU * pairs.preload * np.repeat([1, -1], STATIONS)])
    load = pairs.preload @ pairs.normal + np.einsum("pd,pdx->x", T, pairs.frame[:, :2])
    return pairs, T, load


def total(pairs, T):
    return np.maximum(pairs.preload, 0) @ pairs.normal + np.einsum(
        "pd,pdx->x", T, pairs.frame[:, :2]
    )


@pytest.mark.parametrize("seed", range(5))
def test_kept_stations_balance_the_pull(seed):
    whole, T, load = map_with_friction(np.random.default_rng(seed))
    kept = whole.select(np.isin(whole.station, [0, 1, 2, 3]))
    forces = balancing_forces(whole, kept, T, load, (0, 1, 0))
    done = redistribute(whole, kept, forces)
    friction = redistribute_friction(whole, T, done)
    assert np.linalg.norm(total(done.pairs, friction) - load) < 1e-12 * np.linalg.norm(load)
    assert (np.abs(friction) <= MU * done.pairs.preload[:, None] * (1 + 1e-12)).all()
    # the side sums of the whole map would not: they miss the load by per cent
    sums = {s: whole.preload[whole.side == s].sum() for s in whole.sides}
    plain = redistribute(whole, kept, sums)
    left = total(plain.pairs, redistribute_friction(whole, T, plain)) - load
    assert np.linalg.norm(left) > 0.01 * np.linalg.norm(load)


def test_open_rows_of_a_station_keep_their_opening():
    """Two rows, the upper one open: kept itself it stays open by its own gap; left out, the lower
    one loses nothing."""
    whole, T, _ = map_with_friction(np.random.default_rng(0))
    upper = whole.replace(row=np.ones(len(whole)), preload=-whole.preload / 2)
    both = join(whole, upper)
    forces = {s: 2 * whole.preload[whole.side == s].sum() for s in whole.sides}
    done = redistribute(both, both, forces).pairs
    assert done.preload == pytest.approx(np.r_[2 * whole.preload, upper.preload])
    lower = both.row == 0
    assert redistribute(both, both.select(lower), forces).pairs.preload == pytest.approx(
        2 * whole.preload
    )
    friction = redistribute_friction(both, np.vstack([T, 0 * T]), redistribute(both, both, forces))
    assert friction == pytest.approx(np.vstack([2 * T, 0 * T]))


def test_a_map_that_the_kept_stations_cannot_carry():
    whole, T, _ = map_with_friction(np.random.default_rng(0))
    with pytest.raises(
        InputError, match="cannot carry the pull with the friction of the whole map: left -"
    ):
        balancing_forces(whole, whole, T, np.array([-10.0, 0, 0]), (0, 1, 0))


def test_moment_of_friction_that_is_left_out():
    """Of a force F at r on the damper, r x F about the middle of the whole map; friction in both
    directions of the frame, on the blades: the damper has its opposite."""
    whole, T, _ = map_with_friction(np.random.default_rng(0))
    T = T + np.random.default_rng(1).standard_normal(T.shape)
    kept = whole.select(whole.station < 3)
    done = redistribute(whole, kept, {s: 1.0 for s in whole.sides})
    of_kept = redistribute_friction(whole, T, done)
    expected, middle = np.zeros(3), whole.position.mean(axis=0)
    for pairs, normal, friction, sign in (
        (whole, whole.preload, T, 1),
        (kept, done.pairs.preload, of_kept, -1),
    ):
        for i in range(len(pairs)):
            t1, t2, n = pairs.frame[i]
            force = -normal[i] * n - friction[i, 0] * t1 - friction[i, 1] * t2
            expected += sign * np.cross(pairs.position[i] - middle, force)
    assert done.with_friction(whole, T, of_kept) == pytest.approx(expected, rel=1e-12)
