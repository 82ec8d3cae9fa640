"""What a mesh must fulfil before anything is computed with it; what can be repaired is, with a
warning."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError
from tipdamp.modal.elements.cells import CELLS, smallest_jacobians
from tipdamp.modal.faces import face_blocks, face_keys
from tipdamp.modal.mesh import Mesh

FLAT = 1e-12  # of the cube of the cell's longest side: below it a Jacobian is rounding


def checked(mesh: Mesh) -> Mesh:
    """The mesh with inside-out cells turned around and cells given twice dropped, both named in its
    warnings.

    Raises InputError for coordinates that are not finite, cells that repeat a node, folded and flat
    cells, and nodes in the middle of two edges.
    """
    bad = ~np.isfinite(mesh.position).all(axis=1)
    if bad.any():
        raise InputError(
            f"{mesh.source}: node {mesh.node[bad][0]} has a coordinate that is not a finite number "
            f"({int(bad.sum())} such nodes)"
        )
    cells, number, warnings = {}, {}, list(mesh.warnings)
    for kind, block in mesh.cells.items():
        own = mesh.number.get(kind, np.arange(1, len(block) + 1))
        _no_repeated_node(mesh, kind, block, own)
        block, own = _once(kind, block, own, warnings)
        cells[kind], number[kind] = _upright(mesh, kind, block, own, warnings), own
    mesh = replace(mesh, cells=cells, number=number)
    _one_edge_a_middle(mesh)
    warnings += _seams(mesh)
    return replace(mesh, warnings=tuple(warnings))


def _no_repeated_node(mesh: Mesh, kind: str, block: np.ndarray, number: np.ndarray) -> None:
    ordered = np.sort(block, axis=1)
    twice = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    if twice.any():
        raise InputError(
            f"{mesh.source}: {int(twice.sum())} {kind} cells name a node twice and have no volume "
            f"there (smallest Jacobian 0): elements {some(number[twice])}"
        )


def _one_edge_a_middle(mesh: Mesh) -> None:
    """InputError where a node is the middle of two edges: faces that are cut along both diagonals
    and were merged by places."""
    blocks = [
        np.column_stack([block[:, middle], np.sort(block[:, list(ends)], axis=1)])
        for kind, block in mesh.cells.items()
        for middle, ends in CELLS[kind].middles
    ]
    if not blocks:
        return
    known = np.unique(np.concatenate(blocks), axis=0)
    middle, first, count = np.unique(known[:, 0], return_index=True, return_counts=True)
    if not (count > 1).any():
        return
    at = int((count > 1).argmax())
    (a, b), (c, d) = mesh.node[known[first[at] : first[at] + 2, 1:]]
    raise InputError(
        f"{mesh.source}: node {mesh.node[middle[at]]} lies in the middle of two edges, {a} to {b} "
        f"and {c} to {d} ({int((count > 1).sum())} such nodes): faces of two parts that are cut "
        "differently were merged; mesh the parts as one, or merge corner nodes of matching faces "
        "alone"
    )


def _once(
    kind: str, block: np.ndarray, number: np.ndarray, warnings: list
) -> tuple[np.ndarray, np.ndarray]:
    """Without cells that have the same nodes as an earlier one: they would count twice in K and
    M."""
    _, first = np.unique(np.sort(block, axis=1), axis=0, return_index=True)
    if len(first) == len(block):
        return block, number
    first = np.sort(first)
    warnings.append(
        f"{len(block) - len(first)} {kind} cells are in the file twice (same nodes); each is "
        "taken once"
    )
    return block[first], number[first]


def _upright(
    mesh: Mesh, kind: str, block: np.ndarray, number: np.ndarray, warnings: list
) -> np.ndarray:
    corners = mesh.position[block[:, : CELLS[kind].corners]]
    with np.errstate(over="ignore"):  # a damaged coordinate may be as large as a number can be
        size = np.linalg.norm(np.ptp(corners, axis=1), axis=1) ** 3
    low, high = smallest_jacobians(kind, mesh.position, block).T
    turned = high < -FLAT * size
    if turned.any():
        block = block.copy()
        block[turned] = block[turned][:, CELLS[kind].mirrored()]
        low = np.where(turned, -high, low)
        warnings.append(
            f"{int(turned.sum())} {kind} cells were numbered inside out (negative volume) and "
            f"turned around: elements {some(number[turned])}"
        )
    bad = low <= FLAT * size
    if bad.any():
        raise InputError(
            f"{mesh.source}: {int(bad.sum())} {kind} cells are inverted or flat (smallest Jacobian "
            f"{low.min():.2e} m3): elements {some(number[bad])}, first at node "
            f"{mesh.node[block[bad][0, 0]]}"
        )
    return block


def some(numbers: Sequence, limit: int = 5) -> str:
    """The first few numbers of a list, and how many there are."""
    text = ", ".join(str(n) for n in numbers[:limit])
    return text if len(numbers) <= limit else f"{text}, ... ({len(numbers)} in all)"


def _seams(mesh: Mesh) -> list:
    """Faces at which neighbours do not fit: linear beside quadratic, or two triangles on one
    four-sided face."""
    if len(mesh.cells) < 2:
        return []
    blocks = face_blocks(mesh)
    keys = np.concatenate([face_keys(b) for b in blocks])
    nodes = np.concatenate([np.full(len(b), b.shape[1]) for b in blocks])
    unique, inverse, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    inverse = inverse.ravel()
    low, high = np.full(len(unique), 99), np.zeros(len(unique), dtype=int)
    np.minimum.at(low, inverse, nodes)
    np.maximum.at(high, inverse, nodes)
    found = []
    unlike = int((low != high).sum())
    if unlike:
        found.append(
            f"{unlike} faces are shared by cells with different numbers of nodes on them (linear "
            "beside quadratic, or 20-node beside 27-node): the displacement has gaps there"
        )
    single = unique[count == 1]
    halves = _halved(single[single[:, 0] >= 0], single[single[:, 0] < 0][:, 1:])
    if halves:
        found.append(
            f"{halves} four-sided faces meet two triangles each, with no pyramid between: the "
            "displacement has gaps there"
        )
    return found


def _halved(quads: np.ndarray, triangles: np.ndarray) -> int:
    """How many four-sided faces have a triangle of three of their corners as neighbour."""
    known = {tuple(t) for t in triangles.tolist()}
    return (
        sum(any(tuple(q[:i] + q[i + 1 :]) in known for i in range(4)) for q in quads.tolist())
        if known
        else 0
    )


def parts(mesh: Mesh) -> tuple[int, np.ndarray]:
    """How many pieces that share no node the mesh consists of, and the piece of each node (n,)."""
    n = len(mesh.node)
    rows = [np.repeat(b[:, 0], b.shape[1] - 1) for b in mesh.cells.values()]
    columns = [b[:, 1:].ravel() for b in mesh.cells.values()]
    rows, columns = np.concatenate(rows), np.concatenate(columns)
    graph = sp.coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n))
    return sp.csgraph.connected_components(graph, directed=False)
