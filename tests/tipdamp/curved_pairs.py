"""A contact table on a circular arc beside a line, with irregular stations and forces."""

import numpy as np

from tipdamp.hbm.contact import ContactTable


def curved_pairs(rows=3, stations=6, seed=3) -> ContactTable:
    """One side on a circular arc with irregular stations and forces, another that is a line."""
    rng = np.random.default_rng(seed)
    y = np.cumsum(rng.uniform(1e-3, 4e-3, stations))
    angle = np.linspace(0.3, 1.1, rows)
    grid = [(s, r) for s in range(stations) for r in range(rows)]
    n = np.array([[np.cos(angle[r]), 0, np.sin(angle[r])] for _, r in grid])
    place = np.array([[0, y[s], 0] for s, _ in grid]) + 5e-3 * n
    line_n = np.tile([-1.0, 0, 0], (stations, 1))
    normal = np.vstack([n, line_n])
    position = np.vstack([place, np.column_stack([-5e-3 + 0 * y, y, 0 * y])])
    t1 = np.tile([0.0, 1, 0], (len(normal), 1))
    frame = np.stack([t1, np.cross(normal, t1), normal], axis=1)
    P = len(normal)
    side = np.array(["arc"] * len(grid) + ["line"] * stations)
    return ContactTable(
        side,
        np.r_[[s for s, _ in grid], np.arange(stations)],
        np.r_[[r for _, r in grid], np.zeros(stations, int)],
        ["blades"] * P,
        1000 + 7 * np.arange(P),
        ["damper"] * P,
        50 + 3 * np.arange(P),
        position,
        frame,
        np.zeros(P),
        np.full(P, 1e6),
        np.full(P, 9e5),
        np.full(P, 0.6),
        rng.uniform(-1, 5, P),
        np.ones(P),
    )
