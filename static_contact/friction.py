"""Static contact with Coulomb friction along a history of loads: preload depends on how the load was reached.

    K q + B' f = F,    N = max(0, kn (u_n - g0)),    T = kt (u_t - w)  with  |T| <= mu N

Where the limit is reached the slider w follows. The bodies are condensed on the pairs: with the stuck springs k0 at
all of them u = u0 - G (f(u) - k0 u), G = B A^-1 B', A = K + B' k0 B. Newton's matrix differs from the identity only
where a pair slips or is open. Each increment of the load is solved by return mapping from the sliders of the last.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel
from static_contact.free_motions import free_motions, rigid_motions

_ITERATIONS = 40
_TOLERANCE = 1e-11      # of the relative motion
_LARGEST_RESIDUAL = 1e-8
_FAR = 1e6              # a step that many times the motion has met a singular matrix
_DASHPOT_STEPS = 60
_HALVINGS = 4           # of an increment that does not converge


@dataclass(frozen=True)
class FrictionState:
    """One equilibrium of the history.

    pairs - with the preload (negative = open); tangential : (P, 2) N along t1, t2; slider : (P, 2) m, w in
    T = kt (u_t - w): the `start` of a response with origin 'unloaded' under the same static load
    slips : (P,) bool - at the limit; displacement : (r,) m; load : (r,) N; time - loads passed so far (1.5: half way
    from the first to the second); residual - |K q + B' f - F| / largest |F| of the history; iterations; converged
    """

    pairs: ContactTable
    tangential: np.ndarray
    slider: np.ndarray
    slips: np.ndarray
    displacement: np.ndarray
    load: np.ndarray
    time: float
    residual: float
    iterations: int
    converged: bool

    @property
    def force(self) -> np.ndarray:
        """(P,) N contact force."""
        return np.maximum(self.pairs.preload, 0.0)


class FrictionalContact:
    """One model and its pairs, factored once.

    coupled=False: each tangent has its own limit mu N, as the law DryFriction2T has; True: the resultant of both has.
    Springs must be finite. Raises InputError when even stuck pairs leave a motion free.
    """

    def __init__(self, model: ReducedModel, pairs: ContactTable, *, coupled: bool = False):
        if not len(pairs) or not pairs.carrying.any():
            raise InputError("no contact pairs: a free damper needs at least one pair on two sides")
        if np.isinf(pairs.kn).any():
            raise InputError("friction needs springs: kn = inf (hard contact) is for the frictionless preload")
        self.model, self.pairs, self.coupled = model, pairs, coupled
        self.B = relative_motion(model, pairs).toarray()
        self.kn, self.kt = pairs.kn * pairs.weight, pairs.kt * pairs.weight
        self.k0 = np.column_stack([self.kt, self.kt, self.kn]).ravel()
        A = model.K + self.B.T * self.k0 @ self.B
        _, names, *_ = free_motions(rigid_motions(model), model, A)
        if names:
            raise InputError(f"{', '.join(n for n, _ in names)}: not even stuck pairs resist this")
        self.factor = sl.cho_factor(A)
        self.G = self.B @ sl.cho_solve(self.factor, self.B.T)

    def solve(self, loads, *, steps: int = 20, gap=None) -> tuple[FrictionState, ...]:
        """The states along the history that goes straight from no load to each of `loads` (n, r) N in turn.

        steps : increments for each of them. An increment that does not converge is halved; where that does not help
        the history ends with a state that says so (converged=False): a load beyond what friction holds, or one that
        lifts the damper off, has no equilibrium.
        """
        loads = np.vstack([np.zeros(self.model.size), *np.atleast_2d(np.asarray(loads, dtype=float))])
        gap = self.pairs.gap if gap is None else np.asarray(gap, dtype=float)
        scale = np.linalg.norm(loads, axis=1).max()
        w = np.zeros((len(self.pairs), 2))
        u, time, states = np.zeros(3 * len(self.pairs)), 0.0, []
        for target in np.arange(1, (len(loads) - 1) * steps + 1) / steps:
            size = target - time
            while time < target:
                now = target if time + size >= target - 1e-12 else time + size
                load = _at(loads, now)
                found, iterations = self._increment(load, _at(loads, time), u, w, gap)
                if found is None and size > (1 / steps) * 0.5**_HALVINGS:
                    size /= 2
                    continue
                u = u if found is None else found
                states.append(self._state(u, w, gap, load, now, scale, iterations, found is not None))
                if not states[-1].converged:
                    return tuple(states)
                w, time = states[-1].slider, now
        return tuple(states)

    def _increment(self, load, before, u, w, gap):
        """Relative motion (3P,) under `load`, from u under the load `before`; None without one; and the Newton steps.

        Where Newton does not converge, dashpots with a share of the stuck springs take the pairs from u to the
        equilibrium in some steps: the share falls as long as that goes well, and at last Newton must do without.
        """
        u0 = self.B @ sl.cho_solve(self.factor, load)
        at = u + u0 - self.B @ sl.cho_solve(self.factor, before)
        found, total = self._equilibrium(u0, at, w, gap)
        share, at = 1.0, u
        for _ in range(_DASHPOT_STEPS):
            if found is not None:
                break
            moved, steps = self._equilibrium(u0, at, w, gap, share)
            total += steps
            share = share / 3 if moved is not None else share * 6
            if moved is not None:
                at = moved
                found, steps = self._equilibrium(u0, at, w, gap)
                total += steps
        return found, total

    def _equilibrium(self, u0, u, w, gap, share=0.0):
        """Newton for u - u0 + G (f - k0 u + share k0 (u - start)) = 0, and its steps; None where it fails."""
        start, k = u, (1 - share) * self.k0
        size = np.linalg.norm(u0) + np.linalg.norm(u)

        def residual(u):
            f, tangent, _ = self.law(u, w, gap)
            return u - u0 + self.G @ (f - k * u - share * self.k0 * start), tangent

        F, tangent = residual(u)
        for step in range(1, _ITERATIONS + 1):
            norm = np.linalg.norm(F)
            if norm <= _TOLERANCE * size:
                return u, step
            du = self._newton(F, tangent, k)
            if not np.linalg.norm(du) <= _FAR * size:
                break
            for part in (1.0, 0.5, 0.25, 0.125, 1.0):       # where none of these helps the full step is taken
                G, tangent = residual(u + part * du)
                if np.linalg.norm(G) < norm:
                    break
            u, F = u + part * du, G
        return None, step

    def _newton(self, F, tangent, k):
        """-[I + G D]^-1 F, D = f' - k, through the rows of D that are not zero."""
        D = tangent.copy()
        for i in range(3):
            D[:, i, i] -= k[i::3]
        moved = np.abs(D).max(axis=(1, 2)) > 0
        if not moved.any():
            return -F
        rows = (3 * np.flatnonzero(moved)[:, None] + np.arange(3)).ravel()
        block = sl.block_diag(*D[moved])
        system = np.eye(len(rows)) + block @ self.G[np.ix_(rows, rows)]
        right = -block @ F[rows]
        try:
            y = np.linalg.solve(system, right)
        except np.linalg.LinAlgError:
            y = np.linalg.lstsq(system, right, rcond=None)[0]
        return -F - self.G[:, rows] @ y

    def law(self, u, w, gap):
        """Forces (3P,), tangents (P, 3, 3) and slipping pairs (P,) at the motion u (3P,) from the sliders w (P, 2)."""
        u = u.reshape(-1, 3)
        N = np.maximum(self.kn * (u[:, 2] - gap), 0.0)
        closed = (N > 0).astype(float)
        limit, dlimit = self.pairs.mu * N, self.pairs.mu * self.kn * closed
        trial = self.kt[:, None] * (u[:, :2] - w)
        f, J = np.zeros((len(u), 3)), np.zeros((len(u), 3, 3))
        f[:, 2], J[:, 2, 2] = N, self.kn * closed
        norm = np.linalg.norm(trial, axis=1)[:, None] * np.ones(2) if self.coupled else np.abs(trial)
        slips = norm > limit[:, None]
        along = np.divide(trial, norm, out=np.zeros_like(trial), where=norm > 0)
        f[:, :2] = np.where(slips, limit[:, None] * along, trial)
        for d in range(2):
            J[:, d, d] = np.where(slips[:, d], 0.0, self.kt)
            J[:, d, 2] = np.where(slips[:, d], dlimit * along[:, d], 0.0)
        if self.coupled:          # the direction of slip turns with the motion
            turn = np.divide(limit * self.kt, norm[:, 0], out=np.zeros(len(u)), where=slips[:, 0])
            J[:, :2, :2] += turn[:, None, None] * (np.eye(2) - along[:, :, None] * along[:, None, :])
        return f.ravel(), J, slips.any(axis=1)

    def _state(self, u, w, gap, load, time, scale, iterations, converged):
        f, _, slips = self.law(u, w, gap)
        q = sl.cho_solve(self.factor, load - self.B.T @ (f - self.k0 * u))
        left = np.linalg.norm(self.model.K @ q + self.B.T @ f - load)
        residual = float(left / scale) if scale > 0 else float(left)
        f, motion = f.reshape(-1, 3), u.reshape(-1, 3)
        reach = np.divide(f[:, :2], self.kt[:, None], out=np.zeros((len(f), 2)), where=self.kt[:, None] > 0)
        slider = np.where(slips[:, None], motion[:, :2] - reach, w)
        if not self.coupled:      # a tangent that does not slip keeps its slider to the last digit
            still = np.abs(self.kt[:, None] * (motion[:, :2] - w)) <= (self.pairs.mu * f[:, 2])[:, None]
            slider = np.where(still, w, slider)
        pairs = self.pairs.replace(preload=self.kn * (motion[:, 2] - gap), gap=gap)
        return FrictionState(pairs, f[:, :2].copy(), slider, slips & (f[:, 2] > 0), q, load, float(time),
                             residual, iterations, converged and residual <= _LARGEST_RESIDUAL)


def _at(loads, time):
    """Load at a time between the loads, straight from each to the next."""
    k = min(int(np.floor(time)), len(loads) - 2)
    return loads[k] + (time - k) * (loads[k + 1] - loads[k])
