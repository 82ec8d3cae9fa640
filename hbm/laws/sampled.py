"""Defaults of a contact law made from its step: tangents by the complex step, and the cycle sample
by sample.

The forces of a cycle are as good as its samples. Velocity and length of a step follow from the
frequency,

    v = omega du/dtau,      dt = 2 pi/(omega n)      at n samples,

so that the chain rule carries derivatives by the harmonics of u and by omega.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import matrix_balance, schur, solve_sylvester

from tipdamp.hbm import fourier
from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.records import (
    ContactForces,
    Contacts,
    Motion,
    SampleGrid,
    SliderStart,
    Tangents,
)

if TYPE_CHECKING:
    from tipdamp.hbm.laws.base import ContactLaw


@dataclass(frozen=True)
class SamplingSettings:
    """Tolerances of the sampled cycle."""

    step: float = 1e-30  # of the complex step: its square is below rounding
    max_periods: int = 30  # a state that creeps longer is taken as it is then
    repeats: float = 1e-12  # of the largest motion or state: the period repeats
    neutral: float = 1e-6  # |1 - eigenvalue| of A: below, a period leaves this part where it was
    dissipates: float = 1e-4  # of |force| |motion|: above what sampling makes up
    rounding: float = 1e-12  # relative size of derivatives, and of slider motion, that are none


SETTINGS = SamplingSettings()


class SampledCycle(NamedTuple):
    """A periodic cycle of n samples: motion u (n, P, nd), states before and after each step, force,
    tangents.

    dforce : (n, P, nd, nd nh + 1) derivative of the force by the harmonics of u, and by omega
    """

    u: np.ndarray
    before: np.ndarray
    after: np.ndarray
    force: np.ndarray
    tangents: Tangents
    dforce: np.ndarray


def projector(E: np.ndarray) -> np.ndarray:
    """(n, nh) weights that take samples to harmonics; E (n, nh) is the basis at the samples."""
    weights = E * (2 / len(E))
    weights[:, 0] /= 2
    return weights


def tangents(
    law: "ContactLaw", motion: Motion, state: np.ndarray, contacts: Contacts
) -> tuple[np.ndarray, np.ndarray, Tangents]:
    """Force, state and `Tangents` of one step of a law by complex steps."""
    P, nd = motion.u.shape
    ns = state.shape[1]
    force, new, by = _complex_steps(law, motion, state, contacts, rate=False)
    by_u, by_state = by[:, :, :nd], by[:, :, nd:]
    by_v, by_dt = np.zeros((P, nd + ns, nd)), np.zeros((P, nd + ns))
    # one step in v and dt together tells whether the law depends on the rate at all
    along = SETTINGS.step * np.sqrt(np.arange(2, 2 + nd))
    probe = Motion(motion.u, motion.v + 1j * along, motion.dt + 1j * SETTINGS.step)
    if any(np.imag(a).any() for a in law.step(probe, state, contacts)):
        by_v = _complex_steps(law, motion, state, contacts, rate=True)[2]
        longer = motion._replace(dt=motion.dt + 1j * SETTINGS.step)
        changed = law.step(longer, state, contacts)
        by_dt = np.concatenate([np.imag(a) / SETTINGS.step for a in changed], axis=1)
    every = (by_u, by_v, by_state, by_dt)
    return force, new, Tangents(*(a[:, :nd] for a in every), *(a[:, nd:] for a in every))


def _complex_steps(
    law: "ContactLaw", motion: Motion, state: np.ndarray, contacts: Contacts, rate: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, state and their derivative (P, nd + ns, .) by v (`rate`), or by u and state; all
    columns in one call."""
    P, nd = motion.u.shape
    moved = motion.v if rate else np.concatenate([motion.u, state], axis=1)
    m = moved.shape[1]
    moved = np.tile(moved.astype(complex), (m, 1)).reshape(m, P, m)
    moved[np.arange(m), :, np.arange(m)] += 1j * SETTINGS.step
    moved, every = moved.reshape(m * P, m), np.tile(np.arange(P), m)
    if rate:
        motion, state = Motion(motion.u[every], moved, motion.dt), state[every]
    else:
        motion, state = Motion(moved[:, :nd], motion.v[every], motion.dt), moved[:, nd:]
    force, new = law.select(every).step(motion, state, contacts.select(every))
    by = np.concatenate([np.imag(force), np.imag(new)], axis=1) / SETTINGS.step
    return force[:P].real, new[:P].real, by.reshape(m, P, nd + len(new.T)).transpose(1, 2, 0)


