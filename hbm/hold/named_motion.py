"""A motion of the model in words, for messages: the body, and whether it slides, rotates or
deforms."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm.hold.rigid_motion import HOLD, body_motions

if TYPE_CHECKING:
    from tipdamp.hbm.model import ReducedModel


@dataclass(frozen=True)
class NamedMotion:
    """A motion in words: the body that it belongs to, whether that moves as a whole, whether it
    turns then, and the rigid motion that it is mostly, as `hold` takes it; empty where it has no
    such name."""

    text: str
    body: str
    rigid: bool
    turns: bool
    motion: str = ""

    @property
    def remedy(self) -> str:
        """How to hold it."""
        if not self.motion:
            return "give that motion a stiffness that restrains it"
        own = f"Hold({self.motion}, mean=True, body='{self.body}')"
        return (
            (
                "hold its mean position, the vibration stays free: hold = { motion = "
                f"{self.motion}, mean = true "
                f"}} in [damper] or [model] of a study (in Python: hold = {own})"
            )
            if self.body == "damper"
            else f"hold its mean position: hold = {own} in Python"
        )

    def __str__(self) -> str:
        return self.text


def describe_motion(model: "ReducedModel", motion: np.ndarray) -> NamedMotion:
    """Which body a motion (r,) belongs to, and whether it moves along or rotates about an axis, or
    deforms."""
    share = {
        body: float(np.sum(motion[model.body == body] ** 2))
        for body in dict.fromkeys(model.body.tolist())
    }
    body = max(share, key=lambda name: share[name])
    rows = np.flatnonzero((model.body == body) & model.moves & np.isfinite(model.position[:, 0]))
    if len(rows) < 3:
        return NamedMotion(
            f"body '{body}', mostly {_dof_name(model, np.abs(motion).argmax())}", body, False, False
        )
    part, size, left = _rigid_part(body_motions(model, body)[rows], motion[rows])
    slide, turn = np.linalg.norm(part[:3]), np.linalg.norm(part[3:])
    turns = bool(turn > 0.3 * slide)  # rolling on an edge moves the centre too
    vector = (part / size)[3:] if turns else part[:3]
    vector = vector / (np.linalg.norm(vector) * np.sign(vector[np.abs(vector).argmax()]) or 1.0)
    verb = "rotates about" if turns else "slides along"
    words = ", ".join(f"{round(v, 2) + 0.0:.2f}" for v in vector)
    k = int(np.abs(vector).argmax())
    oblique = np.abs(np.delete(vector, k)).max() > HOLD.rigid
    name = f"'{'xyz'[k]}'"
    if turns:
        name = f"'about {'xyz'[k]}'"
    elif oblique:
        name = f"[{words}]"
    axis = f" through {_through(model.position[rows].mean(axis=0), part / size)}" if turns else ""
    return NamedMotion(
        f"body '{body}' {verb} ({words}){axis}", body, bool(left < HOLD.rigid), turns, name
    )


def _rigid_part(rigid: np.ndarray, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """(coefficients (6,) of the rigid motions (n, 6) over their sizes (6,), these sizes, the share
    that they leave) of a motion (n,)."""
    size = np.linalg.norm(rigid, axis=0)
    size[size == 0] = 1.0
    part = np.linalg.lstsq(rigid / size, motion, rcond=None)[0]
    left = np.linalg.norm(motion - (rigid / size) @ part)
    return part, size, float(left / max(float(np.linalg.norm(motion)), 1e-300))


def _through(centre: np.ndarray, motion: np.ndarray) -> str:
    """The point of the axis of a rigid motion (6,), slides and turns about the centre, that is
    nearest to it."""
    slide, turn = motion[:3], motion[3:]
    x = centre + np.cross(turn, slide) / (turn @ turn)
    return f"({', '.join(f'{v + 0.0:.3g}' for v in np.where(np.abs(x) < 1e-9, 0.0, x))}) m"


def mostly(motion: np.ndarray) -> NamedMotion:
    """The name of a motion of which nothing but the numbers of its dofs is known."""
    return NamedMotion(f"mostly dof {np.abs(motion).argmax()}", "", False, False)


def _dof_name(model: "ReducedModel", i: int) -> str:
    return f"dof {i} (node {model.node[i]}, {model.direction[i]})"
