"""Frictionless balance of the free damper: the normal force on each side.     [Zucca 2016, sec. 7.1, figure 6]"""

import numpy as np
from numpy.typing import ArrayLike

from hbm.contact import ContactTable
from hbm.errors import InputError
from static_contact.rigid_motions import SETTINGS, RigidMotionSettings


def side_normals(pairs: ContactTable) -> dict[str, np.ndarray]:
    """Mean unit normal of each side, (3,), from the damper into the blade."""
    normals = {}
    for side in pairs.sides:
        mean = pairs.normal[pairs.side == side].mean(axis=0)
        normals[side] = mean / np.linalg.norm(mean)
    return normals


def side_forces(normals: dict[str, np.ndarray], pull: ArrayLike,
                settings: RigidMotionSettings = SETTINGS) -> dict[str, float]:
    """Force N on each side from sum_s N_s n_s = pull, with the pull (3,) N on the damper.

    The blade pushes the damper by -N n. Raises InputError when the sides leave more than 1e-3 of the pull, or one
    would have to pull the damper.
    """
    pull = np.asarray(pull, dtype=float)
    A = np.column_stack(list(normals.values()))
    force, *_ = np.linalg.lstsq(A, pull, rcond=None)
    left = pull - A @ force
    size = np.linalg.norm(pull)
    if np.linalg.matrix_rank(A, tol=1e-6) < A.shape[1]:
        raise InputError(f"sides {', '.join(normals)}: their normals are not independent, the split is not determined")
    if np.linalg.norm(left) > settings.taken_up * size:
        raise InputError(f"sides {', '.join(normals)} cannot balance the pull {pull.tolist()} N without friction: a "
                         f"residual of {np.linalg.norm(left):.3g} N along "
                         f"{np.round(left / np.linalg.norm(left), 3).tolist()} remains")
    for name, value in zip(normals, force, strict=True):
        if value < 0:
            raise InputError(f"side '{name}' would have to pull the damper ({value:.3g} N): check the pull direction "
                             "and the normals")
    return dict(zip(normals, force.tolist(), strict=True))
