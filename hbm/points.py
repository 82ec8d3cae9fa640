"""ContactPoints: places on the surface of a body that move as a weighted mean of its dofs.

A matched pair is two nodes; where the meshes of a contact differ, it is two contact points, one on
either body."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """n contact points of one body.

    number : (n,) int - above every node number of the body's mesh, or of a node that is a contact
        point itself, so that a contact table can name either
    position : (n, 3) m
    motion : (3n, size) CSR - x, y, z of each point in turn, from the dofs of the Body or the
    ReducedModel
    """

    number: np.ndarray
    position: np.ndarray
    motion: sp.csr_matrix

    def __post_init__(self) -> None:
        object.__setattr__(self, "number", np.asarray(self.number, dtype=np.int64))
        object.__setattr__(self, "position", np.asarray(self.position, dtype=float))
        motion = sp.csr_matrix(self.motion)
        motion.sort_indices()
        object.__setattr__(self, "motion", motion)
        n = len(self.number)
        if (
            self.position.shape != (n, 3)
            or motion.shape[0] != 3 * n
            or len(np.unique(self.number)) < n
        ):
            raise InputError(
                f"contact points: {n} numbers, positions {self.position.shape}, motion "
                f"{motion.shape}: must be {n} different ones, ({n}, 3) and ({3 * n}, dofs)"
            )

    def arrays(self) -> dict[str, np.ndarray]:
        """The points as plain arrays, for a file."""
        motion = self.motion
        return {
            "number": self.number,
            "position": self.position,
            "values": motion.data,
            "columns": motion.indices,
            "starts": motion.indptr,
            "size": np.array(motion.shape[1]),
        }

    @classmethod
    def of_arrays(
        cls,
        number: np.ndarray,
        position: np.ndarray,
        values: np.ndarray,
        columns: np.ndarray,
        starts: np.ndarray,
        size: np.ndarray,
    ) -> "ContactPoints":
        """What `arrays` made."""
        return cls(
            number,
            position,
            sp.csr_matrix((values, columns, starts), shape=(len(starts) - 1, int(size))),
        )

    def onto(self, basis: np.ndarray | sp.spmatrix) -> "ContactPoints":
        """The points of a model in other dofs: basis (size, new size), q = basis q_new."""
        return replace(self, motion=sp.csr_matrix(self.motion @ basis))

    def among(self, start: int, size: int) -> "ContactPoints":
        """The points where the body's dofs stand from `start` among `size` ones."""
        own = self.motion
        return replace(
            self,
            motion=sp.csr_matrix(
                (own.data, own.indices + start, own.indptr), shape=(own.shape[0], size)
            ),
        )


def check_points(where: str, points: ContactPoints, size: int, nodes: np.ndarray) -> None:
    """InputError where points do not fit a body of `size` dofs and the node numbers (n,)."""
    if points.motion.shape[1] != size or not np.isfinite(points.motion.data).all():
        raise InputError(
            f"{where}: the motion of the contact points is {points.motion.shape}, must be finite "
            f"and have a column for each of the {size} dofs"
        )
    if len(both := np.intersect1d(points.number, nodes)):
        raise InputError(
            f"{where}: contact point {both[0]} has the number of a node: points are numbered above "
            f"{nodes.max()}"
        )


def motion_of(
    numbers: ArrayLike, dofs: Callable[[int], np.ndarray], points: ContactPoints | None, size: int
) -> sp.csr_matrix:
    """(3n, size) x, y, z of nodes and contact points in turn. A node's rows are unit rows, zero
    where it is clamped.

    dofs : node number to (3,) int, -1 where clamped; it raises where there is no such node
    """
    numbers = np.asarray(numbers, dtype=np.int64)
    found = _places(points, numbers)
    column = np.array(
        [dofs(int(n)) if p < 0 else (-1, -1, -1) for n, p in zip(numbers, found, strict=True)],
        dtype=np.int64,
    ).ravel()
    row = np.flatnonzero(column >= 0)
    unit = sp.csr_matrix((np.ones(len(row)), (row, column[row])), shape=(len(column), size))
    if points is None or (found < 0).all():
        return unit
    mine = np.flatnonzero(found >= 0)
    place = placing(mine, len(numbers))
    return (unit + place @ points.motion[xyz_rows(found[mine])]).tocsr()


def _places(points: ContactPoints | None, numbers: np.ndarray) -> np.ndarray:
    """(n,) of numbers among the contact points; -1 of others."""
    if points is None or not len(points.number):
        return np.full(len(numbers), -1)
    order = np.argsort(points.number)
    place = order[np.searchsorted(points.number, numbers, sorter=order).clip(max=len(order) - 1)]
    return np.where(points.number[place] == numbers, place, -1)


def xyz_rows(places: np.ndarray) -> np.ndarray:
    """(3n,) rows of x, y, z of each place (n,) in turn."""
    return (3 * places[:, None] + np.arange(3)).ravel()


def placing(places: np.ndarray, count: int, factor: float = 1.0) -> sp.csr_matrix:
    """(3 count, 3n) that puts x, y, z of n vectors, times a factor, at their places (n,)."""
    rows = xyz_rows(places)
    entries = np.full(len(rows), factor), (rows, np.arange(len(rows)))
    return sp.csr_matrix(entries, shape=(3 * count, len(rows)))
