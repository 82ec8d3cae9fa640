"""Static contact with Coulomb friction along a history of loads: preload depends on how the load
was reached.

    K q + B' f = F,    N = max(0, kn (u_n - g0)),    T = kt (u_t - w)  with  |T| <= mu N

Where the limit is reached the slider w follows. kn = inf (hard contact) and kt = inf (no creep
before slip) may be: 0 <= N complementary to g0 - u_n >= 0, and u_t = w until |T| = mu N. The bodies
are condensed on the pairs: with springs k0 at all of them (their own, or the bodies' own stiffness
for rigid ones) u = u0 - G (f - k0 u), G = B A^-1 B', A = K + B' k0 B. The unknown is z = u + f/k0
where a spring is rigid (the force is a plain function of it, that of the spring k0: the resolvent
of the unilateral law) and z = u elsewhere, so that Newton's matrix differs from the identity only
where a pair is rigid, slips or is open. Each increment of the load is solved by return mapping from
the sliders of
the last.
"""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.friction import FrictionLimit, each_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.solvers.cholesky import SingularStiffness
from tipdamp.static_contact.bodies.free_motions import free_motions
from tipdamp.static_contact.bodies.rigid_motions import loose, rigid_motions
from tipdamp.static_contact.bodies.stuck_bodies import (
    BodiesOnSprings,
    stuck_bodies,
    stuck_springs,
)
from tipdamp.static_contact.contact.preload import SETTINGS as STATIC
from tipdamp.static_contact.contact.preload import check_pairs, finite_values


@dataclass(frozen=True)
class FrictionSettings:
    """Of the increments of a history and of Newton's method in each of them."""

    iterations: int = 40
    tolerance: float = 1e-11  # of the relative motion
    # of the largest load of the history, in the equilibrium of a state that converged
    residual: float = STATIC.residual
    far: float = 1e6  # a step that many times the motion has met a singular matrix
    dashpot_steps: int = 60  # in which the dashpots of an increment fade
    halvings: int = 4  # of an increment that does not converge


SETTINGS = FrictionSettings()
STEP = 2.0**-100  # of the complex step: a power of two, so that linear forces have exact tangents