def periodic(
    law: "ContactLaw",
    contacts: Contacts,
    x: np.ndarray,
    start: SliderStart,
    grid: SampleGrid,
    omega: float,
    newton: bool = True,
) -> SampledCycle:
    """The cycle of a law once its state repeats: the states sample by sample, then all tangents in
    one call.

    At least two periods. A state that creeps is taken to the one that repeats by Newton on the map
    of the period; the part that a period leaves where it was, as of a tangent at rest, stays. Where
    that leads to more of it than there was at first, the state that repeats is not unique: then
    without `newton`."""
    P, nd, nh = x.shape
    _, E, E_rate = grid
    n, ns = len(E), law.states
    order, dt = np.r_[1:n, 0], 2 * np.pi / (omega * n)
    u, u_rate = (np.ascontiguousarray((x @ basis.T).transpose(2, 0, 1)) for basis in (E, E_rate))
    every = np.tile(np.arange(P), n)
    law_every, contacts_every = law.select(every), contacts.select(every)
    motion = Motion(u.reshape(n * P, nd), omega * u_rate.reshape(n * P, nd), dt)
    state, dstate = _initial(law, u[0], start, contacts, E[0])
    dforce = np.zeros((n, P, nd, nd * nh + 1))
    creeps = np.zeros(P, dtype=bool)
    repeats = np.ones(P, dtype=bool)
    at_first = np.full(P, ns)  # parts of the state that stay where they are
    for period in range(SETTINGS.max_periods if ns else 1):
        first = state
        before, state = _stepped(law, contacts, motion, order, state)
        force, after, t = law_every.tangents(motion, before.reshape(n * P, ns), contacts_every)
        rows, t, force = (E, omega * E_rate), t.reshaped(n, P), force.reshape(n, P, nd)
        by = _stacked(t, u_rate, -dt / omega)
        chain(order, *rows, by, dstate, dforce)
        repeats = (np.abs(state - first) <= SETTINGS.repeats * _sizes(law, u, before)).all(axis=1)
        if period and repeats.all():
            break
        if period and newton:
            A, moves = _map(order, t)
            if period > 1:  # what is left after Newton's step may be rounding of the law
                largest = np.abs(force).max(axis=(0, 2)) + np.abs(contacts.preload)
                repeats |= creeps & _moves_nothing(moves, state - first, largest)
                if repeats.all():
                    break
            stays, parts = _neutral(A)
            now = ~repeats & (parts < ns)
            change = (state - first)[now, :, None]
            state[now] = first[now] + _beside(change, A[now], stays[now])[:, :, 0]
            at_first = np.where(now & ~creeps, parts, at_first)
            creeps |= now
    if creeps.any():
        A = _map(order, t)[0][creeps]
        stays, parts = _neutral(A)
        if not repeats.all() or (parts > at_first[creeps]).any():
            return periodic(law, contacts, x, start, grid, omega, newton=False)
        those = tuple(np.ascontiguousarray(a[:, creeps]) for a in by)
        dforce[:, creeps] = _fixed_point(order, rows, those, A, stays, dstate[creeps])
    return SampledCycle(u, before, after.reshape(n, P, ns), force, t, dforce)


