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
        few = len(shapes) <= DEFAULT.few_components
        self._rows = np.arange(len(shapes)) if few else np.empty(0, dtype=int)    # that the series is known for
        self._kept: dict[float, tuple] = {}      # by reach: low modes, matrices

    def between(self, to: np.ndarray, at: np.ndarray, factors: np.ndarray, w: float) -> np.ndarray:
        """(len(to), len(at), H+1) complex between components; factors (m, H+1) : of the modes at the orders of w."""
        low, powers = self.terms(w, np.union1d(to, at))
        left, right, factors = self.shapes[to][:, low], self.shapes[at][:, low], np.ascontiguousarray(factors[low])
        G = np.empty((len(to), len(at), self.H + 1), dtype=complex)
        rows = max(1, DEFAULT.products // max(right.size, 1))
        for i in range(0, len(to), rows):
            products, into = left[i:i + rows, None] * right, G[i:i + rows]
            into[:] = real_times(products.reshape(into[..., 0].size, len(factors)), factors).reshape(into.shape)
        if powers is not None:
            x = np.power.outer(1j * w * np.arange(self.H + 1), np.arange(len(powers))).T
            here = np.searchsorted(self._rows, to)[:, None], np.searchsorted(self._rows, at)
            G += real_times(powers[:, here[0], here[1]].reshape(len(powers), -1).T, x).reshape(G.shape)
        return G

    def terms(self, w: float, rows: np.ndarray) -> tuple:
        """Indices of the modes to sum one by one, and the matrices S_n of sum_n (i k w)^n S_n for the others, between
        components that have been asked for so far, `rows` among them.

        1/(1 + x^2 + 2 zeta x) = sum U_n(-zeta) x^n with x = i k w/w_r (generating function of Chebyshev's U_n), and
        1/(i k w - s) = -sum (i k w)^n / s^(n + 1) for poles, which come in conjugate pairs.
        """
        r = self.receptance
        if r.shapes.shape[1] < DEFAULT.few_modes:
            return slice(None), None
        if not np.isin(rows, self._rows).all():
            self._rows, self._kept = np.union1d(self._rows, rows), {}
        # a power of two, whatever came before: a curve that is continued later has the same series
        reach = 2.0 ** np.ceil(np.log2(w * max(self.H, 1)))
        if reach not in self._kept:
            above = reach * DEFAULT.series_reach
            self._kept[reach] = (self._of_poles(np.abs(r.poles) > above) if r.poles.size else
                                 self._of_modes((np.sqrt(r.mass) * above < 1) & (r.ratio < 0.3)))
        return self._kept[reach]

    def _of_modes(self, high):
        P, zeta = self.shapes[self._rows][:, np.flatnonzero(high)], self.receptance.ratio[high]
        s = np.sqrt(self.receptance.mass[high])
        powers = np.empty((DEFAULT.series_terms, len(P), len(P)))
        before, now = np.zeros_like(zeta), np.ones_like(zeta)
        for n in range(DEFAULT.series_terms):
            powers[n] = (P * (now * s**n)) @ P.T
            before, now = now, -2 * zeta * now - before
        return np.setdiff1d(np.arange(self.shapes.shape[1]), np.flatnonzero(high)), powers

    def _of_poles(self, high):
        fast, P = 1 / self.receptance.poles[high], self.shapes[self._rows][:, np.flatnonzero(high)]
        powers, weight = [], -fast
        for _ in range(DEFAULT.series_terms):
            powers.append(((P * weight) @ P.T).real)
            weight = weight * fast
        return np.setdiff1d(np.arange(self.shapes.shape[1]), np.flatnonzero(high)), np.array(powers)


def real_times(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A @ B for complex B; a real A is not turned into a complex one."""
    if np.iscomplexobj(A) or not np.iscomplexobj(B):
        return A @ B
    B = np.ascontiguousarray(B)
    return np.ascontiguousarray(A @ B.view(float)).view(complex)
