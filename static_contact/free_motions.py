"""Motions of the bodies that meet no stiffness: found, named, and made definite by a gauge that carries no force."""

import numpy as np

from hbm.model import ReducedModel

FREE_STIFFNESS = 3e-7   # of the stiffness of the nodes held one by one


def rigid_motions(model: ReducedModel) -> np.ndarray:
    """(r, 6 b): unit translations along and rotations about x, y, z of every body whose node positions are known.

    Rotations are about the mean position of the body's nodes.
    """
    blocks = []
    for body in dict.fromkeys(model.body.tolist()):
        rows = np.flatnonzero((model.body == body) & (model.direction != "mode"))
        if not len(rows) or not np.isfinite(model.position[rows]).all():
            continue
        axis = np.array([("x", "y", "z").index(d) for d in model.direction[rows]])
        arm = model.position[rows] - model.position[rows].mean(axis=0)
        motions = np.zeros((model.size, 6))
        motions[rows, axis] = 1.0
        for k in range(3):
            motions[rows, 3 + k] = np.cross(np.eye(3)[k], arm)[np.arange(len(rows)), axis]
        blocks.append(motions)
    return np.hstack(blocks) if blocks else np.zeros((model.size, 0))


def free_motions(rigid, model, K):
    """Rigid motions that neither the bodies nor the contact normals resist: (r, m), names, their coefficients in the
    columns of `rigid`, and the gauge (r, r).

    The stiffness that each rigid motion meets is measured against that of its nodes held one by one.
    """
    diagonal = K.diagonal()
    scale = np.sqrt(np.einsum("ij,i,ij->j", rigid, diagonal, rigid))
    used = np.flatnonzero(np.abs(rigid).max(axis=0, initial=0.0) > 0)
    scale[scale == 0] = scale.max(initial=0.0) or 1.0        # nothing at all holds the nodes: free
    unit = rigid[:, used] / scale[used]
    lam, z = np.linalg.eigh(unit.T @ K @ unit)
    count = int((lam < FREE_STIFFNESS).sum())
    if not count:
        return np.zeros((model.size, 0)), [], np.zeros((rigid.shape[1], 0)), 0.0
    coefficients = np.zeros((rigid.shape[1], count))
    coefficients[used] = z[:, :count] / scale[used, None]
    reduced, names = name_motions(rigid, coefficients.T)
    free = rigid @ reduced.T
    basis = np.linalg.qr(free)[0]
    return free, names, reduced.T, np.median(diagonal[diagonal > 0]) * (basis @ basis.T)


def name_motions(rigid, coefficients):
    """Unit rigid motions that span the free ones: each named after the slide or rotation that leads it.

    Row reduction of coefficients (m, 6 f) with complete pivoting, rotations weighed by the size of the body.
    """
    arm = np.linalg.norm(rigid[:, 3:6]) / np.linalg.norm(rigid[:, :3])
    weight = np.tile([1.0, 1.0, 1.0, arm, arm, arm], rigid.shape[1] // 6)
    rows, names = coefficients.copy(), [None] * len(coefficients)
    label = [(f"slide along {a}", "N") for a in "xyz"] + [(f"roll about {a}", "N m") for a in "xyz"]
    for _ in names:
        left = [i for i, name in enumerate(names) if name is None]
        i, j = np.unravel_index(np.abs(rows[left] * weight).argmax(), (len(left), rows.shape[1]))
        i = left[i]
        names[i] = label[j % 6]
        rows[i] /= rows[i, j]
        for other in range(len(rows)):
            if other != i:
                rows[other] -= rows[other, j] * rows[i]
    return rows, names
