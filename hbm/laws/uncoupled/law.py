"""Contact laws as data sheets: which components they act on, their stuck stiffness, and one time step with tangents.

A law knows the relative motion of a pair, and not time, harmonics, dofs or solvers. `step` is the plain form, used by
the time integration and by the tests; `corridor = True` says that the law is a slider in a corridor (see `located`),
for which harmonics are computed with located transitions.
"""

from dataclasses import dataclass

import numpy as np

from hbm.laws.base import Contacts, Tangents


@dataclass(frozen=True)
class CorridorLaw:
    """Sliders held by mu N: `tangents` of them, each on its own, with a normal spring or a constant normal load.

    N = max(0, preload + kn u_n), or preload where there is no normal component; |T_i| <= mu N; open: T = 0 and the
    slider follows the motion [Yang, Menq 1998; Petrov, Ewins 2003; Siewert 2010].
    """

    name: str
    components: tuple
    tangents: int
    has_normal: bool
    corridor: bool = True

    def stuck_stiffness(self, pairs: Contacts) -> np.ndarray:
        """(P, nd) stiffness K_c of each component while the pair sticks, N/m."""
        columns = [pairs.kt] * self.tangents + [pairs.kn] * self.has_normal
        return np.stack(columns, axis=1)

    def step(self, u, slider, pairs: Contacts):
        """Force (P, nd) at the relative motion u (P, nd), slider (P, nt) after the step, and the tangents."""
        P, nd, nt = len(pairs), len(self.components), self.tangents
        N, closed = pairs.preload.copy(), pairs.preload > 0
        if self.has_normal:
            N = pairs.preload + pairs.kn * u[:, -1]
            closed = N > 0
            N = np.maximum(N, 0.0)
        force, new = np.zeros((P, nd)), np.array(slider, dtype=float)
        t = Tangents(np.zeros((P, nd, nd)), np.zeros((P, nd, nt)), np.zeros((P, nt, nd)), np.zeros((P, nt, nt)))
        if self.has_normal:
            force[:, -1] = N
            t.force_u[:, -1, -1] = pairs.kn * closed
        limit = pairs.mu * np.maximum(N, 0.0) * closed
        for d in range(nt):
            trial = pairs.kt * (u[:, d] - slider[:, d])
            slips = (np.abs(trial) > limit) | ~closed
            force[:, d] = np.where(slips, np.sign(trial) * limit, trial)
            reach = np.divide(force[:, d], pairs.kt, out=np.zeros(P), where=pairs.kt > 0)
            new[:, d] = np.where(slips, u[:, d] - reach, slider[:, d])
            t.force_u[:, d, d] = np.where(slips, 0.0, pairs.kt)
            t.force_slider[:, d, d] = np.where(slips, 0.0, -pairs.kt)
            t.slider_u[:, d, d] = slips
            t.slider_slider[:, d, d] = ~slips
            if self.has_normal:
                push = np.where(slips & closed, np.sign(trial) * pairs.mu * pairs.kn, 0.0)
                t.force_u[:, d, -1] = push
                t.slider_u[:, d, -1] = -np.divide(push, pairs.kt, out=np.zeros(P), where=pairs.kt > 0)
        return force, new, t


def Jenkins1D() -> CorridorLaw:
    """One tangent, constant normal load: limit mu * preload. A spring kt in series with a slider [Griffin 1980]."""
    return CorridorLaw("Jenkins1D", ("t1",), 1, False)


def DryFriction2T() -> CorridorLaw:
    """Two uncoupled tangents under one variable normal load, with slip and lift-off [Yang, Menq 1998]."""
    return CorridorLaw("DryFriction2T", ("t1", "t2", "n"), 2, True)


def UnilateralSpring() -> CorridorLaw:
    """Normal only: a spring with preload (positive) or gap -preload/kn (negative)."""
    return CorridorLaw("UnilateralSpring", ("n",), 0, True)


LAWS = {"Jenkins1D": Jenkins1D, "DryFriction2T": DryFriction2T, "UnilateralSpring": UnilateralSpring}
