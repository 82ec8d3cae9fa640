"""Coulomb friction is stated in hbm/laws/friction.py. Every other place that says the same, in
closed form, compiled or as a table, is named here and held to that statement, marched through
random cycles in which contacts stick, slip, turn, lift off and close again.

A place that states friction anew is a test here and a line in docs/decisions.md.
"""

from typing import NamedTuple

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tests.hbm.conformance import random_case
from tipdamp.hbm import fourier
from tipdamp.hbm.balance import aft
from tipdamp.hbm.laws import (
    Contacts,
    DryFriction1T,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    Motion,
)
from tipdamp.hbm.laws.friction import each_limited, resultant_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.testing import forces, total_force
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.stiffness.partial_slip import displacement_loop

EACH = (Jenkins1D(), DryFriction1T(), DryFriction2T())
ALL = (*EACH, IsotropicFriction())
LIMITS = {IsotropicFriction: resultant_limited}
SAMPLES = 3000  # of a cycle: an event is missed by 2e-3 rad at most


class Marched(NamedTuple):
    """force (n, P, nd) N, slider (n, P, nt) m, slips (n, P, nt) and opened (n, P) at n samples."""

    force: np.ndarray
    slider: np.ndarray
    slips: np.ndarray
    opened: np.ndarray


def marched(law, contacts, motion, slider):
    """The statement, instant by instant along the motion (n, P, nd), from the slider (P, nt)."""
    limited, nt = LIMITS.get(type(law), each_limited), law.sliders
    normal = law.components[-1] == "n"
    kt, rows = contacts.kt[:, None], []
    for u in motion:
        N = np.maximum(contacts.preload + (contacts.kn * u[:, -1] if normal else 0.0), 0.0)
        T, slips = limited(kt * (u[:, :nt] - slider), contacts.mu * N)
        slider = np.where(slips | (N == 0)[:, None], u[:, :nt] - T / kt, slider)
        rows.append((np.column_stack([T, N]) if normal else T, slider, slips, N == 0))
    return Marched(*(np.array(column) for column in zip(*rows, strict=True)))


def cycles(law, seed=0, count=2, P=40):
    """(x, contacts, motion (n, P, nd) of some cycles, their statement)"""
    x, contacts, _ = random_case(law, P=P, H=3, seed=seed)
    tau = 2 * np.pi * np.arange(count * SAMPLES) / SAMPLES
    motion = np.moveaxis(x @ fourier.basis(tau, 3).T, 2, 0)
    return x, contacts, motion, marched(law, contacts, motion, np.zeros((P, law.sliders)))


def test_the_random_cycles_have_every_state():
    """Stick, slip, turn of the slip, lift-off and re-contact, for all laws."""
    for law in ALL:
        _, contacts, _, found = cycles(law)
        slips, opened = found.slips.any(axis=2), found.opened
        assert (slips & ~opened).any() and (~slips & ~opened).any()
        turns = np.diff(np.sign(found.force[..., 0]) * found.slips[..., 0], axis=0)
        assert (np.abs(turns) > 0).sum() > 100
        if "n" in law.components:
            assert (np.diff(opened.astype(int), axis=0) > 0).sum() > 20
            assert (np.diff(opened.astype(int), axis=0) < 0).sum() > 20


def close(found, statement, allowed):
    """Largest difference over the largest value."""
    assert np.abs(found - statement).max() <= allowed * np.abs(statement).max()


@pytest.mark.parametrize("law", ALL, ids=lambda law: law.name)
def test_steps_in_time(law):
    """`step` of the laws (uncoupled/law.py, coupled/law.py), and the sliders in their state."""
    _, contacts, motion, statement = cycles(law, seed=1)
    state = np.zeros((len(contacts), law.states))
    state[:, law.sliders :] = motion[0, :, : law.states - law.sliders]
    rows = []
    for u in motion:
        force, state = law.step(Motion(u, 0 * u, 1.0), state, contacts)
        rows.append((force, state[:, : law.sliders]))
    force, slider = (np.array(column) for column in zip(*rows, strict=True))
    close(force, statement.force, 5e-3)
    close(slider, statement.slider, 5e-3)


