"""As many harmonics as a tolerance needs: curves with more and more, by the estimates of their
truncation."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

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


SETTINGS = HarmonicsSettings()


def enough_harmonics(
    curve_of: Callable[[int], ForcedResponse], tolerance: float, force_order: int
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
        further = next_orders(tried, tolerance)
    if complete is None:
        return curve
    cut = "" if curve.complete else f"; the curve with H = {curve.H} is incomplete"
    warnings.warn(f"harmonics = 'auto': {not_met(tried, tolerance)}{cut}", Doubt, stacklevel=4)
    return complete


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
    (H, error), falls = tried[-1], SETTINGS.falls
    if H >= SETTINGS.most:
        return None
    if len(tried) > 1:
        before, larger = tried[-2]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.log(larger / error) / np.log(H / before)
        falls = max(float(slope), SETTINGS.slowest) if np.isfinite(slope) else falls
    growth = min((error / tolerance) ** (1 / falls), SETTINGS.growth)
    # an odd number: where motion and forces are odd, the even orders are zero
    return min(max(H + 1, int(np.ceil(growth * H))) | 1, SETTINGS.most)
