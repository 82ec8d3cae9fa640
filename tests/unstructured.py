"""Boxes of irregular cells of every type: triangles of places moved off a lattice, or
quadrilaterals cut out of them, extruded."""

import numpy as np
from scipy.spatial import Delaunay

from tests.modal import blocks


def box(kind, across, layers, size, seed=0):
    """A mesh with about `across` cells along x and y of a box of this size (3,) m, and `layers`
    along z."""
    rng, base = np.random.default_rng(seed), blocks.CORNERS[kind]
    if base == "hexahedron" and across > 1:
        place, cells = _quadrilaterals(*_triangles(across // 2, rng))
    elif base == "hexahedron":
        place = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
        cells = np.array([[0, 1, 2, 3]])
    else:
        place, cells = _triangles(across, rng)
    z, n = np.linspace(0, 1, layers + 1), len(place)
    position = np.vstack([np.column_stack([place, np.full(n, height)]) for height in z]) * size
    cells = np.concatenate([np.hstack([cells + n * k, cells + n * (k + 1)]) for k in range(layers)])
    if base == "tetra":
        cells = blocks._tetrahedra(cells)
    return blocks._mesh({kind: (base, cells)}, position, size)


def _triangles(across, rng):
    """Places (n, 2) in the unit square and triangles (m, 3), counterclockwise."""
    place = np.stack(np.meshgrid(*[np.arange(across + 1.0)] * 2, indexing="ij"), axis=-1).reshape(
        -1, 2
    )
    inside = (place > 0) & (place < across)
    place = (place + inside * rng.uniform(-0.3, 0.3, place.shape)) / across
    corners = Delaunay(place).simplices
    (x1, y1), (x2, y2) = (place[corners[:, k]].T - place[corners[:, 0]].T for k in (1, 2))
    area = x1 * y2 - x2 * y1
    corners = np.where(area[:, None] < 0, corners[:, ::-1], corners)
    return place, corners[np.abs(area) > 1e-9]


def _quadrilaterals(place, triangles):
    """Each triangle cut into three, from its centre to the middles of its edges."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    pairs, middle = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    middle = len(place) + middle.reshape(-1, 3)
    centre = len(place) + len(pairs) + np.arange(len(triangles))
    cells = [
        np.column_stack([triangles[:, k], middle[:, k], centre, middle[:, k - 1]]) for k in range(3)
    ]
    return np.vstack(
        [place, place[pairs].mean(axis=1), place[triangles].mean(axis=1)]
    ), np.concatenate(cells)
