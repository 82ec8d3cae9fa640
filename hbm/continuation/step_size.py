"""The step-size rule: predictor order and arc length of the next step, from the errors of the last
prediction."""

import numpy as np

from tipdamp.hbm.continuation.settings import Settings


def next_step(
    step: float, errors: np.ndarray, iterations: int, shortened: bool, settings: Settings
) -> tuple[int, float]:
    """(order, arc length) of the step after an accepted point: those whose predicted error equals
    the target.

    step : that led to the point; errors : of the predictions of order 1, 2, ... of the point;
    iterations : of its corrector; shortened : whether a longer step had failed before
    """
    order = 1 + int(np.argmin(errors * 1.5 ** np.arange(len(errors))))
    error = max(errors[order - 1], 1e-12)
    growth = min(max((settings.aim / error) ** (1 / (order + 1)), 0.5), 1.8)
    if iterations > 4:
        growth = min(growth, 0.6)
    elif shortened:
        growth = min(growth, 1.0)  # what stopped the longer step still lies ahead
    return order, min(step * growth, settings.largest_step)


def shorter_step(step: float, order: int) -> tuple[int, float]:
    """(order, arc length) of the step after one that failed."""
    return min(order, 1 if step < 1e-2 else 2), 0.4 * step
