"""ReducedModel: mass, damping and stiffness of the bodies, and what each of their dofs is.

The matrices may come from `tipdamp.modal.craig_bampton` or from any other program.
"""

import json
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dpotrf

from tipdamp.hbm import tables
from tipdamp.hbm.errors import Doubt, InputError, nearest, shown
from tipdamp.hbm.io.array_files import save_npz
from tipdamp.hbm.io.dof_table import DIRECTIONS, ROTATIONS, read_npz
from tipdamp.hbm.io.matrices_in import read_model
from tipdamp.hbm.points import ContactPoints, check_points, motion_of
from tipdamp.hbm.validation import brief, numbers

SYMMETRY_TOLERANCE = 1e-10
NEGATIVE = 1e-10  # share of the largest eigenvalue of C that is rounding
RESISTED = 1e-9  # share of the largest stiffness that a rigid motion may meet as rounding
# share of the largest stiffness of a displacement: another's below it is not known
ROUNDING = 2.2e-16
BUCKLED = 1e-8  # negative stiffness, as a share of the diagonal, that is more than rounding
LARGEST = 1e100  # entry of a matrix whose square double precision holds
BLOCK = 256  # rows whose transpose the cache holds
SLOWEST = 0.1  # rad/s: where no dof alone oscillates faster, M and K are swapped
HEAVIEST = 1e3  # kg at a dof


