"""Small meshes of every cell type and of mixtures, made here node by node, with inner nodes moved
off the lattice."""

from itertools import product

import numpy as np

from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import checked

LENGTH, WIDTH, HEIGHT = 0.1, 0.02, 0.01
CORNERS = {
    "tetra": "tetra",
    "tetra10": "tetra",
    "hexahedron": "hexahedron",
    "hexahedron20": "hexahedron",
    "hexahedron27": "hexahedron",
    "wedge": "wedge",
    "wedge15": "wedge",
    "wedge18": "wedge",
}
_WEDGES = [(0, 1, 3, 4, 5, 7), (1, 2, 3, 5, 6, 7)]  # of a hexahedron, cut along the diagonal 1-3
MIXTURES = {
    1: {"hexahedron": "hexahedron", "wedge": "wedge", "tetra": "tetra"},
    2: {"hexahedron": "hexahedron20", "wedge": "wedge15", "tetra": "tetra10"},
}


def block(kind, divisions=(4, 2, 2), distort=0.0, size=(LENGTH, WIDTH, HEIGHT)):
    """A box of one cell type: hexahedra as they are, or cut into wedges or tetrahedra."""
    hexahedra, points = _lattice(divisions, size, distort)
    base = CORNERS[kind]
    if base == "wedge":
        cells = _wedges(hexahedra)
    elif base == "tetra":
        cells = _tetrahedra(_wedges(hexahedra))
    else:
        cells = hexahedra
    return _mesh({kind: (base, cells)}, points, size)


def mixture(order, divisions=(4, 2, 2), distort=0.0, size=(LENGTH, WIDTH, HEIGHT), only=None):
    """An L: the lower half is hexahedra (small x) and wedges (large x), on the wedges stand
    tetrahedra.

    only : one cell type for all of it ("tetra", "tetra10")
    """
    hexahedra, points = _lattice(divisions, size, distort)
    low = np.array([k < divisions[2] // 2 for _, _, k in product(*map(range, divisions))])
    left = np.array([i < divisions[0] // 2 for i, _, _ in product(*map(range, divisions))])
    parts = {
        "hexahedron": hexahedra[low & left],
        "wedge": _wedges(hexahedra[low & ~left]),
        "tetra": _tetrahedra(_wedges(hexahedra[~low & ~left])),
    }
    if only:
        everything = _tetrahedra(np.concatenate([_wedges(parts["hexahedron"]), parts["wedge"]]))
        return _mesh({only: ("tetra", np.concatenate([everything, parts["tetra"]]))}, points, size)
    return _mesh(
        {MIXTURES[order][base]: (base, cells) for base, cells in parts.items()}, points, size
    )


def volume(divisions, size=(LENGTH, WIDTH, HEIGHT)):
    """Of the L."""
    return np.prod(size) * 0.75


def _lattice(divisions, size, distort):
    shape = [d + 1 for d in divisions]
    grid = np.array(list(product(*map(range, shape))), dtype=float) / divisions
    inside = ((grid > 1e-9) & (grid < 1 - 1e-9) & (np.abs(grid - 0.5) > 1e-9)).all(axis=1)
    shift = np.random.default_rng(1).uniform(-distort, distort, grid.shape) / divisions
    points = (grid + np.where(inside[:, None], shift, 0)) * size
    at = np.arange(len(grid)).reshape(shape)
    # fmt: off
    corner = [
        (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
        (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
    ]
    # fmt: on
    cells = [
        [at[i + a, j + b, k + c] for a, b, c in corner]
        for i, j, k in product(*map(range, divisions))
    ]
    return np.array(cells), points


def _wedges(hexahedra):
    return np.concatenate([hexahedra[:, list(w)] for w in _WEDGES])


def _tetrahedra(wedges):
    """Three of each wedge; every four-sided face is cut at its lowest node, so that neighbours
    agree."""
    out = []
    for w in wedges:
        turn = int(w.argmin())
        order = [
            (0, 1, 2, 3, 4, 5),
            (1, 2, 0, 4, 5, 3),
            (2, 0, 1, 5, 3, 4),
            (3, 5, 4, 0, 2, 1),
            (4, 3, 5, 1, 0, 2),
            (5, 4, 3, 2, 1, 0),
        ][turn]
        a, b, c, d, e, f = w[list(order)]
        out.append((a, e, f, d))
        out += (
            [(a, b, c, f), (a, b, f, e)] if min(b, f) < min(c, e) else [(a, b, c, e), (a, e, c, f)]
        )
    return np.array(out)


def _mesh(parts, points, size):
    """Nodes between corners are added where the cell type has them, shared by neighbours."""
    known = {tuple(np.round(p, 12)): i for i, p in enumerate(points)}
    places = list(points)
    cells = {}
    number = {}
    start = 1
    for kind, (base, corners) in parts.items():
        shape = CELLS[base].shape(CELLS[kind].reference)
        rows = []
        for cell in corners:
            row = []
            for p in shape @ points[cell]:
                key = tuple(np.round(p, 12))
                if key not in known:
                    known[key] = len(places)
                    places.append(p)
                row.append(known[key])
            rows.append(row)
        cells[kind], number[kind] = np.array(rows), np.arange(start, start + len(rows))
        start += len(rows)
    used = np.unique(np.concatenate([c.ravel() for c in cells.values()]))
    position = np.array(places)[used]
    cells = {k: np.searchsorted(used, c) for k, c in cells.items()}
    label = 10 + 3 * np.arange(len(used))  # the user's numbers are not ours
    groups = {
        "clamp": label[np.abs(position[:, 0]) < 1e-9],
        "tip": label[np.abs(position[:, 0] - size[0]) < 1e-9],
    }
    return checked(
        Mesh(
            label,
            position,
            cells,
            groups,
            source="block",
            number=number,
            cell_groups={k: n for k, n in number.items()},
        )
    )
