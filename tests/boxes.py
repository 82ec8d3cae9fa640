"""Meshes of blocks of hexahedra for the tests, without a mesh generator."""

import numpy as np

from tipdamp.meshes.structured import HEX27
from tipdamp.modal.mesh import Mesh


def block(x, y, z, order=1) -> Mesh:
    """Nodes at all combinations of the coordinates; groups x0 to z1. order 2: 27-node cells, odd
    counts."""
    shape = len(x), len(y), len(z)
    position = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(position)).reshape(shape)
    columns = HEX27 if order == 2 else HEX27[:8] // 2
    first = np.stack(
        np.meshgrid(*(np.arange(0, n - order, order) for n in shape), indexing="ij"), -1
    ).reshape(-1, 1, 3)
    cells = index[tuple((first + columns).transpose(2, 0, 1))]
    groups = {
        f"{a}{side}": np.unique(index.take(-side, axis=k)) + 1
        for k, a in enumerate("xyz")
        for side in (0, 1)
    }
    kind = "hexahedron27" if order == 2 else "hexahedron"
    return Mesh(np.arange(1, len(position) + 1), position, {kind: cells}, groups, source="block")
