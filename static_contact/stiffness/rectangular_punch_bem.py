"""Rigid rectangular punch on an elastic half-space by boundary elements: the origin of
rectangular_punch_table.csv.

The traction q on the rectangle |x| < L/2, |y| < w/2 gives every point of it the same displacement:

    along x:  integral q [ (1 - nu)/r + nu x^2/r^3 ] dA = 1        across (y): the same with y^2/r^3

(Boussinesq and Cerruti, Johnson, Contact Mechanics, 1985, ch. 3). nu = 0 is the normal problem for
every nu. The displacement at right angles to the tangential load is left free; forcing it to zero
raises the stiffness
by 1e-6 (slender) to 1e-3 (square). Both kernels are sums of x^2/r^3 and y^2/r^3, whose integrals
over a rectangle are closed, so the method is collocation with constant cells, a quarter of the
punch by symmetry, cells refined towards the edges as (cell/n)^2, and Richardson extrapolation over
five meshes.

`python -m tipdamp.static_contact.stiffness.rectangular_punch_bem` writes the table again (about ten
minutes)."""

from collections.abc import Sequence
from functools import lru_cache
from math import asinh, sinh, sqrt
from pathlib import Path

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.static_contact.stiffness.flat_punch import TABLE, table_nodes

# cells over the half-width; multiples of 4, so that the cells along the length scale
MESHES = (8, 12, 16, 24, 32)
ORDERS = (2, 3, 4, 5)  # powers of 1/n in the error on the quadratically refined mesh
GAUSS = sqrt(0.6)  # three-point Gauss rule, weights 5/9, 8/9, 5/9


@njit(cache=True)
def _corner(x: float, y: float) -> tuple[float, float]:
    """Antiderivatives in x and y of x^2/r^3 and y^2/r^3."""
    along = y * asinh(x / abs(y)) if y != 0.0 else 0.0
    across = x * asinh(y / abs(x)) if x != 0.0 else 0.0
    return along, across


@njit(cache=True)
def _cell(x: float, y: float, a: float, b: float) -> tuple[float, float]:
    """Integrals of x^2/r^3 and y^2/r^3 over the cell of half sizes a, b centred at (x, y), seen
    from the origin."""
    # far: the closed form would cancel, Gauss is exact to 1e-9
    if x * x + y * y > 100.0 * max(a, b) ** 2:
        along = across = 0.0
        for i in range(-1, 2):
            for j in range(-1, 2):
                u, v = x + i * GAUSS * a, y + j * GAUSS * b
                r2 = u * u + v * v
                weight = (8.0 - 3.0 * abs(i)) * (8.0 - 3.0 * abs(j)) / 81.0 / (r2 * sqrt(r2))
                along += weight * u * u
                across += weight * v * v
        return along * a * b, across * a * b
    p = _corner(x + a, y + b)
    q = _corner(x - a, y + b)
    r = _corner(x + a, y - b)
    s = _corner(x - a, y - b)
    return p[0] - q[0] - r[0] + s[0], p[1] - q[1] - r[1] + s[1]


@njit(cache=True)
def _influence(
    length: float, x_edges: np.ndarray, y_edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (n, n) of both kernels between the cells of one quarter, images included.

    x and y are measured from the corner of the punch (width 1), so that small cells of a long punch
    stay exact."""
    nx, ny = x_edges.size - 1, y_edges.size - 1
    along = np.empty((nx * ny, nx * ny))
    across = np.empty((nx * ny, nx * ny))
    x, a = 0.5 * (x_edges[1:] + x_edges[:-1]), 0.5 * (x_edges[1:] - x_edges[:-1])
    y, b = 0.5 * (y_edges[1:] + y_edges[:-1]), 0.5 * (y_edges[1:] - y_edges[:-1])
    for i in range(nx * ny):
        for j in range(nx * ny):
            ix = i // ny
            iy = i % ny
            jx = j // ny
            jy = j % ny
            sum_along = sum_across = 0.0
            for dx in (x[jx] - x[ix], length - x[jx] - x[ix]):
                for dy in (y[jy] - y[iy], 1.0 - y[jy] - y[iy]):
                    cell = _cell(dx, dy, a[jx], b[jy])
                    sum_along += cell[0]
                    sum_across += cell[1]
            along[i, j], across[i, j] = sum_along, sum_across
    return along, across


def _edges(length: float, n: int) -> np.ndarray:
    """Cell edges (n + 1,) from the end to the middle: quadratic at the end, geometric along a long
    side."""
    stretch = asinh(sqrt(length))
    return (
        0.5
        * length
        * np.array([(sinh(stretch * i / n) / sinh(stretch)) ** 2 for i in range(n + 1)])
    )


@lru_cache(maxsize=len(MESHES))
def _quarter(aspect: float, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    nx = n * round(4 + 2 * (asinh(sqrt(aspect)) - asinh(1))) // 4  # the longer, the more cells
    x_edges, y_edges = _edges(aspect, nx), _edges(1.0, n)
    area = np.outer(np.diff(x_edges), np.diff(y_edges)).ravel()
    return *_influence(aspect, x_edges, y_edges), area


def mesh_compliance(aspect: float, nu: float, n: int) -> np.ndarray:
    """Dimensionless compliances (2,), along and across, of the rigid rectangle L x w, aspect = L/w
    >= 1, on one mesh.

    c = L / (pi Q), Q the total of the traction that displaces the punch by 1: the normal stiffness
    of a pair is
    Kn = E* L / c(nu=0), the tangential one Kt = 2 L / (c(nu) (1/G1 + 1/G2)).
    """
    along, across, area = _quarter(float(aspect), n)
    ones = np.ones(area.size)
    totals = [
        4 * area @ np.linalg.solve(first + (1 - nu) * second, ones)
        for first, second in ((along, across), (across, along))
    ]
    return aspect / (np.pi * np.array(totals))


def compliance(
    aspect: float, nu: float = 0.0, meshes: tuple = MESHES
) -> tuple[np.ndarray, np.ndarray]:
    """`mesh_compliance` (2,) extrapolated over `meshes`, and its change (2,) when the finest mesh
    is left out."""
    values = [mesh_compliance(aspect, nu, n) for n in meshes]
    best = _extrapolate(meshes, values)
    return best, np.abs(best - _extrapolate(meshes[:-1], values[:-1]))


def _extrapolate(meshes: tuple[int, ...], values: Sequence[np.ndarray]) -> np.ndarray:
    powers = (0, *ORDERS)[: len(meshes)]
    return np.linalg.solve(
        np.array([[n ** -float(p) for p in powers] for n in meshes]), np.array(values)
    )[0]


def write_table(path: str | Path = TABLE) -> None:
    """Columns: length/width, nu, compliance along and across, estimated error of each; a line at a
    time."""
    with open(path, "w", encoding="ascii") as file:
        file.write("aspect,nu,along,across,error_along,error_across\n")
        for aspect in table_nodes()[0]:
            for nu in table_nodes()[1]:
                value, error = compliance(aspect, nu)
                file.write(
                    f"{aspect:.17g},{nu:.17g},{value[0]:.12g},{value[1]:.12g},{error[0]:.1e},{error[1]:.1e}\n"
                )
            file.flush()
            print(f"length / width {aspect:.6g}", flush=True)


if __name__ == "__main__":
    write_table()
