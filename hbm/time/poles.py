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

from tipdamp.hbm.balance.receptance import Receptance
from tipdamp.hbm.errors import InputError


@dataclass(frozen=True)
class Poles:
    """q = Re(out y) + static flexibility times f, y' = s y + into' f.

    s : (n,) complex, one of each conjugate pair; out, into : (r, n) complex
    static : (r, 2, k) columns a, b of the flexibility sum Re(a b') of the modes without mass
    """

    s: np.ndarray
    out: np.ndarray
    into: np.ndarray
    static: np.ndarray

    def flexibility(self, B: np.ndarray) -> np.ndarray:
        """(nc, nc) m/N of the modes without mass at the rows of B."""
        return np.ascontiguousarray(((B @ self.static[:, 0]) @ (B @ self.static[:, 1]).T).real)


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
        w = np.sqrt(
            receptance.stiffness / np.maximum(receptance.mass, 1e-28 * receptance.mass.max())
        )
        damped = w * np.sqrt(1 - receptance.ratio**2)
        s = -receptance.ratio * w + 1j * damped
        into = receptance.modes.astype(complex)
        out = into * (w**2 / (1j * damped * receptance.stiffness))
    slow = (np.abs(s) <= fastest) & (np.abs(s) < 1e10 * np.abs(s).min())
    fast = ~slow
    return Poles(
        s[slow],
        out[:, slow],
        into[:, slow],
        np.stack([-out[:, fast] / s[fast], into[:, fast]], axis=1),
    )


def split(
    receptance: Receptance, B: np.ndarray, stiffness: np.ndarray, limit: float, foreign_share: float
) -> Poles:
    """Poles, those above `limit` (rad/s) without mass where springs other than the contacts' (nc,)
    hold them too.

    foreign_share : of the contact stiffness, that other springs must add. A light body that hangs
    on contact springs alone would have no stiffness once they open: its modes keep their mass.
    """
    fastest = np.abs(poles(receptance).s).max(initial=0.0)
    while limit < fastest:
        found = poles(receptance, limit)
        if _foreign_share(found.flexibility(B), stiffness) > foreign_share:
            return found
        limit *= 1.5
    return poles(receptance)


def _foreign_share(S: np.ndarray, stiffness: np.ndarray) -> float:
    """Least share that springs other than the contacts' have in the stiffness of a massless
    motion."""
    k = np.sqrt(stiffness)
    return np.linalg.eigvalsh(np.eye(len(k)) - 0.5 * (S + S.T) * np.outer(k, k))[0]
