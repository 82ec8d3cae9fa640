"""Rigid motions of the bodies, and those that their stiffness does not resist: a body that floats.

A body resists what its K does beyond its rounding. free_motions.py looks for those that no contact
resists either."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from tipdamp.hbm.hold.rigid_motion import HOLD, body_motions
from tipdamp.hbm.model import ReducedModel


@dataclass(frozen=True)
class RigidMotionSettings:
    """Thresholds that tell a free motion from a stiff one, and a load from rounding."""

    # of the stiffness of single dofs: less is rounding of K, 5e-14 of 80 000 dofs
    free_stiffness: float = 1e-11
    weak: float = 3e-7  # of the same: far below elastic stiffness
    doubtful: float = 1e-9  # of the same: less is rounding rather than a spring that somebody meant
    # times the most negative stiffness of a rigid motion: what the digits of K leave
    noise: float = 30.0
    on_axis: float = HOLD.on_axis  # of the body's size: nodes that near to an axis lie on it
    # direction cosine below which a normal counts as orthogonal (coordinate round-off)
    facing: float = 3e-3
    # of the load: what inexact coordinates leave along a motion that nothing resists
    taken_up: float = 1e-3
    mentioned: float = 1e-5  # of a motion: a normal that faces it by less is not worth a word
    rounding: float = 1e-10  # of what the whole load could do along a motion
    parallel: float = 1e-6  # of a side force: normals that near to one plane, or line, share theirs
    roll: float = 0.1  # of a motion: with more rotation than that it is called a roll
    along: float = 0.9999  # of a slide: with less of one coordinate a hold needs its direction


SETTINGS = RigidMotionSettings()


def rigid_motions(model: ReducedModel) -> np.ndarray:
    """(r, 6 b): unit translations along and rotations about x, y, z of every body that floats, or
    may float and whose node positions are known.

    Those that the model knows of a body; otherwise those of its nodes, with rotations about their
    mean position; where that puts all of them on an axis of x, y, z its column is zero. On an
    oblique line three rotations are kept that span two motions: see `moving`.
    """
    blocks = []
    for body in dict.fromkeys(model.body.tolist()):
        rows = np.flatnonzero((model.body == body) & model.moves)
        if body in model.rigid:
            block = np.zeros((model.size, model.rigid[body].shape[1]))
            block[model.body == body] = model.rigid[body]
            blocks.append(block)
        elif len(rows) and np.isfinite(model.position[rows]).all():
            blocks.append(body_motions(model, body))
    return np.hstack(blocks) if blocks else np.zeros((model.size, 0))


def loose(
    model: ReducedModel,
    rigid: np.ndarray,
    below: float | None = None,
    settings: RigidMotionSettings = SETTINGS,
) -> np.ndarray:
    """(6 b, m) coefficients in the columns of `rigid_motions` of those that K does not resist: what
    the model knows, and of the other bodies what `floating` finds."""
    known = np.isin(model.body, list(model.rigid))
    columns = np.repeat(
        rigid[known].reshape(known.sum(), rigid.shape[1] // 6, 6).any(axis=(0, 2)), 6
    )
    rest = floating(
        rigid[np.ix_(~known, ~columns)], model.K[np.ix_(~known, ~known)], below, settings
    )
    own = moving(rigid[np.ix_(known, columns)], settings)
    found = np.zeros((rigid.shape[1], own.shape[1] + rest.shape[1]))
    found[columns, : own.shape[1]], found[~columns, own.shape[1] :] = own, rest
    return found


def moving(rigid: np.ndarray, settings: RigidMotionSettings = SETTINGS) -> np.ndarray:
    """(6 b, m): combinations of the columns of `rigid` that really move nodes, of unit size, body
    by body.

    Lost are those that nodes on one line, or in one point, do not feel, whatever the direction of
    the line.
    """
    found = []
    for first in range(0, rigid.shape[1], 6):
        block = rigid[:, first : first + 6]
        size = np.linalg.norm(block, axis=0)
        size = np.where(size > settings.on_axis**2 * size.max(initial=0.0), size, 0.0)
        unit = np.divide(block, size, out=np.zeros_like(block), where=size > 0)
        _, amount, way = np.linalg.svd(unit, full_matrices=False)
        felt = amount > settings.on_axis * amount[0]
        columns = np.zeros((rigid.shape[1], int(felt.sum())))
        columns[first : first + 6] = (
            way[felt] / amount[felt, None] / np.where(size > 0, size, 1.0)
        ).T
        found.append(columns)
    return np.hstack(found) if found else np.zeros((0, 0))


def floating(
    rigid: np.ndarray,
    K: np.ndarray,
    below: float | None = None,
    settings: RigidMotionSettings = SETTINGS,
) -> np.ndarray:
    """(6 b, m) coefficients in the columns of `rigid` of the motions that K (r, r) does not resist
    beyond rounding, or by less than `below` of the stiffness of single dofs.

    Positions given with a few digits do not quite fit K and make an elastic motion of a rigid one:
    one step of inverse iteration takes that out before the stiffness is measured. Where K itself
    has few digits, some rigid motions meet negative stiffness: that says how much of it is noise.
    Bodies that K does not couple are kept apart, so that none has rounding of another in its
    motions.
    """
    found = [np.zeros((rigid.shape[1], 0))]
    for rows, columns in _coupled_by(K, rigid):
        own = _floating_together(
            rigid[np.ix_(rows, columns)],
            K[np.ix_(rows, rows)],
            settings.free_stiffness if below is None else below,
            settings,
        )
        found.append(np.zeros((rigid.shape[1], own.shape[1])))
        found[-1][columns] = own
    return np.hstack(found)


def _coupled_by(
    K: sp.spmatrix | np.ndarray, rigid: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Dofs, and columns of `rigid`, of the bodies that K couples with each other: one pair of index
    arrays for each such set of bodies."""
    if not rigid.shape[1]:
        return []
    body = sp.csr_matrix(rigid.reshape(len(rigid), -1, 6).any(axis=2))
    label = connected_components(
        sp.bmat([[sp.csr_matrix(K != 0), body], [body.T, None]]), directed=False
    )[1]
    of_column = np.repeat(label[len(K) :], 6)
    return [
        (np.flatnonzero(label[: len(K)] == one), np.flatnonzero(of_column == one))
        for one in np.unique(of_column)
    ]


def _floating_together(
    rigid: np.ndarray, K: np.ndarray, below: float, settings: RigidMotionSettings
) -> np.ndarray:
    """As `floating`, of bodies that K couples."""
    ways = moving(rigid, settings)
    own = np.abs(K.diagonal())
    own = np.where(own > 0, own, np.median(own[own > 0]) if own.any() else 1.0)
    motions = rigid @ ways
    size = np.sqrt(np.einsum("ij,i,ij->j", motions, own, motions))
    unit = motions / size
    if not unit.shape[1]:
        return np.zeros((rigid.shape[1], 0))
    root = np.sqrt(own)
    scaled = K / np.outer(root, root)
    near = sl.solve(scaled + settings.weak * np.eye(len(K)), root[:, None] * unit, assume_a="sym")
    near = np.linalg.qr(near / np.linalg.norm(near, axis=0))[0]
    stiffness, mixed = np.linalg.eigh(near.T @ scaled @ near)
    free = stiffness < max(below, min(-settings.noise * stiffness[0], settings.weak))
    softest = np.linalg.lstsq(root[:, None] * unit, near @ mixed[:, free], rcond=None)[0]
    return ways @ (softest / size[:, None])
