"""Intersections of triangles in a plane: Sutherland and Hodgman's clipping, all pairs at a time.

[Sutherland and Hodgman 1974, Reentrant polygon clipping; as mortar methods use it: Puso and Laursen
2004, sec. 4.2]"""

import numpy as np


def intersections(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that the intersections of triangles (m, 3, 2), both counter-clockwise, consist of.

    Returns their corners (s, 3, 2) and the pair (s,) that each belongs to, in order.
    """
    polygon, count = one, np.full(len(one), 3)
    for k in range(3):
        polygon, count = _half_plane(polygon, count, other[:, k], other[:, (k + 1) % 3])
    first = np.repeat(polygon[:, :1], polygon.shape[1] - 2, axis=1)
    fans = np.stack([first, polygon[:, 1:-1], polygon[:, 2:]], axis=2)
    there = np.arange(fans.shape[1]) + 2 < count[:, None]
    return fans[there], np.nonzero(there)[0]


def areas(triangle: np.ndarray) -> np.ndarray:
    """(s,) signed areas of triangles (s, 3, 2)."""
    a, b = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def _half_plane(
    polygon: np.ndarray, count: np.ndarray, a: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What of convex polygons (m, v, 2) with `count` corners lies left of the lines a to b."""
    m, v = polygon.shape[:2]
    there = np.arange(v) < count[:, None]
    along = b - a
    height = along[:, :1] * (polygon[:, :, 1] - a[:, 1:]) - along[:, 1:] * (
        polygon[:, :, 0] - a[:, :1]
    )
    following = np.where(np.arange(v) + 1 < count[:, None], np.arange(v) + 1, 0)
    rows = np.arange(m)[:, None]
    next_height, inside = height[rows, following], height >= 0
    crosses = there & (inside != (next_height >= 0))
    share = np.divide(height, height - next_height, out=np.zeros_like(height), where=crosses)[
        :, :, None
    ]
    cut = polygon + share * (polygon[rows, following] - polygon)
    corners = np.stack([polygon, cut], axis=2).reshape(m, 2 * v, 2)
    kept = np.stack([there & inside, crosses], axis=2).reshape(m, 2 * v)
    # v + 1 at most, but for edges on the line: rounding may cross it more than twice
    count = kept.sum(axis=1)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : count.max(initial=v)]
    return corners[rows, order], count
