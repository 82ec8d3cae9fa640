"""A hold: what keeps a rigid motion that no contact resists from drifting, and the force that this
takes.

The spring acts on the coordinate s = row' q of the motion (`rigid_motion.rigid_coordinate`), K + k
row row': a pure force or couple on the body, that bends nothing. Soft beside the contacts and the
inertia it changes no vibration, and its mean force is the mean friction force that a stop would
have to balance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import ContactTable, Moves, relative_motion
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.hold.rigid_motion import (
    HOLD,
    body_motions,
    parse_motion,
    rigid_coordinate,
    share_faced,
)
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.validation import brief, check_kind, positive

if TYPE_CHECKING:
    import scipy.sparse as sp


class Bodies(Moves, Protocol):
    """What a hold asks of a model beside `Moves`: a ReducedModel, or bodies that are not
    reduced."""

    @property
    def body(self) -> np.ndarray:
        """(r,) of each dof."""

    @property
    def position(self) -> np.ndarray:
        """(r, 3) m, of each dof, NaN where that is not known."""

    @property
    def K(self) -> Any:
        """(r, r) N/m, dense or sparse."""


@dataclass(frozen=True)
class Hold:
    """A rigid motion of a body that is to be held.

    motion : direction (3,), 'x', 'y', 'z', or 'about x', 'about y', 'about z' (through the centre
    of mass)
    stiffness : N/m, of rotations N m/rad; None: 1e-5 of what the sticking pairs resist the motion
    with
    mean : only the mean of the motion is held, and rigidly: the vibration along it is free

    >>> model, pairs = two_blades()
    >>> flat = pairs.replace(frame=[np.eye(3)] * 2)  # normals along z: friction alone resists y
    >>> tip = model.displacement_row("blade1", 1, [0, 1, 0])
    >>> given = dict(damping_ratio=0.01, outputs={"tip": tip}, harmonics=1)
    >>> hold = Hold("y", mean=True)
    >>> curve = forced_response(model, flat, DryFriction2T(), tip, (650, 800), hold=hold, **given)
    >>> curve.held.tolist()
    ['damper: slide along y']
    """

    motion: "str | ArrayLike"
    stiffness: float | None = None
    mean: bool = False
    body: str = "damper"


@dataclass(frozen=True, eq=False)
class HeldMotion:
    """A hold on the dofs of a model.

    name : 'damper: slide along y'; unit : of its force, 'N' or 'N m'
    row, motion : (r,) amount of the motion in q, and the motion itself; stiffness : N/m or N m/rad,
    of the amount
    mean : order 0 alone is held, rigidly; doubt : a sentence where contact normals resist the
    motion too
    small : m or rad, up to which displacements along it count as small
    extent : largest displacement of a dof in the motion, which makes of a force on the dofs one
    along the motion

    >>> model, pairs = two_blades()
    >>> flat = pairs.replace(frame=[np.eye(3)] * 2)  # normals along z: friction alone resists y
    >>> held: HeldMotion = held_motions(model, flat, Hold("y"))[0]
    >>> print(f"{held.name}, {held.stiffness:.0f} {held.unit}/m")
    damper: slide along y, 50 N/m
    """

    name: str
    unit: str
    row: np.ndarray
    motion: np.ndarray
    stiffness: float
    mean: bool = False
    doubt: str = ""
    small: float = np.inf
    extent: float = 1.0


def held_motions(
    model: ReducedModel | Bodies, pairs: ContactTable, holds: Hold | Sequence[Hold]
) -> tuple[HeldMotion, ...]:
    """The holds on the dofs of a model whose pairs carry.

    Raises InputError for an unknown body or motion, a stiffness that is not positive, a motion that
    the body cannot do, that its own stiffness holds, or that is held twice.

    >>> model, pairs = two_blades()
    >>> flat = pairs.replace(frame=[np.eye(3)] * 2)  # normals along z: friction alone resists y
    >>> [held.name for held in held_motions(model, flat, [Hold("y"), Hold([0, 0, 1])])]
    ['damper: slide along y', 'damper: slide along z']
    """
    found: list[HeldMotion] = []
    for given in holds if isinstance(holds, list | tuple) else [holds]:
        hold: Hold = check_kind("hold", given, Hold, "Hold('y') or Hold([0, 1, 0], stiffness)")
        try:
            found.append(_held(model, pairs, hold))
        except InputError as error:
            raise InputError(f"hold = {brief(hold.motion)}: {error}") from None
    rows = np.array([held.row / np.linalg.norm(held.row) for held in found])
    if len(found) > 1 and np.linalg.matrix_rank(rows, tol=1e-6) < len(found):
        raise InputError(
            f"hold = {[held.name for held in found]}: a motion is held twice; leave one of them out"
        )
    return tuple(found)


def with_springs(K: np.ndarray, held: Sequence[HeldMotion]) -> np.ndarray:
    """(r, r) K + sum k row row'."""
    rows = np.array([np.sqrt(one.stiffness) * one.row for one in held])
    return K + rows.T @ rows if len(rows) else K


