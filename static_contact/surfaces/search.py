"""Which facets of two surfaces may overlap: those near each other and facing each other, found by
trees."""

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.static_contact.surfaces.facets import Facets
from tipdamp.static_contact.surfaces.settings import SurfaceSettings


def candidates(
    one: Facets, other: Facets, reach: float, settings: SurfaceSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Indices of facets of both, pair by pair: their spheres meet along the gap, which is at most
    `reach` m, and their normals oppose each other. The facets of the other surface are sorted by
    size, so that one large face among small ones does not make all of them neighbours."""
    gap = np.minimum(cKDTree(other.centre).query(one.centre)[0], reach)
    octave = np.floor(np.log2(other.radius)).astype(int)
    mine, theirs = [], []
    for level in np.unique(octave):
        group = np.flatnonzero(octave == level)
        tree = cKDTree(other.centre[group])
        found = tree.query_ball_point(one.centre, one.radius + other.radius[group].max() + gap)
        length = np.array([len(f) for f in found])
        mine.append(np.repeat(np.arange(len(one.centre)), length))
        theirs.append(group[np.concatenate([np.asarray(f, dtype=np.int64) for f in found])])
    i, j = np.concatenate(mine), np.concatenate(theirs)
    opposed = np.einsum("ij,ij->i", one.normal[i], other.normal[j]) < -np.cos(
        np.radians(settings.facing)
    )
    order = np.lexsort((j[opposed], i[opposed]))
    return i[opposed][order], j[opposed][order]
