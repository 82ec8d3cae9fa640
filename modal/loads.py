"""Static loads on a body as consistent nodal forces: groups of nodes, faces, gravity and rotation.

Every function returns forces (d,) N on the free dofs of a Body; `Reduction.condense_dofs` takes
them to the reduced model, exactly in statics.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.faces import face_rule, group_faces
from tipdamp.modal.mesh import Mesh


@dataclass(frozen=True)
class Rotation:
    """speed : rad/s about the axis (3,) through the point (3,) m."""

    speed: float
    axis: tuple = (1.0, 0.0, 0.0)
    point: tuple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, given in (("axis", self.axis), ("point", self.point)):
            value = np.asarray(given, dtype=float)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise InputError(f"rotation: {name} must be three finite numbers, got {given}")
        if not np.isfinite(self.speed) or np.linalg.norm(self.axis) == 0:
            raise InputError(
                f"rotation: speed = {self.speed:g} rad/s must be finite and the axis must not be "
                "zero"
            )

    @property
    def across(self) -> np.ndarray:
        """(3, 3) projection onto the plane of rotation."""
        k = np.asarray(self.axis, dtype=float) / np.linalg.norm(self.axis)
        return np.eye(3) - np.outer(k, k)


def on_dofs(body: Body, nodal: np.ndarray) -> np.ndarray:
    """Nodal forces (n, 3) N, in the order of body.node, on the free dofs; what acts on clamped
    nodes goes to ground."""
    return np.asarray(nodal, dtype=float)[body.dof_node, body.dof_direction]


def nodal_load(body: Body, numbers: Iterable[int], forces: np.ndarray) -> np.ndarray:
    """Nodal forces (m, 3) N on the nodes of these numbers (m,), added where one stands there twice,
    on the free dofs."""
    nodal = np.zeros((len(body.node), 3))
    index = {int(n): i for i, n in enumerate(body.node)}
    for number, force in zip(numbers, forces, strict=True):
        nodal[index[int(number)]] += force
    return on_dofs(body, nodal)


def point_force(body: Body, group: str, force: ArrayLike) -> np.ndarray:
    """A total force (3,) N in equal parts on the nodes of a group."""
    mine = np.isin(body.node, body.group(group))
    return on_dofs(body, np.outer(mine / mine.sum(), _finite("force", force, 3)))


def pressure(body: Body, mesh: Mesh, group: str, value: float) -> np.ndarray:
    """A pressure in Pa on the faces of a group (`faces.group_faces`); positive presses on the
    body."""
    pascals = _finite("pressure", value)
    return on_dofs(body, _on_faces(mesh, group, lambda area: -pascals * area))


def traction(body: Body, mesh: Mesh, group: str, value: ArrayLike) -> np.ndarray:
    """A traction (3,) Pa, of fixed direction, on the faces of a group."""
    value = _finite("traction", value, 3)
    return on_dofs(
        body,
        _on_faces(mesh, group, lambda area: np.linalg.norm(area, axis=-1, keepdims=True) * value),
    )


def gravity(body: Body, acceleration: ArrayLike) -> np.ndarray:
    """Weight under an acceleration (3,) m/s2."""
    return _inertia(body, np.tile(_finite("acceleration", acceleration, 3), (len(body.node), 1)))


def centrifugal(body: Body, rotation: Rotation) -> np.ndarray:
    """Body force M (speed^2 r), r the arm of each point from the axis: exact, since r is linear
    over an element."""
    arm = (body.position - np.asarray(rotation.point, dtype=float)) @ rotation.across
    return _inertia(body, rotation.speed**2 * arm)


def _finite(name: str, value: Any, *shape: int) -> np.ndarray:
    array = np.asarray(value, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(
            f"{name} = {value} must be {'three finite numbers' if shape else 'a finite number'}"
        )
    return array


def _inertia(body: Body, acceleration: np.ndarray) -> np.ndarray:
    """M a with the accelerations (n, 3) of all nodes, clamped ones included."""
    flat = acceleration.ravel()
    free = 3 * body.dof_node + body.dof_direction
    clamped = np.setdiff1d(np.arange(len(flat)), free)
    force = body.M @ flat[free]
    if body.M_clamped is None:
        return force
    return force + body.M_clamped @ flat[clamped]


def _on_faces(mesh: Mesh, group: str, density: Callable) -> np.ndarray:
    """(n, 3) N: integral of N_i times the force per face, density(area vectors (f, 3) at a Gauss
    point)."""
    mesh.group(group)  # refused where it is not there, or empty
    nodal, count = np.zeros((len(mesh.node), 3)), 0
    for faces in group_faces(mesh, group):
        count += len(faces)
        for shape, slope, weight in zip(*face_rule(faces.shape[1]), strict=True):
            a, b = np.einsum("dk,fkx->dfx", slope, mesh.position[faces])
            force = weight * density(np.cross(a, b))
            for i, column in enumerate(faces.T):
                np.add.at(nodal, column, shape[i] * force)
    if not count:
        raise InputError(
            f"{mesh.source}: the nodes of group '{group}' make up no face of the surface; "
            "a pressure or traction needs a surface group"
        )
    return nodal