@dataclass(frozen=True)
class ReducedModel:
    """M q'' + C q' + K q = f, with a name for every dof.

    M, K : (r, r) kg, N/m - symmetric
    C : (r, r) N s/m or None - None where damping is given as ratios of the stuck modes
    body : (r,) str - body that the dof belongs to
    node : (r,) int - node number in the user's mesh; for modal dofs the number of the mode, from 1
    direction : (r,) str - 'x', 'y', 'z', 'rx', 'ry', 'rz' (rotations, rad) or 'mode'
    position : (r, 3) m - of the node; NaN for modal dofs
    groups : {"body/group": (n,) int node numbers}
    loads : {name: (r,) N} - static loads, for example "pull": the pull of 1 N on the damper,
    condensed
    provenance : {str: str} - where the matrices came from
    points : {body: ContactPoints} - where the meshes of a contact differ
    rigid : {body: (dofs of the body, 6)} - motions of a body that floats, exactly K rigid = 0: unit
    slides along and rotations about x, y, z; (dofs, 0) for one that is supported; a body that is
    not named may be either

    >>> model = ReducedModel.from_matrices(
    ...     M=0.05 * np.eye(2), K=[[2e6, -1e6], [-1e6, 2e6]], node=[7, 8], direction=["y", "y"]
    ... )
    >>> model.displacement_row("body", 8, [0, 1, 0])
    array([0., 1.])
    >>> print(natural_frequencies(model).round())
    [ 712. 1233.]
    """

    M: np.ndarray
    K: np.ndarray
    C: np.ndarray | None
    body: np.ndarray
    node: np.ndarray
    direction: np.ndarray
    position: np.ndarray
    groups: dict = field(default_factory=dict)
    loads: dict = field(default_factory=dict)
    provenance: dict = field(default_factory=dict)
    points: dict[str, ContactPoints] = field(default_factory=dict)
    rigid: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def _dofs_of_bodies(self) -> dict[str, int]:
        """{body: number of its dofs}, in the order of the model."""
        bodies = dict.fromkeys(self.body.tolist())
        return {body: int((self.body == body).sum()) for body in bodies}

    def __repr__(self) -> str:
        bodies = ", ".join(f"{body} {count}" for body, count in self._dofs_of_bodies.items())
        return (
            f"<ReducedModel: {self.size} dofs ({bodies}), {int((self.direction == 'mode').sum())} "
            f"of them modes; C {'given' if self.C is not None else 'none'}, groups "
            f"{len(self.groups)}, loads {', '.join(self.loads) or 'none'}>"
        )

    def _repr_html_(self) -> str:
        rows = {f"body '{body}'": f"{count} dofs" for body, count in self._dofs_of_bodies.items()}
        rows |= {"damping": "C" if self.C is not None else "none"}
        rows |= {"groups": ", ".join(self.groups), "loads": ", ".join(self.loads)}
        return tables.notebook_table(f"Model of {self.size} dofs", rows)

    @property
    def moves(self) -> np.ndarray:
        """(r,) bool: dofs that are displacements of nodes, neither rotations nor modes."""
        return np.isin(self.direction, DIRECTIONS)

    @property
    def size(self) -> int:
        """r, the number of dofs."""
        return self.K.shape[0]

    @classmethod
    def from_matrices(
        cls,
        M: np.ndarray | sp.spmatrix,
        K: np.ndarray | sp.spmatrix,
        C: np.ndarray | sp.spmatrix | None = None,
        *,
        body: str | np.ndarray = "body",
        **table: Any,
    ) -> "ReducedModel":
        """Dense or sparse matrices (r, r) from anywhere. Without a dof table every dof is modal.

        body : (r,) names, or one for all; table : the other fields of ReducedModel
        Raises InputError when shapes disagree, an entry is not finite, a matrix is not symmetric to
        1e-10, M is not positive definite, M and K are swapped, C feeds energy in, a dof is there
        twice, or a group names a node without a dof. Warns where K is indefinite: then only contact
        can restrain that motion.
        """
        M, K = symmetric("M", M), symmetric("K", K, NOT_HERE)
        C = None if C is None else symmetric("C", C, NOT_HERE)
        r = K.shape[0]
        _check_sizes({"M": M, "C": C, "K": K}, {"body": body} | table)
        groups, loads, rigid = (
            {k: np.asarray(v, dtype=kind) for k, v in (table.pop(name, None) or {}).items()}
            for name, kind in (("groups", np.int64), ("loads", float), ("rigid", float))
        )
        provenance, points = (
            dict(table.pop(name, None) or {}) for name in ("provenance", "points")
        )
        _check_loads(loads, r)
        owner, node, direction, position = _columns(r, body, **table)
        model = cls(
            M, K, C, owner, node, direction, position, groups, loads, provenance, points, rigid
        )
        _check_rigid(model)
        _check_swapped(M, K)
        _check_mass(model)
        if C is not None:
            check_damping(C, lambda i: _dof(model, i))
        _warn_of_negative_stiffness(model)
        _check_table(model)
        for name, mine in points.items():
            check_points(f"body '{shown(name)}'", mine, r, node[(owner == name) & model.moves])
        return model

    @classmethod
    def from_files(
        cls,
        M: str | Path,
        K: str | Path,
        C: str | Path | None = None,
        dofs: str | Path | None = None,
        **more: Any,
    ) -> "ReducedModel":
        """One file per matrix and a dof table, in the formats of `tipdamp.hbm.io.matrices_in`.

        more : body (name where the table has none), groups and loads beside those of the table
        Raises InputError where a file cannot be read, or the files do not fit each other.
        """
        return cls.from_matrices(**read_model(M, K, C, dofs, **more))

    def dofs(self, body: str, node: int) -> np.ndarray:
        """Rows of the x, y, z displacement of a node, (3,) int; -1 where that direction is not in
        the model."""
        rows = self._rows.get((str(body), int(node)))
        if rows is None and body not in self.body:
            raise InputError(
                f"the model has no body '{shown(str(body))}' (node {node}); "
                f"{nearest(str(body), self._dofs_of_bodies)}"
            )
        if rows is None:
            raise InputError(
                f"node {node} of body '{body}' is not in the reduced model: "
                "make it a master node (contact, excitation or response) and reduce again"
            )
        return rows

    def motion_of(self, body: str, numbers: "ArrayLike") -> sp.csr_matrix:
        """(3n, r): x, y, z of nodes and contact points of a body in turn; rows of zeros where the
        node has no such dof. Raises InputError as `dofs` does."""
        return motion_of(
            numbers, lambda node: self.dofs(body, node), self.points.get(str(body)), self.size
        )

    def displacement_row(self, body: str, node: int, direction: "ArrayLike") -> np.ndarray:
        """(r,) row that takes the displacement of a node along a direction (3,) out of q."""
        row = np.zeros(self.size)
        allowed = "must be three numbers, for example [0, 1, 0], not all zero"
        along = numbers("direction", direction, allowed)
        if along.shape != (3,) or not np.isfinite(along).all() or not along.any():
            raise InputError(f"direction = {brief(direction)}: {allowed}")
        for rank, component in zip(self.dofs(body, node), along, strict=True):
            if component and rank < 0:
                raise InputError(
                    f"node {node} of body '{body}' has no such direction in the reduced model"
                )
            if component:
                row[rank] = component
        return row

    @property
    def _rows(self) -> dict:
        cached = self.__dict__.get("_row_table")
        if cached is None:
            cached = {}
            for i in np.flatnonzero(self.moves):
                key = (str(self.body[i]), int(self.node[i]))
                cached.setdefault(key, np.full(3, -1))[DIRECTIONS.index(self.direction[i])] = i
            object.__setattr__(self, "_row_table", cached)
        return cached

    def part(self, *bodies: str) -> "ReducedModel":
        """The dofs of the named bodies only."""
        for name in bodies:
            if name not in self.body:
                raise InputError(
                    f"the model has no body '{name}'; {nearest(name, self._dofs_of_bodies)}"
                )
        rows = np.flatnonzero(np.isin(self.body, bodies))
        block = np.ix_(rows, rows)
        own = sp.eye(self.size, format="csr")[:, rows]
        return replace(
            self,
            M=self.M[block],
            K=self.K[block],
            C=None if self.C is None else self.C[block],
            body=self.body[rows],
            node=self.node[rows],
            direction=self.direction[rows],
            position=self.position[rows],
            groups={k: v for k, v in self.groups.items() if k.split("/")[0] in bodies},
            loads={k: v[rows] for k, v in self.loads.items()},
            points={k: v.onto(own) for k, v in self.points.items() if k in bodies},
            rigid={k: v for k, v in self.rigid.items() if k in bodies},
        )

    def with_stiffness(self, K: np.ndarray) -> "ReducedModel":
        """The same dofs with another stiffness matrix, for example with a declared roll stiffness
        added."""
        return replace(self, K=symmetric("K", K), rigid={})

    def save(self, path: str | Path) -> Path:
        """Write one .npz without pickled objects."""
        given = ("M", "K", "body", "node", "direction", "position", "C")
        arrays: dict[str, Any] = {k: vars(self)[k] for k in given if vars(self)[k] is not None}
        arrays["groups"] = np.array(json.dumps({k: v.tolist() for k, v in self.groups.items()}))
        arrays.update({f"load/{k}": v for k, v in self.loads.items()})
        arrays.update({f"rigid/{k}": v for k, v in self.rigid.items()})
        arrays["provenance"] = np.array(json.dumps(self.provenance))
        arrays.update(
            {
                f"points/{body}/{k}": v
                for body, points in self.points.items()
                for k, v in points.arrays().items()
            }
        )
        return save_npz(path, **arrays)

    @classmethod
    def load(cls, path: str | Path) -> "ReducedModel":
        """Read what `save` wrote, or any .npz with M, K (and C, body, node, direction,
        position)."""
        return cls.from_matrices(**read_npz(path))


