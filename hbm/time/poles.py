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
        s[fast],
    )


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
