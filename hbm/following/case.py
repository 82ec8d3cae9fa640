"""What is followed: the problem, the parameter, the outputs that are measured, and whole curves at
one value."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.amplitude import amplitude, amplitude_along, orders_of
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.outputs import ModalRows
from tipdamp.hbm.curve.watched import Progress
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.following.extremum import Slope
from tipdamp.hbm.following.start import folds, highest_peak
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.result import ForcedResponse

AROUND = 0.01  # of the frequency: band around a peak in which it is found again
WIDER = (1.0, 4.0)  # times that
SHARE = 1.0  # of that band, by which a unit step moves the frequency: the peak is solved anyway


class Extreme(NamedTuple):
    """A peak, or a fold, at one value of the parameter: x (n,) and w rad/s of the curve, whose
    output `column` has it."""

    x: np.ndarray
    w: float
    column: int


@dataclass(frozen=True)
class Case:
    """What is followed. rows (m, r) and names of all outputs, of which those of `columns` are
    measured, and the largest of them counts; progress - of `curve.watched`."""

    problem: ContactProblem
    forces: dict
    parameter: Parameter
    what: str
    names: list
    rows: np.ndarray
    columns: tuple[int, ...]
    kind: str
    band: tuple
    H: int
    start: str | np.ndarray | None
    samples: int | None
    settings: Settings
    progress: Progress | None = None

    @property
    def orders(self) -> list[int]:
        """That count in an amplitude."""
        return orders_of(self.kind, None, self.H, list(self.forces))

    @cached_property
    def modal(self) -> ModalRows:
        """Of all outputs."""
        return ModalRows(self.rows)

    @cached_property
    def damped(self) -> ContactProblem:
        """The problem with a matrix of damping in the place of ratios where the stuck modes change
        on the way, which the ratios would follow: the damping stays as it was given."""
        if not self.parameter.stiffens or self.problem.damping_ratio is None:
            return self.problem
        return replace(self.problem, C=self.problem.damping_matrix, damping_ratio=None)

    def inside(self, w: float) -> bool:
        """Whether w rad/s lies in the band."""
        return self.band[0] <= w / (2 * np.pi) <= self.band[1]

    def balance(self) -> HarmonicBalance:
        """Of the problem, at the value 1."""
        start = "zero_slider" if self.start is None else self.start
        return HarmonicBalance(self.problem, self.forces, self.H, start, self.samples)

    def heights(self, found: Linearisation) -> np.ndarray:
        """(m,) m, amplitudes of all outputs at a linearisation."""
        return amplitude(self.modal.of(found.balance) @ found.modal, self.kind, self.orders)

    def named(self, p: float) -> str:
        """A place of the branch for messages."""
        return self.parameter.named(p / self.parameter.scale)

    def curve(
        self,
        value: float,
        band: tuple | None = None,
        guess: tuple[float, np.ndarray] | None = None,
        settings: Settings | None = None,
    ) -> tuple[ForcedResponse, ContactProblem]:
        """(curve over the band, or over another one, its problem) at a value of the parameter."""
        problem, forces = self.parameter.rebuild(self.damped, self.forces, value)
        told = self.progress

        def alive(hz: float, step: float, calls: int) -> None:
            if told:
                told(value, 0.0, calls)

        curve = follow_band(
            problem,
            forces,
            self.band if band is None else band,
            outputs={self.names[j]: self.rows[j] for j in self.columns},
            settings=settings or self.settings,
            harmonics=self.H,
            samples=self.samples,
            truncation=False,
            start=self.start,
            guess=guess,
            progress=alive,
        )
        return curve, problem

    def slope(self, column: int) -> Slope:
        """Of the logarithm of what is extreme."""
        if self.what == "fold":
            return lambda found, tangent, length: tangent[1] / (found.w * length)
        modal = ModalRows(self.rows[[column]])
        orders = self.orders
        kind = self.kind

        def of_height(
            found: Linearisation, tangent: tuple[np.ndarray, float], length: float
        ) -> float:
            rows = modal.of(found.balance)
            X = rows @ found.modal
            change = rows @ (found.moved(*tangent).modal - found.modal)
            value, slope = amplitude_along(X, change, kind, orders)
            return float(slope[0] / (value[0] * length))

        return of_height

    def begin(self, value: float, near: float | None = None) -> Extreme | None:
        """The highest peak, or the fold nearest to `near` Hz, on the whole curve at a value."""
        if self.what == "peak":
            return self.highest_at(value)[0]
        curve = self.curve(value)[0]
        hz = self.band[0] if near is None else near
        found = min(folds(curve), key=lambda fold: abs(fold[1] - 2 * np.pi * hz), default=None)
        return None if found is None else Extreme(*found, self.columns[0])

    def highest_at(self, value: float) -> tuple[Extreme | None, str]:
        """(the highest peak of the whole curve at a value, why it has none in words)."""
        curve, problem = self.curve(value)
        top = self._highest(curve, problem)
        whole = curve.complete
        return top, "" if whole or top else f"the curve has no peak, it {curve.ended}"

    def again(self, top: Extreme, value: float) -> Extreme | None:
        """A peak at another value, on the piece of the curve around it: no derivative is asked
        for."""
        hz = top.w / (2 * np.pi)
        settings = replace(self.settings, parameter_share=SHARE)
        for wider in WIDER:
            side = AROUND * wider * hz
            try:
                around = self.curve(value, (hz - side, hz + side), (hz, top.x), settings)
            except InputError:  # no solution at that frequency beside it
                around = self.curve(value, (hz - side, hz + side), None, settings)
            found = self._highest(*around)
            if found is not None:
                return found
        return None

    def _highest(self, curve: ForcedResponse, problem: ContactProblem) -> Extreme | None:
        found = []
        for j in self.columns:
            top = highest_peak(curve, problem, self.names[j], self.kind)
            if top is not None:
                found.append((top[2], Extreme(top[0], top[1], j)))
        return max(found, key=lambda one: one[0], default=(0.0, None))[1]
