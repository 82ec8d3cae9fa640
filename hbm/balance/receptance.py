"""Linear side of the contact problem: modes of the stuck system and its receptance.

The receptance is q = shapes diag(d(w)) shapes' f. With damping ratios of the modes, phi' K phi = k, phi' M phi = m,

    d_r(w) = 1 / (k_r - m_r w^2 + 2 i zeta_r sqrt(k_r m_r) w),

scaled to k_r = 1 so that massless dofs do no harm (to m_r = 1 where rigid motions are left free); with a general
damping matrix d_r(w) = 1/(i w - s_r) over the poles of the state-space pencil, diagonalised once.

Two kinds of shapes stand behind the modes. Free motions, which neither K nor the contacts resist: -1/w^2 with a unit of
mass, and at w = 0, where no force acts along them, 0. And constraints a' q = 0 of order 0 alone: with z = K^-1 a and
-1/(a' K^-1 a) the response is that of the constrained system, as if a stood on a stop; 0 at other orders.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from hbm.balance.kernels import modal_factors
from hbm.balance.named_motion import describe_motion, mostly
from hbm.balance.restraint import SUPPORT, check_restrained, with_gauge
from hbm.balance.settings import DEFAULT
from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel
from hbm.validation import brief, check_forcing, check_outputs


@dataclass(frozen=True)
class Receptance:
    """q = shapes diag(d(w)) shapes.T f.

    shapes : (r, m), real with damping ratios, complex with a general damping matrix
    stiffness, mass, ratio : (m,) modal k_r and m_r, and damping ratios; empty with a general damping matrix
    poles : (m,) 1/s with a general damping matrix, else empty
    free : number of shapes behind the modes that are free motions
    constraint_forces : (h, h) of the h constraints of order 0, the last shapes: takes their coordinates to the forces
        on what holds
    """

    shapes: np.ndarray
    stiffness: np.ndarray = field(default_factory=lambda: np.empty(0))
    mass: np.ndarray = field(default_factory=lambda: np.empty(0))
    ratio: np.ndarray = field(default_factory=lambda: np.empty(0))
    poles: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=complex))
    free: int = 0
    constraint_forces: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def modes(self) -> np.ndarray:
        """(r, m) the shapes of the modes."""
        return self.shapes[:, :self.shapes.shape[1] - self.free - len(self.constraint_forces)]

    @property
    def frequencies(self) -> np.ndarray:
        """Natural frequencies in Hz, lowest first (with poles: |s|/2 pi of each)."""
        if self.poles.size:
            return np.sort(np.abs(self.poles)) / (2 * np.pi)
        with np.errstate(divide="ignore"):
            return np.sort(np.r_[np.zeros(self.free), np.sqrt(self.stiffness / self.mass)]) / (2 * np.pi)

    def factors(self, w: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """d and dd/dw, each (m, n) complex, at the angular frequencies w (n,)."""
        at = np.atleast_1d(np.asarray(w, dtype=float))
        d, rate = self._of_modes(at)
        if len(d) == self.shapes.shape[1]:
            return d, rate
        moving = at != 0
        more, more_rate = np.zeros((2, self.shapes.shape[1] - len(d), len(at)))
        more[:self.free, moving], more_rate[:self.free, moving] = -1 / at[moving]**2, 2 / at[moving]**3
        more[self.free:, ~moving] = -1.0
        return np.concatenate([d, more]), np.concatenate([rate, more_rate])

    def _of_modes(self, w):
        if self.poles.size:
            d = 1 / (1j * w - self.poles[:, None])
            return d, -1j * d * d
        return modal_factors(self.stiffness, self.mass, self.ratio, w)

    def constrained(self, rows: np.ndarray) -> "Receptance":
        """With rows (h, r) q = 0 in order 0; InputError where that takes hold of a free motion."""
        if self.free and np.abs(rows @ self.shapes[:, -self.free:]).max() > 0:
            raise InputError("hold with mean = true: no contact resists the motion even where it sticks; hold it by a "
                             "spring, without mean")
        reach = (self.shapes @ (self.factors(0.0)[0] * (self.shapes.T @ rows.T))).real     # K^-1 rows'
        back = np.linalg.inv(np.linalg.cholesky(rows @ reach).T)
        return replace(self, shapes=np.hstack([self.shapes, reach @ back]), constraint_forces=-back)

    def respond(self, rows: np.ndarray, force: np.ndarray, w: np.ndarray) -> np.ndarray:
        """(n, k) response of the rows (k, r) to a force (r,) at the angular frequencies w (n,)."""
        return ((rows @ self.shapes) @ (self.factors(w)[0] * (self.shapes.T @ force)[:, None])).T


def stuck_receptance(M: np.ndarray, C: np.ndarray | None, K: np.ndarray, damping_ratio: ArrayLike | None = None,
                     describe: Callable | None = None, remedy: str = SUPPORT,
                     free: np.ndarray | None = None) -> Receptance:
    """Receptance of (K, M), which restrains every motion, with a damping matrix C or with damping ratios of its modes.

    damping_ratio : a number, or one per mode from the lowest; the last one holds for all modes above.
    describe : function of a motion (r,) that names it; remedy : what to do. Both for the error about a free motion.
    free : (r, e) motions of `floating_motions`, which K need not restrain
    Raises InputError when K leaves another motion free, or when no damping or both kinds are given.
    """
    r = K.shape[0]
    if (C is None) == (damping_ratio is None):
        both = "both a damping matrix C and damping_ratio" if C is not None else "neither C nor damping_ratio"
        raise InputError(f"damping: {both} given, exactly one is needed")
    given = ratios(damping_ratio, r) if C is None else np.empty(0)
    if free is not None and free.shape[1]:
        return _beside_free(M, C, K, given, describe, remedy, free)
    check_restrained(K, describe, remedy=remedy)
    period2, shapes = la.eigh(M, K)
    if period2[0] < -1e-10 * period2[-1]:
        dof = np.abs(shapes[:, 0]).argmax() + 1
        raise InputError(f"M is not positive: a motion mostly of dof {dof} has negative mass")
    period2, shapes = period2[::-1], np.ascontiguousarray(shapes[:, ::-1])
    return of_modes(shapes, period2, None if C is None else shapes.T @ C @ shapes, given)


def of_modes(shapes: np.ndarray, period2: np.ndarray, modal: np.ndarray | None, ratio: np.ndarray) -> Receptance:
    """Receptance of modes (r, m) of unit stiffness and the mass period2 (m,), with a damping matrix (m, m) of these or
    with damping ratios (m,)."""
    period2 = np.maximum(period2, 0.0)
    if modal is None:
        return Receptance(shapes, np.ones(len(period2)), period2, ratio)
    ratio = 0.5 * np.diag(modal) / np.sqrt(np.maximum(period2, 1e-300))
    off = modal - np.diag(np.diag(modal))
    if np.abs(off).max() <= 1e-12 * np.abs(modal).max():
        return Receptance(shapes, np.ones(len(period2)), period2, ratio)
    return _pencil(shapes, period2, modal)


def _beside_free(M, C, K, ratio, describe, remedy, free):
    """Receptance of the motions beside the free ones (M-orthogonal to them), then the free ones."""
    check_restrained(with_gauge(M, K, free), describe, remedy=remedy)
    e = free.shape[1]
    if C is not None and np.abs(C @ free).max() > DEFAULT.loose * len(K) * np.abs(C).max() * np.abs(free).max():
        raise InputError(f"a motion meets damping but no stiffness, even when every contact sticks: "
                         f"{describe(free[:, 0]) if describe else mostly(free[:, 0])}; support the body, however "
                         "softly, or take that damping out of C")
    N = la.qr(M @ free)[0][:, e:]
    inside = stuck_receptance(N.T @ M @ N, None if C is None else N.T @ C @ N, N.T @ K @ N,
                              ratio[e:] if C is None else None)
    return replace(inside, shapes=np.hstack([N @ inside.shapes, free]), free=e)


def free_receptance(M: np.ndarray, K: np.ndarray, damping_ratio: ArrayLike) -> Receptance:
    """Receptance of (K, M) with damping ratios of its modes; rigid motions may be free, M must be regular."""
    stiffness, shapes = la.eigh(K, M)
    return Receptance(shapes, np.maximum(stiffness, 0.0), np.ones(len(K)), ratios(damping_ratio, len(K)))


def ratios(damping_ratio: Any, r: int) -> np.ndarray:
    """(r,) of every mode; InputError where they are none."""
    try:
        ratio = np.atleast_1d(np.asarray(damping_ratio, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"damping_ratio = {brief(damping_ratio)}: must be a number or up to {r} numbers, each "
                         "0 <= ratio < 1 (2 % is 0.02)") from None
    if ratio.ndim != 1 or not 1 <= len(ratio) <= r or not np.isfinite(ratio).all() or (ratio < 0).any() \
            or (ratio >= 1).any():
        raise InputError(f"damping_ratio = {damping_ratio}: must be a number or up to {r} numbers, each 0 <= ratio < 1")
    return np.r_[ratio, np.full(r - len(ratio), ratio[-1])]


def _pencil(shapes, period2, C):
    """Poles and shapes of s^2 diag(period2) + s C + I, scaled so that the receptance is sum z z'/(i w - s).

    With the state (y, sqrt(period2) y') that is a standard eigenvalue problem for -1/s. Motions without mass have poles
    of first order; those without damping either follow statically, and no others then act on them (C is not negative).
    Where two poles meet they have one mode: there it is the mean of the receptances for a little more and a little less
    damping, where they are apart.
    """
    shapes, period2, C, still = _without_mass(shapes, period2, C)
    growth = 1 / np.sqrt(period2.max())         # exp(growth t): no resonance is near, however light the damping
    system = np.diag(1 + period2 * growth**2) + growth * C
    for changes, allowed in zip(((0.0,), (DEFAULT.apart, -DEFAULT.apart)), DEFAULT.defect, strict=True):
        parts = [_poles(period2, (1 + change) * C) for change in changes]
        poles, Z = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        Z = Z / np.sqrt(len(parts))
        error = np.abs(system @ ((Z / (growth - poles)) @ Z.T) - np.eye(len(C))).max()
        if error < allowed:
            break
    else:
        raise InputError(f"the damping matrix has no full set of modes (defect {error:.1e}): "
                         "change it a little, or give damping_ratio instead")
    static = np.full(still.shape[1], -DEFAULT.static_pole / np.sqrt(period2.max()))
    return Receptance(np.hstack([shapes @ Z, still * np.sqrt(np.abs(static))]), poles=np.r_[poles, static])


def _poles(period2, C):
    """(n,) poles and (m, n) scaled shapes; of no use where poles meet that have one mode.

    Left modes are the right ones with -v: products Y'Y - V'V are diagonal, as the receptance takes them to be. Those of
    close poles are mixed by rounding over their distance, and made so.
    """
    m, heavy = len(period2), np.flatnonzero(period2)
    coupling = np.zeros((m, len(heavy)))
    coupling[heavy, np.arange(len(heavy))] = np.sqrt(period2[heavy])
    inverse, state = la.eig(np.block([[C, coupling], [-coupling.T, np.zeros((len(heavy),) * 2)]]), overwrite_a=True,
                            check_finite=False)
    state = _separated(state, np.r_[np.ones(m), -np.ones(len(heavy))][:, None])
    y, v = state[:m], state[m:]
    with np.errstate(divide="ignore", invalid="ignore"):
        return -1 / inverse, y / np.sqrt(np.einsum("ij,ij->j", y, C @ y + 2 * (coupling @ v)))


def _separated(state, signs):
    """Modes (k, n) whose products with each other, under signs (k, 1), vanish."""
    for _ in range(DEFAULT.separations):
        products = state.T @ (signs * state)
        size = np.sqrt(products.diagonal())
        with np.errstate(divide="ignore", invalid="ignore"):
            products = products / size / size[:, None]
            mixed = np.abs(products - np.eye(len(size))).max()
            if not DEFAULT.mixed[0] < mixed < np.inf:
                break
            state = state / size
        if mixed < DEFAULT.mixed[1]:
            state = 1.5 * state - 0.5 * state @ products
        else:
            values, vectors = la.eig(products)
            state = state @ (vectors / np.sqrt(values)) @ la.pinv(vectors)
    return state


def _without_mass(shapes, period2, C):
    """shapes, period2 (0 where there is no mass) and C of the motions with mass or damping; shapes of the others."""
    light = period2 <= 1e-14 * period2.max()
    if not light.any():
        return shapes, period2, C, shapes[:, :0]
    damping, turn = la.eigh(C[np.ix_(light, light)])
    T = np.eye(len(period2))
    T[np.ix_(light, light)] = turn
    damped = np.ones(len(period2), dtype=bool)
    damped[light] = damping > 1e-12 * np.abs(C).max()
    shapes, C = shapes @ T, T.T @ C @ T
    return shapes[:, damped], np.where(light, 0.0, period2)[damped], C[np.ix_(damped, damped)], shapes[:, ~damped]


def assembled(model: ReducedModel, pairs: ContactTable | None) -> np.ndarray:
    """K + B' diag(weight kt, weight kt, weight kn) B of a model whose pairs all stick; K where pairs is None."""
    if pairs is None or not len(pairs):
        return model.K
    B = relative_motion(model, pairs)
    k = (pairs.weight[:, None] * np.stack([pairs.kt, pairs.kt, pairs.kn], axis=1)).ravel()
    return model.K + (B.T @ B.multiply(k[:, None])).toarray()


def natural_frequencies(model: ReducedModel, pairs: ContactTable | None = None) -> np.ndarray:
    """(r,) Hz, undamped, lowest first, of the model whose pairs all stick, or without contact where pairs is None.

    Between the two lie the resonances of a friction damper: a band is chosen by them. Rigid motions of a free damper
    are about 0.
    """
    values = la.eigh(assembled(model, pairs), model.M, eigvals_only=True)
    return np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)


def linear_response(model: ReducedModel, pairs: ContactTable | None, forcing: ArrayLike, frequencies: ArrayLike,
                    damping_ratio: ArrayLike | None = None, outputs: dict | None = None) -> np.ndarray:
    """(n, m) complex harmonic 1 of the outputs when every pair sticks, or without damper where pairs is None.

    forcing : (r,) real or complex, N, amplitude F of Re F exp(i w t); frequencies : (n,) Hz
    damping_ratio : of the modes of this linear system; None takes the model's C
    outputs : {name: (r,) row}
    """
    rows = check_outputs(outputs, model.size)[1]
    force = check_forcing(forcing, model.size, 1)[1]
    K = assembled(model, pairs)
    if damping_ratio is not None:
        receptance = free_receptance(model.M, K, damping_ratio)
    else:
        receptance = stuck_receptance(model.M, model.C, K, None, lambda v: describe_motion(model, v))
    return receptance.respond(rows, force, 2 * np.pi * np.asarray(frequencies, dtype=float))
