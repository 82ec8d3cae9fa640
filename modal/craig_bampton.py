"""Craig-Bampton reduction: a Body and its master nodes become a ReducedModel, and back to the full
mesh.

    q_B = master dofs,  q_I = Psi q_B + Phi eta,   Psi = -K_II^-1 K_IB   (constraint modes)
    S = K_BB + K_BI Psi   (the Schur stiffness, exact in statics)                       [Craig and
    Bampton 1968]

Contact points whose nodes are no masters bring contact shapes, which make their motions exact in
statics as well (modal/contact_shapes.py). One factorisation of K_II serves Psi, the fixed-interface
modes Phi, contact shapes, interior loads and the error bound of the truncation. A free body needs
no springs to ground: K_II is positive definite because its boundary is fixed, and S keeps the six
rigid motions.
"""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body, check_support
from tipdamp.modal.contact_shapes import contact_shapes, holding_nodes, spread
from tipdamp.modal.definite import check_condensed, definite_factor
from tipdamp.modal.eigen import Factor, Modes
from tipdamp.modal.load_modes import with_load_modes
from tipdamp.modal.reduction import EQUAL, Reduction, labelled, points_on
from tipdamp.modal.truncation import Truncation, highest_frequency

if TYPE_CHECKING:
    from tipdamp.hbm.points import ContactPoints


@dataclass(frozen=True)
class ReductionSettings:
    """Of the reduction of a body."""

    rigid: float = 1e-9  # stiffness, of the largest entry: more is an error, a free body must float
    equal: float = EQUAL


SETTINGS = ReductionSettings()


def craig_bampton(
    body: Body,
    masters: Iterable[int],
    modes: int | None = None,
    *,
    below_hz: float | None = None,
    loads: Sequence = (),
    bound: bool = True,
    tractions: sp.csr_matrix | None = None,
) -> Reduction:
    """Reduce a body onto its master nodes (numbers of the user's mesh) and its lowest
    fixed-interface modes.

    masters - any nodes that are not clamped; all of them gives the body itself, with no modes. A
    free body with contact points needs none: nodes that hold it are added.
    modes - how many, 0 is Guyan's static reduction; or all below_hz, Hz; counted by inertia, so
    that none is missed. Modes of the same frequency are kept together: more than asked for, which
    the log "modal" says.
    loads : [(node numbers, (n, 3) forces) or (d,) N on the free dofs], of which the static shape is
    kept beside the modes: the quasi-static response to them is then exact on the whole mesh, not
    only on the masters.
    bound : whether `truncation` is made, for which one mode more is sought, and a back-solve a
    master dof. Without it (truncation None) and with 0 modes the cost is one factorisation and the
    static shapes: what a preload needs. tractions (n, c): of `contact_shapes.traction_cells`,
    instead of contact shapes of every point: statics is not exact then, and `truncation` bounds no
    frequency.
    Raises InputError when a master does not exist or is clamped, when the body's support is not as
    declared, and when a motion meets negative stiffness, as above the critical speed of a rotating
    body.

    >>> springs = 1e8 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])  # held at one end
    >>> table = dict(node=[1, 2, 3], position=0.1 * np.eye(3), dof_node=np.repeat([0, 1, 2], 3))
    >>> K, M, xyz = np.kron(springs, np.eye(3)), np.eye(9), np.tile([0, 1, 2], 3)
    >>> blade = Body.from_matrices("blade", K, M, dof_direction=xyz, **table)
    >>> reduction = craig_bampton(blade, masters=[3], modes=3)
    >>> reduction.model
    <ReducedModel: 6 dofs (blade 6), 3 of them modes; C none, groups 0, loads none>
    """
    _check_modes(body, modes, below_hz)
    boundary, interior, rigid = _partition(body, masters)
    _check_count(body, modes, len(interior))
    K = _Blocks.of(body.K, boundary, interior)
    M = _Blocks.of(body.M, boundary, interior)
    factor = definite_factor(body, interior, K.II, M.II)
    statics = modes == 0 and not bound
    # the modes first: their count makes a second factor for a while
    found = (
        _no_modes(len(interior))
        if statics
        else _whole_clusters(body, factor, M.II, modes, below_hz)
    )
    Psi = factor.solve((-K.IB).toarray(order="F"))
    if rigid:
        _keep_rigid(body, boundary, interior, K, Psi)
    M_Psi = _inertia(M, Psi)
    found, shapes = _with_contact_shapes(body, interior, factor, M.II, found, tractions)
    G = _left_out(factor, M.II, M_Psi, found, shapes) if bound else None
    omega, Phi = with_load_modes(body, interior, factor, M.II, found, loads)

    model = _reduced_model(
        body,
        boundary,
        K.BB.toarray() + K.IB.T @ Psi,
        M.BB.toarray() + M.IB.T @ Psi + Psi.T @ M_Psi,
        M_Psi.T @ Phi,
        omega,
    )
    model = replace(model, points=points_on(body, boundary, interior, Psi, Phi))
    return Reduction(
        body,
        model,
        boundary,
        interior,
        Psi,
        Phi,
        omega,
        rigid,
        shapes,
        len(omega) - len(found.omega),
        None if G is None else _truncation(body, model.size, found.free_to, G),
        tractions,
    )


