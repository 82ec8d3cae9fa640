"""A small two-blade rig made of point masses and bars: two blades on grounded nodes, a free damper
between them.

Every spring acts along the line between its nodes, so that a body without ground has exactly six
rigid motions. The damper lies along x and is pressed up (z) into the V of the two inclined contact
lines by 80 N a side.
"""

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel

ANGLE = np.radians(35.0)
RADIUS = 3e-3


def _bars(x, k):
    K = np.zeros((3 * len(x), 3 * len(x)))
    for i in range(len(x)):
        for j in range(i):
            e = (x[i] - x[j]) / np.linalg.norm(x[i] - x[j])
            block = k * np.outer(e, e)
            for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
                K[3 * a : 3 * a + 3, 3 * b : 3 * b + 3] += sign * block
    return K


def small_rig(stations=9, roll=2.0, seed=0):
    """(ReducedModel, ContactTable, excitation row at the tip of blade 1 along y)."""
    rng = np.random.default_rng(seed)
    axis = np.linspace(-0.015, 0.015, stations)
    bodies = {}
    for name, side in (("blade1", -1.0), ("blade2", 1.0)):
        contact = np.stack(
            [
                axis,
                np.full(stations, side * RADIUS * np.cos(ANGLE)),
                np.full(stations, RADIUS * np.sin(ANGLE)),
            ],
            axis=1,
        )
        tip = np.array([[0.0, side * 0.02, 0.01]])
        root = np.array(
            [[sx * 0.015, side * (0.012 + sy * 0.006), -0.06] for sx in (-1, 1) for sy in (-1, 1)]
        )
        x = np.vstack([contact, tip, root])
        K = _bars(x, 6e6 * (1.0 if side < 0 else 1.03))
        held = 3 * (stations + 1)
        bodies[name] = (x[: stations + 1], K[:held, :held], np.r_[np.full(stations, 4e-3), 0.12])
    a = np.stack(
        [
            axis,
            np.full(stations, -RADIUS * np.cos(ANGLE)),
            np.full(stations, RADIUS * np.sin(ANGLE)),
        ],
        axis=1,
    )
    b = a * [1, -1, 1]
    core = np.array([[-0.016, 0, -RADIUS], [0.016, 0, -RADIUS]])
    x = np.vstack([a, b, core])
    bodies["damper"] = (x, _bars(x, 4e7), np.full(len(x), 1e-3))
    return _assemble(bodies, stations, roll, rng, a, b)


def _assemble(bodies, stations, roll, rng, a, b):
    r = sum(3 * len(x) for x, _, _ in bodies.values())
    M, K = np.zeros((r, r)), np.zeros((r, r))
    body = []
    node = []
    direction = []
    position = []
    at = 0
    for name, (x, k, m) in bodies.items():
        n = 3 * len(x)
        M[at : at + n, at : at + n], K[at : at + n, at : at + n] = np.diag(np.repeat(m, 3)), k
        if name == "damper":
            K[at : at + n, at : at + n] += roll * _roll_row(x)
        body += [name] * n
        node += np.repeat(np.arange(1, len(x) + 1), 3).tolist()
        direction += ["x", "y", "z"] * len(x)
        position.append(np.repeat(x, 3, axis=0))
        at += n
    model = ReducedModel.from_matrices(
        M, K, body=np.array(body), node=node, direction=direction, position=np.vstack(position)
    )
    P = 2 * stations
    t1 = np.tile([1.0, 0, 0], (P, 1))
    n = np.repeat(
        [[0, -np.cos(ANGLE), np.sin(ANGLE)], [0, np.cos(ANGLE), np.sin(ANGLE)]], stations, axis=0
    )
    share = 0.4 + np.tile(np.linspace(-1, 1, stations) ** 2, 2)
    pairs = ContactTable(
        side=np.repeat(["left", "right"], stations),
        station=np.tile(np.arange(stations), 2),
        row=np.zeros(P, int),
        blade_body=np.repeat(["blade1", "blade2"], stations),
        blade_node=np.tile(np.arange(1, stations + 1), 2),
        damper_body=np.full(P, "damper"),
        damper_node=np.arange(1, P + 1),
        position=np.vstack([a, b]),
        frame=np.stack([t1, np.cross(n, t1), n], axis=1),
        gap=np.zeros(P),
        kn=np.full(P, 3e6),
        kt=np.full(P, 2e6),
        mu=np.full(P, 0.5),
        preload=80.0 * share / share[:stations].sum(),
        weight=np.ones(P),
    )
    return model, pairs, model.displacement_row("blade1", stations + 1, [0, 1, 0])


def _roll_row(x):
    """Projector on the mean rotation of the damper about its axis, so that a moment k theta resists
    it."""
    arm = x - x.mean(axis=0)
    rate = np.stack([np.zeros(len(x)), -arm[:, 2], arm[:, 1]], axis=1).ravel()
    rate /= rate @ rate
    return np.outer(rate, rate)
