"""Nested dissection of a body by its node positions: the order in which a sparse factorisation
fills little.

A set of nodes is cut in the middle of its longest extent; the nodes of one side that touch the
other separate them and come after both.     [George 1973; geometric cuts: Miller, Teng, Thurston
and Vavasis 1997]
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class DissectionSettings:
    """Of the cuts."""

    leaf: int = 48  # nodes that are not cut further: a dense front of them is as fast
    layer: float = 1e-6  # of the extent of a set: nodes that near to each other lie in one layer


SETTINGS = DissectionSettings()


def dissection(
    graph: sp.csr_matrix, position: np.ndarray, settings: DissectionSettings = SETTINGS
) -> list[tuple[np.ndarray, int]]:
    """Sets of nodes in the order of their elimination, each with the number of its children among
    those before it: the last ones that are nobody's yet.

    graph (n, n) CSR, positive where two nodes touch; position (n, 3).
    """
    sets: list[tuple[np.ndarray, int]] = []
    _cut(graph, position, np.arange(len(position)), np.zeros(len(position)), settings, sets)
    return sets


def _cut(
    graph: sp.spmatrix,
    position: np.ndarray,
    nodes: np.ndarray,
    mark: np.ndarray,
    settings: DissectionSettings,
    sets: list[tuple[np.ndarray, int]],
) -> int:
    """Puts those of the nodes into the sets, and returns how many of these are nobody's children;
    mark (n,) scratch of zeros."""
    x = position[nodes]
    along = x[:, np.ptp(x, axis=0).argmax()] if len(x) > settings.leaf else np.zeros(len(x))
    low, high = _halves(nodes, along, settings.layer)
    if not len(high):
        sets.append((nodes, 0))
        return 1
    touching = [_touching(graph, low, high, mark), _touching(graph, high, low, mark)]
    if touching[0].sum() <= touching[1].sum():
        separator, low = low[touching[0]], low[~touching[0]]
    else:
        separator, high = high[touching[1]], high[~touching[1]]
    children = sum(
        _cut(graph, position, part, mark, settings, sets) for part in (low, high) if len(part)
    )
    if not len(separator):
        return children
    sets.append((separator, children))
    return 1


def _halves(nodes: np.ndarray, along: np.ndarray, layer: float) -> tuple[np.ndarray, np.ndarray]:
    """The nodes below and above the gap between layers that is nearest to the median; none above in
    a single layer."""
    order = np.argsort(along, kind="stable")
    step = np.flatnonzero(np.diff(along[order]) > layer * (along[order[-1]] - along[order[0]])) + 1
    if not len(step):
        return nodes, nodes[:0]
    at = step[np.abs(step - len(nodes) / 2).argmin()]
    return nodes[np.sort(order[:at])], nodes[np.sort(order[at:])]


def _touching(
    graph: sp.spmatrix, some: np.ndarray, others: np.ndarray, mark: np.ndarray
) -> np.ndarray:
    """(s,) bool: which of the nodes `some` touch any of `others`."""
    mark[others] = 1
    met = graph[some] @ mark > 0
    mark[others] = 0
    return met