def _truncation(body: Body, size: int, free_to: float, G: np.ndarray) -> Truncation:
    """Of one body, reduced to so many dofs."""
    highest = highest_frequency(body.K, body.M)
    name, sizes, omega, top = (np.array([one]) for one in (body.name, size, free_to, highest))
    return Truncation(name, sizes, omega, (G,), top)


def _reduced_model(
    body: Body,
    boundary: np.ndarray,
    S: np.ndarray,
    M_BB: np.ndarray,
    M_BM: np.ndarray,
    omega: np.ndarray,
) -> ReducedModel:
    """From the Schur stiffness and the mass of the boundary, their coupling M_BM with the modes,
    and omega of these."""
    S = (S + S.T) / 2
    if len(boundary):
        check_condensed(body, boundary, S)
    if body.free:  # rounding of S along rigid motions would hold, or push, what floats
        Q = np.linalg.qr(body.rigid_motions()[boundary])[0]
        SQ = S @ Q
        half = Q @ (SQ - Q @ (Q.T @ SQ) / 2).T
        S = S - half - half.T
    mass = np.block([[(M_BB + M_BB.T) / 2, M_BM], [M_BM.T, np.eye(len(omega))]])
    return labelled(body, boundary, mass, sl.block_diag(S, np.diag(omega**2)), len(omega))


class _Blocks(NamedTuple):
    """Rows and columns of a sparse matrix on the boundary B and in the interior I."""

    BB: sp.csr_matrix
    IB: sp.csr_matrix
    II: sp.csr_matrix

    @classmethod
    def of(cls, matrix: sp.spmatrix, boundary: np.ndarray, interior: np.ndarray) -> "_Blocks":
        inside = matrix[interior]
        return cls(matrix[boundary][:, boundary], inside[:, boundary], inside[:, interior])


def _check_modes(body: Body, modes: int | None, below_hz: float | None) -> None:
    """One of the two, and a number that means something."""
    if (modes is None) == (below_hz is None):
        raise InputError(
            f"body '{body.name}': give either a number of modes or the frequency below which all "
            "are kept"
        )
    if modes is not None and (isinstance(modes, bool) or not isinstance(modes, Integral)):
        raise InputError(f"body '{body.name}': modes = {modes!r} must be a whole number")
    if below_hz is not None and not 0 <= below_hz < np.inf:
        raise InputError(
            f"body '{body.name}': below_hz = {below_hz:g} must be finite and not negative"
        )


def _partition(body: Body, masters: Iterable[int]) -> tuple[np.ndarray, np.ndarray, int]:
    """Boundary and interior dofs, and the number of rigid modes."""
    masters = np.unique(np.asarray(masters, dtype=np.int64))
    absent = np.setdiff1d(masters, body.node[body.dof_node])
    if len(absent):
        raise InputError(
            f"body '{body.name}': master node {absent[0]} does not exist or is clamped"
        )
    rigid = check_support(body)
    boundary = body.node_dofs(masters)
    if rigid and body.points is not None and not _held(body, boundary, rigid):
        boundary = body.node_dofs(np.union1d(masters, holding_nodes(body)))
    if rigid and not _held(body, boundary, rigid):
        raise InputError(
            f"body '{body.name}': it is free and its master nodes do not hold it; name at least "
            "three that are not on one line"
        )
    return boundary, np.setdiff1d(np.arange(body.dofs), boundary), rigid


def _held(body: Body, boundary: np.ndarray, rigid: int) -> bool:
    return len(boundary) >= rigid and np.linalg.matrix_rank(body.rigid_motions()[boundary]) >= rigid


def _whole_clusters(
    body: Body, factor: Factor, M_II: sp.spmatrix, modes: int | None, below_hz: float | None
) -> Modes:
    """The modes asked for, and those equal to the highest of them, as two equal blades have them:
    which part of a cluster a solver finds depends on the numbering of the mesh."""
    found = factor.modes(M_II, modes, below_hz)
    count = len(found.omega)
    while (
        0 < len(found.omega) < len(M_II.indptr) - 1
        and found.free_to <= (1 + SETTINGS.equal) * found.omega[-1]
    ):
        found = factor.modes(M_II, len(found.omega) + 1)
    if len(found.omega) > count:
        hz = found.omega[-1] / (2 * np.pi)
        logging.getLogger("modal").info(
            "body '%s': %d modes in place of %d, since their frequencies are the same near %.6g Hz",
            body.name,
            len(found.omega),
            count,
            hz,
        )
    return found


def _check_count(body: Body, modes: int | None, size: int) -> None:
    if modes is not None and not 0 <= modes <= size:
        raise InputError(
            f"body '{body.name}': {modes} modes asked for: must be between 0 and the {size} dofs "
            "that the masters leave"
        )


def _no_modes(size: int) -> Modes:
    return Modes(np.empty(0), np.empty((size, 0)), 0.0)


