"""Contacts that surely stick are passed over: what is found is what the law finds for all of
them."""

from dataclasses import fields

import numpy as np
import pytest

from tipdamp.hbm.balance import aft
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.laws import (
    Contacts,
    DryFriction1T,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    MixedLaw,
    UnilateralSpring,
)
from tipdamp.hbm.laws.records import SliderStart

P, H = 80, 4
LAWS = [
    Jenkins1D(),
    DryFriction1T(),
    DryFriction2T(),
    IsotropicFriction(),
    UnilateralSpring(),
    MixedLaw((DryFriction2T(), UnilateralSpring()), np.arange(P) % 2),
]


def case(law, size=1.0):
    rng = np.random.default_rng(3)
    contacts = Contacts(
        rng.uniform(1, 3, P),
        rng.uniform(1, 2, P),
        rng.uniform(0.2, 0.8, P),
        rng.uniform(0.5, 9.0, P),
    )
    x = size * rng.normal(size=(P, len(law.components), 2 * H + 1)) / (1 + np.arange(2 * H + 1))
    return contacts, x, aft.sample_grid(H, law.default_samples(H))


def asked(monkeypatch, law):
    """How many contacts the law is asked for at each call."""
    calls, harmonics = [], type(law).harmonics

    def counted(self, contacts, *rest):
        calls.append(len(contacts))
        return harmonics(self, contacts, *rest)

    monkeypatch.setattr(type(law), "harmonics", counted)
    return calls


@pytest.mark.parametrize("size", [0.0, 0.2, 1.0, 30.0])
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_forces_are_those_of_all_contacts(law, size, monkeypatch):
    contacts, x, grid = case(law, size)
    start = SliderStart(np.zeros((P, law.sliders)), False)
    every = law.harmonics(contacts, x, start, grid, 2.0)
    calls = asked(monkeypatch, law)
    found = aft.evaluate(law, contacts, x, start, grid, 2.0)
    assert calls[0] == P if size == 30.0 else calls[0] < P
    alike(found, every)


def alike(found, every, rtol=0.0):
    """All of two forces but their events, which are of the contacts that were followed."""
    for name in {f.name for f in fields(found)} - {"events"}:
        a, b = getattr(found, name), getattr(every, name)
        assert (a is None) == (b is None), name
        if a is not None:
            assert a.shape == b.shape, name
            assert np.abs(1.0 * a - b).max(initial=0.0) <= rtol * np.abs(b).max(initial=1.0), name


@pytest.mark.parametrize("size", [0.2, 1.0, 30.0])
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_more_orders_by_the_events_that_are_known(law, size):
    """With twice the orders, by the events of the same motion with fewer: as located anew."""
    contacts, x, _ = case(law, size)
    samples = law.default_samples(2 * H + 1)
    start = SliderStart(np.zeros((P, law.sliders)), False)
    known = aft.evaluate(law, contacts, x, start, aft.sample_grid(H, samples), 2.0)
    grid = aft.sample_grid(2 * H + 1, samples)
    more = np.concatenate([x, np.zeros((*x.shape[:2], 2 * H + 2))], axis=2)
    alike(
        aft.evaluate(law, contacts, more, start, grid, 2.0, known),
        law.harmonics(contacts, more, start, grid, 2.0),
        1e-11,
    )


@pytest.mark.parametrize(
    "start", [SliderStart(np.zeros((P, 2)), True), SliderStart(np.full((P, 2), 0.1), False)]
)
def test_sliders_that_start_elsewhere_are_followed(start, monkeypatch):
    """Their force at rest is not zero: no bound of the motion about zero holds for it."""
    law = DryFriction2T()
    contacts, x, grid = case(law, 0.2)
    calls = asked(monkeypatch, law)
    aft.evaluate(law, contacts, x, start, grid, 2.0)
    assert calls == [P]


def test_few_contacts_are_all_asked(monkeypatch):
    law = DryFriction2T()
    contacts, x, grid = case(law, 0.2)
    calls = asked(monkeypatch, law)
    few = np.arange(DEFAULT.few_contacts)
    aft.evaluate(
        law, contacts.select(few), x[few], SliderStart(np.zeros((len(few), 2)), False), grid, 2.0
    )
    assert calls == [len(few)]


def test_bound_is_sharp():
    """One harmonic that just reaches the limit of a contact makes no difference, a little more
    does."""
    law = Jenkins1D()
    contacts = Contacts(np.zeros(P), np.full(P, 2.0), np.full(P, 0.5), np.full(P, 8.0))
    x = np.zeros((P, 1, 3))
    for factor, moves in ((1 - 1e-9, 0), (1 + 1e-9, P)):
        x[:, 0, 1:] = factor * np.array([1.2, 1.6])  # |X_1| = 2 = mu N / kt
        found = aft.evaluate(
            law, contacts, x, SliderStart(np.zeros((P, 1)), False), aft.sample_grid(1, 64), 1.0
        )
        assert found.active.sum() == moves
    assert found.g.any()
