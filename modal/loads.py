"""Static loads on a body as consistent nodal forces: groups of nodes, faces, gravity and rotation.

Every function returns forces (d,) N on the free dofs of a Body; `Reduction.condense_dofs` takes them to the reduced
model, exactly in statics.
"""

from dataclasses import dataclass

import numpy as np

from hbm.errors import InputError
from modal.body import Body
from modal.mesh import Mesh, boundary_faces


@dataclass(frozen=True)
class Rotation:
    """speed : rad/s about the axis (3,) through the point (3,) m."""

    speed: float
    axis: tuple = (1.0, 0.0, 0.0)
    point: tuple = (0.0, 0.0, 0.0)

    def __post_init__(self):
        for name in ("axis", "point"):
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise InputError(f"rotation: {name} must be three finite numbers, got {getattr(self, name)}")
        if not np.isfinite(self.speed) or np.linalg.norm(self.axis) == 0:
            raise InputError(f"rotation: speed = {self.speed:g} rad/s must be finite and the axis must not be zero")

    @property
    def across(self) -> np.ndarray:
        """(3, 3) projection onto the plane of rotation."""
        k = np.asarray(self.axis, dtype=float) / np.linalg.norm(self.axis)
        return np.eye(3) - np.outer(k, k)


def on_dofs(body: Body, nodal: np.ndarray) -> np.ndarray:
    """Nodal forces (n, 3) N, in the order of body.node, on the free dofs; what acts on clamped nodes goes to ground."""
    return np.asarray(nodal, dtype=float)[body.dof_node, body.dof_direction]


def point_force(body: Body, group: str, force) -> np.ndarray:
    """A total force (3,) N in equal parts on the nodes of a group."""
    mine = np.isin(body.node, body.group(group))
    return on_dofs(body, np.outer(mine / mine.sum(), _finite("force", force, 3)))


def pressure(body: Body, mesh: Mesh, group: str, value: float) -> np.ndarray:
    """A pressure in Pa on the faces whose nodes all belong to the group; positive presses on the body."""
    value = _finite("pressure", value)
    return on_dofs(body, _on_faces(mesh, group, lambda area: -value * area))


def traction(body: Body, mesh: Mesh, group: str, value) -> np.ndarray:
    """A traction (3,) Pa, of fixed direction, on the faces whose nodes all belong to the group."""
    value = _finite("traction", value, 3)
    return on_dofs(body, _on_faces(mesh, group, lambda area: np.linalg.norm(area, axis=-1, keepdims=True) * value))


def gravity(body: Body, acceleration) -> np.ndarray:
    """Weight under an acceleration (3,) m/s2."""
    return _inertia(body, np.tile(_finite("acceleration", acceleration, 3), (len(body.node), 1)))


def centrifugal(body: Body, rotation: Rotation) -> np.ndarray:
    """Body force M (speed^2 r), r the arm of each point from the axis: exact, since r is linear over an element."""
    arm = (body.position - np.asarray(rotation.point, dtype=float)) @ rotation.across
    return _inertia(body, rotation.speed**2 * arm)


def _finite(name, value, *shape):
    array = np.asarray(value, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"{name} = {value} must be {'three finite numbers' if shape else 'a finite number'}")
    return array


def _inertia(body, acceleration):
    """M a with the accelerations (n, 3) of all nodes, clamped ones included."""
    flat = acceleration.ravel()
    free = 3 * body.dof_node + body.dof_direction
    clamped = np.setdiff1d(np.arange(len(flat)), free)
    force = body.M @ flat[free]
    if body.M_clamped is None:
        return force
    return force + body.M_clamped @ flat[clamped]


# ---- faces -----------------------------------------------------------------------------------------------------

_TRIANGLE = {3: [(0, 0), (1, 0), (0, 1)], 6: [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]}
_SQUARE = {4: [(i, j) for i in range(2) for j in range(2)], 9: [(i, j) for i in range(3) for j in range(3)]}
_SQUARE[8] = [p for p in _SQUARE[9] if p != (2, 2)]
_QUAD = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=float)
_TRI = np.array([(0, 0), (1, 0), (0, 1), (.5, 0), (.5, .5), (0, .5)])


def _on_faces(mesh, group, density):
    """(n, 3) N: integral of N_i times the force per face, density(area vectors (f, 3) at a Gauss point)."""
    member = np.zeros(len(mesh.node), dtype=bool)
    member[mesh.index(mesh.group(group))] = True
    nodal, count = np.zeros((len(mesh.node), 3)), 0
    for faces in boundary_faces(mesh):
        faces = faces[member[faces].all(axis=1)]
        count += len(faces)
        for shape, slope, weight in zip(*_rule(faces.shape[1]), strict=True):
            a, b = np.einsum("dk,fkx->dfx", slope, mesh.position[faces])
            force = weight * density(np.cross(a, b))
            for i, column in enumerate(faces.T):
                np.add.at(nodal, column, shape[i] * force)
    if not count:
        raise InputError(f"{mesh.source}: the nodes of group '{group}' make up no face of the surface; "
                         "a pressure or traction needs a surface group")
    return nodal


def _rule(nodes):
    """Shape functions (g, k), slopes (g, 2, k) and weights (g,) of a face with so many nodes."""
    power = np.array({**_TRIANGLE, **_SQUARE}[nodes])
    if nodes in _TRIANGLE:          # the square rule collapsed onto the triangle: exact to degree 5
        x, w = np.polynomial.legendre.leggauss(4)
        r, s = ((g.ravel() + 1) / 2 for g in np.meshgrid(x, x))
        points, weight = np.column_stack([r, s * (1 - r)]), (np.outer(w, w).ravel() / 4) * (1 - r)
        reference = _TRI[:nodes]
    else:
        x, w = np.polynomial.legendre.leggauss(4)
        points, weight = np.column_stack([g.ravel() for g in np.meshgrid(x, x)]), np.outer(w, w).ravel()
        reference = _QUAD[:nodes]
    inverse = np.linalg.inv(_monomials(power, reference, (0, 0)))
    slope = np.stack([_monomials(power, points, d) @ inverse for d in ((1, 0), (0, 1))], axis=1)
    return _monomials(power, points, (0, 0)) @ inverse, slope, weight


def _monomials(power, points, derivative):
    """x^i y^j of each pair of powers at each point, or its first derivative."""
    (i, j), (dx, dy) = power.T, derivative
    x, y = points.T[:, :, None]
    return (i**dx) * x ** np.maximum(i - dx, 0) * (j**dy) * y ** np.maximum(j - dy, 0)