def _columns(
    r: int,
    body: "ArrayLike | str",
    node: "ArrayLike | None" = None,
    direction: "ArrayLike | None" = None,
    position: np.ndarray | None = None,
) -> tuple:
    """Columns body, node, direction, position of the dof table, as arrays with r rows."""
    columns = {
        "body": np.full(r, body) if isinstance(body, str) else np.asarray(body, dtype=str),
        "node": np.asarray(range(1, r + 1) if node is None else node, dtype=np.int64),
        "direction": np.asarray(["mode"] * r if direction is None else direction, dtype=str),
        "position": np.full((r, 3), np.nan)
        if position is None
        else np.asarray(position, dtype=float),
    }
    for name, column in columns.items():
        if len(column) != r:
            raise InputError(f"dof table: {name} has {len(column)} rows, M and K are {(r, r)}")
    known = (*DIRECTIONS, *ROTATIONS, "mode")
    unknown = sorted(set(columns["direction"].tolist()) - set(known))
    if unknown:
        raise InputError(
            f"dof table: direction '{unknown[0]}' is unknown; {nearest(unknown[0], known)}"
        )
    return tuple(columns.values())


def square(name: str, matrix: np.ndarray | sp.spmatrix) -> np.ndarray:
    """A matrix as a dense array; InputError where it is not real, square and finite."""
    matrix = _real(name, matrix)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise InputError(f"{name} must be a square matrix, got shape {matrix.shape}")
    largest = max(matrix.max(), -matrix.min())  # NaN where an entry is
    if not np.isfinite(largest):
        i, j = np.argwhere(~np.isfinite(matrix))[0]
        raise InputError(f"{name}[{i}, {j}] is {matrix[i, j]}: every entry must be finite")
    if largest > LARGEST:
        i, j = np.unravel_index(np.abs(matrix).argmax(), matrix.shape)
        raise InputError(
            f"{name}[{i}, {j}] is {matrix[i, j]:.3g}: entries up to {LARGEST:g} can be carried"
        )
    return matrix


ROUNDED = 1e-5  # of the largest entry: up to there a file may have been written with few digits
# circulatory and gyroscopic forces, which no study has
NOT_HERE = "; what is meant otherwise is solved in Python: ContactProblem(..., general=True)"


