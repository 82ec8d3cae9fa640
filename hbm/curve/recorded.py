"""The harmonic balance with a journal: its costly steps are taken from there, as far as it
reaches."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.residual import Derivative, HarmonicBalance, by_frequency
from tipdamp.hbm.curve.journal import Journal
from tipdamp.hbm.laws.records import Contacts

# marks of the steps; those of evaluations are negative
SOLVE, DIRECTION, MOVED, RESTORING, FURTHER = range(5)


class RecordedBalance(HarmonicBalance):
    """A HarmonicBalance whose linearisations go through a journal; arguments : of
    HarmonicBalance."""

    def __init__(self, journal: Journal, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.journal = journal

    def evaluate(
        self,
        x: np.ndarray,
        w: float,
        level: float = 1.0,
        contacts: Contacts | None = None,
        derivative: Derivative = by_frequency,
    ) -> Any:
        """As that of HarmonicBalance."""
        if self.on_call:
            self.on_call()
        real = Once(partial(self._uncounted, x, w, level, contacts, derivative))
        mark = -1 - crc32(np.r_[x, w, level].tobytes())
        residual, cover = self.journal.result(mark, lambda: (real().residual, real().balance.cover))
        return Recorded(self.covering(cover), x, residual, real)

    def _uncounted(self, *arguments: Any) -> Linearisation:
        on_call, self.on_call = self.on_call, None
        try:
            return super().evaluate(*arguments)
        finally:
            self.on_call = on_call


class Once:
    """A linearisation that is made when it is first asked for."""

    def __init__(self, make: Callable[[], Linearisation]) -> None:
        self.make = make
        self.made = list[Linearisation]()

    def __call__(self) -> Linearisation:
        if not self.made:
            self.made.append(self.make())
        return self.made[0]


class KeptForces(NamedTuple):
    """What a curve needs of the contact forces of a point: see
    `tipdamp.hbm.laws.records.ContactForces`."""

    g: np.ndarray
    shares: np.ndarray


class Recorded:
    """A Linearisation of which only what is asked for, and not in the journal, is computed."""

    def __init__(
        self, balance: RecordedBalance, x: np.ndarray, residual: np.ndarray, real: Once
    ) -> None:
        self.balance = balance
        self.x = x
        self.residual = residual
        self.real = real
        self.known: tuple = ()  # modal, forces
        self.border: tuple = ()  # row and corner of the last system for a direction

    @property
    def modal(self) -> np.ndarray:
        """As that of Linearisation."""
        return self.known[0] if self.known else self.real().modal

    @property
    def forces(self) -> Any:
        """As that of Linearisation, or of them what is kept."""
        return self.known[1] if self.known else self.real().forces

    def solve(
        self, row: np.ndarray, corner: float, value: float, residual: np.ndarray | None = None
    ) -> tuple[np.ndarray, float]:
        """As that of Linearisation."""
        (step,) = self._result(
            SOLVE, lambda: (np.r_[self.real().solve(row, corner, value, residual)],)
        )
        return step[:-1], step[-1]

    def direction(self, row: np.ndarray, corner: float) -> tuple[np.ndarray, float, float]:
        """As that of Linearisation."""
        self.border = row, corner
        step, *kept = self._result(
            DIRECTION,
            lambda: (
                np.r_[self.real().direction(row, corner)],
                *(() if self.known else _kept(self.real())),
            ),
        )
        self._keep(*kept)  # asked for at every point of a branch
        return step[:-2], step[-2], step[-1]

    def moved(self, dx: np.ndarray, dp: float) -> "Recorded":
        """As that of Linearisation."""
        real = Once(lambda: self.real().moved(dx, dp))
        found = Recorded(self.balance, self.x + dx, self.residual, real)
        found._keep(*self._result(MOVED, lambda: _kept(real())))
        return found

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """As that of Linearisation."""
        return self._result(RESTORING, lambda: (self.real().restoring(away),))[0]

    def further(self, compute: Callable[[Linearisation], np.ndarray]) -> np.ndarray:
        """As that of Linearisation."""
        return self._result(FURTHER, lambda: (compute(self._factorised()),))[0]

    def forget(self) -> None:
        """As that of Linearisation."""
        for made in self.real.made:
            made.forget()

    def displacement(self) -> np.ndarray:
        """As that of Linearisation."""
        return self.real().displacement()

    def outputs(self, rows: np.ndarray) -> np.ndarray:
        """As that of Linearisation."""
        return self.real().outputs(rows)

    def contact_force(self, rest: np.ndarray) -> np.ndarray:
        """As that of Linearisation."""
        return self.real().contact_force(rest)

    def smallest_motion(self) -> tuple[float, np.ndarray | None]:
        """As that of Linearisation."""
        return self.real().smallest_motion()

    def _factorised(self) -> Linearisation:
        """The real one with the system of its direction factorised, as it is without a journal."""
        real = self.real()
        if self.border and not real.border:
            real.direction(*self.border)
        return real

    def _keep(self, modal: np.ndarray | None = None, *forces: np.ndarray) -> None:
        if modal is not None:
            self.known = modal, KeptForces(*forces)

    def _result(self, mark: int, compute: Callable) -> tuple[np.ndarray, ...]:
        return self.balance.journal.result(mark, compute)


def _kept(real: Linearisation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return real.modal, real.forces.g, real.forces.shares
