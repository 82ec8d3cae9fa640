"""Rigid motions of a body of a model: their shapes, their names, and the coordinate that measures
one of them; tolerances of held motions, each with its reason."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.dof_table import DIRECTIONS, ROTATIONS

SLIDES = tuple((f"slide along {axis}", "N") for axis in DIRECTIONS)
ROLLS = tuple((f"roll about {axis}", "N m") for axis in DIRECTIONS)
# (name, unit of the force along it), in the order of `body_motions`
RIGID_MOTIONS = (*SLIDES, *ROLLS)
ALLOWED = (
    "must be a direction [x, y, z], 'x', 'y' or 'z', or a rotation 'about x', 'about y' or "
    "'about z'"
)


@dataclass(frozen=True)
class HoldSettings:
    """Numbers that the answer does not depend on, but for the holds that they refuse or warn of."""

    rigid: float = 0.05  # share of a motion that is left beside the rigid one of its body
    hold: float = 1e-5  # of the stiffness of the sticking pairs along a motion: a hold that is soft
    faced: float = 3e-3  # direction cosine from which contact normals resist a motion that is held
    # times the stiffness of a hold: the solution that shows whether it is soft
    stiffer: float = 10.0
    stiffer_steps: tuple = (1, 4, 16)  # in which it is reached, where fewer lead to no solution
    # times itself: a mean reaction that grows more by ten times the stiffness follows
    follows: float = 2.0
    # it, contacts that stick carry what it would be on a stop ...
    no_reaction: float = 1e-7  # ... unless it is rounding beside the excitation
    small_angle: float = 0.01  # rad, and as a share of a body's size: displacements that are small
    # of the peak: how much lower the points beside it lie, from which it is solved
    hold_flank: float = 1e-3
    # again
    # of a body's size: nodes that near to an axis lie on it, turning moves nothing
    on_axis: float = 1e-6
    one_point: float = 1e-12  # of the distance from the origin: a body that small does not turn
    # of the peak, or of the force: more change by a stiffer hold is worth a warning
    hold_differs: float = 1e-4
    noise: float = 50.0  # times the rounding of the stiffness: what a restrained motion must store


HOLD = HoldSettings()


def share_faced(normals: Any, motion: np.ndarray) -> float:
    """How much contact normals (P, r), rows of relative motions, face a motion (r,), as a share of
    its size."""
    return float(np.abs(normals @ motion).max(initial=0.0) / np.abs(motion).max())


def body_motions(model: Any, body: str) -> np.ndarray:
    """(r, 6) unit translations along and rotations about x, y, z, through the mean position of the
    body's nodes.

    A rotation about an axis on which all nodes lie, and all three where positions are unknown, are
    columns of zeros.
    model : a ReducedModel
    """
    mine, motions = model.body == body, np.zeros((len(model.body), 6))
    rows = np.flatnonzero(mine & model.moves)
    axis = np.array([DIRECTIONS.index(d) for d in model.direction[rows]], dtype=int)
    motions[rows, axis] = 1.0
    if not len(rows) or not np.isfinite(model.position[rows]).all():
        return motions
    arm = model.position[rows] - model.position[rows].mean(axis=0)
    size = np.abs(arm).max()
    if size <= HOLD.one_point * np.abs(model.position[rows]).max():
        size = np.inf
    for k in range(3):
        turn = np.cross(np.eye(3)[k], arm)[np.arange(len(rows)), axis]
        if np.abs(turn).max() > HOLD.on_axis * size:
            motions[rows, 3 + k] = turn
        motions[mine & (model.direction == ROTATIONS[k]), 3 + k] = 1.0
    return motions


def parse_motion(value: Any) -> tuple[str, str, np.ndarray]:
    """(name, unit of the force along it, (6,) coefficients in `body_motions`) of a rigid motion in
    a user's words.

    value : direction (3,), or a text such as 'y', 'slide along y', 'about y'. Raises InputError for
    anything else."""
    if isinstance(value, str):
        found = re.fullmatch(
            r"(?:(?:slide )?(?:along )?|((?:roll |rotation )?about ))([xyz])", value.strip().lower()
        )
        if not found:
            raise InputError(ALLOWED)
        k = DIRECTIONS.index(found[2]) + 3 * bool(found[1])
        return *RIGID_MOTIONS[k], np.eye(6)[k]
    numeric = (
        isinstance(value, Sequence | np.ndarray)
        and len(value) == 3
        and all(isinstance(v, int | float | np.number) and not isinstance(v, bool) for v in value)
    )
    vector = np.array(value, dtype=float) if numeric else np.zeros(3)
    if not np.isfinite(vector).all() or not vector.any():
        raise InputError(ALLOWED)
    vector = vector / np.abs(vector).max()  # squares of the given numbers may vanish or overflow
    vector = vector / np.linalg.norm(vector)
    along = np.flatnonzero(vector == 1.0)
    name = (
        SLIDES[along[0]][0]
        if len(along)
        else f"slide along ({', '.join(f'{v + 0.0:.3g}' for v in vector)})"
    )
    return name, "N", np.r_[vector, np.zeros(3)]


def rigid_coordinate(
    model: Any, body: str, coefficients: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Motion (r,) of a body and the row (r,) that takes its amount out of q; rows of zeros where
    the body cannot do it.

    The row is that of the centre of mass: row' q = 1 for the motion itself, 0 for the other rigid
    motions and for every elastic mode. As a force it is the pure force, or couple, along the
    motion, spread as inertia is.
    coefficients : (6,) in `body_motions`, rotations about the centre of mass
    """
    mine = model.body == body
    R = body_motions(model, body)
    slides = R[:, :3][:, R[:, :3].any(axis=0)]
    inertia = mine[:, None] * (model.M @ slides)
    R[:, 3:] -= slides @ np.linalg.lstsq(slides.T @ inertia, inertia.T @ R[:, 3:], rcond=None)[0]
    inertia = mine[:, None] * (model.M @ R)
    unit = 1 / np.sqrt(np.maximum(np.einsum("ij,ij->j", R, inertia), np.finfo(float).tiny))
    G = (R * unit).T @ inertia * unit
    row = (
        inertia
        * unit
        @ (np.linalg.pinv(G, rcond=HOLD.on_axis, hermitian=True) @ (coefficients * unit))
    )
    motion = R @ coefficients
    if abs(row @ motion - 1) > HOLD.on_axis:  # on one line, or in a plane: nodes do not feel it
        return np.zeros_like(row), motion
    return row, motion
