"""Mass and support of an elastic body by its mesh alone, where nothing else is asked of its
matrices."""

import numpy as np

from tipdamp.modal.elasticity import Material, blocks
from tipdamp.modal.elements.cells import tables
from tipdamp.modal.elements.isoparametric import chunks, gradients
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import parts

HELD = 1e-6  # of the largest: a rigid motion that moves clamped nodes less may be free


def moving_mass(
    mesh: Mesh, fixed: np.ndarray, material: Material, others: dict[str, Material]
) -> float:
    """kg that a unit translation of all but the fixed nodes, (n,) bool, moves, along any direction;
    as `Body.mass` has it from the consistent mass matrix."""
    moves, mass = np.where(fixed, 0.0, 1.0), 0.0
    for kind, cells, of in blocks(mesh, material, others):
        N = tables(kind)[0]
        for part in chunks(cells):
            volume = gradients(mesh.position[part], kind)[1]
            mass += of.density * float((volume * (moves[part] @ N.T) ** 2).sum())
    return mass


def all_held(mesh: Mesh, fixed: np.ndarray) -> bool:
    """Whether the fixed nodes, (n,) bool, hold every piece of the mesh beyond doubt: no rigid
    motion of one leaves them in place, or nearly so."""
    count, label = parts(mesh)
    return all(_held(mesh.position[label == i], fixed[label == i]) for i in range(count))


def _held(position: np.ndarray, fixed: np.ndarray) -> bool:
    """Translations and turns about the centre, by the size of the piece, at the fixed nodes."""
    arm = (position - position.mean(axis=0)) / max(np.ptp(position, axis=0).max(), 1e-300)
    unit = np.eye(3)
    turns = np.stack([np.cross(way, arm[fixed]) for way in unit], axis=-1)
    motions = np.concatenate([np.broadcast_to(unit, (int(fixed.sum()), 3, 3)), turns], axis=2)
    size = np.linalg.svd(motions.reshape(-1, 6), compute_uv=False)
    return len(size) == 6 and bool(size[5] > HELD * size[0])
