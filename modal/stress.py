"""Stresses on the full mesh from nodal displacements, for example those that `Reduction.recover` gives."""

import numpy as np

from modal.elasticity import Material, blocks
from modal.elements.cells import CELLS
from modal.elements.isoparametric import CHUNK, gradients, hooke
from modal.mesh import Mesh

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


def nodal_stress(mesh: Mesh, material: Material, displacement: np.ndarray,
                 other_materials: dict[str, Material] | None = None) -> np.ndarray:
    """Stress at every node, (n, 6) Pa in the order of COMPONENTS; displacement (n, 3) m, real or complex.

    Linear elastic, isotropic; other_materials {cell group: Material} as in `elastic_body`. An isolated node has NaN.
    In each cell the stress is sampled at the integration points, where isoparametric cells are most accurate [Barlow
    1976], fitted by the field of a cell without midside nodes and extrapolated to the nodes; there it is averaged over
    the adjacent cells by volume, across the interface of two materials too, where the true stress jumps.
    """
    total = np.zeros((len(mesh.node), 6), dtype=np.result_type(displacement, float))
    weight = np.zeros(len(mesh.node))
    for kind, cells, of in blocks(mesh, material, other_materials or {}):
        to_nodes = _continuation(kind)
        for first in range(0, len(cells), CHUNK):
            part = cells[first:first + CHUNK]
            gradient, volume = gradients(mesh.position[part], kind)
            stress = hooke(gradient @ displacement[part][:, None], of.lame, of.shear)
            at_nodes = np.einsum("nq,cqs->cns", to_nodes, np.stack([stress[..., i, j] for i, j in _ENTRIES], axis=-1))
            volume = volume.sum(axis=1)
            np.add.at(total, part, at_nodes * volume[:, None, None])
            np.add.at(weight, part, np.broadcast_to(volume[:, None], part.shape))
    with np.errstate(invalid="ignore"):
        return total / weight[:, None]


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Equivalent stress of (n, 6) real stresses, (n,) Pa."""
    xx, yy, zz, xy, yz, zx = stress.T
    return np.sqrt(((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) / 2 + 3 * (xy**2 + yz**2 + zx**2))


def _continuation(kind):
    """(nodes, points) matrix from values at the integration points to values at the nodes of a cell."""
    cell, plain = CELLS[kind], CELLS[kind.rstrip("0123456789")]
    return plain.shape(cell.reference) @ np.linalg.pinv(plain.shape(cell.points))
