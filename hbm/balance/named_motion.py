"""A motion of the model in words, for messages: the body, and whether it slides, rotates or deforms."""

from dataclasses import dataclass

import numpy as np

from hbm.balance.settings import DEFAULT


@dataclass(frozen=True)
class NamedMotion:
    """A motion in words: the body that it belongs to, whether that moves as a whole, and whether it turns then."""

    text: str
    body: str
    rigid: bool
    turns: bool

    def __str__(self) -> str:
        return self.text


def describe_motion(model, motion: np.ndarray) -> NamedMotion:
    """Which body a motion (r,) belongs to, and whether it moves along or rotates about an axis, or deforms."""
    share = {body: float(np.sum(motion[model.body == body] ** 2)) for body in dict.fromkeys(model.body.tolist())}
    body = max(share, key=lambda name: share[name])
    rows = np.flatnonzero((model.body == body) & model.moves & np.isfinite(model.position[:, 0]))
    if len(rows) < 3:
        return NamedMotion(f"body '{body}', mostly {_dof_name(model, np.abs(motion).argmax())}", body, False, False)
    axis = np.array(["xyz".index(d) for d in model.direction[rows]])
    arm = model.position[rows] - model.position[rows].mean(axis=0)
    rigid = np.zeros((len(rows), 6))
    rigid[np.arange(len(rows)), axis] = 1.0
    for k in range(3):
        rigid[:, 3 + k] = np.cross(np.eye(3)[k], arm)[np.arange(len(rows)), axis]
    size = np.linalg.norm(rigid, axis=0)
    size[size == 0] = 1.0
    part = np.linalg.lstsq(rigid / size, motion[rows], rcond=None)[0]
    left = np.linalg.norm(motion[rows] - (rigid / size) @ part) / max(float(np.linalg.norm(motion[rows])), 1e-300)
    slide, turn = np.linalg.norm(part[:3]), np.linalg.norm(part[3:])
    turns = bool(turn > 0.3 * slide)              # rolling on an edge moves the centre too
    vector = (part / size)[3:] if turns else part[:3]
    vector = vector / (np.linalg.norm(vector) * np.sign(vector[np.abs(vector).argmax()]) or 1.0)
    verb = "rotates about" if turns else "slides along"
    words = ", ".join(f"{round(v, 2) + 0.0:.2f}" for v in vector)
    return NamedMotion(f"body '{body}' {verb} ({words})", body, bool(left < DEFAULT.rigid), turns)


def mostly(motion: np.ndarray) -> str:
    """The name of a motion of which nothing but the numbers of its dofs is known."""
    return f"mostly dof {np.abs(motion).argmax() + 1}"


def _dof_name(model, i) -> str:
    return f"dof {i + 1} (node {model.node[i]}, {model.direction[i]})"
