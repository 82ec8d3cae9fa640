"""A model that is small enough for examples and first tries: two blade tips with a damper between
them."""

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel

TIPS = 0.050, 0.052  # kg
DAMPER = 0.003  # kg
GROUND = 4e6, 1e6, 2e7  # N/m of a blade along x, y, z
STOP = 1e5  # N/m that hold the damper along its axis
CHAIN = 5e6  # N/m between neighbouring stations of a body
ANGLE = np.radians(35)  # of the flanks' normals above y
PITCH = 0.004  # m between stations
PULL = 60.0  # N


def two_blades(stations: int = 1) -> tuple[ReducedModel, ContactTable]:
    """(model, pairs): a damper that a pull of 60 N along z presses into the V of two blade tips.

    stations : along x, of each of the bodies 'blade1', 'blade2' and 'damper', whose nodes are
        numbered from 1; they share the mass of the body and its stiffness to the ground
    The load "pull" of the model is that of 1 N. The table has the side 'left' before the side
    'right', and equal preloads.
    Raises InputError where there is no station.

    >>> model, pairs = two_blades(stations=3)
    >>> pairs
    <ContactTable: 6 pairs (left 3, right 3), 6 carry; preload 17.4 to 17.4 N>
    """
    if stations < 1:
        raise InputError(f"stations = {stations}: must be 1 or more")
    n = stations
    x = PITCH * (np.arange(n) - (n - 1) / 2)
    D = np.diff(np.eye(n), axis=0)
    ground = np.concatenate([np.tile(GROUND, 2 * n), np.tile([STOP, 0, 0], n)]) / n
    pull = np.zeros(9 * n)
    pull[6 * n + 2 :: 3] = 1 / n
    model = ReducedModel.from_matrices(
        np.diag(np.repeat([*TIPS, DAMPER], 3 * n)) / n,
        np.diag(ground) + np.kron(np.eye(3), np.kron(CHAIN * D.T @ D, np.eye(3))),
        body=np.repeat(["blade1", "blade2", "damper"], 3 * n),
        node=np.tile(np.repeat(np.arange(1, n + 1), 3), 3),
        direction=["x", "y", "z"] * (3 * n),
        position=np.repeat([[a, y, 0] for y in (-0.003, 0.003, 0) for a in x], 3, axis=0),
        loads={"pull": pull},
    )
    return model, _pairs(x)


def _pairs(x: np.ndarray) -> ContactTable:
    """Of the stations at x (n,) m."""
    n, two = len(x), np.ones(2 * len(x))
    y, z = np.cos(ANGLE), np.sin(ANGLE)
    normal = np.repeat([[0, -y, z], [0, y, z]], n, axis=0)  # from the damper outwards
    t1 = np.tile([1.0, 0, 0], (2 * n, 1))
    return ContactTable(
        side=np.repeat(["left", "right"], n),
        station=np.tile(np.arange(n), 2),
        row=0 * two,
        blade_body=np.repeat(["blade1", "blade2"], n),
        blade_node=np.tile(np.arange(1, n + 1), 2),
        damper_body=np.repeat("damper", 2 * n),
        damper_node=np.tile(np.arange(1, n + 1), 2),
        position=np.tile(np.outer(x, [1, 0, 0]), (2, 1)),
        frame=np.stack([t1, np.cross(normal, t1), normal], axis=1),
        gap=0 * two,
        kn=3e6 / n * two,
        kt=2.5e6 / n * two,
        mu=0.5 * two,
        preload=PULL / (2 * n * z) * two,
        weight=two,
    )


def cantilever(
    length: float, height: float, thickness: float, elements: int = 8, E: float = 210e9
) -> tuple[np.ndarray, np.ndarray]:
    """(M, K), each (2 elements,) square, of a steel beam in bending, clamped at one end: deflection
    m and slope of each node in turn, the tip last [Przemieniecki 1968]; lengths in m, E in Pa.

    >>> M, K = cantilever(0.7, 0.014, 0.014)
    >>> print(natural_frequencies(ReducedModel.from_matrices(M, K))[0].round(1))
    23.9
    """
    area, inertia, h = height * thickness, height * thickness**3 / 12, length / elements
    scale = np.diag([1.0, h, 1.0, h])
    bending = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    heavy = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    M, K = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(0, 2 * elements, 2):
        own = slice(e, e + 4)
        K[own, own] += E * inertia / h**3 * scale @ bending @ scale
        M[own, own] += 7850.0 * area * h / 420 * scale @ heavy @ scale
    return M[2:, 2:], K[2:, 2:]
