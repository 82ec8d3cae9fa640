"""What is integrated over the pieces of an overlap, and the contact points that come of it."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class Overlap:
    """n contact points, those corners of the damper's faces around which the surfaces overlap.

    vertex : (n,) int - node index in the damper's mesh; area : (n,) m2
    damper, blade : (n, nodes) CSR - weights of the nodes of either mesh, rows of sum 1
    normal : (n, 3) - from the damper into the blade, read where the motions are: of the smooth
    surface (normals.py), on lines of contact that of the corner (lines.py)
    turned : (n, 3) - sum of the unit normals of both smooth surfaces there: 0 where they touch
    gap : (n,) m - between the smooth surfaces, read there too, negative: overlapping
    opposed : (n,) degrees - mean normals of damper and blade off opposition; least : (n,) m -
    smallest gap
    covered : share of the damper's facets that the blade covers
    doubled : (c, 3) m - centres of facets that lie opposite to two blade faces at once
    layers : (c, 2) m - smallest and largest gap there
    """

    vertex: np.ndarray
    area: np.ndarray
    damper: sp.csr_matrix
    blade: sp.csr_matrix
    normal: np.ndarray
    turned: np.ndarray
    gap: np.ndarray
    opposed: np.ndarray
    least: np.ndarray
    covered: float = 0.0
    doubled: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    layers: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class QuadraturePoints:
    """m quadrature points; shapes (m, nodes) of the corners and of the nodes of both meshes.

    normal, opposite : (m, 3) - of the faces of damper and blade; smooth, beyond : (m, 3) - of their
    smooth surfaces
    arm : (m, 2) m - of `normals.arms` on both
    gap : (m,) m - between the smooth surfaces
    """

    weight: np.ndarray
    corners: sp.csr_matrix
    damper: sp.csr_matrix
    blade: sp.csr_matrix
    normal: np.ndarray
    opposite: np.ndarray
    smooth: np.ndarray
    beyond: np.ndarray
    arm: np.ndarray
    gap: np.ndarray
