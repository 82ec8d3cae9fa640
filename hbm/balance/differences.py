"""Derivatives of a contact law beside differences: in the tests of a law, and before a curve of a
law of one's own."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance import aft
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.records import Contacts, Motion

STEPS = 32  # of a cycle, in which the tangents are looked at
VARIED = {
    "u": "motion",
    "v": "velocity",
    "state": "state before",
    "dt": "length of the step",
}  # in the order of what a step is given: fields of `Tangents`, and their names in words
LEAST = 1e-15  # m: of a motion, of which a step returns more than rounding
STEP = 1e-6  # of differences, in shares of what varies
WIDER = np.array([1.0, 1e3, 1e6, 1e9])  # times that, while it is no more than of the largest state
ROUNDING = 1e-14  # of the largest state: a smaller one has no size of its own


def check_derivatives(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """InputError where the tangents of a law are not the derivatives of its step, in steps of the
    cycles x (P, nd, nh).

    For the start of a curve: of a few contacts; kinks, which differences cannot pass, may be in a
    quarter of the steps. Contacts that do not move but by rounding, as by symmetry, tell nothing.
    """
    if 0 < np.abs(x).max(initial=0.0) < LEAST:
        return
    at = np.argsort(-np.abs(x).sum(axis=(1, 2)))[:8]
    for what, found, expected, allowed in tangents_and_differences(
        law.select(at), contacts.select(at), x[at], omega
    ):
        if (~(np.abs(found - expected) <= 100 * allowed)).any(axis=1).mean() > 0.25:
            raise InputError(
                f"law {law.name}: {what}: {worst_entry(found, expected, allowed)}; "
                "tipdamp.check_law tests the whole law"
            )


def tangents_and_differences(
    law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float
) -> Iterator[tuple[str, np.ndarray, np.ndarray, float | np.ndarray]]:
    """(what, found (rows, nd + ns), expected, allowed difference) of force and state in 32 steps a
    contact: derivatives are for a change by a tenth of the size of what varies. Each state has a
    size of its own, as one may be a force and the next a motion; the difference that is allowed
    is of the size of what is returned, (nd + ns,)."""
    u, v, before, dt = given = _steps(law, contacts, x, omega)
    every = np.tile(np.arange(len(contacts)), STEPS)
    law, contacts = law.select(every), contacts.select(every)

    def stepped(u: np.ndarray, v: np.ndarray, state: np.ndarray, dt: float) -> np.ndarray:
        return np.concatenate(law.step(Motion(u, v, dt), state, contacts), axis=1)

    force, new, t = law.tangents(Motion(u, v, dt), before, contacts)
    both = np.concatenate([force, new], axis=1)
    allowed = 1e-12 * np.abs(both).max(initial=0.0)
    yield "tangents returns another force or state than step", both, stepped(*given), allowed
    returned = np.r_[np.full(force.shape[1], np.abs(force).max(initial=0.0)), _sizes(new)]
    returned[returned == 0] = returned.max(initial=0.0) or 1.0
    for k, (name, what) in enumerate(VARIED.items()):
        by = np.concatenate([vars(t)[f"force_{name}"], vars(t)[f"state_{name}"]], axis=1)
        by = by[:, :, None] if by.ndim == 2 else by
        size = 0.1 * np.abs(given[k]).max(initial=0.0) or 1.0
        sizes = 0.1 * _sizes(before) if name == "state" else np.full(by.shape[2], size)
        by = by * sizes
        scale = np.maximum(np.abs(by).max(axis=(0, 2), initial=0.0), 1e-3 * returned)
        said = (
            f"tangents by the {what} are not the derivatives of step; is it analytic (no abs, real "
            "comparisons)? An OwnForce that is not takes its derivative=, too"
        )
        for d, own in enumerate(sizes):
            along = own if name == "dt" else own * np.eye(len(sizes))[d]

            def moved(shares: np.ndarray, k: int = k, along: Any = along) -> np.ndarray:
                there = ([*given[:k], given[k] + s * along, *given[k + 1 :]] for s in shares)
                return np.array([stepped(*one) for one in there]) / returned

            found = by[:, :, d]
            steps = STEP * WIDER[WIDER * own <= sizes.max()]
            yield said, found, returned * differences(found / returned, moved, steps), 1e-6 * scale


def _steps(
    law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """u, v, the state before, each (rows, .), and dt of steps of the cycles x (P, nd, nh): of the
    second period, with states beside those of the cycle."""
    rows = STEPS * len(contacts)
    u, v = (a.reshape(rows, -1) for a in samples_of(x, STEPS))
    states = history(law, contacts, x, omega, samples=STEPS, periods=2)[1]
    away = (
        0.05
        * np.abs(states).max(axis=(0, 1), initial=0.0)
        * np.random.default_rng(3).normal(size=states.shape)
    )
    before = np.roll(states + away, 1, axis=0).reshape(rows, law.states)
    return u, omega * v, before, 2 * np.pi / (omega * STEPS)


def _sizes(states: np.ndarray) -> np.ndarray:
    """(ns,) the largest value of each state (rows, ns); of all, where one is rounding beside it."""
    own = np.abs(states).max(axis=0, initial=0.0)
    largest = own.max(initial=0.0)
    return np.where(own > ROUNDING * largest, own, largest or 1.0)


def worst_entry(found: np.ndarray, expected: np.ndarray, allowed: float | np.ndarray = 1.0) -> str:
    """The entry that differs most beside what is allowed, in words; (contact, component,
    coefficient, ...) in the order of the arrays."""
    away = np.abs(found - expected) / allowed
    at = np.unravel_index(np.argmax(np.where(np.isnan(away), np.inf, away)), away.shape)
    return f"entry {list(map(int, at))} is {found[at]:.6g}, expected {expected[at]:.6g}"


def differences(
    found: np.ndarray,
    values_at: Callable[[np.ndarray], np.ndarray],
    steps: Sequence[float] | np.ndarray = (STEP,),
) -> np.ndarray:
    """(rows, ...) derivative at 0 of values_at(shares) (shares, rows, ...), beside `found`.

    By central differences, and in a row that has a kink within their step by the differences of
    second order on one side of it: no row is left out. The best of all steps counts: what is small
    beside its limit changes by rounding alone over a short one.
    """
    numeric = []
    for h in steps:
        here, *others = values_at(np.array([0.0, h, h / 2, -h, -h / 2]))
        ahead, behind = others[:2], others[2:]
        numeric += [
            (ahead[0] - behind[0]) / (2 * h),
            (4 * ahead[1] - ahead[0] - 3 * here) / h,
            (3 * here + behind[0] - 4 * behind[1]) / h,
        ]
    every = np.array(numeric)
    errors = np.abs(found - every).reshape(len(every), len(found), -1).max(axis=2, initial=0.0)
    return every[errors.argmin(axis=0), np.arange(len(found))]


def history(
    law: ContactLaw,
    contacts: Contacts,
    x: np.ndarray,
    omega: float,
    start: Any = "zero_slider",
    samples: int = 512,
    periods: int = 1,
    repeats: float = 1e-13,
) -> tuple[np.ndarray, np.ndarray, float]:
    """(force (n, P, nd), state (n, P, ns), change) of a law over the last period, by its step in a
    plain loop.

    periods : at most; fewer where the force repeats to a share of the largest, by default to
    rounding; change : of the force since the period before"""
    u, v = samples_of(x, samples)
    dt = 2 * np.pi / (omega * samples)
    state = law.initial_state(u[0], aft.slider_start(start, len(contacts), law.sliders), contacts)
    force = np.zeros(u.shape)
    states = np.zeros((samples, *state.shape))
    change = np.inf
    for _ in range(periods):
        before = force.copy()
        for i in np.r_[1:samples, 0]:
            force[i], state = law.step(Motion(u[i], omega * v[i], dt), state, contacts)
            states[i] = state
        change = np.abs(force - before).max(initial=0.0)
        if change <= repeats * np.abs(force).max(initial=0.0):
            break
    return force, states, change


def samples_of(x: np.ndarray, n: int) -> list[np.ndarray]:
    """u and du/dtau (n, P, nd) at n samples of a cycle."""
    tau = 2 * np.pi * np.arange(n) / n
    H = (x.shape[2] - 1) // 2
    return [(x @ e(tau, H).T).transpose(2, 0, 1) for e in (fourier.basis, fourier.basis_rate)]