def _stepped(
    law: "ContactLaw", contacts: Contacts, motion: Motion, order: np.ndarray, state: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """States (n, P, ns) before each step of a period, the motion of which has n P rows, and the
    state (P, ns) after it."""
    n, (P, ns) = len(order), state.shape
    u, v = (a.reshape(n, P, a.shape[1]) for a in motion[:2])
    before = np.empty((n, P, ns))
    for i in order if ns else ():
        before[i] = state
        state = law.step(Motion(u[i], v[i], motion.dt), state, contacts)[1]
    return before, state


def _moves_nothing(moves: np.ndarray, change: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """(P,) bool, whether a change (P, ns) of the state, which moves the force by at most `moves`
    (P, nd, ns) times that, is none beside its largest value (P,)."""
    changed = np.einsum("pis,ps->pi", moves, np.abs(change)).max(axis=1)
    return changed <= SETTINGS.repeats * largest


def _stacked(
    t: Tangents, u_rate: np.ndarray, dt_by_omega: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives of force and state in one array each: by u, v and state (n, P, nd + ns, .), by
    omega (n, P, .)."""
    by_u, by_v, by_state, by_dt = (
        np.concatenate(pair, axis=2)
        for pair in (
            (t.force_u, t.state_u),
            (t.force_v, t.state_v),
            (t.force_state, t.state_state),
            (t.force_dt, t.state_dt),
        )
    )
    return by_u, by_v, by_state, np.einsum("npij,npj->npi", by_v, u_rate) + by_dt * dt_by_omega


def _fixed_point(
    order: np.ndarray,
    rows: tuple[np.ndarray, np.ndarray],
    by: tuple[np.ndarray, ...],
    A: np.ndarray,
    stays: np.ndarray,
    dstate: np.ndarray,
) -> np.ndarray:
    """(n, p, nd, columns) derivative of the force of states that repeat: A is the map of the
    period; of what it leaves where it was, `stays`, the derivative is that of dstate."""
    n, p, m, ns = by[2].shape
    part = np.zeros((n, p, m - ns, dstate.shape[2]))
    kept, fixed = stays @ dstate, np.zeros_like(dstate)
    chain(order, *rows, by, fixed, part)
    fixed = kept + _beside(fixed - stays @ fixed, A, stays)
    chain(order, *rows, by, fixed, part)
    return part


def _sizes(law: "ContactLaw", u: np.ndarray, before: np.ndarray) -> np.ndarray:
    """(ns,) size of each entry of the state, beside which it repeats: of the motion for sliders."""
    sizes = np.abs(before).max(axis=(0, 1), initial=0.0)
    sizes[: law.sliders] = np.abs(u).max(initial=0.0)
    return sizes + 1e-300


def harmonics(
    law: "ContactLaw",
    contacts: Contacts,
    x: np.ndarray,
    start: SliderStart,
    grid: SampleGrid,
    omega: float,
) -> ContactForces:
    """Forces of the periodic cycle of a law, as their deviation from the stuck springs."""
    P, nd, nh = x.shape
    c = periodic(law, contacts, x, start, grid, omega)
    weights = projector(grid.E)
    f = np.tensordot(c.force, weights, (0, 0))
    D = np.tensordot(weights, c.dforce, (0, 0)).transpose(1, 2, 0, 3)
    by_omega = np.ascontiguousarray(D[..., -1]) if c.tangents.of_rate else None
    D = np.ascontiguousarray(D[..., :-1]).reshape(P, nd, nh, nd, nh)
    shares = _shares(law, contacts, c, f, x)
    s = law.sliders
    slip = (c.after - c.before)[:, :, :s]
    work = fourier.work(f[:, s:], x[:, s:]) + slip_work(c.force[:, :, :s], slip)
    g, active = _deviation(law, contacts, c, f, D, x)
    return ContactForces(g, active, D[active.any(axis=1)], None, by_omega, shares, work)


def _deviation(
    law: "ContactLaw",
    contacts: Contacts,
    c: SampledCycle,
    f: np.ndarray,
    D: np.ndarray,
    x: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """g (P, nd, nh) of the force f from that of the stuck springs, and which components are active;
    D becomes its derivative. What is rounding becomes zero."""
    _, nd, nh = x.shape
    stiffness, constant = law.stuck_stiffness(contacts), law.stuck_force(contacts)
    g = f - stiffness[:, :, None] * x
    g[:, :, 0] -= constant
    for d in range(nd):
        D[:, d, np.arange(nh), d, np.arange(nh)] -= stiffness[:, d, None]
    slope = np.abs(c.dforce[..., :-1]).max(axis=(0, 3), initial=0.0)
    active = np.abs(D).max(axis=(2, 3, 4)) > SETTINGS.rounding * np.maximum(slope, 1e-300)
    D[~active] = 0.0  # rounding of a component beside one that is active
    largest = np.abs(c.force).max(axis=0) + stiffness * np.abs(x).sum(axis=2) + np.abs(constant)
    g[(np.abs(g).max(axis=2) <= 0.1 * SETTINGS.rounding * largest) & ~active] = 0.0
    return g, active


def slip_work(force: np.ndarray, slip: np.ndarray) -> np.ndarray:
    """(P,) J of forces (n, P, s) after each sample of a period along the slip (n, P, s) of the
    sliders before it."""
    return 0.5 * np.einsum("tpi,tpi->p", force + np.roll(force, 1, 0), slip)


def _shares(
    law: "ContactLaw", contacts: Contacts, c: SampledCycle, f: np.ndarray, x: np.ndarray
) -> np.ndarray:
    """(P, 3) share of the cycle in stick, slip, open; open: a contact with stuck springs that gives
    no force nor any for small motions."""
    gives = (
        c.force.any(axis=2)
        | c.tangents.force_u.any(axis=(2, 3))
        | c.tangents.force_v.any(axis=(2, 3))
    )
    opens = (law.stuck_stiffness(contacts) > 0).any(axis=1) & ~gives
    if law.sliders:
        moved = np.abs(c.after - c.before)[:, :, : law.sliders].max(axis=2)
        slips = ~opens & (moved > SETTINGS.rounding * (np.abs(c.u).max(initial=0.0) + 1e-300))
    else:
        size = np.linalg.norm(f[:, :, 1:], axis=(1, 2)) * np.linalg.norm(x[:, :, 1:], axis=(1, 2))
        slips = ~opens & (fourier.work(f, x) > SETTINGS.dissipates * size)
    return np.stack([~slips & ~opens, slips, opens], axis=2).mean(axis=0)


def _map(order: np.ndarray, t: Tangents) -> tuple[np.ndarray, np.ndarray]:
    """(derivative (P, ns, ns) of the state after a period by the state before it, the most
    (P, nd, ns) that the latter moves the force)."""
    _, P, nd, ns = t.force_state.shape
    A, moves = np.tile(np.eye(ns), (P, 1, 1)), np.zeros((P, nd, ns))
    for i in order:
        moves = np.maximum(moves, np.abs(t.force_state[i] @ A))
        A = t.state_state[i] @ A
    return A, moves


def _neutral(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(spectral projectors (P, ns, ns) on what a period leaves where it was, dimensions (P,) of
    it)."""
    eye = np.eye(A.shape[1])
    stays, parts = np.zeros_like(A), np.zeros(len(A), dtype=int)
    for p in np.flatnonzero(np.abs(np.linalg.det(eye - A)) <= 2.0 ** len(eye) * SETTINGS.neutral):
        balanced, scale = matrix_balance(A[p], permute=False, separate=True)
        T, Z, k = schur(balanced, output="complex", sort=lambda z: abs(1 - z) <= SETTINGS.neutral)
        # P = Z [[I, Y], [0, 0]] Z^H with T11 Y - Y T22 = T12
        Y = solve_sylvester(T[:k, :k], -T[k:, k:], T[:k, k:]) if 0 < k < len(T) else T[:k, k:]
        projector = Z[:, :k] @ (Z[:, :k].conj().T + Y @ Z[:, k:].conj().T)
        scale = scale[0]
        stays[p], parts[p] = (scale[:, None] * projector / scale).real, k
    return stays, parts


def _beside(change: np.ndarray, A: np.ndarray, stays: np.ndarray) -> np.ndarray:
    """What changes (p, ns, .) over a period add up to until nothing changes: (I - A)^-1 of them,
    and what they are where a period leaves the state where it was."""
    return np.linalg.solve(np.eye(A.shape[1]) - A + stays, change)


def _initial(
    law: "ContactLaw", u: np.ndarray, start: SliderStart, contacts: Contacts, e: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """State at t = 0 and its derivative (P, ns, nd nh + 1) by the harmonics of the motion and
    omega."""
    P, nd = u.shape
    state = law.initial_state(u, start, contacts)
    dstate = np.zeros((P, law.states, nd * len(e) + 1))
    for k in range(nd if law.states else 0):
        moved = u.astype(complex)
        moved[:, k] += 1j * SETTINGS.step
        by = np.imag(law.initial_state(moved, start, contacts)) / SETTINGS.step
        dstate[:, :, k * len(e) : (k + 1) * len(e)] = by[:, :, None] * e
    return state, dstate


@njit(cache=True)
def chain(
    order: np.ndarray,
    E: np.ndarray,
    E_rate: np.ndarray,
    by: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    dstate: np.ndarray,
    dforce: np.ndarray,
) -> None:
    """Carry dstate (P, ns, nd nh + 1) through a period and fill dforce (n, P, nd, nd nh + 1) by the
    chain rule.

    E, E_rate (n, nh) : derivative of u and of v by the harmonics; by : of `_stacked`, force above
    state
    """
    by_u, by_v, by_state, by_omega = by
    n, P, rows, nd = by_u.shape
    ns, nh = by_state.shape[3], E.shape[1]
    new = np.empty((ns, nd * nh + 1))
    for i in order:
        for p in range(P):
            old = dstate[p]
            for r in range(rows):
                into = dforce[i, p, r] if r < nd else new[r - nd]
                for k in range(nd):
                    for m in range(nh):
                        into[k * nh + m] = (
                            by_u[i, p, r, k] * E[i, m] + by_v[i, p, r, k] * E_rate[i, m]
                        )
                into[nd * nh] = by_omega[i, p, r]
                for s in range(ns):
                    a = by_state[i, p, r, s]
                    if a != 0:
                        for c in range(nd * nh + 1):
                            into[c] += a * old[s, c]
            dstate[p] = new
