"""The outputs at the solved points of a branch: harmonics and amplitudes, and how they change along
the branch."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tipdamp.hbm.amplitude import KINDS, amplitude_along
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import DEFAULT


class ModalRows:
    """rows (m, r) of outputs as rows (m, modes) of the modes of a balance, made once a balance."""

    def __init__(self, rows: np.ndarray) -> None:
        self.rows = rows
        self._made = rows
        self._balance: HarmonicBalance | None = None

    def of(self, balance: HarmonicBalance) -> np.ndarray:
        """(m, modes) of a balance; those of the last one are kept."""
        if balance is not self._balance:
            self._made = self.rows @ balance.receptance.shapes
            self._balance = balance
        return self._made


class Outputs:
    """Outputs, rows (m, r), in one kind of amplitude; orders : that count in 'harmonic'. Made once
    for each point."""

    def __init__(self, rows: np.ndarray, kind: str = KINDS[0], orders: Sequence[int] = ()) -> None:
        self.rows = rows
        self.kind = kind
        self.orders = list(orders)
        self._modal_rows = ModalRows(rows)
        # X and its change along the tangent (2, m, H+1)
        self._known: dict[int, tuple[Point, np.ndarray]] = {}
        self._measured: dict[int, np.ndarray] = {}  # amplitude and its slope (2, m)

    def at(self, detail: Any) -> np.ndarray:
        """(m, H+1) complex, m, of a linearisation."""
        return real_times(self._modal_rows.of(detail.balance), detail.modal)

    def along(self, point: Point) -> np.ndarray:
        """(2, m, H+1) harmonics at a solved point and their change along its tangent, NaN where
        that is not known."""
        if id(point) not in self._known:
            X = self.at(point.detail)
            change = (
                np.full_like(X, np.nan)
                if point.tangent is None
                else self.at(point.detail.moved(*point.tangent)) - X
            )
            self._known[id(point)] = point, np.array([X, change])
        return self._known[id(point)][1]

    def harmonics(self, points: list[Point], H: int) -> np.ndarray:
        """(n, m, H+1) complex, m; NaN where a point failed."""
        X = np.full((len(points), len(self.rows), H + 1), np.nan, dtype=complex)
        for i, point in enumerate(points):
            if point.converged:
                X[i] = self.along(point)[0]
        return X

    def amplitudes(self, points: Sequence[Point]) -> np.ndarray:
        """(2, n, m) amplitudes and their slopes along the tangents, NaN where a point failed."""
        new = [point for point in points if point.converged and id(point) not in self._measured]
        if new:
            X = np.array([self.along(point) for point in new])
            found = amplitude_along(X[:, 0], X[:, 1], self.kind, self.orders)
            self._measured |= dict(zip(map(id, new), np.stack(found, axis=1), strict=True))
        table = np.full((len(points), 2, len(self.rows)), np.nan)
        for i, point in enumerate(points):
            if point.converged:
                table[i] = self._measured[id(point)]
        return table.transpose(1, 0, 2)

    def noise(self, points: list[Point]) -> np.ndarray:
        """(m,) amplitudes of the outputs that are rounding beside the motion of the whole model."""
        most = max(
            (p for p in points if p.converged), key=lambda p: np.linalg.norm(p.detail.modal[:, 1:])
        ).detail
        motion = real_times(most.balance.receptance.shapes, most.modal[:, 1:])
        return DEFAULT.peak_noise * np.linalg.norm(self.rows, axis=1) * np.linalg.norm(motion)