def symmetric(name: str, matrix: np.ndarray | sp.spmatrix, otherwise: str = "") -> np.ndarray:
    """The symmetric part of a matrix as a dense array; InputError where it is not `square`, or not
    symmetric to 1e-10: what is left of rounding is large beside the small entries. otherwise : what
    to do where it is meant so."""
    matrix = square(name, matrix)
    if _mirrored(matrix):
        return matrix
    gap = np.abs(matrix - matrix.T)
    scale = np.abs(matrix).max()
    if gap.max() > SYMMETRY_TOLERANCE * scale:
        i, j = np.unravel_index(gap.argmax(), gap.shape)
        rounded = f"; where that is rounding, give ({name} + {name}.T) / 2"
        raise InputError(
            f"{name} is not symmetric: |{name}[{i}, {j}] - {name}[{j}, {i}]| is "
            f"{gap.max() / scale:.1e} of the largest entry, allowed 1e-10"
            f"{rounded if gap.max() < ROUNDED * scale else ''}{otherwise}"
        )
    return 0.5 * (matrix + matrix.T)


def _mirrored(matrix: np.ndarray) -> bool:
    """Whether it is symmetric to the last digit, in blocks that the cache holds."""
    return all(
        np.array_equal(matrix[i : i + BLOCK, i:], matrix[i:, i : i + BLOCK].T)
        for i in range(0, len(matrix), BLOCK)
    )


def _real(name: str, matrix: np.ndarray) -> np.ndarray:
    matrix = numbers(name, matrix, "must be a square matrix of numbers", complex)
    if np.iscomplexobj(matrix) and matrix.imag.any():
        i, j = np.argwhere(matrix.imag)[0]
        raise InputError(
            f"{name}[{i}, {j}] is {matrix[i, j]:g}: matrices must be real; structural damping "
            "eta, as in K (1 + i eta), is given as damping_ratio = eta/2 of the modes, or as "
            "viscous C = eta K/w about the angular frequency w of interest"
        )
    return matrix.real.astype(float)


def _dof(model: ReducedModel, i: int) -> str:
    return f"dof {i} ({model.body[i]}, node {model.node[i]}, {model.direction[i]})"


def _check_mass(model: ReducedModel) -> None:
    """InputError where a motion has no mass."""
    diagonal = model.M.diagonal()
    if (diagonal <= 0).any():
        i = int((diagonal <= 0).argmax())
        what = f"{diagonal[i]:g} on its diagonal" if model.M[i].any() else "a row of zeros"
        raise InputError(f"M has {what} at {_dof(model, i)}: every dof must have mass")
    if not _positive(model.M, 0.0):
        values, shapes = np.linalg.eigh(model.M / np.sqrt(np.outer(diagonal, diagonal)))
        i = int(np.abs(shapes[:, 0]).argmax())
        raise InputError(
            f"M is not positive definite: a motion mostly of {_dof(model, i)} has the mass "
            f"{values[0]:.1e} of its diagonal"
        )


def _warn_of_negative_stiffness(model: ReducedModel) -> None:
    stiff = np.abs(model.K.diagonal())
    rounding = np.where(model.moves, ROUNDING * stiff.max(initial=0.0, where=model.moves), 0.0)
    size = np.sqrt(np.maximum(np.maximum(stiff, rounding), 1e-30 * np.abs(model.K).max()))
    if model.K.any() and not _positive(scaled := model.K / np.outer(size, size), BUCKLED):
        values, shapes = np.linalg.eigh(scaled)
        i = int(np.abs(shapes[:, 0]).argmax())
        warnings.warn(
            f"K is indefinite: a motion mostly of {_dof(model, i)} has a negative stiffness, "
            f"{-values[0]:.1e} of its diagonal; a sign is wrong, or the body buckles and contact "
            "alone restrains it",
            Doubt,
            stacklevel=4,
        )


def _check_sizes(matrices: dict[str, np.ndarray | None], table: dict[str, Any]) -> None:
    """InputError where the matrices differ in shape, with what the columns of the dof table say."""
    given = {name: matrix.shape for name, matrix in matrices.items() if matrix is not None}
    if len(set(given.values())) == 1:
        return
    shapes = ", ".join(f"{name} is {shape}" for name, shape in given.items())
    columns = {name: table.get(name) for name in ("body", "node", "direction", "position")}
    tables = [
        f"{name} has {len(column)} rows"
        for name, column in columns.items()
        if column is not None and not isinstance(column, str)
    ]
    raise InputError("; ".join([shapes, *tables]) + ": all must have the same size")


