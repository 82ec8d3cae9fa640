"""Conformance of a law with its contract, for laws of your own as for those shipped here:
`check_law` of a contact law, `check_force` of a nonlinear force that is no contact."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance import aft
from tipdamp.hbm.balance.differences import (
    differences,
    history,
    samples_of,
    tangents_and_differences,
    worst_entry,
)
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.piecewise import PiecewiseLinear
from tipdamp.hbm.laws.records import ContactForces, Contacts, Motion
from tipdamp.hbm.laws.sampled import projector

__all__ = [
    "check_force",
    "check_law",
    "contacts_of_size",
    "forces",
    "full_derivative",
    "history",
    "shifted",
    "total_force",
]

ORDERS = 3  # harmonics of the motions that are tried
SHIFTED = 1, 15, 60  # harmonics of those that are shifted in time
PERIODS = 60  # in which the state must repeat
REPEATS = 1e-6  # of the force: with what still creeps then, far below what is allowed
TOGETHER = 20  # motions of a path in one call


def check_law(
    law: ContactLaw, contacts: Contacts | None = None, amplitude: float = 1.0, omega: float = 2.0
) -> None:
    """Raise AssertionError with the first point in which a law breaks the contract of `ContactLaw`.

    contacts : those of the law; by default 12, or one for each entry of its array parameters, with
        kn, kt around 1 N/m, mu around 0.5, and preloads from -0.3 to 1 N
    amplitude : m, of the random motions that are tried; it should make contacts stick, slip and
    open
    omega : rad/s, of the cycles

    >>> check_law(Jenkins1D())  # silent: it keeps the contract
    """
    contacts, x = _tried(law, contacts, amplitude)
    for check in (*_STEPS, _mirror, *_CYCLES, _sticking):
        check(law, contacts, x, omega)


def check_force(
    law: ContactLaw, contacts: Contacts | None = None, amplitude: float = 1.0, omega: float = 2.0
) -> None:
    """Raise AssertionError with the first point in which a force that is no contact breaks its
    contract (`tipdamp.hbm.laws.PlainForce`): it depends on the present motion alone, and may prefer
    a direction.

    contacts, amplitude, omega : as of `check_law`

    >>> check_force(CubicSpring(1.0))  # silent: it keeps the contract
    """
    contacts, x = _tried(law, contacts, amplitude)
    for check in (_present_motion, *_STEPS, *_CYCLES):
        check(law, contacts, x, omega)


def _tried(
    law: ContactLaw, contacts: Contacts | None, amplitude: float
) -> tuple[Contacts, np.ndarray]:
    """The contacts, by default random ones, and random motions (P, nd, nh) of them."""
    rng = np.random.default_rng(0)
    if contacts is None:
        size = max((np.size(v) for v in vars(law).values()), default=0)
        contacts = contacts_of_size(1.0, 1.0, size if size > 1 else 12, rng)
    P, nd = len(contacts), len(law.components)
    decay = (1 + np.r_[0, np.repeat(np.arange(1, ORDERS + 1), 2)]) ** 2
    x = amplitude * rng.normal(size=(P, nd, len(decay))) / decay
    law.check(contacts)
    return contacts, x


def forces(
    law: ContactLaw,
    contacts: Contacts,
    x: np.ndarray,
    omega: float = 1.0,
    start: Any = "zero_slider",
    samples: int | None = None,
) -> ContactForces:
    """ContactForces of a law at the relative motion x (P, nd, nh) m, with its own number of samples
    or with another."""
    H = (x.shape[2] - 1) // 2
    return law.harmonics(
        contacts,
        np.ascontiguousarray(x),
        aft.slider_start(start, len(contacts), law.sliders),
        aft.sample_grid(H, samples or law.default_samples(H)),
        omega,
    )


def _side_by_side(
    law: ContactLaw, contacts: Contacts, motions: np.ndarray, omega: float, **given: Any
) -> ContactForces:
    """Forces at m motions (m, P, nd, nh) of the same contacts, of m P contacts in one call: a law
    that steps takes each step once."""
    m, P, *of_contact = motions.shape
    every = np.tile(np.arange(P), m)
    rows = motions.reshape(m * P, *of_contact)
    return forces(law.select(every), contacts.select(every), rows, omega, **given)


def total_force(law: ContactLaw, contacts: Contacts, x: np.ndarray, f: ContactForces) -> np.ndarray:
    """(P, nd, nh) N, harmonics of the force out of its deviation from the stuck springs."""
    total = f.g + law.stuck_stiffness(contacts)[:, :, None] * x
    total[:, :, 0] += law.stuck_force(contacts)
    return total


def full_derivative(f: ContactForces, x: np.ndarray) -> np.ndarray:
    """(P, nd, nh, nd, nh) N/m, derivative of g at x, zero for contacts that are not active."""
    D = np.zeros((*x.shape, *x.shape[1:]))
    D[f.contacts] = f.D
    return D


def shifted(x: np.ndarray, phase: float) -> np.ndarray:
    """(..., nh) harmonics of what comes earlier by the phase (rad)."""
    X = fourier.to_complex(x)
    return fourier.to_real(X * np.exp(1j * phase * np.arange(X.shape[-1])))


def contacts_of_size(
    stiffness: float, amplitude: float, count: int = 12, rng: np.random.Generator | int = 0
) -> Contacts:
    """Random contacts that stick, slip and open in motions of an amplitude (m): kn, kt around a
    stiffness (N/m), mu around 0.5, preloads from -0.3 to 1 times both."""
    rng = np.random.default_rng(rng)
    kn, kt = (stiffness * rng.uniform(0.5, 2, count) for _ in range(2))
    return Contacts(
        kn, kt, rng.uniform(0.1, 0.8, count), stiffness * amplitude * rng.uniform(-0.3, 1, count)
    )


def _require(law: ContactLaw, holds: bool, what: str) -> None:
    if not holds:
        raise AssertionError(f"law {law.name}: {what}")


def _agree(
    law: ContactLaw,
    what: str,
    found: np.ndarray,
    expected: np.ndarray,
    tolerance: float | np.ndarray,
    scale: float | None = None,
) -> None:
    """AssertionError with the entry of two arrays that differs most, where that is more than a
    share of the largest entry, or of a scale."""
    allowed = tolerance * (np.abs(expected).max(initial=0.0) + 1e-300 if scale is None else scale)
    _require(
        law,
        (np.abs(found - expected) <= allowed).all(),
        f"{what}: {worst_entry(found, expected, allowed)}, allowed difference "
        f"{np.max(allowed):.1g}",
    )


def _no_contacts(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    none = np.zeros(len(contacts), dtype=bool)
    f = forces(law.select(none), contacts.select(none), x[none], omega)
    _require(
        law,
        f.g.shape == x[none].shape and f.shares.shape == (0, 3),
        f"harmonics of no contacts: g is "
        f"{f.g.shape}, must be {x[none].shape}, shares are {f.shares.shape}, must be (0, 3)",
    )


def _tangents(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """Of steps near a cycle, against central differences in motion, velocity, state and length of
    the step."""
    for what, found, expected, allowed in tangents_and_differences(law, contacts, x, omega):
        _agree(law, what, found, expected, allowed, 1.0)


def _selection(
    law: ContactLaw,
    contacts: Contacts,
    x: np.ndarray,
    omega: float,
) -> None:
    """Contacts do not know of each other, and parameters are cut with them."""
    at = np.random.default_rng(1).permutation(len(contacts))[: len(contacts) // 2 + 1]
    whole = forces(law, contacts, x, omega)
    part = forces(law.select(at), contacts.select(at), x[at], omega)
    scale = np.abs(whole.g).max() + 1e-300
    _agree(
        law,
        "harmonics of some contacts depend on the others, or select does not cut the parameters",
        part.g,
        whole.g[at],
        1e-10,
        scale,
    )
    force, _, _ = history(law, contacts, x, omega, samples=32)
    own, _, _ = history(law.select(at), contacts.select(at), x[at], omega, samples=32)
    _agree(
        law,
        "step of some contacts depends on the others, at [sample, contact, component]",
        own,
        force[:, at],
        1e-12,
    )


def _mirror(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """No direction in the tangential plane is preferred to its opposite."""
    sign = np.array([-1.0 if name != "n" else 1.0 for name in law.components])[:, None]
    both = _side_by_side(law, contacts, np.array([x, sign * x]), omega).g
    there, mirrored = both.reshape(2, *x.shape)
    _agree(
        law,
        "mirrored tangential motion does not give mirrored tangential forces (contacts with "
        "negative preload are open at rest and hold nothing; a force that is no contact is a "
        "PlainForce, for check_force)",
        mirrored,
        sign * there,
        1e-10,
    )


def _present_motion(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """No past, no time step and no setting of a contact enters the force."""
    _require(
        law,
        law.states == 0,
        f"a force that is no contact has no state, states = {law.states}; is it a contact "
        "law, for check_law?",
    )
    u, v = (a.reshape(-1, len(law.components)) for a in samples_of(x, 32))
    every = np.tile(np.arange(len(contacts)), 32)
    law, contacts, state = law.select(every), contacts.select(every), np.zeros((len(every), 0))
    force = law.step(Motion(u, omega * v, 0.1), state, contacts)[0]
    later = law.step(Motion(u, omega * v, 0.2), state, contacts)[0]
    _agree(
        law,
        "the force depends on the length of the step, at [sample, component]",
        later,
        force,
        1e-12,
    )
    others = Contacts(
        *(2 * a + 1 for a in (contacts.kn, contacts.kt, contacts.mu, contacts.preload))
    )
    changed = law.step(Motion(u, omega * v, 0.1), state, others)[0]
    _agree(
        law,
        "the force depends on kn, kt, mu or preload, at [sample, component]; is it a contact "
        "law, for check_law?",
        changed,
        force,
        1e-12,
    )


def _cycle(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """The state repeats, and the harmonics are those of step in a plain loop with many samples."""
    for start in aft.STARTS:
        f = forces(law, contacts, x, omega, start)
        total = total_force(law, contacts, x, f)
        size = np.abs(total).max() + 1e-300
        force, _, change = history(law, contacts, x, omega, start, periods=PERIODS, repeats=REPEATS)
        _require(
            law,
            change <= 1e-3 * size,
            f"the force does not repeat within {PERIODS} periods: it still changes by "
            f"{change / size:.1e} of its size, allowed 1e-3",
        )
        E = fourier.basis(2 * np.pi * np.arange(len(force)) / len(force), ORDERS)
        expected = np.tensordot(force, projector(E), (0, 0))
        _agree(
            law,
            f"harmonics differ from those of step (start '{start}')",
            total,
            expected,
            2e-3,
            size,
        )
        _agree(
            law,
            "the shares of stick, slip and open are not each at least 0, with the sum 1",
            np.abs(f.shares).sum(axis=1),
            f.shares.any(axis=1).astype(float),  # none where the force is no contact
            1e-5,
        )
        resting = np.abs(full_derivative(f, x)[~f.active]).max(initial=0.0)
        _require(
            law, resting == 0, f"a component that is not active has a derivative, {resting:.3g} N/m"
        )


def _shift(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """No instant is preferred, where forces do not hang on where the state starts: those of a
    motion that is shifted by whole samples are shifted with it, and so are their derivatives."""
    at, rng = np.arange(min(4, len(contacts))), np.random.default_rng(4)
    law, contacts, size = law.select(at), contacts.select(at), np.sqrt(np.mean(x[:, :, 0] ** 2))
    for H in SHIFTED:
        decay = (1 + np.r_[0, np.repeat(np.arange(1, H + 1), 2)]) ** 2
        motion, along = size * rng.normal(size=(2, len(at), x.shape[1], 2 * H + 1)) / decay
        phase = 2 * np.pi * 3 / law.default_samples(H)
        here, later = (
            _force_and_slope(law, contacts, a, da, omega)
            for a, da in ((motion, along), (shifted(motion, phase), shifted(along, phase)))
        )
        other = forces(law, contacts, motion, omega, "zero_force").g
        scale = np.abs(other).max() + 1e-300
        forgets = (np.abs(other - here[0]) <= 1e-9 * scale).all(axis=(1, 2))
        for found, expected, allowed, of in zip(
            later, here, (1e-8, 1e-6), ("", "derivatives of "), strict=True
        ):
            expected = shifted(expected, phase)[forgets]
            _agree(
                law,
                f"a motion shifted in time does not shift the {of}harmonics up to {H}",
                found[forgets],
                expected,
                allowed,
                max(scale, np.abs(expected).max(initial=0.0)),
            )


def _force_and_slope(
    law: ContactLaw, contacts: Contacts, x: np.ndarray, dx: np.ndarray, omega: float
) -> tuple[np.ndarray, np.ndarray]:
    """g (P, nd, nh) at x, and its derivative along dx."""
    f = forces(law, contacts, x, omega)
    return f.g, np.einsum("pijkl,pkl->pij", full_derivative(f, x), dx)


def _samples(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """Forces of an event-driven law do not depend on the samples; its table gives the force of its
    step."""
    table = law.piecewise_linear(contacts)
    if table is None:
        return
    coarse, fine = (forces(law, contacts, x, omega, samples=n).g for n in (64, 1024))
    _agree(
        law,
        "event-driven harmonics depend on the number of samples, 64 or 1024",
        coarse,
        fine,
        1e-12,
    )
    n = 1024
    force, states, change = history(law, contacts, x, omega, samples=n, periods=3)
    size = np.abs(force).max() + 1e-300
    _require(
        law,
        change <= 1e-12 * size,
        f"sliders do not repeat after the first cycle: the force changes by "
        f"{change / size:.1e} of its size, allowed 1e-12",
    )
    u, v = samples_of(x, n)
    memory = states[0][:, : table.follows.shape[1]]
    _agree(
        law,
        "the piecewise-linear table gives another force than step, at [sample, contact, component]",
        _by_table(table, u, omega * v, memory),
        force,
        2e-2,
        size,
    )


def _by_table(
    table: PiecewiseLinear, u: np.ndarray, v: np.ndarray, memory: np.ndarray
) -> np.ndarray:
    """(n, P, nd) N, the forces of a table over a period of a motion u, v (n, P, nd)."""
    state, at, found = table.initial, np.arange(u.shape[1]), np.empty(u.shape)
    for i in [*range(1, len(u)), 0]:
        state, memory = table.settled(u[i], v[i], state, memory)
        found[i] = (
            np.einsum("pij,pj->pi", table.stiffness[at, state], u[i])
            + table.offset[at, state]
            + np.einsum("pim,pm->pi", table.by_memory[at, state], memory)
        )
    return found


def _derivatives(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """Of the harmonics, against central differences."""
    for start in aft.STARTS:
        for by, found, values_at, allowed in _varied(law, contacts, x, omega, start):
            _agree(
                law,
                f"derivatives of harmonics by {by} differ from differences (start '{start}')",
                found,
                differences(found, values_at),
                1.0,
                allowed,
            )


def _varied(
    law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float, start: str
) -> Iterator[tuple[str, np.ndarray, Callable, float]]:
    """(by what, derivative of g, g at shares of a change, allowed difference) for a change by the
    size of what varies, so that no unit of length or force decides."""

    def at(**changed: Any) -> ContactForces:
        given: dict[str, Any] = {"contacts": contacts, "x": x, "omega": omega} | changed
        return forces(law, start=start, **given)

    f = at()
    size = np.abs(total_force(law, contacts, x, f)).max() + 1e-300
    dx = np.abs(x).max() * np.random.default_rng(2).normal(size=x.shape)
    along = np.einsum("pijkl,pkl->pij", full_derivative(f, x), dx)
    steep = np.abs(f.D).max(initial=0.0) * np.abs(dx).max()

    def moved(shares: np.ndarray) -> np.ndarray:
        motions = x + np.multiply.outer(shares, dx)
        f = _side_by_side(law, contacts, motions, omega, start=start)
        return f.g.reshape(motions.shape)

    def each(changed: Callable[[float], dict]) -> Callable:
        """g at shares of a change; changed(share) : what is then given."""
        return lambda shares: np.array([at(**changed(s)).g for s in shares])

    yield "the motion", along, moved, 5e-7 * max(steep, 1e-3 * size)
    by = np.zeros(x.shape) if f.by_omega is None else omega * f.by_omega
    allowed = 1e-6 * max(np.abs(by).max(initial=0.0), 1e-3 * size)
    yield "omega", by, each(lambda s: {"omega": (1 + s) * omega}), allowed
    if f.by_preload is not None:

        def loaded(s: float) -> dict:
            return {"contacts": replace(contacts, preload=contacts.preload + s * size)}

        yield "the preload", size * f.by_preload, each(loaded), 1e-6 * size
    by_mu = law.by_friction(contacts, x, f)
    if by_mu is not None:

        def rougher(s: float) -> dict:
            return {"contacts": replace(contacts, mu=(1 + s) * contacts.mu)}

        yield "mu", by_mu, each(rougher), 1e-6 * size


def _sums_of_derivatives(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """Summed along a path from rest to slip and lift-off they give the change of the force: no jump
    is missed."""
    six = np.arange(min(6, len(contacts)))
    law, contacts, x = law.select(six), contacts.select(six), x[six][:, :, :5]
    # a slider that only just slips goes to rest as a square root of the amplitude: steep, and hard
    # to sum
    tolerance = 5e-3 if law.piecewise_linear(contacts) is None else 2e-3
    what = "the force jumps where its derivative does not tell"
    for steps in (100, 600):  # more only where the derivative changes fast
        change, expected = _summed(law, contacts, x, omega, steps)
        if np.abs(change - expected).max() <= tolerance * np.abs(expected).max():
            return
    change, expected = _summed(law, contacts, x, omega, 6000)
    _agree(law, what, change, expected, tolerance)


def _summed(
    law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """Change of g (P, nd, nh) from rest to x by the sum of n derivatives, and as it is."""
    change = np.zeros(x.shape)
    for shares in np.split((np.arange(n) + 0.5) / n, n // TOGETHER):
        motions = np.multiply.outer(shares, x)
        f = _side_by_side(law, contacts, motions, omega, samples=64)
        D = full_derivative(f, motions.reshape(-1, *x.shape[1:]))
        D = D.reshape(TOGETHER, *x.shape, *x.shape[1:]).sum(axis=0)
        change += np.einsum("pijkl,pkl->pij", D, x) / n
    there, rest = (forces(law, contacts, s * x, omega, samples=64).g for s in (1.0, 0.0))
    return change, there - rest


def _sticking(law: ContactLaw, contacts: Contacts, x: np.ndarray, omega: float) -> None:
    """Contacts that stick surely are springs."""
    for scale in np.logspace(-3, 0, 7):
        amplitude = scale * np.abs(x).sum(axis=2)
        sure = law.sticks_surely(contacts, amplitude)
        _require(
            law,
            sure.shape == (len(contacts),),
            f"sticks_surely has the shape {sure.shape}, must be ({len(contacts)},)",
        )
        if not sure.any():
            continue
        f = forces(law, contacts, scale * x, omega)
        slips = np.flatnonzero(sure & (f.active.any(axis=1) | f.g.any(axis=(1, 2))))
        _require(
            law,
            not len(slips),
            f"a contact that sticks_surely does not stick: contact {slips[:1]} within "
            f"{amplitude[slips[:1]]} m",
        )


_STEPS = (_no_contacts, _tangents, _selection)
_CYCLES = (_cycle, _shift, _samples, _derivatives, _sums_of_derivatives)
