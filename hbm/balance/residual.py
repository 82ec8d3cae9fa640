"""Harmonic balance condensed to the relative motion at the contact pairs.

    u_k + G(k w) [f_k(u) - K_c u_k] = G-response to the external force,        k = 0..H

G is the receptance of the stuck system at the pairs and the bracket is that of `aft`; Newton's linear system is in
`linearisation`.
"""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from hbm import fourier
from hbm.balance import aft
from hbm.balance.memory import check_harmonics_fit
from hbm.balance.newton import Linearisation, real_times
from hbm.balance.receptance import Receptance, check_rest, stuck_receptance
from hbm.errors import InputError
from hbm.laws.base import ContactLaw, Contacts
from hbm.laws.shipped import check_law
from hbm.model import check_damping, symmetric
from hbm.validation import check_kind, check_samples, numbers

SERIES_REACH = 4.0       # modes above this many times the highest harmonic enter the Jacobian by a series
SERIES_TERMS = 18        # 4^-18 is below 1e-10
HELD = 1e-10             # share of its stuck stiffness that Newton's matrix leaves the mean position of a moving pair
ORDER_ZERO_WEIGHT = 0.01     # the mean position is nearly indeterminate in slip: it counts little in the arc length
SETTINGS = ("preload", "mu", "kn", "kt")      # of the pairs, that may be a parameter of the continuation


@dataclass(frozen=True)
class ContactProblem:
    """M q'' + C q' + K q + B' f(B q) = F0 + Re sum F_k exp(i k w t), with a contact law f on P pairs.

    B : (P nd, r) dense or sparse - components of each pair in turn, in the order of the law
    static : (r,) N or None - constant force beside the one that balances the preload
    preloaded : True when q = 0 is the preloaded state (the force sum B_n' max(preload, 0) is implied: open pairs, of
        negative preload, carry nothing), False when q = 0 is the unloaded one and `static` carries all static loads
    damping_ratio : of the modes of the stuck system; None takes C
    describe : motion (r,) -> NamedMotion for messages (see `linear.describe_motion`), or None
    """

    M: np.ndarray
    C: np.ndarray | None
    K: np.ndarray
    B: np.ndarray | sp.spmatrix
    law: ContactLaw
    pairs: Contacts
    static: np.ndarray | None = None
    preloaded: bool = True
    damping_ratio: float | np.ndarray | None = None
    describe: object = None

    def __post_init__(self):
        for name in "MCK":
            if getattr(self, name) is not None:
                object.__setattr__(self, name, symmetric(name, getattr(self, name)))
        check_law(self.law)
        check_kind("pairs", self.pairs, Contacts, "Contacts(kn, kt, mu, preload)")
        nd, r = len(self.law.components), self.K.shape[0]
        if any(matrix is not None and matrix.shape != (r, r) for matrix in (self.M, self.C)):
            shapes = ", ".join(f"{name} is {np.shape(getattr(self, name))}" for name in "MCK")
            raise InputError(f"{shapes}: all must have the same size")
        self._check_signs()
        if not len(self.pairs):
            raise InputError("no contact pairs: use linear_response for a model without contact")
        if np.shape(self.B) != (len(self.pairs) * nd, r):
            raise InputError(f"B is {np.shape(self.B)}: law {self.law.name} on {len(self.pairs)} pairs of a model with "
                             f"{r} dofs needs ({len(self.pairs) * nd}, {r})")
        numbers("B", self.B, "must be a real matrix")
        self.law.check(self.pairs)
        if self.static is not None:
            static = numbers("static", self.static, f"must be {r} real numbers in N")
            if static.shape != (r,) or not np.isfinite(static).all():
                raise InputError(f"static load: must be finite with shape ({r},), got {static.shape}")

    def _check_signs(self):
        """Massless dofs are allowed, but not every one; damping must not drive."""
        if not self.M.any():
            raise InputError("M is zero: at least one dof must have mass")
        if (self.M.diagonal() < 0).any():
            i = int(self.M.diagonal().argmin())
            raise InputError(f"M has {self.M[i, i]:g} on its diagonal at dof {i}: masses must not be negative")
        if self.C is not None:
            check_damping(self.C)

    @property
    def stuck_stiffness(self) -> np.ndarray:
        """(r, r) K + B' K_c B."""
        k = self.law.stuck_stiffness(self.pairs).ravel()
        B = self.B.toarray() if sp.issparse(self.B) else np.asarray(self.B, dtype=float)
        return self.K + (B.T * k) @ B

    def rest_force(self, pairs) -> np.ndarray:
        """(P, nd) N: force at q = 0 that the implied loads hold; pairs: these ones, or with other settings."""
        return self.law.force_at_rest(pairs) if self.preloaded else np.zeros((len(pairs), len(self.law.components)))

    def receptance(self) -> Receptance:
        """Of the stuck system, computed once; raises InputError when a motion is left free."""
        if "_receptance" not in self.__dict__:
            if self.law.stuck_stiffness(self.pairs).any() and not self.law.stiffness_at_rest(self.pairs).any():
                check_rest(self.K, None if self.preloaded else self.static, self.describe)
            C = self.C if self.damping_ratio is None else None
            found = stuck_receptance(self.M, C, self.stuck_stiffness, self.damping_ratio, self.describe)
            object.__setattr__(self, "_receptance", found)
        return self.__dict__["_receptance"]


