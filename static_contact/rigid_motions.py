"""Motions of the bodies that meet no stiffness: found, named, and made definite by a gauge that carries no force.

Bodies resist what their K does beyond its rounding, contact pairs what their normals face beyond the errors of
coordinates. How stiff the springs are does not matter: soft ones hold as well as stiff ones.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.optimize import linprog
from scipy.sparse.csgraph import connected_components

from hbm.errors import InputError
from hbm.model import ROTATIONS, ReducedModel

FREE_STIFFNESS = 1e-11  # of the stiffness of the nodes held one by one: less is rounding of K, 5e-14 of 80 000 dofs
FACING = 3e-3           # of a motion: normals that face it by less do so by inexact coordinates, and do not hold it
TAKEN_UP = 1e-3         # of the load: what inexact coordinates of meshes leave along motions that nothing holds
_SEEN = 1e-5            # of a motion: a normal that faces it by less is not worth a word
_ROUNDING = 1e-12       # of the distance from the origin
_NOTHING = 1e-10        # of what the whole load could do: less along a motion is rounding
WEAK = 3e-7             # of the same: far below elastic stiffness
_NOISE = 30             # times the most negative stiffness of a rigid motion, which none has: what K's digits leave
_ROLLS = 0.1            # of a motion: more of it by rolling makes it a roll
_FITS = 1e-7            # of the largest gap: overlaps that linear programming takes for none
_LABELS = [(f"slide along {a}", "N") for a in "xyz"] + [(f"roll about {a}", "N m") for a in "xyz"]
_ARM = 1e-6             # of the body's size: nodes that near to an axis lie on it, and turning about it moves nothing


def rigid_motions(model: ReducedModel) -> np.ndarray:
    """(r, 6 b): unit translations along and rotations about x, y, z of every body whose node positions are known.

    Rotations are about the mean position of the body's nodes; where that puts all of them on an axis of x, y, z its
    column is zero. On an oblique line three rotations are kept that span two motions: see `moving`.
    """
    blocks = []
    for body in dict.fromkeys(model.body.tolist()):
        rows = np.flatnonzero((model.body == body) & model.moves)
        if not len(rows) or not np.isfinite(model.position[rows]).all():
            continue
        axis = np.array([("x", "y", "z").index(d) for d in model.direction[rows]])
        arm = model.position[rows] - model.position[rows].mean(axis=0)
        size = np.abs(arm).max()
        if size <= _ROUNDING * np.abs(model.position[rows]).max():
            size = np.inf                                       # one point, and nothing turns
        motions = np.zeros((model.size, 6))
        motions[rows, axis] = 1.0
        for k in range(3):
            turn = np.cross(np.eye(3)[k], arm)[np.arange(len(rows)), axis]
            if np.abs(turn).max() > _ARM * size:
                motions[rows, 3 + k] = turn
            motions[(model.body == body) & (model.direction == ROTATIONS[k]), 3 + k] = 1.0
        blocks.append(motions)
    return np.hstack(blocks) if blocks else np.zeros((model.size, 0))


def moving(rigid) -> np.ndarray:
    """(6 b, m): combinations of the columns of `rigid` that really move nodes, of unit size, body by body.

    Lost are those that nodes on one line, or in one point, do not feel, whatever the direction of the line.
    """
    found = []
    for first in range(0, rigid.shape[1], 6):
        block = rigid[:, first:first + 6]
        size = np.linalg.norm(block, axis=0)
        unit = np.divide(block, size, out=np.zeros_like(block), where=size > 0)
        _, amount, way = np.linalg.svd(unit, full_matrices=False)
        felt = amount > _ARM * amount[0]
        columns = np.zeros((rigid.shape[1], int(felt.sum())))
        columns[first:first + 6] = (way[felt] / amount[felt, None] / np.where(size > 0, size, 1.0)).T
        found.append(columns)
    return np.hstack(found) if found else np.zeros((0, 0))


def floating(rigid, K, below=FREE_STIFFNESS):
    """(6 b, m) coefficients in the columns of `rigid` of the motions that K (r, r) does not resist but by rounding, or
    by less than `below` of the stiffness of the nodes held one by one.

    Positions that do not quite fit K, given with a few digits, make an elastic motion of a rigid one. One step of
    inverse iteration takes that out again before the stiffness is measured. Where K itself has few digits, some rigid
    motions meet negative stiffness: that says how much of it is noise. Bodies that K does not couple are kept apart,
    so that none has rounding of another in its motions.
    """
    found = [np.zeros((rigid.shape[1], 0))]
    for rows, columns in _coupled_by(K, rigid):
        own = _floating_together(rigid[np.ix_(rows, columns)], K[np.ix_(rows, rows)], below)
        found.append(np.zeros((rigid.shape[1], own.shape[1])))
        found[-1][columns] = own
    return np.hstack(found)


def _coupled_by(K, rigid):
    """Dofs, and columns of `rigid`, of the bodies that K couples with each other: one pair of index arrays for each
    such set of bodies."""
    if not rigid.shape[1]:
        return []
    body = sp.csr_matrix(rigid.reshape(len(rigid), -1, 6).any(axis=2))
    label = connected_components(sp.bmat([[sp.csr_matrix(K != 0), body], [body.T, None]]), directed=False)[1]
    of_column = np.repeat(label[len(K):], 6)
    return [(np.flatnonzero(label[:len(K)] == one), np.flatnonzero(of_column == one)) for one in np.unique(of_column)]


def _floating_together(rigid, K, below):
    """As `floating`, of bodies that K couples."""
    ways = moving(rigid)
    own = np.abs(K.diagonal())
    own = np.where(own > 0, own, np.median(own[own > 0]) if own.any() else 1.0)
    motions = rigid @ ways
    size = np.sqrt(np.einsum("ij,i,ij->j", motions, own, motions))
    unit = motions / size
    if not unit.shape[1]:
        return np.zeros((rigid.shape[1], 0))
    root = np.sqrt(own)
    scaled = K / np.outer(root, root)
    near = sl.solve(scaled + WEAK * np.eye(len(K)), root[:, None] * unit, assume_a="sym")
    near = np.linalg.qr(near / np.linalg.norm(near, axis=0))[0]
    stiffness, mixed = np.linalg.eigh(near.T @ scaled @ near)
    free = stiffness < max(below, min(-_NOISE * stiffness[0], WEAK))
    softest = np.linalg.lstsq(root[:, None] * unit, near @ mixed[:, free], rcond=None)[0]
    return ways @ (softest / size[:, None])


@dataclass(frozen=True)
class FreeMotions:
    """Rigid motions that neither the bodies nor the pairs resist.

    rigid : (r, 6 b), coefficients : (6 b, m) - each motion in its columns; names - m of (name, unit)
    owner : (r,) str - the body of each dof; faced : (m,) - largest motion of a pair, of the largest one of a node
    """

    rigid: np.ndarray
    coefficients: np.ndarray
    names: list
    owner: np.ndarray
    faced: np.ndarray
    facing: float

    @property
    def shape(self) -> np.ndarray:
        """(r, m)"""
        return self.rigid @ self.coefficients

    def reach(self, load) -> np.ndarray:
        """(m,) What the load (r,) on the bodies that take part in each motion could do at most along it, N or N m.

        On the dofs of nodes alone: what loads the modes of a body is no force."""
        nodal, shape = self.rigid.any(axis=1), self.shape
        return sum((np.abs(shape[mine]).max(axis=0, initial=0.0) * np.abs(load[mine]).sum()
                    for mine in (nodal & (self.owner == body) for body in sorted(set(self.owner.tolist())))),
                   np.zeros(len(self.names)))

    def _exceeds(self, amounts, load, share):
        """(m,) bool - amounts above a share of the reach of the load, and above rounding of all of it."""
        nodal = self.rigid.any(axis=1)
        everything = np.abs(self.shape).max(axis=0, initial=0.0) * np.abs(load[nodal]).sum()
        return np.abs(amounts) > np.maximum(share * self.reach(load), _NOTHING * everything)

    def refuse(self, amounts, load):
        """InputError where forces do more along a motion than inexact meshes explain: amounts (m,) of load (r,)."""
        loaded = [f"{name} is loaded: {abs(amount):.3g} {unit}, and no contact resists it" + (
                      f" (the normals face it by {faced:.1e} of its size, which counts as held above facing = "
                      f"{self.facing:g})" if faced > _SEEN else "")
                  for (name, unit), amount, faced, much in zip(
                      self.names, amounts, self.faced, self._exceeds(amounts, load, TAKEN_UP), strict=True) if much]
        if loaded:
            raise InputError("; ".join(loaded))

    def taken_up(self, along):
        """(r,) nodal forces that do the work `along` (m,): pure couples against rolls, pure forces against slides, so
        that the balance of forces on the normals stays what it was."""
        taken = np.zeros(len(self.rigid))
        for (_, unit), amount, coefficients in zip(self.names, along, self.coefficients.T, strict=True):
            lead = np.tile(np.repeat([unit == "N", unit == "N m"], 3), len(coefficients) // 6)
            part = np.where(lead, coefficients, 0.0)
            resultant = amount * part / (part @ part)
            taken += self.rigid @ np.linalg.lstsq(self.rigid.T @ self.rigid, resultant, rcond=None)[0]
        return taken

    def held(self, amounts, load, above) -> dict:
        """{name: amount} of those above a share of what the load could do."""
        return {name: float(amount) for (name, _), amount, much in zip(
            self.names, amounts, self._exceeds(amounts, load, above), strict=True) if much}


def free_motions(rigid, model, B, facing=FACING) -> FreeMotions:
    """Of a model; B (P, r) the motions of the pairs that springs act on, however soft."""
    return unfaced(rigid, floating(rigid, model.K), B, model.body, facing, _lengths(model))


def unfaced(rigid, coefficients, B, owner, facing=FACING, weight=1.0) -> FreeMotions:
    """Those of the motions `coefficients` (6 b, m) of bodies that float which no normal faces by more than `facing`.

    weight : (r,) m - turns displacements into metres. Motions that no body and no pair has in common are kept apart.
    """
    weight = np.broadcast_to(weight, len(rigid))[:, None]
    together = [coefficients[:, :0]]
    for columns in _in_common(coefficients, B @ (rigid @ coefficients)):
        part = coefficients[:, columns]
        _, amount, way = np.linalg.svd(weight * (rigid @ part), full_matrices=False)
        part = part @ (way / amount[:, None]).T
        part = part @ np.linalg.svd(B @ (rigid @ part))[2].T
        together.append(part[:, _faced(B, rigid @ part, weight) <= facing])
    coefficients = np.hstack(together)
    reduced, names = name_motions(rigid, coefficients.T)
    return FreeMotions(rigid, reduced.T, names, owner, _faced(B, rigid @ reduced.T, weight), facing)


def _in_common(coefficients, faced):
    """Index arrays of motions (6 b, m) that move the same bodies, or the same pairs, faced (P, m)."""
    if not coefficients.shape[1]:
        return []
    bodies = coefficients.reshape(-1, 6, coefficients.shape[1]).any(axis=1)
    touched = sp.csr_matrix(np.vstack([bodies, faced != 0]), dtype=float)
    count, label = connected_components(touched.T @ touched, directed=False)
    return [np.flatnonzero(label == one) for one in range(count)]


def _faced(B, motions, weight):
    """(m,) largest motion of a pair over the largest motion of a node, column by column."""
    return np.abs(B @ motions).max(axis=0, initial=0.0) / np.abs(weight * motions).max(axis=0)


def _lengths(model):
    """(r,) m: what turns displacements into metres: 1, and of rotations the size of the body."""
    out = np.ones(model.size)
    for body in set(model.body.tolist()):
        mine = model.body == body
        at = model.position[mine & model.moves]
        out[mine & np.isin(model.direction, ROTATIONS)] = np.ptp(at, axis=0).max(initial=0.0) or 1.0
    return out


def name_motions(rigid, coefficients):
    """Unit rigid motions that span the free ones: each named after the slide or rotation that leads it.

    Row reduction of coefficients (m, 6 f) with complete pivoting, rotations weighed by the size of the body.
    """
    if not len(coefficients):
        return coefficients, []
    size = np.linalg.norm(rigid.reshape(len(rigid), -1, 2, 3), axis=(0, 3))
    weight = np.repeat(size / size[:, :1], 3)                   # 1, 1, 1, arm, arm, arm of each body
    rows, names = coefficients.copy(), [None] * len(coefficients)
    for _ in names:
        left = [i for i, name in enumerate(names) if name is None]
        i, j = np.unravel_index(np.abs(rows[left] * weight).argmax(), (len(left), rows.shape[1]))
        i = left[i]
        names[i] = _LABELS[j % 6]
        rows[i] /= rows[i, j]
        for other in range(len(rows)):
            if other != i:
                rows[other] -= rows[other, j] * rows[i]
    return rows, names


def name_of_drift(rigid, K, B, drift) -> str:
    """The rigid motion of the bodies that float that comes nearest to the motion of the pairs drift (P,): the roll that
    leads it, and a slide where it hardly rolls. rigid and K as in `floating`; B (P, r) normal motion of the pairs."""
    ways = floating(rigid, K)
    coefficients = ways @ np.linalg.lstsq(B @ rigid @ ways, drift, rcond=None)[0]
    amount = np.abs(coefficients) * np.linalg.norm(rigid, axis=0)
    rolls = np.tile(np.repeat([False, True], 3), len(amount) // 6)
    if amount[rolls].max(initial=0.0) > _ROLLS * amount.max(initial=0.0):
        amount[~rolls] = 0.0
    return _LABELS[amount.argmax() % 6][0] if amount.any() else "motion of its own"


def unstressed(loose, B, gap):
    """(r,) combination of the motions `loose` (r, m) of the bodies that float with which no pair overlaps, B q <= gap
    (P,): without load no contact force is needed. The one that leaves most room, up to the largest gap. None where the
    bodies do not fit.

    B (P, r) normal motion of the pairs.
    """
    size = np.abs(gap).max()
    if not loose.shape[1] or size == 0:
        return np.zeros(len(loose)) if (gap >= 0).all() else None
    motion = B @ loose
    reach = np.abs(motion).max(axis=0)
    reach[reach == 0] = 1.0
    scaled = np.column_stack([motion / reach, np.ones(len(gap))])            # in units of the largest gap
    answer = linprog(np.r_[np.zeros(loose.shape[1]), -1.0], A_ub=scaled, b_ub=gap / size,
                     bounds=[(None, None)] * loose.shape[1] + [(None, 1.0)], method="highs")
    if answer.status != 0 or answer.x[-1] < -_FITS:
        return None
    return loose @ (size * answer.x[:-1] / reach)
