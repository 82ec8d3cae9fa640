"""Motions of the bodies that meet no stiffness: found, named, and made definite by a gauge that carries no force."""

import numpy as np
import scipy.linalg as sl

from hbm.errors import InputError
from hbm.model import ReducedModel


def rigid_motions(model: ReducedModel) -> np.ndarray:
    """(r, 6 f): unit translations and rotations of every body of the model that floats, in its physical dofs.

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
        stiffness = np.linalg.norm(model.K @ motions, axis=0)
        size = np.abs(model.K[rows][:, rows]).max() * np.linalg.norm(motions, axis=0)
        if (stiffness <= 1e-8 * size).all():
            blocks.append(motions)
    return np.hstack(blocks) if blocks else np.zeros((model.size, 0))


def free_motions(model, K):
    """Motions that neither the bodies nor the contact normals resist: (r, m), their names, and the gauge (r, r)."""
    lam, vectors = sl.eigh(K)
    count = int((lam < 1e-12 * lam[-1]).sum())
    if not count:
        return np.zeros((model.size, 0)), [], 0.0
    space = vectors[:, :count]
    rigid = rigid_motions(model)
    if not rigid.shape[1]:
        raise InputError(f"{count} motions meet no stiffness and the model has no node positions to name them")
    coefficients = np.linalg.lstsq(rigid, space, rcond=None)[0]
    if np.linalg.norm(rigid @ coefficients - space) > 1e-5:
        raise InputError("a motion that is not rigid meets no stiffness: the model's K is singular")
    motions, names = name_motions(rigid, coefficients.T)
    return motions, names, lam[-1] * 1e-3 * (space @ space.T)


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
    return rigid @ rows.T, names
