"""The receptance between the contacts: low modes one by one, the modes far above the harmonics by a power series."""

import numpy as np

from hbm.balance.receptance import Receptance
from hbm.balance.settings import DEFAULT


class ContactReceptance:
    """Receptance between the components of the relative motion, for orders 0..H.

    shapes : (nc, m), the modes of `receptance` at the components
    """

    def __init__(self, receptance: Receptance, shapes: np.ndarray, H: int):
        self.receptance, self.shapes, self.H = receptance, shapes, H
        self._kept: tuple = ()              # (reach, low modes, matrices)

    def between(self, to: np.ndarray, at: np.ndarray, factors: np.ndarray, w: float) -> np.ndarray:
        """(H+1, len(to), len(at)) complex between components; factors (m, H+1) : of the modes at the orders of w."""
        low, powers = self.terms(w)
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

    def terms(self, w: float) -> tuple:
        """Indices of the modes to sum one by one, and the matrices S_n of sum_n (i k w)^n S_n for the others.

        1/(1 + x^2 + 2 zeta x) = sum U_n(-zeta) x^n with x = i k w/w_r (generating function of Chebyshev's U_n), and
        1/(i k w - s) = -sum (i k w)^n / s^(n + 1) for poles, which come in conjugate pairs.
        """
        r = self.receptance
        if r.shapes.shape[1] < DEFAULT.few_modes:
            return slice(None), None
        top = w * max(self.H, 1)
        if not self._kept or not 0.5 * self._kept[0] <= top <= self._kept[0]:
            reach = 1.1 * top
            above = reach * DEFAULT.series_reach
            if r.poles.size:
                self._kept = reach, *self._of_poles(np.abs(r.poles) > above)
            else:
                self._kept = reach, *self._of_modes((np.sqrt(r.mass) * above < 1) & (r.ratio < 0.3))
        return self._kept[1:]

    def _of_modes(self, high):
        P, zeta = self.shapes[:, np.flatnonzero(high)], self.receptance.ratio[high]
        s = np.sqrt(self.receptance.mass[high])
        powers = np.empty((DEFAULT.series_terms, len(P), len(P)))
        before, now = np.zeros_like(zeta), np.ones_like(zeta)
        for n in range(DEFAULT.series_terms):
            powers[n] = (P * (now * s**n)) @ P.T
            before, now = now, -2 * zeta * now - before
        return np.setdiff1d(np.arange(self.shapes.shape[1]), np.flatnonzero(high)), powers

    def _of_poles(self, high):
        fast, P = 1 / self.receptance.poles[high], self.shapes[:, np.flatnonzero(high)]
        powers, weight = [], -fast
        for _ in range(DEFAULT.series_terms):
            powers.append(((P * weight) @ P.T).real)
            weight = weight * fast
        return np.setdiff1d(np.arange(self.shapes.shape[1]), np.flatnonzero(high)), np.array(powers)
