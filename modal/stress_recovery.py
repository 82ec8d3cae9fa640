"""Stresses on the full mesh from nodal displacements, for example those that `Reduction.recover`
gives."""

import numpy as np

from tipdamp.modal.elasticity import Material, blocks
from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.elements.isoparametric import chunks, gradients, hooke
from tipdamp.modal.mesh import Mesh

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


def nodal_stress(
    mesh: Mesh,
    material: Material,
    displacement: np.ndarray,
    other_materials: dict[str, Material] | None = None,
) -> np.ndarray:
    """Stress at every node, (n, 6) Pa in the order of COMPONENTS; displacement (n, 3) m, real or
    complex.

    Linear elastic, isotropic; other_materials {cell group: Material} as in `elastic_body`. An
    isolated node has NaN. In each cell the stress is sampled at the integration points, where
    isoparametric cells are most accurate [Barlow 1976], fitted by the field of a cell without
    midside nodes and extrapolated to the nodes; there it is averaged over the adjacent cells by
    volume, across the interface of two materials too, where the true stress jumps.
    """
    total = np.zeros((len(mesh.node), 6), dtype=np.result_type(displacement, float))
    weight = np.zeros(len(mesh.node))
    for kind, cells, of in blocks(mesh, material, other_materials or {}):
        to_nodes = _continuation(kind)
        for part in chunks(cells):
            gradient, volume = gradients(mesh.position[part], kind)
            stress = hooke(gradient @ displacement[part][:, None], of.lame, of.shear)
            at_nodes = np.einsum(
                "nq,cqs->cns", to_nodes, np.stack([stress[..., i, j] for i, j in _ENTRIES], axis=-1)
            )
            volume = volume.sum(axis=1)
            np.add.at(total, part, at_nodes * volume[:, None, None])
            np.add.at(weight, part, np.broadcast_to(volume[:, None], part.shape))
    with np.errstate(invalid="ignore"):
        return total / weight[:, None]


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Equivalent stress of (n, 6) real stresses, (n,) Pa."""
    xx, yy, zz, xy, yz, zx = stress.T
    return np.sqrt(
        ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + zx**2)
    )


def alternating_stress(stress: np.ndarray) -> np.ndarray:
    """Half of the largest von Mises range over a period, (n,) Pa, of stresses (n, 6, H+1) Pa as
    Fourier coefficients.

    The range is the equivalent stress of the difference of the tensors at two instants, the largest
    of all pairs of instants [ASME BPVC VIII-2, 5.5.3.2]: sign and rotating principal axes count. Of
    in-phase motion at one frequency it is the von Mises stress of the amplitudes. The mean does not
    count.
    """
    xx, yy, zz, *shear = np.moveaxis(stress, 1, 0)
    # the equivalent stress is the length of this vector
    return half_range(
        np.stack(
            [
                (xx - yy) / np.sqrt(2),
                (yy - zz) / np.sqrt(2),
                (zz - xx) / np.sqrt(2),
                *(np.sqrt(3) * one for one in shear),
            ],
            axis=1,
        )
    )


def half_range(motion: np.ndarray) -> np.ndarray:
    """Half of the largest distance between two points of each closed path, (n,), by its Fourier
    coefficients (n, d, H+1); the largest on a grid of instants is refined around them."""
    found, H = np.empty(len(motion)), motion.shape[2] - 1
    grid = np.arange(8 * (H + 3)) * 2 * np.pi / (8 * (H + 3))
    around = np.linspace(-1, 1, 9)
    # all pairs of instants of each
    for part in np.array_split(np.arange(len(motion)), 1 + len(motion) // 500):
        X, step = motion[part], grid[1]
        a, b, largest = _farthest(X, np.tile(grid, (len(X), 1)), np.tile(grid, (len(X), 1)))
        for _ in range(4):  # the instants to 1e-3 of the grid, the distance to 1e-7
            a, b, largest = _farthest(X, a[:, None] + step * around, b[:, None] + step * around)
            step /= 4
        found[part] = largest / 2
    return found


def _farthest(
    X: np.ndarray, one: np.ndarray, other: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Phases (n,) of those in `one` and `other` (n, t) at which the paths are farthest apart, and
    that distance."""
    k = np.arange(1, X.shape[2])
    p, q = (
        np.einsum("ndk,ntk->ntd", X[:, :, 1:], np.exp(1j * tau[..., None] * k)).real
        for tau in (one, other)
    )
    square = (p**2).sum(2)[:, :, None] + (q**2).sum(2)[:, None] - 2 * p @ np.swapaxes(q, 1, 2)
    i, j = np.unravel_index(square.reshape(len(X), -1).argmax(axis=1), square.shape[1:])
    here = np.arange(len(X))
    return one[here, i], other[here, j], np.sqrt(np.maximum(square[here, i, j], 0.0))


def _continuation(kind: str) -> np.ndarray:
    """(nodes, points) matrix from values at the integration points to values at the nodes of a
    cell."""
    cell, plain = CELLS[kind], CELLS[kind.rstrip("0123456789")]
    return plain.shape(cell.reference) @ np.linalg.pinv(plain.shape(cell.points))