class HarmonicBalance:
    """Residual of a ContactProblem under forces {harmonic: (r,) complex} for harmonics 0..H.

    x (P nd nh,) are the real coefficients of the relative motion, pair by pair, component by component.
    """

    def __init__(self, problem: ContactProblem, forces: dict, H: int, start="zero_slider", samples: int | None = None):
        law, pairs = problem.law, problem.pairs
        self.forces, self.given_start = forces, start
        self.problem, self.H, self.nh, self.nd = problem, H, fourier.n_real(H), len(law.components)
        self.n_components = len(pairs) * self.nd
        self.start = aft.slider_start(start, len(pairs), law.sliders)
        self.grid = aft.sample_grid(H, check_samples(samples, H) or law.default_samples(H))
        check_harmonics_fit(len(pairs), self.nd, H)
        self.receptance = problem.receptance()                      # the first thing that takes time
        self.shapes = np.ascontiguousarray(problem.B @ self.receptance.shapes)
        self.static, self.preload_force = self._static_parts()
        self.force = np.zeros((self.receptance.shapes.shape[1], H + 1), dtype=complex)
        for k, F in forces.items():
            self.force[:, k] = self.receptance.shapes.T @ F
        self.weights = np.tile(np.r_[ORDER_ZERO_WEIGHT, np.ones(self.nh - 1)], self.n_components)
        self._series, self.on_call = None, None      # on_call(): told of each evaluation

    def _static_parts(self):
        """Modal constant force: given, and that by which the preload pushes the stuck springs."""
        p, pairs = self.problem, self.problem.pairs
        m = self.receptance.shapes.shape[1]
        static = np.zeros(m) if p.static is None else self.receptance.shapes.T @ p.static
        return static, self.shapes.T @ -self._unheld(pairs).ravel()

    def linear(self, w: float, level: float = 1.0) -> np.ndarray:
        """x of the stuck system at a force level, the solution when no bracket acts."""
        factors = self._factors(w)[0]
        return fourier.to_real(self.shapes @ (factors * self.force_at(level))).ravel()

    def _factors(self, w):
        return self.receptance.factors(w * np.arange(self.H + 1))

    def force_at(self, level):
        """(m, H+1) modal force at a force level, constant parts included."""
        force = level * self.force
        force[:, 0] += self.static + self.preload_force
        return force

    def evaluate(self, x: np.ndarray, w: float, level: float = 1.0, by: str = "w", factor: float = 1.0):
        """Linearisation at angular frequency w and force level.

        by : parameter of the derivative - 'w', 'level', or 'preload', 'mu', 'kn' or 'kt' of all pairs, times `factor`
        """
        if self.on_call:
            self.on_call()
        p = self.problem
        u = x.reshape(len(p.pairs), self.nd, self.nh)
        bracket = self._held(self._bracket(u, w, by, factor))
        d, d_rate = self._factors(w)
        push = self.force_at(level)
        rows = np.flatnonzero(np.any(bracket.g.reshape(-1, self.nh) != 0, axis=1))
        if len(rows):
            push = push - real_times(self.shapes[rows].T, fourier.to_complex(bracket.g.reshape(-1, self.nh)[rows]))
        modal = d * push
        if by in SETTINGS:
            g = self._by_setting(u, w, by, factor, bracket)
            rate = -d * real_times(self.shapes.T, fourier.to_complex(g.reshape(-1, self.nh)))
        else:
            rate = d_rate * np.arange(self.H + 1) * push if by == "w" else d * self.force
            if by == "w" and bracket.by_omega is not None:
                g = bracket.by_omega.reshape(-1, self.nh)
                rate = rate - d * real_times(self.shapes.T, fourier.to_complex(g))
        both = real_times(self.shapes, np.concatenate([modal, rate], axis=1))
        residual = x - fourier.to_real(both[:, :self.H + 1]).ravel()
        by_parameter = -fourier.to_real(both[:, self.H + 1:]).ravel()
        return Linearisation(x, residual, by_parameter, bracket, modal, self, d, w, rate)

    def scaled(self, name, value):
        """The balance with the force ('level') or a setting of every pair times a value."""
        if name == "level":
            other = copy(self)
            other.force = value * self.force
            return other
        problem = replace(self.problem, pairs=self._scaled_pairs(name, value))
        if name in ("preload", "mu"):
            problem.__dict__["_receptance"] = self.receptance          # these do not change it
        other = HarmonicBalance(problem, self.forces, self.H, self.given_start, len(self.grid[0]) - 1)
        other.on_call = self.on_call
        return other

    def _scaled_pairs(self, name, factor):
        p = self.problem
        changed = {name: factor * getattr(p.pairs, name)}
        if name == "kn" and not p.preloaded:
            changed["preload"] = factor * p.pairs.preload          # -kn gap
        return replace(p.pairs, **changed)

    def _held(self, bracket):
        """The bracket with a trace of the stuck springs in the derivative by the mean position.

        Where every pair moves its slider in each cycle, no force depends on the mean position of a free body along the
        sliding direction: it may stand anywhere, and Newton's matrix is singular in that motion though the rest is well
        determined. With the trace the body stays where it was; the residual, and so the solution, is not touched.
        """
        trace = self.trace(bracket).reshape(-1, self.nd)[bracket.contacts]
        for d in range(self.nd):
            bracket.D[:, d, 0, d, 0] += trace[:, d]
        return bracket

    def trace(self, bracket) -> np.ndarray:
        """(P nd,) N/m that Newton's matrix adds to the mean positions: a trace of the stuck springs of moving rows."""
        return HELD * (self.problem.law.stuck_stiffness(self.problem.pairs) * bracket.active).ravel()

    def _bracket(self, u, w, by, factor):
        p = self.problem
        if by not in SETTINGS:
            return aft.evaluate(p.law, p.pairs, u, self.start, self.grid, w)
        pairs = self._scaled_pairs(by, factor)
        bracket = aft.evaluate(p.law, pairs, u, self.start, self.grid, w)
        # the receptance and the constant force are those of the model: what they differ by goes into the bracket
        if by in ("kn", "kt"):
            bracket = bracket.with_springs(p.law.stuck_stiffness(pairs) - p.law.stuck_stiffness(p.pairs), u)
        bracket.g[:, :, 0] += self._unheld(pairs) - self._unheld(p.pairs)
        return bracket

    def _unheld(self, pairs):
        """(P, nd) N: force of the stuck springs at q = 0 beyond the force of the law there."""
        return self.problem.law.stuck_force(pairs) - self.problem.rest_force(pairs)

    def _by_setting(self, u, w, by, factor, bracket):
        """(P, nd, nh) derivative of the bracket by the factor on a setting of every pair."""
        if by == "preload" and bracket.by_preload is not None:
            g = self.problem.pairs.preload[:, None, None] * bracket.by_preload
            g[:, :, 0] += self._unheld(self.problem.pairs)
            return g
        h = 1e-6 * max(abs(factor), 1e-3)
        factor = max(factor, h)
        return (self._bracket(u, w, by, factor + h).g - self._bracket(u, w, by, factor - h).g) / (2 * h)

    def between(self, to, at, factors, w) -> np.ndarray:
        """(H+1, len(to), len(at)) receptance between components: low modes one by one, the others by a series."""
        low, powers = self._series_terms(w)
        left, right = self.shapes[to][:, low], self.shapes[at][:, low].T
        G = np.empty((self.H + 1, len(to), len(at)), dtype=complex)
        for k in range(self.H + 1):
            f = factors[low, k, None]
            if np.iscomplexobj(left):
                G[k] = left @ (f * right)
            else:
                G[k].real, G[k].imag = left @ (f.real * right), left @ (f.imag * right)
        if powers is not None:
            S = powers[:, to[:, None], at]
            x = np.power.outer(1j * w * np.arange(self.H + 1), np.arange(len(powers)))
            flat = S.reshape(len(powers), -1)
            G.real += (x.real @ flat).reshape(G.shape)
            G.imag += (x.imag @ flat).reshape(G.shape)
        return G

    def _series_terms(self, w):
        """Indices of the modes to sum one by one, and the matrices S_n of sum_n (i k w)^n S_n for the others.

        1/(1 + x^2 + 2 zeta x) = sum U_n(-zeta) x^n with x = i k w/w_r (generating function of Chebyshev's U_n), and
        1/(i k w - s) = -sum (i k w)^n / s^(n + 1) for poles, which come in conjugate pairs.
        """
        r = self.receptance
        if r.shapes.shape[1] < 60:
            return slice(None), None
        top = w * max(self.H, 1)
        if self._series is None or not 0.5 * self._series[0] <= top <= self._series[0]:
            reach = 1.1 * top
            if r.poles is not None:
                self._series = (reach, *self._series_of_poles(np.abs(r.poles) > reach * SERIES_REACH))
                return self._series[1:]
            high = (np.sqrt(r.mass) * reach * SERIES_REACH < 1) & (r.ratio < 0.3)
            low = np.flatnonzero(~high)
            P, zeta, s = self.shapes[:, high], r.ratio[high], np.sqrt(r.mass[high])
            powers = np.empty((SERIES_TERMS, self.n_components, self.n_components))
            before, now = np.zeros_like(zeta), np.ones_like(zeta)
            for n in range(SERIES_TERMS):
                powers[n] = (P * (now * s**n)) @ P.T
                before, now = now, -2 * zeta * now - before
            self._series = (reach, low, powers)
        return self._series[1], self._series[2]

    def _series_of_poles(self, high):
        fast, P = 1 / self.receptance.poles[high], self.shapes[:, high]
        powers, weight = [], -fast
        for _ in range(SERIES_TERMS):
            powers.append(((P * weight) @ P.T).real)
            weight = weight * fast
        return np.flatnonzero(~high), np.array(powers)
