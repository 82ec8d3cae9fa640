"""Sets of rows that come and go, against a factor of each set."""

import numpy as np
import pytest

from tipdamp.static_contact.normal.closed_factor import ClosedFactor


def test_sets_that_change():
    """A random walk over sets of 150 rows, by small steps (bordered) and large ones (a new factor);
    the empty set."""
    random = np.random.default_rng(7)
    L = random.normal(size=(150, 150))
    A = L @ L.T / 150 + np.eye(150)
    factor, closed = ClosedFactor(A), np.ones(150, dtype=bool)
    right = random.normal(size=(150, 3))
    bases = set()
    for step in range(60):
        closed = closed.copy()
        change = random.choice(150, 40 if step % 20 == 0 else 1, replace=False)
        closed[change] ^= True
        x = factor.solve(closed, right)
        rows = np.flatnonzero(closed)
        assert x[rows] == pytest.approx(
            np.linalg.solve(A[np.ix_(rows, rows)], right[rows]), abs=1e-12
        )
        assert not x[~closed].any()
        bases.add(factor.base.tobytes())
    assert 3 <= len(bases) < 20  # most sets were solved with the factor of another
    assert not factor.solve(np.zeros(150, dtype=bool), right).any()


def test_a_singular_set():
    A = np.ones((100, 100)) + np.diag(np.r_[np.zeros(2), np.ones(98)])
    with pytest.raises(np.linalg.LinAlgError):
        ClosedFactor(A - 1e-12 * np.eye(100)).solve(np.ones(100, dtype=bool), np.ones((100, 1)))