def spring_forces(held: Sequence[HeldMotion], q: np.ndarray) -> dict[str, float]:
    """{name: N or N m}: the forces on the springs that hold motions where the displacement is q
    (r,)."""
    return {one.name: one.stiffness * float(one.row @ q) for one in held}


def springs(held: Sequence[HeldMotion]) -> tuple[HeldMotion, ...]:
    """The same, with a spring where only the mean is held."""
    return tuple(replace(one, mean=False) for one in held)


def _held(model: Bodies, pairs: ContactTable, hold: Hold) -> HeldMotion:
    name, unit, coefficients = parse_motion(hold.motion)
    bodies = list(dict.fromkeys(model.body.tolist()))
    if hold.body not in bodies:
        raise InputError(f"the model has no body '{hold.body}'; {nearest(str(hold.body), bodies)}")
    row, motion = rigid_coordinate(model, hold.body, coefficients)
    if not row.any():
        raise InputError(
            f"the {hold.body} has no such motion in the model: its nodes have no dofs along it, "
            "lie on one line, or their positions are unknown"
        )
    used = pairs.select(pairs.carrying)
    B, given = relative_motion(model, used), hold.stiffness
    if given is None:
        given = _soft_stiffness(B, used, motion)
    given = positive("stiffness", given, f" {unit}/{'m' if unit == 'N' else 'rad'}")
    if not isinstance(hold.mean, bool):
        raise InputError(f"mean = {brief(hold.mean)}: must be True or False")
    _refuse_supported(model, hold.body, motion, given)
    normals = B[2::3]
    faced = min(share_faced(normals, motion), _faced(model, hold.body, row, normals))
    doubt = (
        ""
        if faced <= HOLD.faced
        else (
            f"hold = {brief(hold.motion)}: contact normals face the {name} of the {hold.body} by "
            f"{faced:.2g} of its size and hold it while they are closed, whatever other rigid "
            "motions go with it; the hold is for curves that end without it as the damper rolls "
            "or slides, where contacts open or few are kept: leave it out where none does"
        )
    )
    small = HOLD.small_angle * (1.0 if unit == "N m" else _size(model, hold.body) or np.inf)
    return HeldMotion(
        f"{hold.body}: {name}",
        unit,
        row,
        motion,
        given,
        hold.mean,
        doubt,
        small,
        float(np.abs(motion).max()),
    )


def _faced(model: Bodies, body: str, row: np.ndarray, normals: "sp.spmatrix") -> float:
    """How much the normals (P, r) face the rigid motion of a unit of the coordinate `row` that they
    face least, as a share of its size: 0 where the body can do it past them, by other rigid motions
    beside it."""
    R = body_motions(model, body)
    R = R[:, R.any(axis=0)] / np.abs(R[:, R.any(axis=0)]).max(axis=0)
    met = normals @ R
    G = met.T @ met
    c = np.linalg.solve(G + HOLD.on_axis**2 * max(np.trace(G), 1.0) * np.eye(len(G)), row @ R)
    return share_faced(normals, R @ c)


def _size(model: Bodies, body: str) -> float:
    """m, largest extent of the nodes of a body; 0 where it is not known."""
    position = model.position[(model.body == body) & np.isfinite(model.position).all(axis=1)]
    return np.ptp(position, axis=0).max() if len(position) else 0.0


def _soft_stiffness(B: "sp.spmatrix", pairs: ContactTable, motion: np.ndarray) -> float:
    """N/m: a small share of what sticking pairs resist the motion with; hard contact, which has no
    spring, counts as none."""
    k = (pairs.weight[:, None] * np.stack([pairs.kt, pairs.kt, pairs.kn], axis=1)).ravel()
    resisted = float(np.where(np.isfinite(k), k, 0.0) @ (B @ motion) ** 2)
    if not resisted > 0:
        raise InputError(
            "no pair resists this motion even where it sticks, so that no stiffness follows: give "
            "it"
        )
    return HOLD.hold * resisted


def _refuse_supported(model: Bodies, body: str, motion: np.ndarray, stiffness: float) -> None:
    """InputError where K resists the motion by more than the hold would, beyond rounding."""
    own = motion @ (model.K @ motion)
    noise = HOLD.noise * np.finfo(float).eps * (np.abs(motion) @ (abs(model.K) @ np.abs(motion)))
    if own > max(stiffness, noise):
        raise InputError(
            f"the {body} is supported: its own stiffness resists this motion with {own:.3g}, and "
            f"the hold would with {stiffness:.3g}; there is nothing to hold, leave it out"
        )
