"""Linear side of the contact problem: modes of the stuck system and its receptance.

The receptance is q = shapes diag(d(w)) shapes' f. With damping ratios of the modes, phi' K phi = k,
phi' M phi = m,

    d_r(w) = 1 / (k_r - m_r w^2 + 2 i zeta_r sqrt(k_r m_r) w),

scaled to k_r = 1 so that massless dofs do no harm (to m_r = 1 where rigid motions are left free);
with a general damping matrix d_r(w) = 1/(i w - s_r) over the poles of the state-space pencil,
diagonalised once.

Two kinds of shapes stand behind the modes. Free motions, which neither K nor the contacts resist:
1/(i w c - m w^2), and at w = 0, where no force acts along them, 0. And constraints a' q = 0 of
order 0 alone: with z = K^-1 a and -1/(a' K^-1 a) the response is that of the constrained system, as
if a stood on a stop; 0 at other orders.

Matrices that are not symmetric have left modes beside the shapes. With structural damping, which is
that of harmonic motions, the modes hold for w > 0 and further shapes for the mean.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from tipdamp.hbm.balance.damped_poles import state_space_modes
from tipdamp.hbm.balance.floating import Drag, coupled_poles, damping_of_free, modes_beside
from tipdamp.hbm.balance.general_poles import general_poles
from tipdamp.hbm.balance.kernels import modal_factors
from tipdamp.hbm.balance.restraint import (
    SUPPORT,
    FloatingMotions,
    acts_along,
    check_restrained,
    floating_motions,
    stiff_factor,
    with_gauge,
)
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.named_motion import describe_motion
from tipdamp.hbm.hold.rigid_motion import HOLD
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.validation import brief, check_forcing, check_outputs, in_hz

# each to a quarter: from 800 points over a band to 1e-5 of their distance
ZOOMS = 8


def _none(*shape: int, dtype: type = float) -> Any:
    return field(default_factory=partial(np.empty, shape, dtype))


@dataclass(frozen=True)
class Receptance:
    """q = shapes diag(d(w)) into.T f.

    shapes : (r, m), real with damping ratios, complex with a general damping matrix
    stiffness, mass, ratio : (m,) modal k_r and m_r, and damping ratios; empty with a general
    damping matrix
    poles : (m,) 1/s with a general damping matrix, else empty
    free_mass, free_damping : (e,) m and c of the shapes behind the modes that are free motions
    constraint_forces : (h, h) of the h constraints of order 0, the last shapes: takes their
        coordinates to the forces on what holds
    left : (r, m) where these are other than the shapes: of matrices that are not symmetric, or with
        structural damping; else empty
    still : number of the last shapes that answer at order 0 alone, where the others do not
    """

    shapes: np.ndarray
    stiffness: np.ndarray = _none(0)
    mass: np.ndarray = _none(0)
    ratio: np.ndarray = _none(0)
    poles: np.ndarray = _none(0, dtype=complex)
    free_mass: np.ndarray = _none(0)
    free_damping: np.ndarray = _none(0)
    constraint_forces: np.ndarray = _none(0, 0)
    left: np.ndarray = _none(0, 0)
    still: int = 0

    @property
    def into(self) -> np.ndarray:
        """(r, m) by which forces act: the left modes, those of symmetric matrices are the
        shapes."""
        return self.left if self.left.size else self.shapes

    @property
    def free(self) -> int:
        """e, the number of free motions."""
        return len(self.free_mass)

    @property
    def damping(self) -> np.ndarray:
        """(m,) modal c_r of the damping ratios; empty with a general damping matrix."""
        return 2 * self.ratio * np.sqrt(self.stiffness * self.mass)

    @property
    def masses(self) -> np.ndarray:
        """(m,) of all shapes, 0 of those that answer at order 0 alone; NaN with poles."""
        if self.poles.size:
            return np.full(self.shapes.shape[1], np.nan)
        found = np.zeros(self.shapes.shape[1])
        both = np.concatenate([self.mass, self.free_mass])
        found[: len(both)] = both
        return found

    @property
    def modes(self) -> np.ndarray:
        """(r, m) the shapes of the modes."""
        behind = self.free + len(self.constraint_forces) + self.still
        return self.shapes[:, : self.shapes.shape[1] - behind]

    def with_damping(self, factor: float) -> "Receptance":
        """The same modes and free motions with damping ratios and dashpots times a factor."""
        return replace(self, ratio=factor * self.ratio, free_damping=factor * self.free_damping)

    @property
    def frequencies(self) -> np.ndarray:
        """Natural frequencies in Hz, lowest first (with poles: |s|/2 pi of each)."""
        with np.errstate(divide="ignore"):
            own = np.abs(self.poles) if self.poles.size else np.sqrt(self.stiffness / self.mass)
        return np.sort(np.r_[np.zeros(self.free), own]) / (2 * np.pi)

    @cached_property
    def damping_shares(self) -> np.ndarray:
        """(m, m) by which a change of the stiffness, in mass-normalised modes, changes the damping
        that keeps its ratios: divided differences of c = 2 zeta w over w^2."""
        w = np.sqrt(self.stiffness / np.maximum(self.mass, 1e-28 * self.mass.max()))
        c = 2 * self.ratio * w
        sums = np.add.outer(w, w)
        apart = np.subtract.outer(w**2, w**2)
        even = np.add.outer(self.ratio, self.ratio)
        near = np.abs(apart) <= 1e-9 * np.add.outer(w**2, w**2)
        return np.where(near, even / sums, np.subtract.outer(c, c) / np.where(near, 1.0, apart))

    def factors(self, w: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """d and dd/dw, each (m, n) complex, at the angular frequencies w (n,)."""
        at = np.atleast_1d(np.asarray(w, dtype=float))
        d, rate = self._of_modes(at)
        if self.still:
            d, rate = d * (at != 0), rate * (at != 0)
            mean = np.tile(at == 0, (self.still, 1)).astype(complex)
            return np.concatenate([d, mean]), np.concatenate([rate, 0 * mean])
        if len(d) == self.shapes.shape[1]:
            return d, rate
        moving = at != 0
        m = self.free_mass[:, None]
        c = self.free_damping[:, None]
        more, more_rate = np.zeros((2, self.shapes.shape[1] - len(d), len(at)), dtype=complex)
        more[: self.free, moving] = met = 1 / (1j * c * at[moving] - m * at[moving] ** 2)
        more_rate[: self.free, moving] = -(met**2) * (1j * c - 2 * m * at[moving])
        more[self.free :, ~moving] = -1.0
        return np.concatenate([d, more]), np.concatenate([rate, more_rate])

    def _of_modes(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.poles.size:
            d = 1 / (1j * w - self.poles[:, None])
            return d, -1j * d * d
        return modal_factors(self.stiffness, self.mass, self.ratio, w)

    def constrained(self, rows: np.ndarray) -> "Receptance":
        """With rows (h, r) q = 0 in order 0; InputError where that takes hold of a free motion."""
        free = self.shapes[:, self.shapes.shape[1] - self.free :]
        if (np.abs(rows @ free) > HOLD.on_axis * (np.abs(rows) @ np.abs(free))).any():
            raise InputError(
                "hold with mean = true: no contact resists the motion even where it sticks; hold "
                "it by a spring, without mean"
            )
        reach = (self.shapes @ (self.factors(0.0)[0] * (self.shapes.T @ rows.T))).real  # K^-1 rows'
        back = np.linalg.inv(np.linalg.cholesky(rows @ reach).T)
        return replace(self, shapes=np.hstack([self.shapes, reach @ back]), constraint_forces=-back)

    def respond(self, rows: np.ndarray, force: np.ndarray, w: np.ndarray) -> np.ndarray:
        """(n, k) response of the rows (k, r) to a force (r,) at the angular frequencies w (n,)."""
        return ((rows @ self.shapes) @ (self.factors(w)[0] * (self.into.T @ force)[:, None])).T


def stuck_receptance(
    M: np.ndarray,
    C: np.ndarray | None,
    K: np.ndarray,
    damping_ratio: "ArrayLike | None" = None,
    describe: Callable | None = None,
    remedy: str = SUPPORT,
    free: FloatingMotions | None = None,
) -> Receptance:
    """Receptance of (K, M), which restrains every motion, with a damping matrix C or with damping
    ratios of its modes.

    damping_ratio : a number, or one per mode from the lowest; the last one holds for all modes
    above.
    describe : function of a motion (r,) that names it; remedy : what to do. Both for the error
    about a free motion.
    free : motions of `floating_motions`, which K need not restrain
    Raises InputError when K leaves another motion free, or when no damping or both kinds are given.
    """
    r = K.shape[0]
    if (C is None) == (damping_ratio is None):
        both = (
            "both a damping matrix C and damping_ratio"
            if C is not None
            else "neither C nor damping_ratio"
        )
        raise InputError(f"damping: {both} given, exactly one is needed")
    given = ratios(damping_ratio, r) if C is None else np.empty(0)
    free = free or FloatingMotions(np.zeros((r, 0)))
    gauged = with_gauge(M, K, free.shapes)
    e = free.shapes.shape[1]
    check_restrained(gauged, describe, remedy=remedy)
    shapes, period2 = modes_beside(M, gauged, free.shapes)
    modal = None
    drag = Drag(free.shapes, np.ones(e), np.zeros(e), False)
    if C is not None:
        modal = shapes.T @ C @ shapes
        drag = damping_of_free(C, gauged, free, (shapes, modal))
    if drag.coupled:
        Z, poles, drag = coupled_poles((M, C, K), period2.max(), drag)
        found = Receptance(Z, poles=poles)
    else:
        found = of_modes(shapes, period2, modal, given[e:])
    return replace(
        found,
        shapes=np.hstack([found.shapes, drag.shapes]),
        free_mass=drag.mass,
        free_damping=drag.damping,
    )


def general_receptance(
    M: np.ndarray,
    C: np.ndarray,
    K: np.ndarray,
    structural: np.ndarray | None = None,
    describe: Callable | None = None,
    remedy: str = SUPPORT,
) -> Receptance:
    """Receptance of matrices that restrain every motion, and of which C and K need not be
    symmetric.

    structural : (r, r) N/m D of the damping force i D q of every harmonic motion, none at rest
    Raises InputError as `general_poles`.
    """
    if structural is None:
        right, left, poles, _ = general_poles(M, C, K, describe, remedy)
        return Receptance(right, poles=poles, left=left)
    right, left, poles, shapes = general_poles(M, C, K + 1j * structural, describe, remedy)
    still = np.linalg.solve(K, np.linalg.inv(shapes).T)  # K^-1 = still shapes'
    return Receptance(
        np.hstack([right, still]),
        poles=poles,
        left=np.hstack([left, shapes]),
        still=still.shape[1],
    )


def of_modes(
    shapes: np.ndarray, period2: np.ndarray, modal: np.ndarray | None, ratio: np.ndarray
) -> Receptance:
    """Receptance of modes (r, m) of unit stiffness and the mass period2 (m,), with a damping matrix
    (m, m) of these or with damping ratios (m,)."""
    period2 = np.maximum(period2, 0.0)
    if modal is None:
        return Receptance(shapes, np.ones(len(period2)), period2, ratio)
    own = np.diag(modal)
    off = modal - np.diag(own)
    least = 1e-12 * np.abs(modal).max()
    # no ratio says what damps a mode without mass
    dashpots = (period2 == 0) & (own > least)
    if np.abs(off).max() <= least and not dashpots.any():
        ratio = 0.5 * own / np.sqrt(np.maximum(period2, 1e-300))
        return Receptance(shapes, np.ones(len(period2)), period2, ratio)
    Z, poles = state_space_modes(shapes, period2, modal)
    return Receptance(Z, poles=poles)


def free_receptance(M: np.ndarray, K: np.ndarray, damping_ratio: "ArrayLike") -> Receptance:
    """Receptance of (K, M) with damping ratios of its modes; rigid motions may be free, M must be
    regular."""
    stiffness, shapes = la.eigh(K, M)
    return Receptance(
        shapes, np.maximum(stiffness, 0.0), np.ones(len(K)), ratios(damping_ratio, len(K))
    )


def ratios(damping_ratio: Any, r: int) -> np.ndarray:
    """(r,) of every mode; InputError where they are none."""
    try:
        ratio = np.atleast_1d(np.asarray(damping_ratio, dtype=float))
    except (TypeError, ValueError):
        raise InputError(
            f"damping_ratio = {brief(damping_ratio)}: must be a number or up to {r} numbers, each "
            "0 <= ratio < 1 (2 % is 0.02)"
        ) from None
    if (
        ratio.ndim != 1
        or not 1 <= len(ratio) <= r
        or not np.isfinite(ratio).all()
        or (ratio < 0).any()
        or (ratio >= 1).any()
    ):
        raise InputError(
            f"damping_ratio = {damping_ratio}: must be a number or up to {r} numbers, each 0 <= "
            "ratio < 1"
        )
    return np.r_[ratio, np.full(r - len(ratio), ratio[-1])]


def assembled(model: ReducedModel, pairs: ContactTable | None) -> np.ndarray:
    """K + B' diag(weight kt, weight kt, weight kn) B of a model whose pairs all stick; K where
    pairs is None."""
    if pairs is None or not len(pairs):
        return model.K
    B = relative_motion(model, pairs)
    k = (pairs.weight[:, None] * np.stack([pairs.kt, pairs.kt, pairs.kn], axis=1)).ravel()
    return model.K + (B.T @ B.multiply(k[:, None])).toarray()


def natural_frequencies(model: ReducedModel, pairs: ContactTable | None = None) -> np.ndarray:
    """(r,) Hz, undamped, lowest first, of the model whose pairs all stick, or without contact where
    pairs is None.

    Between the two lie the resonances of a friction damper: a band is chosen by them. Rigid motions
    of a free damper are about 0.

    >>> model, pairs = two_blades()
    >>> print(natural_frequencies(model, pairs)[:3].round())  # stuck
    [ 694. 1377. 1397.]
    >>> print(natural_frequencies(model)[:3].round())  # free: the damper floats along y and z
    [  0.   0. 698.]
    """
    values = la.eigh(assembled(model, pairs), model.M, eigvals_only=True)
    return np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)


def linear_response(
    model: ReducedModel,
    pairs: ContactTable | None,
    forcing: "ArrayLike",
    frequencies: "ArrayLike | None" = None,
    damping_ratio: "ArrayLike | None" = None,
    outputs: dict | None = None,
    *,
    omega: "ArrayLike | None" = None,
) -> np.ndarray:
    """(n, m) complex harmonic 1 of the outputs when every pair sticks, or without damper where
    pairs is None.

    forcing : (r,) real or complex, N, amplitude F of Re F exp(i w t); frequencies : (n,) Hz; or
        omega : (n,) rad/s
    damping_ratio : of the modes of this linear system; None takes the model's C
    outputs : {name: (r,) row}

    >>> model, pairs = two_blades()
    >>> tip = model.displacement_row("blade1", 1, [0, 1, 0])
    >>> given = dict(damping_ratio=0.01, outputs={"tip": tip})
    >>> free = linear_response(model, None, tip, [711.8], **given)
    >>> stuck = linear_response(model, pairs, tip, [711.8], **given)
    >>> print(f"{abs(free[0, 0]) / abs(stuck[0, 0]):.0f}")  # at the resonance of the free blade
    6
    """
    hz = np.asarray(in_hz("frequencies", frequencies, omega), dtype=float)
    return _linear_response(model, pairs, forcing, hz, damping_ratio, outputs)(hz)


def linear_response_with_peaks(
    model: ReducedModel,
    pairs: ContactTable | None,
    forcing: "ArrayLike",
    frequencies: "ArrayLike",
    damping_ratio: "ArrayLike | None" = None,
    outputs: dict | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(frequencies (n',) Hz ascending, `linear_response` there): those given, the resonances in
    between, and for each output the one of its largest amplitude, to 1e-9 of that amplitude."""
    hz = np.asarray(frequencies, dtype=float)
    response = _linear_response(model, pairs, forcing, hz, damping_ratio, outputs)
    own = natural_frequencies(model, pairs)
    hz = np.union1d(hz, own[(hz.min() < own) & (own < hz.max())])
    hz = np.union1d(hz, _tops(lambda at: np.abs(response(at)), hz))
    return hz, response(hz)