@pytest.mark.parametrize("law", ALL, ids=lambda law: law.name)
def test_located_cycles(law):
    """`harmonics`: the kernels uncoupled/events.py with uncoupled/integrals.py, and those of
    hbm/laws/coupled: forces, shares of the cycle and friction work."""
    x, contacts, motion, statement = cycles(law, seed=2, count=3, P=25)
    found = forces(law, contacts, x)
    last = slice(-SAMPLES, None)
    repeats = np.abs(statement.slider[-1] - statement.slider[-1 - SAMPLES]).max(axis=1) < 1e-4
    assert repeats.sum() > 15
    basis = fourier.basis(2 * np.pi * np.arange(SAMPLES) / SAMPLES, 3)
    weight = np.r_[1.0, np.full(basis.shape[1] - 1, 2.0)] / SAMPLES
    expected = np.moveaxis(np.tensordot(basis, statement.force[last], (0, 0)), 0, 2) * weight
    close(total_force(law, contacts, x, found)[repeats], expected[repeats], 5e-3)
    opened = statement.opened[last]
    slips = statement.slips[last].any(axis=2) & ~opened
    shares = np.stack([(~slips & ~opened), slips, opened], axis=2).mean(axis=0)
    assert np.abs(found.shares - shares)[repeats].max() < 1e-2
    along = np.diff(statement.slider, axis=0)[-SAMPLES:]
    work = (statement.force[last, :, : law.sliders] * along).sum(axis=(0, 2))
    assert np.abs(found.work - work)[repeats].max() < 1e-2 * work.max()


@pytest.mark.parametrize("law", EACH, ids=lambda law: law.name)
def test_tables_of_time_integration(law):
    """`piecewise.slider_table`; time/events.py knows this table and no law."""
    _, contacts, motion, statement = cycles(law, seed=3)
    table = law.piecewise_linear(contacts)
    rate = np.gradient(motion, axis=0)
    at, state = np.arange(len(contacts)), table.initial
    memory, found = np.zeros((len(contacts), law.sliders)), []
    for u, v in zip(motion, rate, strict=True):
        state, memory = table.settled(u, v, state, memory)
        found.append(
            np.einsum("pij,pj->pi", table.stiffness[at, state], u)
            + np.einsum("pij,pj->pi", table.by_memory[at, state], memory)
            + table.offset[at, state]
        )
    close(np.array(found), statement.force, 5e-3)


@pytest.mark.parametrize("law", EACH, ids=lambda law: law.name)
def test_tangents_between_events(law):
    """`variation`: the derivative of the statement at fixed sliders, where these rest, slip, or the
    contact is open."""
    x, contacts, motion, statement = cycles(law, seed=4)
    grid, nt = aft.sample_grid(3, law.default_samples(3)), law.sliders
    found = law.variation(contacts, x, aft.slider_start("zero_slider", len(contacts), nt), grid, 1)
    instants = np.unique(np.r_[0.0, np.sort(found.events), 2 * np.pi])
    between = found.between(instants)
    wide = np.flatnonzero(np.diff(instants) > 0.02)
    middle = (instants[wide] + instants[wide + 1]) / 2
    k = SAMPLES + np.rint(middle / (2 * np.pi) * SAMPLES).astype(int)
    expected = np.zeros((len(wide), len(contacts), motion.shape[2], motion.shape[2]))
    for d in range(motion.shape[2]):
        for i, row in enumerate(k):
            u = motion[row] + 1e-30j * np.eye(motion.shape[2])[d]
            normal = law.components[-1] == "n"
            N = contacts.preload + (contacts.kn * u[:, -1] if normal else 0j)
            N = np.where(N.real > 0, N, 0.0)
            T, slips = each_limited(
                contacts.kt[:, None] * (u[:, :nt] - statement.slider[row - 1]), contacts.mu * N
            )
            T = np.where(statement.opened[row][:, None], 0.0, T)
            expected[i, :, :, d] = np.imag(np.column_stack([T, N]) if normal else T) / 1e-30
    away = np.abs(between.gamma[0, wide] - expected).max(axis=(2, 3)) > 1e-9
    assert len(wide) > 60 and away.mean() < 5e-3  # at the turn of a slider the sample is past it


