"""Rigid motions that neither the bodies nor the contact resist: found, named, and refused where
they are loaded.

Contact pairs resist a motion that their normals face by more than the errors of coordinates. How
stiff the springs are does not matter: soft ones resist as well as stiff ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.rigid_motion import RIGID_MOTIONS
from tipdamp.hbm.io.dof_table import ROTATIONS
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS, RigidMotionSettings

if TYPE_CHECKING:
    from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies


@dataclass(frozen=True)
class FreeMotions:
    """Rigid motions that neither the bodies nor the pairs resist.

    rigid : (r, 6 b), coefficients : (6 b, m) - each motion in its columns; names - m of (name,
    unit)
    owner : (r,) str - the body of each dof; faced : (m,) - largest motion of a pair, of the largest
    one of a node"""

    rigid: np.ndarray
    coefficients: np.ndarray
    names: Sequence[tuple[str, str]]
    owner: np.ndarray
    faced: np.ndarray
    settings: RigidMotionSettings = SETTINGS

    @cached_property
    def shape(self) -> np.ndarray:
        """(r, m) the motions themselves."""
        return self.rigid @ self.coefficients

    @cached_property
    def _nodal(self) -> np.ndarray:
        """(r,) bool - dofs of nodes: what loads the modes of a body is no force."""
        return self.rigid.any(axis=1)

    @cached_property
    def _bodies(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Dofs of nodes of each body, and (m,) how far each motion moves them."""
        mine = (
            np.flatnonzero(self._nodal & (self.owner == body))
            for body in sorted(set(self.owner.tolist()))
        )
        return [(dofs, np.abs(self.shape[dofs]).max(axis=0, initial=0.0)) for dofs in mine]

    @cached_property
    def _most(self) -> np.ndarray:
        """(m,) how far each motion moves any dof."""
        return np.abs(self.shape).max(axis=0, initial=0.0)

    @cached_property
    def _resultants(self) -> np.ndarray:
        """(r, m) nodal forces that do a unit of work along each motion, as `taken_up` has them."""
        forces = np.zeros(self.coefficients.shape)
        for i, (_, unit) in enumerate(self.names):
            lead = np.tile(np.repeat([unit == "N", unit == "N m"], 3), len(forces) // 6)
            part = np.where(lead, self.coefficients[:, i], 0.0)
            forces[:, i] = part / (part @ part)
        return self.rigid @ np.linalg.lstsq(self.rigid.T @ self.rigid, forces, rcond=None)[0]

    def reach(self, load: np.ndarray) -> np.ndarray:
        """(m,) What the load (r,) on the bodies that take part in each motion could do at most
        along it, N or N m."""
        return sum(
            (most * np.abs(load[mine]).sum() for mine, most in self._bodies),
            np.zeros(len(self.names)),
        )

    def _exceeds(self, amounts: np.ndarray, load: np.ndarray, share: float) -> np.ndarray:
        """(m,) bool - amounts above a share of the reach of the load, and above rounding of all of
        it."""
        everything = self._most * np.abs(load[self._nodal]).sum()
        return np.abs(amounts) > np.maximum(
            share * self.reach(load), self.settings.rounding * everything
        )

    def loaded(self, amounts: np.ndarray, load: np.ndarray) -> list[str]:
        """Sentences on motions along which forces do more than inexact meshes explain: amounts (m,)
        of load (r,)."""
        too_much = self._exceeds(amounts, load, self.settings.taken_up)
        return [
            f"{name} is loaded: {abs(amount):.3g} {unit}, and no contact resists it"
            + (
                f" (the normals face it by {self.faced[i]:.1e} of its size, which counts as "
                f"resisted above facing = {self.settings.facing:g})"
                if self.faced[i] > self.settings.mentioned
                else ""
            )
            + self._beside(i, amount, load)
            for i, ((name, unit), amount) in enumerate(zip(self.names, amounts, strict=True))
            if too_much[i]
        ]

    def _beside(self, i: int, amount: float, load: np.ndarray) -> str:
        """How far a force passes beside the axis of roll i, and where it would not."""
        turn = self.coefficients[:, i].reshape(-1, 6)[:, 3:]
        force = (self.rigid.T @ load).reshape(-1, 6)[:, :3]
        across = np.cross(force, turn)
        if np.count_nonzero(across.any(axis=1)) != 1:  # a couple, a slide, or several bodies
            return ""
        way = -1e3 * amount * across.sum(axis=0) / (across**2).sum()
        size = float(np.linalg.norm(way))
        shift = ", ".join(f"{x:.3g}" for x in np.where(abs(way) > 1e-3 * size, way, 0.0))
        return (
            f": the force passes {size:.3g} mm beside where the normals meet, "
            f"through it when moved by ({shift}) mm"
        )

    def refuse(self, amounts: np.ndarray, load: np.ndarray) -> None:
        """InputError where motions are `loaded`."""
        if loaded := self.loaded(amounts, load):
            raise InputError(
                f"{'; '.join(loaded)}; take the load off, or hold the motion (hold, in [damper] or "
                "[model] of a study)"
            )

    def taken_up(self, along: np.ndarray) -> np.ndarray:
        """(r,) nodal forces that do the work `along` (m,): pure couples against rolls, pure forces
        against slides, so that the balance of forces on the normals stays what it was."""
        return self._resultants @ along

    def reactions(self, amounts: np.ndarray, load: np.ndarray, above: float) -> dict[str, float]:
        """{name: N or N m} constraint reactions: the amounts (m,) above a share of what the load
        (r,) could do."""
        found: dict[str, float] = {}
        for (name, _), amount, much in zip(
            self.names, amounts, self._exceeds(amounts, load, above), strict=True
        ):
            again = sum(one.startswith(name) for one in found)  # of another body, or another piece
            if much:
                found[f"{name} ({again + 1})" if again else name] = float(amount)
        return found


def free_motions(
    model: ReducedModel,
    rigid: np.ndarray,
    floats: np.ndarray,
    motion: sp.csr_matrix,
    rows: np.ndarray,
    settings: RigidMotionSettings = SETTINGS,
) -> FreeMotions:
    """Of a model; rigid (r, 6 b), floats (6 b, m) as of `loose`; motion (3P, r) of the pairs, of
    which springs, however soft, act on `rows`."""
    return unresisted(rigid, floats, motion, rows, model.body, settings, _lengths(model))


def unresisted(
    rigid: np.ndarray,
    coefficients: np.ndarray,
    motion: sp.csr_matrix,
    rows: np.ndarray,
    owner: np.ndarray,
    settings: RigidMotionSettings = SETTINGS,
    weight: ArrayLike = 1.0,
) -> FreeMotions:
    """Those of the motions `coefficients` (6 b, m) of bodies that float which no normal faces by
    more than `facing`.

    motion (3P, r) of the pairs; rows - those of it that are resisted; owner (r,) body of each dof;
    weight : (r,) m - turns displacements into metres. Motions that no body and no pair has in
    common are kept apart.
    """
    weight = np.broadcast_to(weight, len(rigid))[:, None]
    B = motion[rows]
    together = [coefficients[:, :0]]
    for columns in _in_common(coefficients, B @ (rigid @ coefficients)):
        part = coefficients[:, columns]
        _, amount, way = np.linalg.svd(weight * (rigid @ part), full_matrices=False)
        part = part @ (way / amount[:, None]).T
        part = part @ np.linalg.svd(B @ (rigid @ part))[2].T
        together.append(part[:, _faced(motion, rows, rigid @ part, weight) <= settings.facing])
    reduced, names = name_motions(rigid, np.hstack(together).T)
    return FreeMotions(
        rigid, reduced.T, names, owner, _faced(motion, rows, rigid @ reduced.T, weight), settings
    )


def _in_common(coefficients: np.ndarray, faced: np.ndarray) -> list[np.ndarray]:
    """Index arrays of motions (6 b, m) that move the same bodies, or the same pairs, faced (P,
    m)."""
    if not coefficients.shape[1]:
        return []
    bodies = coefficients.reshape(-1, 6, coefficients.shape[1]).any(axis=1)
    touched = sp.csr_matrix(np.vstack([bodies, faced != 0]), dtype=float)
    count, label = connected_components(touched.T @ touched, directed=False)
    return [np.flatnonzero(label == one) for one in range(count)]


def _faced(
    motion: sp.spmatrix, rows: np.ndarray, shapes: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """(m,) largest resisted motion of a pair over the largest motion of a pair: a direction cosine;
    column by column. Pairs on the axis of a rotation do not move."""
    moved = motion @ shapes
    still = SETTINGS.on_axis * np.abs(weight * shapes).max(axis=0)
    return np.abs(moved[rows]).max(axis=0, initial=0.0) / np.maximum(
        np.abs(moved).max(axis=0, initial=0.0), still
    )


def _lengths(model: "ReducedModel | SparseBodies") -> np.ndarray:
    """(r,) m: what turns displacements into metres: 1, and of rotations the size of the body."""
    out = np.ones(model.size)
    for body in set(model.body.tolist()):
        mine = model.body == body
        turning = mine & np.isin(model.direction, ROTATIONS)
        if turning.any():  # a body of contact points alone has no nodes
            out[turning] = (
                np.ptp(model.position[mine & model.moves], axis=0).max(initial=0.0) or 1.0
            )
    return out


def name_motions(
    rigid: np.ndarray, coefficients: np.ndarray
) -> tuple[np.ndarray, list[tuple[str, str]]]:
    """Unit rigid motions (m, 6 b) that span the free ones, each named after the slide or rotation
    that leads it.

    What rotates is a roll, whatever its axis; what is left are slides. Each kind is row reduced
    with complete pivoting, rotations weighed by the size of the body. coefficients (m, 6 b)
    """
    if not len(coefficients):
        return coefficients, []
    size = np.linalg.norm(rigid.reshape(len(rigid), -1, 2, 3), axis=(0, 3))
    weight = np.repeat(size / size[:, :1], 3)  # 1, 1, 1, arm, arm, arm of each body
    rows = np.linalg.qr((coefficients * weight).T)[0].T
    rolls = np.tile(np.repeat([False, True], 3), rows.shape[1] // 6)
    way, share, _ = np.linalg.svd(rows[:, rolls])
    rows = way.T @ rows
    rolled = np.r_[share, np.zeros(len(rows) - len(share))] > SETTINGS.roll
    names = _reduce_rows(rows, weight, rolls, rolled)
    return np.divide(rows, weight, out=np.zeros_like(rows), where=weight > 0), names


def _reduce_rows(
    rows: np.ndarray, weight: np.ndarray, rolls: np.ndarray, rolled: np.ndarray
) -> list[tuple[str, str]]:
    """Row reduces motions (m, 6 b) in place, those that are `rolled` (m,) by the columns of `rolls`
    (6 b,) and the others by slides; the names of what leads them."""
    names: dict[int, tuple[str, str]] = {}
    for kind in (False, True):
        mine = list(map(int, np.flatnonzero(rolled == kind)))
        while left := [i for i in mine if i not in names]:
            at, j = np.unravel_index(
                np.abs(rows[left] * (rolls == kind)).argmax(), (len(left), rows.shape[1])
            )
            i = left[at]
            names[i] = RIGID_MOTIONS[j % 6]
            rows[i] *= weight[j] / rows[i, j]
            for other in np.flatnonzero(rolled >= kind):
                if other != i:
                    rows[other] -= rows[other, j] / rows[i, j] * rows[i]
    return [names[i] for i in range(len(rows))]


def name_of_drift(
    rigid: np.ndarray,
    ways: np.ndarray,
    B: np.ndarray,
    drift: np.ndarray,
    settings: RigidMotionSettings = SETTINGS,
) -> str:
    """The rigid motion of the floating bodies that comes nearest to the motion of the pairs drift
    (P,): the roll that leads it, or a slide where it hardly rolls. rigid (r, 6 b), ways (6 b, m) as
    of `loose`; B (P, r) normal motion of the pairs."""
    coefficients = ways @ np.linalg.lstsq(B @ rigid @ ways, drift, rcond=None)[0]
    amount = np.abs(coefficients) * np.linalg.norm(rigid, axis=0)
    rolls = np.tile(np.repeat([False, True], 3), len(amount) // 6)
    if amount[rolls].max(initial=0.0) > settings.roll * amount.max(initial=0.0):
        amount[~rolls] = 0.0
    return RIGID_MOTIONS[amount.argmax() % 6][0] if amount.any() else "motion of its own"