def _tops(amplitude: Callable[[np.ndarray], np.ndarray], hz: np.ndarray) -> np.ndarray:
    """(m,) Hz at which each of m amplitudes (n, m) of frequencies (n,) is largest, beside its
    largest at some of them."""
    top = amplitude(hz).argmax(axis=0)
    low, high = hz[np.maximum(top - 1, 0)], hz[np.minimum(top + 1, len(hz) - 1)]
    each = np.arange(len(top))
    for _ in range(ZOOMS):
        at = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, 9)
        mine = amplitude(at.ravel()).reshape(*at.shape, len(top))[each, :, each]
        best = mine.argmax(axis=1)
        low, high = at[each, np.maximum(best - 1, 0)], at[each, np.minimum(best + 1, 8)]
    return at[each, best]


def _linear_response(
    model: ReducedModel,
    pairs: ContactTable | None,
    forcing: "ArrayLike",
    hz: np.ndarray,
    damping_ratio: "ArrayLike | None",
    outputs: dict | None,
) -> Callable[[np.ndarray], np.ndarray]:
    """The function that gives the harmonics 1 (n, m) of the outputs at frequencies (n,) Hz; hz :
    those that are asked for."""
    rows = check_outputs(outputs, model.size)[1]
    force = check_forcing(forcing, model.size, 1)[1]
    K = assembled(model, pairs)
    if damping_ratio is not None:
        receptance = free_receptance(model.M, K, damping_ratio)
    else:
        free = _checked_free(model, K, force, hz)
        describe = partial(describe_motion, model)
        receptance = stuck_receptance(model.M, model.C, K, None, describe, free=free)
    return lambda at: receptance.respond(rows, force, 2 * np.pi * at)


def _checked_free(
    model: ReducedModel, K: np.ndarray, force: np.ndarray, frequencies: "ArrayLike"
) -> FloatingMotions | None:
    """Free motions of a model that floats; InputError where a force of 0 Hz acts along one."""
    if stiff_factor(K) is not None:
        return None
    free = floating_motions(model.M, K, K, np.zeros((0, model.size)))
    if not np.all(frequencies):
        motion = next(
            (
                m
                for part in (force.real, force.imag)
                if (m := acts_along(free, K, part)) is not None
            ),
            None,
        )
        if motion is not None:
            raise InputError(
                "0 Hz: a constant force acts along a motion that nothing restrains: "
                f"{describe_motion(model, motion)}; leave 0 Hz out, or support the body, however "
                "softly"
            )
    return free
