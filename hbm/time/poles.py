"""Linear side of the time integration: poles of the stuck system, those far above the vibration
without mass.

    y' = s y - b' g(t),     u(t) = stuck(t) + Re(A y) - S g

with the poles s of the stuck system, the response `stuck` of the stuck system to the external
forces, known in closed form, and the flexibility S of the poles that follow statically. Contact
nodes with little mass chatter on re-contact: their modes lie far above the vibration, and without
mass they follow the contact as springs do.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from tipdamp.hbm.balance.receptance import Receptance
from tipdamp.hbm.errors import InputError

CRITICAL = 1e-10  # least distance of the square of a damping ratio from 1


@dataclass(frozen=True)
class Poles:
    """q = Re(out y) + static flexibility times f, y' = s y + into' f.

    s : (n,) complex, one of each conjugate pair; out, into : (r, n) complex
    static : (r, 2, k) columns a, b of the flexibility sum Re(a b') of the modes without mass
    fast : (k,) complex, the poles of these
    """

    s: np.ndarray
    out: np.ndarray
    into: np.ndarray
    static: np.ndarray
    fast: np.ndarray

    def flexibility(self, B: np.ndarray) -> np.ndarray:
        """(nc, nc) m/N of the modes without mass at the rows of B."""
        return np.ascontiguousarray(((B @ self.static[:, 0]) @ (B @ self.static[:, 1]).T).real)

    def let_go(self, B: np.ndarray, stiffness: np.ndarray) -> float:
        """Rad/s of the slowest motion of the modes without mass once the springs (nc,) at the rows
        of B have let go, from their inertia to first order; infinite without any.

        With S + w^2 T their receptance: (1 - sqrt(k) S sqrt(k)) x = w^2 sqrt(k) T sqrt(k) x.
        """
        a, b = (np.sqrt(stiffness)[:, None] * (B @ part) for part in self.static.swapaxes(0, 1))
        inertia = ((-a / self.fast**2) @ b.T).real
        held = np.eye(len(stiffness)) - (a @ b.T).real
        largest = eigh(inertia + inertia.T, held + held.T, eigvals_only=True)[-1]
        return float(largest**-0.5) if largest > 0 else np.inf


def poles(receptance: Receptance, fastest: float = np.inf) -> Poles:
    """First-order form of a receptance; modes above `fastest` (rad/s) and those without mass follow
    statically."""
    if receptance.still:
        raise InputError(
            "structural damping is that of harmonic motions and has no motion in time: for time "
            "integration give damping_ratio = eta/2, or C"
        )
    if receptance.poles.size:
        s, A = receptance.poles, receptance.modes
        kept = s.imag >= 0
        out, into = A[:, kept] * np.where(s.imag > 0, 2.0, 1.0)[kept], receptance.into[:, : len(s)]
        s, into = s[kept], into[:, kept]
    else:
        s, out, into = _of_modes(receptance)
    out, into = _turned(s, out, into)
    slow = (np.abs(s) <= fastest) & (np.abs(s) < 1e10 * np.abs(s).min())
    fast = ~slow
    return Poles(
        s[slow],
        out[:, slow],
        into[:, slow],
        np.stack([-out[:, fast] / s[fast], into[:, fast]], axis=1),
        s[fast],
    )


def _of_modes(receptance: Receptance) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(s, out, into) of modes with ratios of critical damping: a pair of complex poles of each, of
    which one counts, or two real ones."""
    mass = np.maximum(receptance.mass, 1e-28 * receptance.mass.max())
    w = np.sqrt(receptance.stiffness / mass)
    ratio = np.where(receptance.mass < mass, 0.0, receptance.ratio)
    # the two poles of critical damping are one, of which no sum of single poles is made
    ratio = np.where(np.abs(ratio**2 - 1) < CRITICAL, np.sqrt(1 + CRITICAL), ratio)
    beyond = ratio**2 - 1
    half = w * np.sqrt(beyond.astype(complex))  # of the distance between the two poles
    into = receptance.modes.astype(complex)
    out = into * (w**2 / (half * receptance.stiffness))
    over = beyond > 0
    s = -ratio * w + half
    # w^2 over the other one, without the difference of two large numbers
    s[over] = -(w[over] ** 2) / (ratio * w + half)[over]
    out[:, over] /= 2
    return (
        np.concatenate([s, -(ratio * w + half)[over]]),
        np.hstack([out, -out[:, over]]),
        np.hstack([into, into[:, over]]),
    )


def _turned(s: np.ndarray, out: np.ndarray, into: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(out, into) whose columns are real where the pole is."""
    turn = np.ones(len(s), dtype=complex)
    for j in np.flatnonzero(s.imag == 0):
        largest = max(into[:, j], key=abs, default=1.0)
        turn[j] = largest / abs(largest) if largest else 1.0
    return out * turn, into / turn


def split(
    receptance: Receptance,
    B: np.ndarray,
    stiffness: np.ndarray,
    limit: float,
    foreign_share: float,
    let_go: float = 0.0,
) -> Poles:
    """Poles, those above `limit` (rad/s) without mass where springs other than the contacts' (nc,)
    hold them too.

    foreign_share : of the contact stiffness, that other springs must add. A light body that hangs
    on contact springs alone would have no stiffness once they open: its modes keep their mass.
    let_go : rad/s that no motion without mass may reach once contacts open or slip; stiff ones
    make fast modes of what is slow without them
    """
    fastest = np.abs(poles(receptance).s).max(initial=0.0)
    while limit < fastest:
        found = poles(receptance, limit)
        held = _foreign_share(found.flexibility(B), stiffness) > foreign_share
        if held and found.let_go(B, stiffness) > let_go:
            return found
        limit *= 1.5
    return poles(receptance)


def _foreign_share(S: np.ndarray, stiffness: np.ndarray) -> float:
    """Least share that springs other than the contacts' have in the stiffness of a massless
    motion."""
    k = np.sqrt(stiffness)
    return np.linalg.eigvalsh(np.eye(len(k)) - 0.5 * (S + S.T) * np.outer(k, k))[0]
