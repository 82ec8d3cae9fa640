"""Writes what another code would export: M.mtx, K.mtx, dofs.csv and pairs.csv, into the working
directory.

Two blade tips and a damper between them, as springs and point masses. Nodes 1-3 are the left tip,
11-13 the right one, 21-23 the damper, which lies along x and is pulled up (z) into the V of two
surfaces inclined by 35 degrees.
"""

import numpy as np
import scipy.io
import scipy.sparse as sp

from tipdamp import ContactTable

NODES = {"blades": [1, 2, 3, 11, 12, 13], "damper": [21, 22, 23]}
ANGLE = np.radians(35)
PULL = 60.0  # N, along z


def matrices():
    """M, K (27, 27): dofs x, y, z of the nodes in the order of NODES."""
    mass = np.repeat([0.02, 0.021, 0.003], 9)  # kg a node; the right blade is a little heavier
    # damper: a soft stop along x, else free
    ground = np.r_[np.tile([4e6, 1e6, 2e7], 6), np.tile([1e5, 0, 0], 3)]
    K = np.diag(ground)
    for part in range(3):  # neighbours along x hold each other
        for i in range(2):
            a = 9 * part + 3 * i + np.arange(3)
            K[np.ix_(np.r_[a, a + 3], np.r_[a, a + 3])] += 5e6 * np.kron(
                [[1, -1], [-1, 1]], np.eye(3)
            )
    return np.diag(mass), K


def positions():
    """(9, 3) m."""
    along = np.tile([-0.01, 0.0, 0.01], 3)
    across = np.repeat([-0.003, 0.003, 0.0], 3)
    return np.stack([along, across, np.zeros(9)], axis=1)


def contact_table():
    """Six pairs: every damper node touches both blades. n points from the damper into the blade."""
    normal = {
        "left": [0, -np.cos(ANGLE), np.sin(ANGLE)],
        "right": [0, np.cos(ANGLE), np.sin(ANGLE)],
    }
    side = np.repeat(["left", "right"], 3)
    n = np.array([normal[s] for s in side])
    t1 = np.tile([1.0, 0, 0], (6, 1))
    preload = PULL / (6 * np.sin(ANGLE))  # balance of the pull: sum of preload n_z = PULL
    return ContactTable(
        side=side,
        station=np.tile(np.arange(3), 2),
        row=np.zeros(6),
        blade_body=np.full(6, "blades"),
        blade_node=NODES["blades"],
        damper_body=np.full(6, "damper"),
        damper_node=np.tile(NODES["damper"], 2),
        position=positions()[:6],
        frame=np.stack([t1, np.cross(n, t1), n], axis=1),
        gap=np.zeros(6),
        kn=np.full(6, 3e6),
        kt=np.full(6, 2.5e6),
        mu=np.full(6, 0.5),
        preload=np.full(6, preload),
        weight=np.ones(6),
    )


def main():
    for name, matrix in zip("MK", matrices(), strict=True):
        scipy.io.mmwrite(f"{name}.mtx", sp.coo_matrix(matrix), symmetry="symmetric", precision=17)
    with open("dofs.csv", "w", encoding="utf-8") as f:
        f.write("body,node,direction,x,y,z\n")
        rows = [(body, node) for body, nodes in NODES.items() for node in nodes]
        for (body, node), place in zip(rows, positions(), strict=True):
            for direction in "xyz":
                f.write(f"{body},{node},{direction},{place[0]},{place[1]},{place[2]}\n")
    contact_table().save("pairs.csv")


if __name__ == "__main__":
    main()
