"""Stuck modes over the ranks of an mpirun: counted, as those of one process are. (Several ranks:
test_newton.py.)"""

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

pytest.importorskip("slepc4py")

from tests.modal.random_bodies import random_body  # noqa: E402
from tipdamp.modal.solvers import slepc
from tipdamp.static_contact.full import stuck_modes as full


@pytest.fixture(params=[2, 5])
def body(request):
    """A random body with repeated and close modes."""
    K, M, _ = random_body(request.param)
    return sp.csr_matrix(K), sp.csr_matrix(M)


def test_modes_are_those_of_the_dense_pencil(body):
    K, M = body
    exact = np.sqrt(sl.eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=(0, 7)))
    assert full.modes_over_ranks(K, M, 8) == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("lost", [0, 3])
def test_a_missed_mode_is_noticed(body, monkeypatch, lost):
    lowest = slepc.lowest

    def misses_one(A, B, count, **rest):
        lam, shapes = lowest(A, B, count, **rest)
        return np.delete(lam, lost), shapes[:lost] + shapes[lost + 1 :]

    monkeypatch.setattr(slepc, "lowest", misses_one)
    with pytest.raises(
        RuntimeError, match=r"(\d+) modes found below .* Hz, where the inertia counts \d+"
    ):
        full.modes_over_ranks(*body, 8)


def test_a_missed_mode_is_found_later(body, monkeypatch):
    """Asked again with a larger basis."""
    K, M = body
    lowest, asked = slepc.lowest, []

    def misses_once(A, B, count, **rest):
        asked.append(count)
        lam, shapes = lowest(A, B, count, **rest)
        return (lam, shapes) if len(asked) > 1 else (np.delete(lam, 3), shapes[:3] + shapes[4:])

    monkeypatch.setattr(slepc, "lowest", misses_once)
    exact = np.sqrt(sl.eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=(0, 7)))
    assert full.modes_over_ranks(K, M, 8) == pytest.approx(exact, rel=1e-10)
    assert len(asked) == 2 and asked[1] > asked[0]
