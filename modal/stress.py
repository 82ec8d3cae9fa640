"""Stresses on the full mesh from nodal displacements, for example those that `Reduction.recover` gives."""

import numpy as np

from modal.elasticity import Material, blocks
from modal.elements.cells import CELLS, tables
from modal.mesh import Mesh

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
_CHUNK = 5000  # cells at a time


def nodal_stress(mesh: Mesh, material: Material, displacement: np.ndarray, other_materials=None) -> np.ndarray:
    """Stress at every node, (n, 6) Pa in the order of COMPONENTS; displacement (n, 3) m, real or complex.

    Linear elastic and isotropic; other_materials {cell group: Material} as in `elastic_body`. An isolated node has NaN.
    In each cell the stress at the integration points is fitted by the field of a cell without middle nodes, which is
    where isoparametric cells are most accurate [Barlow 1976], continued to the nodes, and averaged over the cells that
    meet there, by volume; also where two materials meet, on whose sides the stress differs.
    """
    total = np.zeros((len(mesh.node), 6), dtype=np.result_type(displacement, float))
    share = np.zeros(len(mesh.node))
    for kind, cells, of in blocks(mesh, material, other_materials or {}):
        _, dN, weight = tables(kind)
        to_nodes = _continuation(kind)
        for first in range(0, len(cells), _CHUNK):
            part = cells[first:first + _CHUNK]
            J = np.einsum("qin,cnj->cqij", dN, mesh.position[part], optimize=True)
            volume = np.linalg.det(J) @ weight
            gradient = np.linalg.solve(J, np.broadcast_to(dN, (len(part), *dN.shape)))  # dN/dx: (c, q, 3, n)
            slope = np.einsum("cqjn,cni->cqij", gradient, displacement[part], optimize=True)
            at_nodes = np.einsum("nq,cqs->cns", to_nodes, _stress(of, slope))
            np.add.at(total, part, at_nodes * volume[:, None, None])
            np.add.at(share, part, np.broadcast_to(volume[:, None], part.shape))
    with np.errstate(invalid="ignore"):
        return total / share[:, None]


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Equivalent stress of (n, 6) real stresses, (n,) Pa."""
    xx, yy, zz, xy, yz, zx = stress.T
    return np.sqrt(((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) / 2 + 3 * (xy**2 + yz**2 + zx**2))


def _continuation(kind):
    """(nodes, points) matrix from values at the integration points to values at the nodes of a cell."""
    cell, plain = CELLS[kind], CELLS[kind.rstrip("0123456789")]
    return plain.shape(cell.reference) @ np.linalg.pinv(plain.shape(cell.points))


def _stress(material, slope):
    strain = (slope + slope.swapaxes(-1, -2)) / 2
    volume = np.trace(strain, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
    stress = 2 * material.shear * strain + material.lame * volume
    return np.stack([stress[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=-1)