def _inertia(M: _Blocks, Psi: np.ndarray) -> np.ndarray:
    """(i, b) kg: forces on the interior by unit accelerations of the boundary, the interior
    following."""
    forces, direct = M.II @ Psi, M.IB.tocoo()
    forces[direct.row, direct.col] += direct.data
    return forces


def _with_contact_shapes(
    body: Body,
    interior: np.ndarray,
    factor: Factor,
    M_II: sp.spmatrix,
    found: Modes,
    tractions: sp.spmatrix | None,
) -> tuple[Modes, int]:
    """The modes behind the contact shapes of forces on interior dofs, and the number of these
    shapes."""
    if body.points is None or not (W := body.points.motion[:, interior]).nnz:
        return found, 0
    omega, Z = contact_shapes(factor.solve, M_II, spread(W, tractions), found.omega, found.phi)
    return Modes(np.r_[omega, found.omega], np.hstack([Z, found.phi]), found.free_to), len(omega)


def _left_out(
    factor: Factor, M_II: sp.spmatrix, M_Psi: np.ndarray, found: Modes, shapes: int
) -> np.ndarray:
    """G of `truncation`: compliance of the inertia forces of Psi and of the contact shapes, the
    first of the modes found, that neither these nor the modes represent."""
    Z, Phi = found.phi[:, :shapes], found.phi[:, shapes:]
    if len(Z) == found.phi.shape[1]:
        return np.zeros((M_Psi.shape[1] + shapes,) * 2)
    rest = (M_II @ Phi) @ (-Phi.T @ M_Psi)
    rest += M_Psi
    if shapes:
        rest = np.hstack([rest, M_II @ Z])
    G = rest.T @ factor.solve(rest)
    if shapes:
        carried = Z.T @ rest / found.omega[:shapes, None]
        G -= carried.T @ carried
    return (G + G.T) / 2


def _keep_rigid(
    body: Body, boundary: np.ndarray, interior: np.ndarray, K: _Blocks, Psi: np.ndarray
) -> None:
    """Corrects the constraint modes of a free body, in place: its rigid motions are among them to
    the last digit. RuntimeError where K and the modes resist them by more than rounding."""
    R = body.rigid_motions()
    inside = Psi @ R[boundary]
    lost = np.abs(K.BB @ R[boundary] + K.IB.T @ inside).max() / (
        abs(K.BB).max() * np.abs(R[boundary]).max()
    )
    if lost > SETTINGS.rigid:
        raise RuntimeError(f"body '{body.name}': its rigid motions meet a stiffness of {lost:.1e}")
    Q, T = np.linalg.qr(R[boundary])
    Psi += sl.solve_triangular(T, (R[interior] - inside).T, trans="T").T @ Q.T


def assemble(*models: ReducedModel) -> ReducedModel:
    """Bodies side by side in one model, not yet connected.

    >>> damper, blade = (
    ...     ReducedModel.from_matrices(m * np.eye(1), [[k]], body=name, node=[1], direction=["y"])
    ...     for name, m, k in (("damper", 0.003, 0.0), ("blade", 0.05, 1e6))
    ... )
    >>> print(natural_frequencies(assemble(damper, blade)).round())  # not yet connected
    [  0. 712.]
    """
    names = [n for m in models for n in dict.fromkeys(m.body.tolist())]
    if len(set(names)) < len(names):
        raise InputError(f"bodies must have different names, got {', '.join(names)}")
    C = None
    if any(m.C is not None for m in models):
        C = sl.block_diag(*(np.zeros_like(m.K) if m.C is None else m.C for m in models))
    columns = ("body", "node", "direction", "position")
    return ReducedModel.from_matrices(
        sl.block_diag(*(m.M for m in models)),
        sl.block_diag(*(m.K for m in models)),
        C,
        **{name: np.concatenate([vars(m)[name] for m in models]) for name in columns},
        groups=_merged(m.groups for m in models),
        loads=side_by_side(models),
        provenance=_merged(m.provenance for m in models),
        points=_points_side_by_side(models),
        rigid=_merged(m.rigid for m in models),
    )


def _merged(parts: Iterable[dict]) -> dict:
    return {k: v for part in parts for k, v in part.items()}


def _points_side_by_side(models: tuple[ReducedModel, ...]) -> "dict[str, ContactPoints]":
    starts = np.cumsum([0, *(m.size for m in models)])
    return {
        name: points.among(int(start), int(starts[-1]))
        for m, start in zip(models, starts, strict=False)
        for name, points in m.points.items()
    }


def side_by_side(parts: Sequence[ReducedModel | Body]) -> dict[str, np.ndarray]:
    """Loads of every part on the joined dofs; a name that several bodies carry is one load case."""
    loads: dict[str, np.ndarray] = {}
    starts = np.cumsum([0, *(part.K.shape[0] for part in parts)])
    for part, start, end in zip(parts, starts, starts[1:], strict=False):
        for name, load in part.loads.items():
            loads.setdefault(name, np.zeros(starts[-1]))[start:end] += load
    return loads