def _check_loads(loads: dict[str, np.ndarray], r: int) -> None:
    for name, load in loads.items():
        if load.shape != (r,) or not np.isfinite(load).all():
            raise InputError(f"load '{name}' must hold {r} finite numbers, got shape {load.shape}")


def _check_rigid(model: ReducedModel) -> None:
    """Rigid motions fit their bodies, and K does not resist them."""
    for body, motions in model.rigid.items():
        mine = model.body == body
        fits = motions.ndim == 2 and len(motions) == mine.sum() and motions.shape[1] % 6 == 0
        if not fits or not np.isfinite(motions).all():
            raise InputError(
                f"rigid motions of body '{shown(body)}' have the shape {motions.shape}, must be "
                f"({mine.sum()}, 6) where it floats, 6 more for each further piece, and "
                f"({mine.sum()}, 0) where it does not, all finite"
            )
        resisted = np.abs(model.K[:, mine] @ motions).max(initial=0.0)
        if resisted > RESISTED * np.abs(model.K).max() * np.abs(motions).max(initial=0.0):
            raise InputError(
                f"rigid motions of body '{shown(body)}': K resists them (by {resisted:.1e}); "
                "leave them out where the body does not float"
            )


def check_damping(
    C: np.ndarray,
    named: Callable[[int], str] = lambda i: f"dof {i}",
    remedy: str = "check the sign of C",
) -> None:
    """InputError where a motion has negative damping: nothing bounds its response. named(i) : a dof
    in words; remedy : what to do about it."""
    if _positive(C, NEGATIVE * np.abs(C).max()):
        return
    values, shapes = np.linalg.eigh(C)
    if values[0] < -NEGATIVE * np.abs(values).max():
        i = int(np.abs(shapes[:, 0]).argmax())
        raise InputError(
            f"C feeds energy in: a motion mostly of {named(i)} has the negative damping "
            f"{values[0]:.3g} N s/m, must be 0 or more; {remedy}"
        )


def _positive(matrix: np.ndarray, shift: float) -> bool:
    """Whether no eigenvalue is below -shift, as Cholesky has it: a third of the work of the
    cheapest eigenvalue.

    Blocks along the diagonal that nothing couples, such as bodies, are taken one by one.
    """
    row = np.arange(len(matrix))
    first = np.minimum((matrix != 0).argmax(axis=1), row)  # entry of a row, or its diagonal
    edges = np.flatnonzero(np.minimum.accumulate(first[::-1])[::-1] == row)
    return all(_has_factor(matrix[i:j, i:j], shift) for i, j in pairwise([*edges, len(matrix)]))


def _has_factor(matrix: np.ndarray, shift: float) -> bool:
    shifted = np.array(matrix.T, order="F")
    shifted[np.diag_indices(len(matrix))] += max(shift, 1e-300)
    return dpotrf(shifted, lower=1, overwrite_a=1, clean=0)[1] == 0


def _check_swapped(M: np.ndarray, K: np.ndarray) -> None:
    """InputError where M can only be the stiffness: tons at a dof, and a period of minutes for the
    fastest alone."""
    m, k = np.abs(M.diagonal()), np.abs(K.diagonal())
    if m.max() < HEAVIEST:
        return
    fastest = np.sqrt(np.divide(k, m, out=np.zeros(len(k)), where=m > 0).max())
    if 0 < fastest < SLOWEST:
        raise InputError(
            f"M and K: no dof alone oscillates faster than {fastest:.1e} rad/s, at least "
            f"{SLOWEST:g} is plausible; M and K seem to be swapped (M is the mass, K the "
            "stiffness)"
        )


def _check_table(model: ReducedModel) -> None:
    """No dof twice; groups name nodes that have dofs, not clamped or eliminated ones."""
    seen: dict[tuple[str, int, str], int] = {}
    for i in np.flatnonzero(model.direction != "mode"):
        key = str(model.body[i]), int(model.node[i]), str(model.direction[i])
        if key in seen:
            raise InputError(f"dof table: {_dof(model, i)} is the same as dof {seen[key]}")
        seen[key] = i
    present = {(body, node) for body, node, _ in seen}
    for name, members in model.groups.items():
        body = name.split("/")[0]
        absent = [int(n) for n in members if (body, int(n)) not in present]
        if absent:
            raise InputError(
                f"group '{shown(name)}': node {absent[0]} of body '{shown(body)}' has no dof in "
                "the model (clamped, eliminated, or of another body)"
            )
