"""Nodal forces of the pull Fc on the damper: at the load points, or at positions along the line
through them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.ties import in_order
from tipdamp.modal.mesh import Mesh


def pull_forces(
    mesh: Mesh,
    group: str,
    axis: ArrayLike,
    direction: ArrayLike,
    *,
    weights: Sequence[float] = (),
    positions: Sequence[float] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers (n,) and forces (n, 3) N of a pull of 1 N.

    axis, direction (3,); weights : part of each load point, ordered along the axis; default equal
    positions : 0..1 along the damper; each takes an equal part (or its own of `weights`) on the
    mesh nodes beside it on the line through the load points. Raises InputError when weights do not
    match or do not add to 1.
    """
    along = np.asarray(axis, float) / np.linalg.norm(axis)
    points = mesh.group(group)
    points = points[in_order(mesh.position[mesh.index(points)] @ along)]
    count = len(positions) or len(points)
    parts = np.asarray(weights if len(weights) else np.full(count, 1 / count), dtype=float)
    if len(parts) != count or abs(parts.sum() - 1) > 1e-9:
        raise InputError(
            f"[damper] shares = {parts.tolist()}: {count} numbers that add to 1 are needed"
        )
    if len(positions):
        points, parts = _on_line(mesh, points, along, np.asarray(positions, float), parts)
    return points, parts[:, None] * np.asarray(direction, float)


def _on_line(
    mesh: Mesh, points: np.ndarray, axis: np.ndarray, positions: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lever rule between the two nodes beside each position, on the line through the load
    points."""
    line = _line_of_nodes(mesh, points, axis)
    along = mesh.position[line] @ axis
    low, high = (mesh.position @ axis).min(), (mesh.position @ axis).max()
    found = np.zeros(len(line))
    for place, weight in zip(low + positions * (high - low), weights, strict=True):
        if not along[0] - 1e-9 <= place <= along[-1] + 1e-9:
            raise InputError(
                f"[damper] positions: {place:.4g} m lies off the line of nodes through the load "
                "points"
            )
        k = int(np.clip(np.searchsorted(along, place) - 1, 0, len(line) - 2))
        t = (place - along[k]) / (along[k + 1] - along[k])
        found[k] += (1 - t) * weight
        found[k + 1] += t * weight
    used = found != 0
    return mesh.node[line[used]], found[used]


def _line_of_nodes(mesh: Mesh, points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Nodes on the line through the load points, in the order of the axis."""
    arm = mesh.position - mesh.position[mesh.index(points)].mean(axis=0)
    off = np.linalg.norm(arm - np.outer(arm @ axis, axis), axis=1)
    line = np.flatnonzero(off < 1e-6)
    if len(line) < 2:
        raise InputError(
            "[damper] positions: the load points do not lie on one line of nodes along the axis"
        )
    return line[np.argsort(mesh.position[line] @ axis)]
