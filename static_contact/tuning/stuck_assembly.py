"""Stuck modes of one reduced model for any set of contact pairs."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.ties import REPEATED, first_largest, turned

MODES = 20  # computed at first; doubled until what is asked for is among them
ENOUGH = 0.9  # of the followed shape must lie in the modes that were computed


@dataclass(frozen=True)
class StuckModes:
    """hz : (m,) ascending; shapes : (r, m) mass-normalised; tracked - index of the followed mode
    mac - energy-weighted MAC of that mode and the followed shape, (follow' M phi)^2 over the whole
    assembly, 0..1"""

    hz: np.ndarray
    shapes: np.ndarray
    tracked: int
    mac: float

    @property
    def tracked_hz(self) -> float:
        """Frequency of the followed mode, Hz."""
        return float(self.hz[self.tracked])


class StuckAssembly:
    """Stuck modes of one model for many sets of pairs: M is factored once.

    motion(model, pairs) -> (3P, r) relative motion at the pairs, rows t1, t2, n of each in turn;
    another one than that of nodal dofs where the pairs do not act on these.

    >>> model, pairs = two_blades()
    >>> mode = model.displacement_row("blade1", 1, [0, 1, 0])
    >>> mode /= np.sqrt(mode @ model.M @ mode)  # the free blade along y
    >>> print(f"{StuckAssembly(model).modes(pairs, mode).tracked_hz:.0f} Hz")
    1377 Hz
    """

    def __init__(self, model: ReducedModel, motion: Callable | None = None) -> None:
        self.model, self.motion = model, motion or nodal_motion
        try:
            self.L = np.linalg.cholesky(model.M)
        except np.linalg.LinAlgError:
            raise InputError(
                "the mass matrix is not positive definite: condense massless dofs first"
            ) from None
        half = sl.solve_triangular(self.L, model.K, lower=True)
        self.K = sl.solve_triangular(self.L, half.T, lower=True)

    def modes(
        self,
        pairs: ContactTable,
        follow: np.ndarray,
        *,
        above_hz: float = 0.0,
        extra: np.ndarray | None = None,
    ) -> StuckModes:
        """Lowest modes with every carrying pair stuck (kt, kt, kn).

        follow (r,): mass-normalised shape; the mode of the highest MAC with it, (follow' M phi)^2,
        is the tracked one. Modes of one frequency count as one: the shapes are such that one of
        them has all of the followed shape. For a shape without damper this is the MAC of the blades
        times their part of the kinetic energy.
        extra : (m, r) rows e with springs e'e added to K (declared roll springs), or None.
        As many modes are computed as reach above_hz and hold most of the followed shape.
        """
        K, count = self._stiffness(pairs, extra), MODES
        while True:
            count = min(count, len(K))
            lam, y = sl.eigh(K, subset_by_index=(0, count - 1))
            shapes = sl.solve_triangular(self.L.T, y, lower=False)
            hz = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
            shapes = turned(hz, shapes, follow @ self.model.M)
            mac = (follow @ self.model.M @ shapes) ** 2
            if count == len(K) or (hz[-1] > above_hz and mac.sum() > ENOUGH):
                best = first_largest(mac, REPEATED.alike)
                return StuckModes(hz, shapes, best, float(mac[best]))
            count *= 2

    def _stiffness(self, pairs: ContactTable, extra: np.ndarray | None) -> np.ndarray:
        """(r, r) of mass-normalised coordinates, with the springs of `modes`."""
        K = self.K
        rows = np.sqrt(stuck_springs(pairs).ravel())[:, None] * self.motion(self.model, pairs)
        rows = rows[np.repeat(pairs.carrying, 3)]
        if extra is not None:
            rows = np.vstack([rows, extra])
        if len(rows) > len(K):
            half = sl.solve_triangular(self.L, rows.T @ rows, lower=True)
            K = K + sl.solve_triangular(self.L, half.T, lower=True)
        elif len(rows):
            half = sl.solve_triangular(self.L, rows.T, lower=True)
            K = K + half @ half.T
        return (K + K.T) / 2


def nodal_motion(model: ReducedModel, pairs: ContactTable) -> np.ndarray:
    """(3P, r) relative motion of pairs of nodes."""
    return relative_motion(model, pairs).toarray()


def stuck_springs(pairs: ContactTable) -> np.ndarray:
    """(P, 3) N/m: kt, kt, kn of the pairs times their weight."""
    return np.column_stack([pairs.kt, pairs.kt, pairs.kn]) * pairs.weight[:, None]


def stuck_rows(model: ReducedModel, pairs: ContactTable) -> np.ndarray:
    """(3P, r) rows b of the carrying pairs with b'b summing to the stuck stiffness B' diag(kt, kt,
    kn) B."""
    pairs = pairs.select(pairs.carrying)
    return np.sqrt(stuck_springs(pairs).ravel())[:, None] * nodal_motion(model, pairs)