@dataclass(frozen=True)
class CoulombSprings:
    """Unilateral springs with Coulomb friction: the force of a pair from its motion and its slider.

    kn, kt : (P,) N/m; mu : (P,); friction - whose limit is mu N: of each tangent, or of their
    resultant."""

    kn: np.ndarray
    kt: np.ndarray
    mu: np.ndarray
    friction: FrictionLimit

    def forces(
        self, z: np.ndarray, w: np.ndarray, gap: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces (3P,), tangents (P, 3, 3) and slipping sliders (P, 2) at the motion z (3P,) m from
        the sliders w (P, 2) m with the gaps (P,) m."""
        u = z.reshape(-1, 3)
        f, slips = self._forces(u, w, gap)
        varied = (self._forces(u + 1j * STEP * way, w, gap)[0] for way in np.eye(3))
        return f.ravel(), np.stack([np.imag(one) / STEP for one in varied], axis=2), slips

    def _forces(
        self, u: np.ndarray, w: np.ndarray, gap: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        N = self.kn * (u[:, 2] - gap)
        N = np.where(N.real > 0, N, 0.0)
        T, slips = self.friction(self.kt[:, None] * (u[:, :2] - w), self.mu * N)
        return np.column_stack([T, N]), slips


class _Outcome(NamedTuple):
    """How an increment ended; time - loads passed so far; scale : N, largest |F| of the history"""

    time: float
    scale: float
    iterations: int
    converged: bool


@dataclass(frozen=True)
class FrictionState:
    """One equilibrium of the history.

    pairs - with the preload (negative = open; where kn = inf the contact force, 0 = open); opening
    : (P,) m - how far a pair stands open, 0 where closed; tangential : (P, 2) N along t1, t2;
    slider : (P, 2) m, w in
    T = kt (u_t - w) (where kt = inf the motion itself): the `start` of a response with origin
    'unloaded' under the same static load
    slips : (P,) bool - at the limit; displacement : (r,) m; load : (r,) N; time - loads passed so
    far (1.5: half way from the first to the second); residual - |K q + B' f - F| / largest |F| of
    the history; iterations; converged"""

    pairs: ContactTable
    opening: np.ndarray
    tangential: np.ndarray
    slider: np.ndarray
    slips: np.ndarray
    displacement: np.ndarray
    load: np.ndarray
    time: float
    residual: float
    iterations: int
    converged: bool

    def __repr__(self) -> str:
        return (
            f"<FrictionState: time {self.time:g}, {len(self.pairs)} pairs, "
            f"{int(self.slips.sum())} slip, {int((self.force <= 0).sum())} open; residual "
            f"{self.residual:.1e}, {'converged' if self.converged else 'not converged'}>"
        )

    @property
    def force(self) -> np.ndarray:
        """(P,) N contact force."""
        return np.maximum(self.pairs.preload, 0.0)


class FrictionalContact:
    """One model and its pairs, factored once.

    friction - what the limit mu N holds, as `ContactLaw.friction`: each tangent by itself, as in
    the law DryFriction2T, or with `resultant_limited` both together, as in IsotropicFriction.
    Raises InputError when even stuck pairs leave a motion free.
    """

    def __init__(
        self,
        model: ReducedModel | Any,
        pairs: ContactTable,
        *,
        friction: FrictionLimit = each_limited,
        settings: FrictionSettings = SETTINGS,
        stuck: Callable[..., BodiesOnSprings] = stuck_bodies,
    ) -> None:
        """stuck : how the bodies are factored, `sparse_bodies.sparse_stuck_bodies` for a
        `sparse_bodies.SparseBodies`, `iterative_bodies.IterativeBodies` for one with thousands of
        pairs; `iterative_bodies.bodies_on_springs` chooses."""
        check_pairs(pairs)
        self.model, self.pairs, self.settings = model, pairs, settings
        self.B = relative_motion(model, pairs)
        self.k0, self.rigid = stuck_springs(model, pairs, self.B)
        self.kn, self.kt = self.k0[2::3], self.k0[::3]
        self.law = CoulombSprings(self.kn, self.kt, pairs.mu, friction)
        self.slack = np.divide(1.0, self.k0, out=np.zeros(len(self.k0)), where=self.rigid)
        rigid = rigid_motions(model)
        names = free_motions(
            model, rigid, loose(model, rigid), self.B, np.flatnonzero(self.k0 > 0)
        ).names
        if names:
            raise InputError(
                f"{', '.join(n for n, _ in names)}: not even stuck pairs resist this; hold it "
                "(hold, in [damper] or [model] of a study)"
            )
        try:
            self.bodies = stuck(model, self.B, self.k0)
        except (np.linalg.LinAlgError, SingularStiffness):
            raise InputError(
                "a motion meets no stiffness, or too little beside that of the bodies for double "
                "precision: the stiffness of the model with all pairs stuck is singular"
            ) from None

    def solve(
        self, loads: ArrayLike, *, steps: int = 20, gap: np.ndarray | None = None
    ) -> tuple[FrictionState, ...]:
        """The states along the history that goes straight from no load to each of `loads` (n, r) N
        in turn.

        gap : (P,) m, or (n + 1, P) m - at the start and under each load, straight in between; by
        default those of the table
        steps : increments for each of them. An increment that does not converge is halved; where
        that does not help the history ends with a state that says so (converged=False): a load
        beyond what friction holds, or one that lifts the damper off, has no equilibrium.
        """
        loads, gaps = self._history(loads, steps, gap)
        scale = np.linalg.norm(loads, axis=1).max()
        w = np.zeros((len(self.pairs), 2))
        z, time, states = np.zeros(3 * len(self.pairs)), 0.0, []
        for target in np.arange(1, (len(loads) - 1) * steps + 1) / steps:
            size = target - time
            while time < target:
                now = target if time + size >= target - 1e-12 else time + size
                load, gap = _at(loads, now), _at(gaps, now)
                found, iterations = self._increment(load, _at(loads, time), z, w, gap)
                if found is None and size > (1 / steps) * 0.5**self.settings.halvings:
                    size /= 2
                    continue
                z = z if found is None else found
                states.append(
                    self._state(
                        z, w, gap, load, _Outcome(now, scale, iterations, found is not None)
                    )
                )
                if not states[-1].converged:
                    return tuple(states)
                w, time = states[-1].slider, now
        return tuple(states)

    def _history(
        self, loads: ArrayLike, steps: int, gap: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Loads (n + 1, r) from none on, and the gaps (n + 1, P) with them, looked at."""
        if isinstance(steps, bool) or not isinstance(steps, Integral) or steps < 1:
            raise InputError(f"steps = {steps!r}: must be a whole number, 1 or more")
        checked = [
            finite_values("load", load, self.model.size, "dofs of the model")
            for load in np.atleast_2d(loads)
        ]
        loads = np.vstack([np.zeros(self.model.size), *checked])
        return loads, _at_each(self.pairs.gap if gap is None else gap, len(loads), len(self.pairs))

    def _increment(
        self, load: np.ndarray, before: np.ndarray, z: np.ndarray, w: np.ndarray, gap: np.ndarray
    ) -> tuple[np.ndarray | None, int]:
        """Motion (3P,) under `load`, from z under the load `before`; None without one; and the
        Newton steps.

        Where Newton does not converge, dashpots with a part of the stuck springs take the pairs
        from z to the equilibrium in some steps: the part falls as long as these converge, and at
        last Newton must do without."""
        found, total = self._equilibrium(load, z + self.bodies.felt(load - before), w, gap)
        damped, at = 1.0, z
        for _ in range(self.settings.dashpot_steps):
            if found is not None:
                break
            moved, steps = self._equilibrium(load, at, w, gap, damped)
            total += steps
            damped = damped / 3 if moved is not None else damped * 6
            if moved is not None:
                at = moved
                found, steps = self._equilibrium(load, at, w, gap)
                total += steps
        return found, total

    def _equilibrium(
        self, load: np.ndarray, z: np.ndarray, w: np.ndarray, gap: np.ndarray, damped: float = 0.0
    ) -> tuple[np.ndarray | None, int]:
        """Newton for u - u0 + G (f - k u + damped k0 (u - start)) = 0, and its steps; None where it
        fails."""
        start = z - self.slack * self.law.forces(z, w, gap)[0]
        u0 = self.bodies.felt(load)

        def residual(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            f, tangent, _ = self.law.forces(z, w, gap)
            u = z - self.slack * f
            return u - u0 + self.bodies.push(
                f - (self.bodies.k - damped * self.k0) * u - damped * self.k0 * start
            ), tangent

        size = float(np.linalg.norm(u0) + np.linalg.norm(z))
        enough = self.settings.tolerance * size
        F, tangent = residual(z)
        for step in range(1, self.settings.iterations + 1):
            if np.linalg.norm(F) <= enough:
                return z, step
            dz = self._newton(F, tangent, self.bodies.k - damped * self.k0, damped, 0.1 * enough)
            if not np.linalg.norm(dz) <= self.settings.far * size:
                break
            z, F, tangent = _nearer(residual, z, F, dz)
            if self.bodies.renew(tangent):
                u0 = self.bodies.felt(load)
                F, tangent = residual(z)
        return None, step

    def _newton(
        self, F: np.ndarray, tangent: np.ndarray, k: np.ndarray, damped: float, enough: float
    ) -> np.ndarray:
        """The step from F to `enough` m: E = du/dz = I - f'/k0 where rigid, D = f' - k E."""
        E = np.eye(3) - self.slack.reshape(-1, 3, 1) * tangent
        return self.bodies.step(
            F,
            E,
            tangent - k.reshape(-1, 3, 1) * E,
            ~tangent.any(axis=(1, 2)) & (damped == 0.0),
            enough,
        )

    def _state(
        self, z: np.ndarray, w: np.ndarray, gap: np.ndarray, load: np.ndarray, outcome: _Outcome
    ) -> FrictionState:
        f, _, slips = self.law.forces(z, w, gap)
        u = z - self.slack * f
        q = self.bodies.solve(load - self.B.T @ (f - self.bodies.k * u))
        left = np.linalg.norm(self.model.K @ q + self.B.T @ f - load)
        residual = float(left / outcome.scale) if outcome.scale > 0 else float(left)
        T, N = np.split(f.reshape(-1, 3), [2], axis=1)
        reach = np.divide(T, self.kt[:, None], out=np.zeros(T.shape), where=self.kt[:, None] > 0)
        N, open_by = N[:, 0], gap - u[2::3]
        preload = np.where(self.rigid[2::3] | (N > 0), N, -self.kn * open_by)
        return FrictionState(
            self.pairs.replace(preload=preload, gap=gap),
            np.where(N > 0, 0.0, open_by),
            T.copy(),
            np.where(slips, z.reshape(-1, 3)[:, :2] - reach, w),
            slips.any(axis=1) & (N > 0),
            q,
            load,
            float(outcome.time),
            residual,
            outcome.iterations,
            outcome.converged and residual <= self.settings.residual,
        )


def _nearer(
    residual: Callable, z: np.ndarray, F: np.ndarray, dz: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """z after so much of the step dz as reduces the residual F, with residual and tangents there;
    where no part does, after the full step."""
    for part in (1.0, 0.5, 0.25, 0.125, 1.0):
        G, tangent = residual(z + part * dz)
        if np.linalg.norm(G) < np.linalg.norm(F):
            break
    return z + part * dz, G, tangent


def _at_each(gap: ArrayLike, count: int, pairs: int) -> np.ndarray:
    """(count, P) m: the gaps at the start and under each load."""
    rows = np.asarray(gap)[None] if np.ndim(gap) < 2 else np.asarray(gap)
    if len(rows) not in (1, count):
        raise InputError(
            f"gap: {len(rows)} rows; allowed are one, or {count} for the start and each load"
        )
    checked = [finite_values("gap", row, pairs, "pairs") for row in rows]
    return np.broadcast_to(checked, (count, pairs))


def _at(loads: np.ndarray, time: float) -> np.ndarray:
    """Load, or gaps, at a time between the loads, straight from each to the next."""
    k = min(int(np.floor(time)), len(loads) - 2)
    return loads[k] + (time - k) * (loads[k + 1] - loads[k])