@pytest.mark.parametrize("law", ALL, ids=lambda law: law.name)
def test_contacts_that_surely_stick(law):
    """`sticks_surely` of the laws and `events.sticks` of the kernels: within such amplitudes the
    statement neither slips nor lifts off."""
    x, contacts, *_ = random_case(law, P=400, H=3, seed=5)
    x = x * np.random.default_rng(6).uniform(0, 0.4, (400, 1, 1))
    sure = forces(law, contacts, x).shares[:, 0] == 1.0
    tau = 2 * np.pi * np.arange(1200) / 600
    motion = np.moveaxis(x @ fourier.basis(tau, 3).T, 2, 0)
    by_law = law.sticks_surely(contacts, np.abs(motion).max(axis=0))
    statement = marched(law, contacts, motion, np.zeros((400, law.sliders)))
    opens = statement.opened.any(axis=0)
    moves = np.abs(statement.slider - statement.slider[600]).max(axis=2) > 1e-9
    assert 30 < by_law.sum() and not (by_law & (opens | statement.slips.any(axis=(0, 2)))).any()
    if law in EACH:  # in the plane a slider creeps to its rest through many cycles
        assert 50 < sure.sum() < 390 and not (sure & (opens | moves[600:].any(axis=0))).any()


@pytest.mark.parametrize("friction", [each_limited, resultant_limited])
def test_static_history(friction):
    """static_contact/contact: one pair on soft ground, pushed about; its force and sliders are
    those of the statement along the motion that it makes, increment by increment."""
    rng = np.random.default_rng(7)
    model = ReducedModel.from_matrices(
        np.eye(3),
        np.diag([3e5, 4e5, 1e5]),
        body="damper",
        node=[1, 1, 1],
        direction=["x", "y", "z"],
        position=np.zeros((3, 3)),
    )
    pairs = contact_table(
        frames([[0, 0, 1.0]]),
        side=["a"],
        station=0,
        damper_node=1,
        mu=0.4,
        kn=1e6,
        kt=8e5,
    )
    loads = np.column_stack([*rng.normal(0, 60.0, (2, 40)), rng.normal(50, 60.0, 40)])
    states = FrictionalContact(model, pairs, friction=friction).solve(loads, steps=3)
    law = DryFriction2T() if friction is each_limited else IsotropicFriction()
    contacts = Contacts(1e6, 8e5, 0.4, 0.0)
    motion = np.array([pairs.frame[0] @ one.displacement for one in states])[:, None]
    statement = marched(law, contacts, motion, np.zeros((1, 2)))
    assert states[-1].converged and len(states) == 120
    assert statement.opened.any() and statement.slips.any() and not statement.slips.all()
    close(np.array([one.tangential for one in states]), statement.force[..., :2], 1e-9)
    close(np.array([one.force for one in states]), statement.force[..., 2], 1e-9)
    close(np.array([one.slider for one in states]), statement.slider, 1e-9)


def test_gross_slip_of_an_elastic_contact():
    """stiffness/partial_slip.py: beyond gross slip the force is the limit of the statement."""
    load, mu = 50.0, 0.4
    _, force = displacement_loop(lambda p: 1e-7 / np.sqrt(p), load, mu, 1e-3)
    limit, _ = each_limited(np.array([[1e9]]), np.array([mu * load]))
    assert force.max() == pytest.approx(limit[0, 0], rel=1e-12)
    assert force.min() == pytest.approx(-limit[0, 0], rel=1e-12)
