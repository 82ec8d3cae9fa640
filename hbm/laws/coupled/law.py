"""Isotropic Coulomb friction in the tangential plane: the formula of a step; its cycle is in
`cycle`."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.coupled.cycle import cycle, paths
from tipdamp.hbm.laws.coupled.motion import SETTINGS
from tipdamp.hbm.laws.coupled.slip import PIECE
from tipdamp.hbm.laws.coupled.tangents import fill
from tipdamp.hbm.laws.friction import resultant_limited
from tipdamp.hbm.laws.records import ContactForces, Contacts, Motion, SampleGrid, SliderStart
from tipdamp.hbm.laws.uncoupled.breaks import BEGIN, END, OPEN, STICK, TWO_PI, Sliders
from tipdamp.hbm.laws.uncoupled.law import CoulombFriction, integrated, located
from tipdamp.hbm.laws.uncoupled.tangents import fill as fill_uncoupled
from tipdamp.hbm.laws.variation import CycleTangents, Turning, Variation


@dataclass(frozen=True)
class IsotropicFriction(CoulombFriction, tested=True):
    """Isotropic coupled friction, |T| <= mu N, under N = max(0, preload + kn u_n); open: T = 0, the
    slider follows.

    State: the slider (2) and the motion before (3). Where load and speed vanish at one instant the
    direction of slip is known to rounding alone, and the force after it may jump.

    >>> from tipdamp.hbm.laws.base import Motion
    >>> contacts = Contacts(kn=1e6, kt=1e6, mu=0.5, preload=100)
    >>> slid = Motion(u=np.array([[3e-3, 4e-3, 0.0]]), v=np.zeros((1, 3)), dt=1.0)
    >>> force, _ = IsotropicFriction().step(slid, np.zeros((1, 5)), contacts)
    >>> print(force.round(6))  # 50 N against the motion, whatever its direction
    [[ 30.  40. 100.]]
    """

    components: ClassVar[tuple] = ("t1", "t2", "n")
    sliders: ClassVar[int] = 2

    def friction(self, trial: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The resultant of the tangents has the limit."""
        return resultant_limited(trial, limit)

    def step(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force (P, 3) N and state (P, 5); the motion of a step and the change of the normal load
        are straight."""
        kind = np.result_type(motion.u, state)
        u, before = np.array(motion.u, dtype=complex), np.array(state, dtype=complex)
        force, new = np.zeros_like(u), np.concatenate([u[:, :2], u], axis=1)
        settings = np.stack([contacts.kt, contacts.kn, contacts.mu, contacts.preload])
        straight(u, before, settings, force, new)
        if kind.kind == "c":
            return force, new
        return force.real.copy(), new.real.copy()

    def variation(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> Variation | None:
        """From the pieces of the cycle: the direction of slip turns with the disturbance, and the
        slider remembers it."""
        law, nh = self._sliders_of(contacts), x.shape[2]
        found = located(law._replace(count=0), x[:, 2:].copy(), start, grid)
        given = _in_forces(law, x, start, grid, found)
        pieces = _pieces(given)
        if pieces is None:
            return None
        (opened, times), c = given[-1], given[0]
        changes = [one[1:, 1][np.diff(one[:, 0]) != 0] for one in pieces]
        edges = [opened[p, : times[p], (BEGIN, END)].ravel() for p in range(len(contacts))]
        happens = np.concatenate([np.empty(0), *changes, *edges])
        carries = np.array([len(one) > 0 for one in pieces])
        moving = np.flatnonzero([(one[:, 0] != STICK).any() for one in pieces])
        least = SETTINGS.on_limit * np.abs(c[:, 2]).sum(axis=1)

        def between(instants: np.ndarray) -> CycleTangents:
            along = _of_normal(law, found, instants)
            for d in range(2):
                along.gamma[..., d, d] = np.where(carries, contacts.kt, 0.0)
            turning = Turning.none(moving, len(instants) - 1, 3)
            for q, p in enumerate(moving):
                blocks = along.gamma[:, :, p], along.rate[:, :, p]
                settings = contacts.kt[p], contacts.mu[p] * contacts.kn[p], least[p]
                into = *blocks, *(one[..., q, :, :] for one in turning[1:])
                fill(c[p], pieces[p], instants, settings, into)
            return along._replace(turning=turning)

        return Variation(2 * (nh - 1), happens[(happens > 0) & (happens < TWO_PI)], between)

    def harmonics(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> ContactForces:
        """Forces of the event-driven cycle: in closed form, and in slip to 1e-8 of the limit
        force."""
        law, (P, nd, nh) = self._sliders_of(contacts), x.shape
        found = located(law._replace(count=0), x[:, 2:].copy(), start, grid)
        pieces, counts, active, shares = _opened(law, found)
        g, D, work = np.zeros((P, 2, nh)), np.zeros((P, 2, nh, nd, nh)), np.zeros(P)
        cycle(*_in_forces(law, x, start, grid, found), (g, D, active, shares, work))
        forces = integrated(law, np.ascontiguousarray(x), pieces, counts, active, shares)
        forces.g[:, :2] += g
        forces.D[:, :2] += (D * _scale(law)[:, None, None, :, None])[forces.contacts]
        by_preload = np.asarray(forces.by_preload)
        by_preload[:, :2] += law.mu[:, None, None] * D[:, :, :, 2, 0]
        return replace(forces, work=work)

    def piecewise_linear(self, contacts: Contacts) -> None:
        """None: the limit of the resultant is no line."""


def _scale(law: Sliders) -> np.ndarray:
    """(P, 3) N/m, of the forces that stand for the motion in the kernels: kt u1, kt u2 and mu N."""
    return np.stack([law.kt, law.kt, law.mu * law.kn], axis=1)


def _in_forces(
    law: Sliders, x: np.ndarray, start: SliderStart, grid: SampleGrid, found: tuple
) -> tuple:
    """What the kernels of `cycle` are given: motion, its waves, kt, start, and the open pieces of
    those that are `found` of the normals."""
    tau, E, E_rate = grid
    c = _scale(law)[:, :, None] * np.ascontiguousarray(x)
    c[:, 2, 0] += law.mu * law.preload
    begin = start._replace(positions=law.kt[:, None] * start.positions)
    return c, (c @ E.T, c @ E_rate.T, tau), law.kt, begin, (found[0][:, 0], found[1][:, 0])


def _pieces(given: tuple) -> list[np.ndarray] | None:
    """Of each contact the pieces (m, PIECE) of its cycle, as the kernel `paths` keeps them of what
    `_in_forces` gives; None where they are too many."""
    P, _, nh = given[0].shape
    most = SETTINGS.pieces + SETTINGS.panels * nh
    path, counts = np.empty((P, most, PIECE)), np.empty(P, np.int64)
    paths(*given, (path, counts))
    return None if (counts == most).any() else [path[p, : counts[p]] for p in range(P)]


def _of_normal(law: Sliders, found: tuple, instants: np.ndarray) -> CycleTangents:
    """Tangents of the normals alone, of which the pieces are `found`."""
    P, normal = len(law.kn), law._replace(count=0)
    along = CycleTangents.none(len(instants) - 1, P, 1)
    along.gamma[..., 0, 0] = law.kn
    own = along.gamma, along.memory, along.captured, along.capture
    fill_uncoupled(normal, np.arange(P), *found[:2], instants, *own)
    return CycleTangents.none(len(instants) - 1, P, 3).put(np.arange(P), [2], along)


def _opened(
    law: Sliders, found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `located` has of the normal, with both tangents: their sliders follow where contacts are
    open."""
    pieces, counts, active, shares = found
    pieces, counts, active = (np.repeat(a, 3, axis=1) for a in (pieces, counts, active))
    counts[law.kt == 0, :2] = 0
    smooth = (law.kt > 0) & (law.mu == 0)
    pieces[smooth, :2, 0, :3], counts[smooth, :2] = (OPEN, 0.0, TWO_PI), 1
    active[:, :2] = counts[:, :2] > 0
    shares[smooth] = np.stack(
        [0 * shares[smooth, 2], 1 - shares[smooth, 2], shares[smooth, 2]], axis=1
    )
    return pieces, counts, active, shares


@njit(cache=True)
def straight(
    u: np.ndarray, before: np.ndarray, settings: np.ndarray, force: np.ndarray, new: np.ndarray
) -> None:
    """Fill in force (P, 3) and the sliders of the state new (P, 5) at the end of straight steps to
    u (P, 3), complex; settings (4, P) : kt, kn, mu, preload."""
    for p in range(len(u)):
        kt, kn, mu, preload = settings[:, p]
        N0, N1 = preload + kn * before[p, 4], preload + kn * u[p, 2]
        if N1.real <= 0:
            continue
        T, d, L0 = np.zeros(2, u.dtype), kt * (u[p, :2] - before[p, 2:4]), 0j
        if N0.real > 0:
            T, L0 = kt * (before[p, 2:4] - before[p, :2]), mu * N0
        else:
            d = d * (N1 / (N1 - N0))
        force[p, :2], force[p, 2] = slide(T, d, L0, mu * N1), N1
        if kt > 0:
            new[p, :2] = u[p, :2] - force[p, :2] / kt


@njit(cache=True, error_model="numpy")
def slide(T: np.ndarray, d: np.ndarray, L0: float, L1: float) -> np.ndarray:
    """Force (2,) at the end of a straight elastic path d under a limit from L0 to L1; complex for
    derivatives."""
    e, dL = T + d, L1 - L0
    if (_dot(e, e) - L1 * L1).real <= 0:
        return e
    size, s = np.sqrt(_dot(d, d)), _slips_from(T, d, L0, dL)
    if size.real == 0 or not s.real <= 1:  # beyond the limit by rounding alone
        return L1 / np.sqrt(_dot(e, e)) * e
    m, L = d / size, L0 + s * dL
    if L.real <= 0 or L1.real <= 0:  # from no load the force lies along the motion
        return L1 * m
    n = (T + s * d) / L
    # not 1 - exp: a path of rounding has any direction m
    turned = _one_less_exp((1 - s) * size / _log_mean(L, L1))
    x = _dot(n, m)
    below = 2 - (1 - x) * turned * (2 - turned)
    if below.real <= 0:
        return -L1 * m  # straight against the motion
    return L1 / below * (2 * (1 - turned) * n + turned * (2 - (1 - x) * turned) * m)


@njit(cache=True)
def _dot(a: np.ndarray, b: np.ndarray) -> complex:
    return a[0] * b[0] + a[1] * b[1]


@njit(cache=True)
def _one_less_exp(z: complex) -> complex:
    """1 - exp(-z), to the digits of a small z."""
    decay, turn = np.exp(-z.real), np.sin(0.5 * z.imag)
    return -np.expm1(-z.real) + 2 * decay * turn * turn + 1j * decay * np.sin(z.imag)


@njit(cache=True, error_model="numpy")
def _slips_from(T: np.ndarray, d: np.ndarray, L0: float, dL: float) -> float:
    """Share of the path from which on the force is at the limit; above 1 where it comes there by
    rounding alone."""
    a, b, c = _dot(d, d) - dL * dL, _dot(T, d) - L0 * dL, _dot(T, T) - L0 * L0
    if c.real < -SETTINGS.on_limit * (L0 * L0).real:
        square = b * b - a * c
        if square.real <= 0:
            return 2 + 0 * a
        return -c / (b + np.sqrt(square)) if b.real >= 0 else (np.sqrt(square) - b) / a
    if b.real >= -SETTINGS.on_limit * (abs(_dot(T, T) * _dot(d, d)) ** 0.5 + abs((L0 * dL).real)):
        return 0 * a
    return -2 * b / a if a.real > -b.real else 2 + 0 * a  # leaves the limit and comes back to it


@njit(cache=True, error_model="numpy")
def _log_mean(a: float, b: float) -> float:
    z = (b - a) / (b + a)
    q = z * z  # a compiled power of a complex number leaves rounding in its imaginary part
    if abs(z) < 1e-2:
        return 0.5 * (a + b) / (1 + q * (1 / 3 + q * (1 / 5 + q / 7)))
    return (b - a) / np.log(b / a)
