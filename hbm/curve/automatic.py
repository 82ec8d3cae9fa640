"""As many harmonics as a tolerance needs: curves with more and more, by the estimates of their
truncation."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from tipdamp.hbm.result import ForcedResponse

AUTO: Literal["auto"] = "auto"
Harmonics: TypeAlias = int | Literal["auto"]


@dataclass(frozen=True)
class AutomaticSettings:
    """How the number of harmonics is found."""

    first: int = 3  # of it, or twice the highest order of the force
    most: int = 45  # stiff stops may want more than can be told apart from rounding
    points: float = 0.99  # share of the points that meet the tolerance
    # error ~ H^-p before two curves tell p [friction 3 to 4, stops 2.5: docs/validation.md]
    falls: float = 3.0
    slowest: float = 1.0  # p that is counted with, where errors fall less
    growth: float = 3.0  # of H at once


SETTINGS = AutomaticSettings()


def enough_harmonics(
    curve_of: Callable[[int], ForcedResponse],
    tolerance: float,
    force_order: int,
    settings: AutomaticSettings = SETTINGS,
) -> ForcedResponse:
    """The first curve whose estimated truncation is within the tolerance, relative to the vibration
    of each point, at 99 % of the points; curve_of(H) : makes one.

    Warns where none is, with the numbers of harmonics that were tried; the last one is returned. A
    curve that stops is returned as it is.
    """
    tried: list[tuple[int, float]] = []
    H = max(settings.first, 2 * force_order)
    while True:
        curve = curve_of(H)
        tried.append((H, error_of(curve, settings)))
        if not curve.complete or tried[-1][1] <= tolerance:
            return curve
        if H >= settings.most:
            said = ", ".join(f"{error:.1e} with H = {orders}" for orders, error in tried)
            warnings.warn(
                f"harmonics = 'auto': the tolerance {tolerance:g} is not met, the estimated error "
                f"is {said}; accept a larger tolerance, or smooth the contact",
                stacklevel=4,
            )
            return curve
        H = min(next_orders(tried, tolerance, settings), settings.most)


def error_of(curve: ForcedResponse, settings: AutomaticSettings = SETTINGS) -> float:
    """Relative truncation that the wanted share of the points keeps."""
    errors = np.sort(curve.relative_truncation[curve.converged])
    if not len(errors):
        return np.inf
    return float(errors[min(int(np.ceil(settings.points * len(errors))), len(errors)) - 1])


def next_orders(
    tried: list[tuple[int, float]], tolerance: float, settings: AutomaticSettings = SETTINGS
) -> int:
    """H at which errors that fall like a power of H reach the tolerance."""
    (H, error), falls = tried[-1], settings.falls
    if len(tried) > 1:
        before, larger = tried[-2]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.log(larger / error) / np.log(H / before)
        falls = max(float(slope), settings.slowest) if np.isfinite(slope) else falls
    growth = min((error / tolerance) ** (1 / falls), settings.growth)
    return max(H + 1, int(np.ceil(growth * H)))
