"""From the stiffness of a whole side to the nodes of its patch, and one factor to meet a measured
frequency.

A node's weight is its part of the full patch. When others are detached it keeps its weight [Zucca,
Berruti & Cosi 2016, sec. 7.1: the stiffness is proportional to the number of active nodes] unless
the total is to be conserved.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness.elastic_constants import positive, require


def tributary_weights(axial: ArrayLike, across: ArrayLike | None = None) -> np.ndarray:
    """Weights (n,) by tributary area; node positions (n,) m along the axis, and across it where
    there are rows.

    Half the distance to each neighbour; end nodes reach to their own position only. Rows and
    stations must form a full grid. A single station or row takes the whole extent.
    """
    axial = np.asarray(axial, dtype=float)
    across = np.zeros_like(axial) if across is None else np.asarray(across, dtype=float)
    if axial.ndim != 1 or axial.size == 0 or across.shape != axial.shape:
        raise InputError(
            f"axial {axial.shape} and across {across.shape}: allowed are two arrays of one length "
            "(n,)"
        )
    require("axial", axial, -np.inf)
    require("across", across, -np.inf)
    station, row = _groups(axial), _groups(across)
    n_cells = (station[0].max() + 1) * (row[0].max() + 1)
    if (
        n_cells != axial.size
        or len(set(zip(*(g[0].tolist() for g in (station, row)), strict=True))) != n_cells
    ):
        raise InputError(
            f"{axial.size} nodes on {station[0].max() + 1} stations and {row[0].max() + 1} rows: "
            "tributary areas need every row at every station"
        )
    return station[1][station[0]] * row[1][row[0]]


def nodal_values(
    total: float, weights: ArrayLike, active: ArrayLike | None = None, conserve: bool = False
) -> np.ndarray:
    """Stiffness of each node (n,), N/m: total times weight, 0 where not `active` (n,) bool.

    conserve=False: active nodes keep their weight in the full patch; True: they take over the whole
    total.
    """
    weights = np.asarray(require("weights", weights, 0), dtype=float)
    if abs(weights.sum() - 1) > 1e-9:
        raise InputError(f"weights add up to {weights.sum():.12g}: allowed is 1, the full patch")
    active = np.ones(weights.size, dtype=bool) if active is None else np.asarray(active)
    if active.dtype != bool or active.shape != weights.shape:
        raise InputError(
            f"active is {active.dtype} {active.shape}: allowed is bool {weights.shape}"
        )
    if conserve and not weights[active].sum() > 0:
        raise InputError("active selects no weight: nothing can carry a conserved total")
    values = np.where(active, total * weights, 0.0)
    return values / weights[active].sum() if conserve else values


def calibrate_scale(
    frequency: Callable, target: float, low: float = 1e-3, high: float = 1e3
) -> float:
    """The factor on all contact stiffness for which `frequency(scale)` (Hz, rising) meets `target`
    (Hz) to 1e-10."""
    positive("target", target, "Hz")
    positive("low", low)
    require("high", high, low, open_low=True)
    bottom, top = frequency(low), frequency(high)
    if not bottom <= target <= top:
        raise InputError(
            f"target = {target:g} Hz is not reachable: {bottom:.6g}..{top:.6g} Hz "
            f"for scale {low:g}..{high:g}"
        )
    log = brentq(
        lambda u: frequency(np.exp(u)) / target - 1,
        np.log(low),
        np.log(high),
        xtol=1e-13,
        rtol=1e-13,
    )
    return float(np.exp(log))


def _groups(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index (n,) of each position among the distinct ones, and the weight of each distinct one."""
    extent = np.ptp(positions)
    order = np.argsort(positions, kind="stable")
    steps = (
        np.diff(positions[order]) > 1e-6 * extent
        if extent > 0
        else np.zeros(positions.size - 1, dtype=bool)
    )
    index = np.empty(positions.size, dtype=int)
    index[order] = np.concatenate([[0], np.cumsum(steps)])
    distinct = np.bincount(index, positions) / np.bincount(index)
    if distinct.size == 1:
        return index, np.ones(1)
    edges = np.concatenate([distinct[:1], (distinct[1:] + distinct[:-1]) / 2, distinct[-1:]])
    return index, np.diff(edges) / extent
