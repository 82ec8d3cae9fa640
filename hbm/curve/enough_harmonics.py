"""As many harmonics as a tolerance needs: a curve with few of them, then the points that miss the
tolerance most with more and more, and a curve with as many as these need."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tipdamp.hbm.errors import Doubt
from tipdamp.hbm.result import ForcedResponse

AUTO: Literal["auto"] = "auto"
Harmonics: TypeAlias = int | Literal["auto"]


@dataclass(frozen=True)
class HarmonicsSettings:
    """How the number of harmonics is found."""

    first: int = 3  # of it, or twice the highest order of the force
    most: int = 45  # stiff stops may want more than can be told apart from rounding
    points: float = 0.99  # share of the points that meet the tolerance
    # error ~ H^-p before two curves tell p [friction 3 to 4, stops 2.5: docs/validation.md]
    falls: float = 3.0
    slowest: float = 1.0  # p that is counted with, where errors fall less
    growth: float = 3.0  # of H at once
    probed: int = 6  # points that are solved with more orders ...
    aim: float = 0.5  # ... of the tolerance at these, for others may need more
    calls: int = 40  # of Newton for one of these; where it converges it takes ten to twenty
    step: float = 1.25  # of H: least growth from one whole curve to the next
    closer: float = 0.25  # of H: how near it comes to the largest number that is too small


SETTINGS = HarmonicsSettings()


class Probe(NamedTuple):
    """A point of a curve: value of the parameter, (n,) unknowns of as many or fewer orders as it is
    solved with."""

    value: float
    unknowns: np.ndarray


class Probed(NamedTuple):
    """A point solved again: the point, and its relative truncation."""

    probe: Probe
    error: float


Probing: TypeAlias = Callable[[int, Sequence[Probe]], list[Probed]]
"""Solves points with H orders; those that have no solution there are left out."""


def enough_harmonics(
    curve_of: Callable[[int], ForcedResponse],
    probing: Probing,
    tolerance: float,
    force_order: int,
) -> ForcedResponse:
    """The first curve whose estimated truncation is within the tolerance, relative to the vibration
    of each point, at 99 % of the points; curve_of(H) : makes one.

    Warns where none is, with the numbers of harmonics that were tried; the last one that is
    complete is returned. A first curve that stops is returned as it is.
    """
    complete: ForcedResponse | None = None
    tried: list[tuple[int, float]] = []
    further: int | None = first_orders(force_order)
    while further is not None:
        curve = curve_of(further)
        tried.append((further, error_of(curve)))
        if not curve.complete:
            break
        complete = curve
        if tried[-1][1] <= tolerance:
            return curve
        further = orders_by_points(curve, tolerance, probing)
    if complete is None:
        return curve
    cut = "" if curve.complete else f"; the curve with H = {curve.H} is incomplete"
    warnings.warn(f"harmonics = 'auto': {not_met(tried, tolerance)}{cut}", Doubt, stacklevel=4)
    return complete


def orders_by_points(curve: ForcedResponse, tolerance: float, probing: Probing) -> int | None:
    """H with which the points of a complete curve that miss the tolerance most meet it; the most
    that are tried where none does, None where the curve has as many."""
    probes = _worst(curve, tolerance)
    missed = curve.H
    aim = SETTINGS.aim * tolerance
    tried = [(curve.H, error_of(curve))]
    while (H := next_orders(tried, aim)) is not None:
        found = probing(H, probes)
        error = max((one.error for one in found), default=0.0)
        if error <= aim:
            break
        probes = [one.probe for one in found]
        missed = H
        tried.append((H, error))
    if H is None:
        return SETTINGS.most if curve.H < SETTINGS.most else None
    while found and H - missed > max(2, SETTINGS.closer * H):
        middle = (H + missed) // 2 | 1
        found = probing(middle, probes)
        if max((one.error for one in found), default=np.inf) <= aim:
            H = middle
        else:
            missed = middle
    return min(max(H, int(np.ceil(SETTINGS.step * curve.H)) | 1), SETTINGS.most)


def _worst(curve: ForcedResponse, tolerance: float) -> list[Probe]:
    """Points of the upper half of those that miss the tolerance, from the wanted share on."""
    errors = np.where(curve.converged, curve.relative_truncation, 0.0)
    order = np.argsort(errors, kind="stable")
    missing = np.count_nonzero(errors > tolerance)
    last = int(np.ceil(SETTINGS.points * len(order))) - 1
    first = max(last - missing // 2, 0)
    at = np.unique(np.linspace(first, last, SETTINGS.probed).astype(int))
    return [Probe(float(curve.parameter[i]), curve.unknowns[i]) for i in order[at]]


def not_met(tried: Sequence[tuple[int, float]], tolerance: float, where: str = "") -> str:
    """What was tried, and what helps."""
    said = ", ".join(f"{error:.1e} with H = {orders}" for orders, error in tried)
    return (
        f"the tolerance {tolerance:g} is not met{where}, the estimated error is {said}; accept a "
        "larger tolerance, or smooth the contact"
    )


def error_of(curve: ForcedResponse) -> float:
    """Relative truncation that the wanted share of the points keeps."""
    errors = np.sort(curve.relative_truncation[curve.converged])
    if not len(errors):
        return np.inf
    return float(errors[min(int(np.ceil(SETTINGS.points * len(errors))), len(errors)) - 1])


def first_orders(force_order: int = 1) -> int:
    """H to begin with."""
    return max(SETTINGS.first, 2 * force_order)


def next_orders(tried: Sequence[tuple[int, float]], tolerance: float) -> int | None:
    """H to try after those that miss the tolerance, (H, error) each: at which errors that fall like
    a power of H reach it, an odd number; None where no more are tried."""
    H, error = tried[-1]
    falls = SETTINGS.falls
    if H >= SETTINGS.most:
        return None
    if len(tried) > 1:
        before, larger = tried[-2]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.log(larger / error) / np.log(H / before)
        # errors above a tenth are none to tell a slope by, and fall fast at first
        falls = float(np.clip(slope, SETTINGS.slowest, falls)) if np.isfinite(slope) else falls
    growth = min((error / tolerance) ** (1 / falls), SETTINGS.growth)
    # an odd number: where motion and forces are odd, the even orders are zero
    return min(max(H + 1, int(np.ceil(growth * H))) | 1, SETTINGS.most)
