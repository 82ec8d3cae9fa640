"""Tolerances of the geometry of surfaces, each with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SurfaceSettings:
    """What counts as facing, as covered and as flat."""

    # degrees off opposition: flanks of a round side beyond it carry no normal force
    facing: float = 60.0
    # degrees that the nearest faces may be off; as much as matching of nodes allows
    opposed: float = 20.0
    reach: float = 0.1  # of the damper's size: a wider gap never closes
    # of a face's size by which middle nodes may be off: it is then one triangle
    straight: float = 1e-6
    landed: float = 1e-13  # of a face's size: the projection of a point onto it has converged
    steps: int = 30  # of Newton's method for that; curved faces take 3 to 6
    # degrees between faces: a round side has eleven or more around it, a chamfer has 45
    crease: float = 35.0
    turned: float = 1e-12  # of the smooth normals in the last turn: they are found
    turns: int = 6  # of Gauss and Newton's method for that; 2 to 4 are taken
    solved: float = 1e-14  # of the least squares in each turn
    most_steps: int = 500  # of theirs; 20 to 60 are taken
    sliver: float = 1e-12  # of a facet: smaller intersections are rounding
    # of a point from the centre of its area to its corner: second moments are then exact
    shift: float = 0.5
    # of int psi psi' over a face; more is a strip of it, on which nothing is shifted
    conditioned: float = 1e8
    # rad that the normals of both surfaces turn against each other over a face, twice that in full:
    # they touch along a line
    parting: float = 0.01
    # degrees around a round side from its line of contact to the nearest point, which is how far
    # the directions of its forces are off: those of flanks at 45 degrees by 2 %
    beside: float = 1.0
    # of the functions that move points there: 1 on whole triangles, more where a strip is covered;
    # beyond it single nodes would count for more than once
    steep: float = 4.0
    ridge: float = 1e-3  # of squared moves: what is left of them along a line, by flat triangles
    # of a vertex's own area: what is covered less is the rounding of a common edge
    dropped: float = 1e-6
    # times its area that a facet may be covered: projections of curves overlap
    doubled: float = 1.5
    # of the faces' size: deeper overlaps are another geometry, not the facets of a curve
    penetration: float = 0.1
    # of the damper's faces that are covered: where it is less, the units are looked at
    seen: float = 0.01
    most: float = 0.5  # of them, by a factor between two units: then that is the reason
    # of the damper's size: a gap up to which faces count as opposite, in messages
    farthest: float = 1.0
    smallest: float = 0.01  # of the blades' size: a damper
    # of a face's size: points of one station lie closer together, stations farther apart
    line: float = 0.3
    near: int = 16  # facets whose distance to a point is measured: those around the nearest centre
    block: int = 20_000  # pairs of facets integrated at a time: about 0.3 GB


DEFAULT = SurfaceSettings()
