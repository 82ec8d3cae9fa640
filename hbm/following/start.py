"""Where following begins: the highest peak, or a fold, of a whole curve at one value."""

import numpy as np

from tipdamp.hbm.amplitude import KINDS, local_maxima, orders_of
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.peaks import Output, beside
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.result import ForcedResponse


def highest_peak(
    curve: ForcedResponse, problem: ContactProblem, name: str, kind: str
) -> tuple[np.ndarray, float, float] | None:
    """(x (n,), rad/s, amplitude) of the highest maximum of an output inside the band; None where
    there is none."""
    j = curve.column(name)
    heights = curve.amplitude(kind)[:, j]
    maxima = local_maxima(heights, curve.jumps)
    if not maxima:
        return None
    i = max(maxima, key=lambda k: heights[k])
    x, hz = curve.unknowns[i], curve.frequency[i]
    if kind == KINDS[0] and curve.peak_points.size and curve.peak_points[i, j]:
        return x, 2 * np.pi * hz, float(heights[i])
    equation, points = restored(curve, problem)
    orders = orders_of(kind, None, curve.H, curve.force_orders)
    outputs = Outputs(curve.output_rows[[j]], kind, orders)
    output = Output(equation, Branch(points), outputs, DEFAULT)
    top = output.largest(0, heights, beside(heights, i), points)[0]
    return top.point.x, top.point.parameter, top.value


def folds(curve: ForcedResponse) -> list[tuple[np.ndarray, float]]:
    """[(x (n,), rad/s)] of the points at which a curve turns back, in their order."""
    f = curve.frequency
    good = curve.converged & ~curve.jumps
    return [
        (curve.unknowns[i], 2 * np.pi * f[i])
        for i in range(1, len(f) - 1)
        if good[i - 1 : i + 2].all() and (f[i] - f[i - 1]) * (f[i + 1] - f[i]) < 0
    ]
