"""A factor that carries rows with it, against dense algebra; the nested dissection, against the
graph."""

import numpy as np
import pytest
import scipy.sparse as sp

from tipdamp.modal.solvers.cholesky import SingularStiffness
from tipdamp.modal.solvers.dissection import DissectionSettings, dissection
from tipdamp.modal.solvers.multifrontal import CarryingFactor


def lattice(seed, shape=(7, 5, 4), missing=0.0):
    """Springs between neighbours of a lattice, some of them absent, each node held a little: K (n,
    n) and positions."""
    random = np.random.default_rng(seed)
    place = (
        np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
        .reshape(-1, 3)
        .astype(float)
    )
    apart = np.abs(place[:, None] - place[None]).max(axis=2)
    k = np.triu(
        (apart == 1)
        * random.uniform(0.5, 2, apart.shape)
        * (random.uniform(size=apart.shape) >= missing),
        1,
    )
    k = k + k.T
    return sp.csr_matrix(np.diag(k.sum(axis=1) + random.uniform(1e-3, 1, len(k))) - k), place


def rows(random, n, dofs):
    """W (n, dofs): weighted means over some dofs far apart, one row empty."""
    W = np.where(random.uniform(size=(n, dofs)) < 5 / dofs, random.uniform(size=(n, dofs)), 0.0)
    W[0] = 0
    return sp.csr_matrix(W)


@pytest.mark.parametrize("seed", range(4))
def test_against_dense_algebra(seed):
    K, place = lattice(seed, missing=0.9 * (seed % 2))  # with few springs left, of many parts
    random = np.random.default_rng(seed)
    W, f = rows(random, 9, K.shape[0]), random.normal(size=(K.shape[0], 3))
    factor = CarryingFactor(K, W, dissection(abs(K), place, DissectionSettings(leaf=6)))
    inverse = np.linalg.inv(K.toarray())
    lower = factor.take_compliance()
    assert lower + np.tril(lower, -1).T == pytest.approx(W @ inverse @ W.T, rel=1e-11, abs=1e-12)
    assert factor.solve(f) == pytest.approx(inverse @ f, rel=1e-11, abs=1e-12)
    assert factor.felt(f[:, 0]) == pytest.approx(W @ inverse @ f[:, 0], rel=1e-11, abs=1e-12)


def test_what_is_not_definite_is_refused():
    K, place = lattice(0)
    with pytest.raises(SingularStiffness, match="not positive definite"):
        CarryingFactor(
            (K - 2 * sp.identity(len(place))).tocsr(),
            rows(np.random.default_rng(0), 2, len(place)),
            dissection(abs(K), place),
        )


def test_sets_separate_what_came_before_them():
    """Every node once; the nodes below two children of a set do not touch, so that the set lies
    between them."""
    K, place = lattice(0, (9, 8, 7))
    sets, below = dissection(abs(K), place, DissectionSettings(leaf=8)), []
    for nodes, children in sets:
        split = len(below) - children
        own = below[split:]
        for i in range(len(own)):
            for j in range(i):
                assert not K[own[i]][:, own[j]].nnz
        below[split:] = [np.concatenate([nodes, *own])]
    assert len(below) == 1 and sorted(below[0]) == list(range(len(place)))
    assert max(len(nodes) for nodes, _ in sets) <= 56 and len(sets) > 50
