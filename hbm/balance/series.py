"""The receptance between the contacts: low modes one by one, the modes far above the harmonics by a
power series."""

from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.receptance import Receptance
from tipdamp.hbm.balance.settings import DEFAULT

TINY = float(np.finfo(float).tiny)


class ContactReceptance:
    """Receptance between the components of the relative motion, for any frequency and number of
    harmonics.

    shapes, into : (nc, m), the modes of `receptance` at the components, and its left modes there
    """

    def __init__(
        self, receptance: Receptance, shapes: np.ndarray, into: np.ndarray | None = None
    ) -> None:
        self.receptance = receptance
        self.shapes = shapes
        self.into = shapes if into is None else into
        few = len(shapes) <= DEFAULT.few_components
        # that the series is known for
        self._rows = np.arange(len(shapes)) if few else np.empty(0, dtype=int)
        self._kept: dict[float, tuple] = {}  # by reach: low modes, matrices
        # low modes and weights of `between`, by components and reach
        self._between: dict[tuple, tuple] = {}
        self._many: dict[tuple, tuple] = {}  # the same of many components, without the weights
        self._acting: dict[bytes, np.ndarray] = {}  # by components: their rows of the shapes
        # border of a system, and the modal forces that it stands for
        self._border: tuple = (None, None)

    def into_of(self, at: np.ndarray) -> np.ndarray:
        """(len(at), m) left modes at components, by which forces there act on the modes."""
        return self.rows_of(at) if self.into is self.shapes else self.into[at]

    def rows_of(self, at: np.ndarray) -> np.ndarray:
        """(len(at), m) shapes at components; from one point to the next they are the same, and a
        few are kept."""
        if (key := at.tobytes()) not in self._acting:
            if len(self._acting) > DEFAULT.few_rows:
                self._acting.clear()
            self._acting[key] = self.shapes[at]
        return self._acting[key]

    def excited_by(self, row: np.ndarray) -> np.ndarray:
        """(m, H+1) modal forces conjugate to the border row (nc nh,) of a system; known for the
        last one."""
        if self._border[0] is not row:
            harmonics = fourier.to_complex(row.reshape(len(self.shapes), -1)).conj()
            self._border = row, real_times(self.shapes.T, harmonics)
        return self._border[1]

    def between(
        self,
        to: np.ndarray,
        at: np.ndarray,
        factors: np.ndarray,
        w: float,
        orders: np.ndarray | None = None,
    ) -> np.ndarray:
        """(len(to), len(at), k) complex between components, at k orders of w, None for 0..H;
        factors (m, k) : of the modes there.

        From one point of a branch to the next the same contacts act: what does not depend on w is
        kept.
        """
        orders = np.arange(factors.shape[1]) if orders is None else orders
        if not len(to) or not len(at):
            return np.zeros((len(to), len(at), len(orders)), dtype=complex)
        highest = orders[-1]
        # a power of two, whatever came before: a curve that is continued later has the same series
        reach = 2.0 ** np.ceil(np.log2(max(abs(w) * max(highest, 1), TINY)))
        x = (1j * w * orders) ** np.arange(DEFAULT.series_terms)[:, None]
        if len(to) * len(at) > DEFAULT.few_between:
            return self._between_many(to, at, factors, reach, x)
        asked = to.tobytes(), at.tobytes(), reach
        if asked not in self._between:
            if len(self._between) > DEFAULT.few_reaches:
                self._between.clear()
            low, powers = self.terms(reach, np.union1d(to, at))
            self._between[asked] = low, self._weights(to, at, low, powers)
        low, weights = self._between[asked]
        own = factors[low]
        terms = np.concatenate([own, x]) if weights.shape[1] > len(own) else own
        return real_times(weights, terms).reshape(len(to), len(at), len(orders))

    def _weights(
        self, to: np.ndarray, at: np.ndarray, low: slice | np.ndarray, powers: np.ndarray | None
    ) -> np.ndarray:
        """(len(to) len(at), low modes and terms of the series): products of shapes, and entries of
        the matrices."""
        left, right = self.shapes[to][:, low], self.into[at][:, low]
        products = (left[:, None] * right).reshape(len(to) * len(at), -1)
        return products if powers is None else np.hstack([products, self._chosen(powers, to, at).T])

    def _chosen(self, powers: np.ndarray, to: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(n, len(to) len(at)) of the matrices of `terms`, between some of their components."""
        here = np.searchsorted(self._rows, to)[:, None], np.searchsorted(self._rows, at)
        return powers[:, here[0], here[1]].reshape(len(powers), -1)

    def _between_many(
        self, to: np.ndarray, at: np.ndarray, factors: np.ndarray, reach: float, x: np.ndarray
    ) -> np.ndarray:
        """As `between`, order by order: products of the shapes would fill the memory; x (n, k) :
        powers of the frequencies."""
        low, powers = self._terms_between(to, at, reach)
        left, right = self.rows_of(to)[:, low], self.into_of(at)[:, low].T
        own = factors[low].T
        parts = np.concatenate([own.real, own.imag])
        each = (left * parts[:, None]).reshape(len(parts) * len(to), left.shape[1])
        found = (each @ right).reshape(len(parts), len(to), len(at))
        if powers is not None:
            further = np.concatenate([x.real, x.imag], axis=1).T
            found += (further @ powers).reshape(found.shape)
        half = len(own)
        return np.moveaxis(found[:half] + 1j * found[half:], 0, 2)

    def _terms_between(
        self, to: np.ndarray, at: np.ndarray, reach: float
    ) -> tuple[slice | np.ndarray, np.ndarray | None]:
        """As `terms`, with the matrices (n, len(to) len(at)) of these components alone; known for
        the last ones."""
        asked = to.tobytes(), at.tobytes(), reach
        if asked in self._many:
            return self._many[asked]
        low, powers = self.terms(reach, np.union1d(to, at))
        if powers is None:
            return low, None
        chosen = self._chosen(powers, to, at)
        self._forget_down_to(DEFAULT.kept_between - chosen.size)
        self._many[asked] = low, chosen
        return low, chosen

    def _forget_down_to(self, entries: int) -> None:
        """Drop the matrices that were asked for first, until so many entries are left."""
        sizes = {asked: powers.size for asked, (_, powers) in self._many.items()}
        for asked in list(sizes):
            if sum(sizes.values()) <= entries:
                return
            del self._many[asked], sizes[asked]

    def terms(self, reach: float, rows: np.ndarray) -> tuple:
        """Indices of the modes to sum one by one, and the matrices S_n of sum_n (i k w)^n S_n for
        the others, between components that have been asked for so far, `rows` among them; reach :
        rad/s up to which these hold.

        1/(1 + x^2 + 2 zeta x) = sum U_n(-zeta) x^n with x = i k w/w_r (generating function of
        Chebyshev's U_n), and 1/(i k w - s) = -sum (i k w)^n / s^(n + 1) for poles, which come in
        conjugate pairs.
        """
        r = self.receptance
        if r.shapes.shape[1] < DEFAULT.few_modes or r.still:
            return slice(None), None
        if not np.isin(rows, self._rows).all():
            self._rows = np.union1d(self._rows, rows)
            self._kept = {}
        if reach not in self._kept:
            above = reach * DEFAULT.series_reach
            if r.poles.size:
                high = np.abs(r.poles) > above
                of = self._of_poles
            else:
                high = (np.sqrt(r.mass) * above < 1) & (r.ratio < 0.3)
                of = self._of_modes
            far = np.flatnonzero(high)
            self._kept[reach] = np.setdiff1d(np.arange(self.shapes.shape[1]), far), of(far)
        return self._kept[reach]

    def _of_modes(self, high: np.ndarray) -> np.ndarray:
        P = self.shapes[self._rows][:, high]
        zeta = self.receptance.ratio[high]
        s = np.sqrt(self.receptance.mass[high])
        powers = np.empty((DEFAULT.series_terms, len(P), len(P)))
        before, now = np.zeros_like(zeta), np.ones_like(zeta)
        for n in range(DEFAULT.series_terms):
            powers[n] = (P * (now * s**n)) @ P.T
            before, now = now, -2 * zeta * now - before
        return powers

    def _of_poles(self, high: np.ndarray) -> np.ndarray:
        fast = 1 / self.receptance.poles[high]
        P, Q = (part[self._rows][:, high] for part in (self.shapes, self.into))
        powers = []
        weight = -fast
        for _ in range(DEFAULT.series_terms):
            powers.append(((P * weight) @ Q.T).real)
            weight = weight * fast
        return np.array(powers)


def contact_receptance(receptance: Receptance, B: Any) -> ContactReceptance:
    """Of the relative motion B (nc, r), dense or sparse."""
    into = np.ascontiguousarray(B @ receptance.left) if receptance.left.size else None
    return ContactReceptance(receptance, np.ascontiguousarray(B @ receptance.shapes), into)


def real_times(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A @ B for complex B; a real A is not turned into a complex one."""
    if A.dtype.kind == "c" or B.dtype.kind != "c":
        return A @ B
    if not B.flags.c_contiguous:
        B = np.ascontiguousarray(B)
    found = A @ B.view(float)
    return (found if found.flags.c_contiguous else np.ascontiguousarray(found)).view(complex)
