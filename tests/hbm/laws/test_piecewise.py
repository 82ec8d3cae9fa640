"""Tables of piecewise-linear laws: sliders, mixtures, and shapes that do not fit."""

from dataclasses import replace

import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts, DryFriction2T, Jenkins1D, UnilateralSpring
from tipdamp.hbm.laws.base import Motion, SliderStart
from tipdamp.hbm.laws.mixed import MixedLaw
from tipdamp.hbm.laws.piecewise import merged_table, slider_table

P = 40


def contacts_of_every_kind():
    """Some without kn, kt or mu, preload of both signs."""
    random = np.random.default_rng(0)
    kn, kt, mu = (random.random(P) * (random.random(P) > 0.2) for _ in range(3))
    return Contacts(kn, kt, mu, random.normal(size=P))


def force_of(table, state, memory, u):
    at = np.arange(len(u))
    return (
        np.einsum("pij,pj->pi", table.stiffness[at, state], u)
        + np.einsum("pij,pj->pi", table.by_memory[at, state], memory)
        + table.offset[at, state]
    )


@pytest.mark.parametrize(
    "law",
    [
        Jenkins1D(),
        DryFriction2T(),
        UnilateralSpring(),
        MixedLaw((Jenkins1D(), DryFriction2T(), UnilateralSpring()), np.arange(P) % 3),
    ],
)
def test_table_of_a_law_is_its_step(law):
    """Forces along a motion, also with the memory that the motion carries along taken into the
    table."""
    contacts, nd = contacts_of_every_kind(), len(law.components)
    table = law.piecewise_linear(contacts)
    zero = np.zeros((P, nd))
    state = law.initial_state(zero, SliderStart(np.zeros((P, law.sliders)), False), contacts)
    memory = state[:, : table.follows.shape[1]]
    for i in range(200):
        u = 3 * np.sin(np.array([0.1, 0.07, 0.13])[:nd] * i + np.arange(P)[:, None])
        force, state = law.step(Motion(u, zero, 1.0), state, contacts)
        if law.sliders:  # a contact that closes takes up its slider within the step
            memory = state[:, : table.follows.shape[1]]
        place, memory = table.settled(u, zero, table.initial, memory)
        assert np.abs(force_of(table, place, memory, u) - force).max() < 1e-13
        assert np.abs(force_of(table.resolved(), place, memory, u) - force).max() < 1e-13


def test_merged_tables_keep_each_law():
    contacts = contacts_of_every_kind()
    some = replace(contacts, **{name: getattr(contacts, name)[:10] for name in vars(contacts)})
    one, two = slider_table(some, 1, False), slider_table(some, 2, True)
    merged = merged_table(
        [(one, np.arange(10), [0]), (two, np.arange(10, 20), [0, 1, 2])], np.full((20, 3), 7.0)
    )
    S, G = len(one.follows), len(one.state)
    assert (merged.initial[:10] < S).all() and (merged.initial[10:] >= S).all()
    assert (merged.offset[:10, :S, 1:] == 7).all() and np.array_equal(
        merged.stiffness[10:, S:], two.stiffness
    )
    assert (
        np.array_equal(merged.guard_u[10:, G:], two.guard_u) and not merged.watched[10:, :G].any()
    )


def test_shapes_of_a_table_are_checked():
    table = slider_table(contacts_of_every_kind(), 1, True)
    with pytest.raises(InputError, match=r"guard_0 has the shape \(1, 2\), must be \(40, 8\)"):
        replace(table, guard_0=np.zeros((1, 2)))
