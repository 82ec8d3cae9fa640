"""Solid cells: one data sheet per type, from which faces, numbering, shape functions and Jacobians
follow.

Nodes are numbered as gmsh does: corners, then the middles of edges, of four-sided faces, and of the
cell. Reference coordinates: tetrahedra in x, y, z >= 0, x + y + z <= 1; hexahedra in [-1, 1]^3;
wedges are the triangle times [-1, 1]."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import numpy as np
from numpy.typing import ArrayLike

# fmt: off
_HEX = [
    (-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
    (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1),
]
# fmt: on
_TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_WEDGE = [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)]

# nodes between corners, in gmsh's order
# fmt: off
_HEX_EDGES = [
    (0, 1), (0, 3), (0, 4), (1, 2),
    (1, 5), (2, 3), (2, 6), (3, 7),
    (4, 5), (4, 7), (5, 6), (6, 7),
]
# fmt: on
_TET_EDGES = [(0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1)]
_WEDGE_EDGES = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)]
_HEX_QUADS = [(0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)]
_WEDGE_QUADS = [(0, 1, 4, 3), (0, 2, 5, 3), (1, 2, 5, 4)]

# corners of each face, counter-clockwise seen from outside
_HEX_FACES = _HEX_QUADS
_TET_FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
_WEDGE_FACES = [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (0, 3, 5, 2), (1, 2, 5, 4)]


def _powers(highest: int, keep: Callable[..., bool]) -> list[tuple[int, ...]]:
    return [p for p in product(range(highest + 1), repeat=3) if keep(*p)]


# powers of x, y, z that the shape functions span
_SERENDIPITY = _powers(2, lambda i, j, k: sum(p for p in (i, j, k) if p == 2) <= 2)
_WEDGE15 = _powers(2, lambda i, j, k: i + j <= 2 and (k < 2 or i + j <= 1))


def _line(n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(n)


def _hex_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """n^3 Gauss points."""
    x, w = _line(n)
    return np.array(list(product(x, x, x))), np.array([a * b * c for a, b, c in product(w, w, w)])


# triangles, weights sum to 1: 3 points, exact to degree 2; 6 points, degree 4 [Strang and Fix 1973]
_TRIANGLES = {
    3: [(1 / 6, 1 / 3)],
    6: [(0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322)],
}


def _wedge_rule(triangle: int, line: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = _line(line)
    plane = [
        (p, q, weight / 2)
        for a, weight in _TRIANGLES[triangle]
        for p, q in ((a, a), (a, 1 - 2 * a), (1 - 2 * a, a))
    ]
    points = [(p, q, z) for (p, q, _), z in product(plane, x)]
    return np.array(points), np.array([wt * wz for (_, _, wt), wz in product(plane, w)])


def _tet_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """4 points, exact to degree 2; 14 points, exact to degree 5, all weights positive [Walkington
    2000]."""
    if n == 4:
        a = (5 - np.sqrt(5)) / 20
        return np.array([[a, a, a], *(np.where(np.eye(3) > 0, 1 - 3 * a, a))]), np.full(4, 1 / 24)
    points, weights = [], []
    for a, weight in (
        (0.31088591926330060980, 0.11268792571801585080),
        (0.092735250310891226402, 0.073493043116361949544),
    ):
        points += [[a, a, a], *(np.where(np.eye(3) > 0, 1 - 3 * a, a))]
        weights += [weight / 6] * 4
    c = 0.045503704125649649492
    d = 0.5 - c
    points += [[c, d, d], [d, c, d], [d, d, c], [d, c, c], [c, d, c], [c, c, d]]
    weights += [0.042546020777081466438 / 6] * 6
    return np.array(points), np.array(weights)


@dataclass(frozen=True)
class Cell:
    """One type of cell.

    reference : (n, 3) - places of the nodes; corners - how many of them are corners; edges - corner
    pairs
    powers : (n, 3) - exponents of the monomials that the shape functions span
    points, weights : (q, 3), (q,) - integration, full in the sense of the hexahedra's 2x2x2 and
    3x3x3 Gauss points
    faces : node numbers of each face: corners counter-clockwise from outside, then edges, then the
    centre
    """

    name: str
    reference: np.ndarray
    corners: int
    powers: np.ndarray
    points: np.ndarray
    weights: np.ndarray
    faces: tuple

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.reference)

    @property
    def middles(self) -> list[tuple[int, tuple[int, int]]]:
        """(node, corners at the ends) of each edge that has a node in its middle; the middle of a
        face or of the cell lies between several pairs of corners."""
        corner = self.reference[: self.corners]
        found = []
        for node in range(self.corners, len(self.reference)):
            ends = [
                (a, b)
                for a, b in combinations(range(self.corners), 2)
                if np.array_equal((corner[a] + corner[b]) / 2, self.reference[node])
            ]
            if len(ends) == 1:
                found.append((node, ends[0]))
        return found

    def shape(self, points: np.ndarray) -> np.ndarray:
        """(q, n) shape functions at points (q, 3)."""
        return _monomials(points, self.powers) @ self._coefficients

    def gradient(self, points: np.ndarray) -> np.ndarray:
        """(q, 3, n) derivatives of the shape functions with respect to the reference
        coordinates."""
        parts = []
        for k in range(3):
            lowered = self.powers - np.eye(3, dtype=int)[k]
            part = _monomials(points, np.maximum(lowered, 0)) * self.powers[:, k]
            parts.append(part @ self._coefficients)
        return np.stack(parts, axis=1)

    @property
    def _coefficients(self) -> np.ndarray:
        return np.linalg.inv(_monomials(self.reference, self.powers))

    def mirrored(self) -> np.ndarray:
        """Columns that turn an inside-out cell around: the nodes with x and y of the reference
        exchanged."""
        return _find(self.reference, self.reference[:, [1, 0, 2]])

    def columns(self, between: Sequence[tuple[int, ...]]) -> np.ndarray:
        """Columns that bring a cell whose middle nodes come in the order of the corners that they
        lie between, pairs of them on edges, into ours."""
        corner = self.reference[: self.corners]
        theirs = np.vstack([corner, *[corner[list(e)].mean(axis=0) for e in between]])
        return _find(theirs, self.reference)


def _monomials(points: np.ndarray, powers: np.ndarray) -> np.ndarray:
    return np.prod(np.asarray(points)[:, None, :] ** powers, axis=2)


def _find(places: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    distance = np.abs(places[None] - wanted[:, None]).max(axis=2)
    assert distance.min(axis=1).max() < 1e-12
    return distance.argmin(axis=1)


def _make(
    name: str,
    corner: ArrayLike,
    between: Sequence[tuple[int, ...]],
    powers: Sequence[tuple[int, ...]],
    rule: tuple[np.ndarray, np.ndarray],
    face_corners: Sequence[tuple[int, ...]],
) -> Cell:
    corner = np.array(corner, dtype=float)
    reference = np.vstack([corner, *[corner[list(b)].mean(axis=0)[None] for b in between]])
    known = {frozenset(b): len(corner) + i for i, b in enumerate(between)}
    faces = []
    for face in face_corners:
        pairs = zip(face, (*face[1:], face[0]), strict=True)
        extra = [known[frozenset(p)] for p in pairs if frozenset(p) in known]
        centre = [known[frozenset(face)]] if frozenset(face) in known and len(face) > 3 else []
        faces.append((*face, *extra, *centre))
    points, weights = rule
    return Cell(name, reference, len(corner), np.array(powers), points, weights, tuple(faces))


_ALL = [tuple(range(8))]
CELLS = {
    cell.name: cell
    for cell in (
        _make("tetra", _TET, [], _powers(1, lambda *p: sum(p) <= 1), _tet_rule(4), _TET_FACES),
        _make(
            "tetra10",
            _TET,
            _TET_EDGES,
            _powers(2, lambda *p: sum(p) <= 2),
            _tet_rule(14),
            _TET_FACES,
        ),
        _make("hexahedron", _HEX, [], _powers(1, lambda *p: True), _hex_rule(2), _HEX_FACES),
        _make("hexahedron20", _HEX, _HEX_EDGES, _SERENDIPITY, _hex_rule(3), _HEX_FACES),
        _make(
            "hexahedron27",
            _HEX,
            [*_HEX_EDGES, *_HEX_QUADS, *_ALL],
            _powers(2, lambda *p: True),
            _hex_rule(3),
            _HEX_FACES,
        ),
        _make(
            "wedge",
            _WEDGE,
            [],
            _powers(1, lambda i, j, k: i + j <= 1),
            _wedge_rule(3, 2),
            _WEDGE_FACES,
        ),
        _make("wedge15", _WEDGE, _WEDGE_EDGES, _WEDGE15, _wedge_rule(6, 3), _WEDGE_FACES),
        _make(
            "wedge18",
            _WEDGE,
            [*_WEDGE_EDGES, *_WEDGE_QUADS],
            _powers(2, lambda i, j, k: i + j <= 2),
            _wedge_rule(6, 3),
            _WEDGE_FACES,
        ),
    )
}


@cache
def tables(kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shape functions (q, n), their gradients (q, 3, n) and weights (q,) at the integration points
    of a cell type."""
    cell = CELLS[kind]
    return cell.shape(cell.points), cell.gradient(cell.points), cell.weights


def smallest_jacobians(kind: str, position: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(c, 2) m3: smallest and largest Jacobian determinant over the corners and integration points
    of each cell.

    Both positive: fine. Both negative: numbered inside out. Otherwise the cell is folded or flat.
    """
    cell = CELLS[kind]
    gradient = cell.gradient(np.vstack([cell.reference[: cell.corners], cell.points]))
    out = np.empty((len(cells), 2))
    for first in range(0, len(cells), 20000):
        part = slice(first, first + 20000)
        jacobian = np.einsum("qin,cnj->cqij", gradient, position[cells[part]], optimize=True)
        determinant = np.linalg.det(jacobian)
        out[part] = np.column_stack([determinant.min(axis=1), determinant.max(axis=1)])
    return out
