"""Sets of closed pairs on whole equations, by pivoting and proximal points, on systems of a few
dofs."""

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")

from tipdamp.modal.solvers import petsc  # noqa: E402
from tipdamp.static_contact.full.closed_sets import FullSets  # noqa: E402
from tipdamp.static_contact.full.newton import ContactNewton, Equations  # noqa: E402
from tipdamp.static_contact.normal.complementarity import NoEquilibrium  # noqa: E402


def sets(K, B, k, gap, f):
    whole = Equations(sp.csr_matrix(K), sp.csr_matrix(B), k, gap, f, definite=True)
    newton = ContactNewton(petsc.start(), (0, len(f)), whole)
    return FullSets(newton, sp.csr_matrix(B), np.ones(len(k), dtype=bool))


@pytest.mark.parametrize("anchor, at", [(0.0, 0.0), (1e-2, 0.0), (0.3, 4e-6)])
def test_a_set_is_one_linear_system(anchor, at):
    """(K + B' k (closed + anchor) B) x = f + B' k (closed gap + anchor at), with numpy."""
    random = np.random.default_rng(3)
    root, B = random.standard_normal((6, 6)), random.standard_normal((4, 6))
    K, k = 1e5 * (root @ root.T + np.eye(6)), random.uniform(1e5, 1e6, 4)
    gap, f = random.uniform(0, 1e-5, 4), 10 * random.standard_normal(6)
    closed, at = np.array([True, False, True, False]), at * random.standard_normal(4)
    problem = sets(K, B, k, gap, f)
    found = problem.solve_set(closed, None, gap, anchor, at)
    tangent = K + B.T @ np.diag(k * (closed + anchor)) @ B
    x = np.linalg.solve(tangent, f + B.T @ (k * (closed * gap + anchor * at)))
    u = B @ x
    assert found.u == pytest.approx(u, rel=1e-9)
    assert found.N == pytest.approx(np.where(closed, k * (u - gap), 0.0), rel=1e-9)
    # of the equations with the true contact, which a wrong set or an anchor leaves
    left = np.linalg.norm(K @ x + B.T @ np.maximum(k * (u - gap), 0.0) - f)
    (residual,) = problem.found.values()
    assert residual == pytest.approx(left / np.linalg.norm(f), rel=1e-6)


def plank(load_at, gap, push=100.0):
    """Heave and pitch of a rigid plank on springs of 1 N/um at -1, 0 and 1."""
    B = np.array([[1.0, -1], [1, 0], [1, 1]])
    return sets(
        np.zeros((2, 2)), B, np.full(3, 1e6), np.array(gap), push * np.array([1.0, load_at])
    )


def test_a_plank_that_balances_on_its_middle():
    """Only anchors hold its pitch; they leave nothing in forces and residual."""
    u, residual = plank(0.0, [1e-2, 0, 1e-2]).solve()
    assert np.maximum(1e6 * (u - [1e-2, 0, 1e-2]), 0) == pytest.approx([0, 100, 0], rel=1e-8)
    assert residual < 1e-8


def test_a_plank_that_tips_until_an_end_touches():
    """Statics alone; the residual is that of the equations without anchors."""
    problem = plank(1 / 3, [1.0, 0, 1.0])
    u, residual = problem.solve()
    force = 1e6 * np.maximum(u - [1.0, 0, 1.0], 0)
    assert force == pytest.approx([0, 200 / 3, 100 / 3], rel=1e-6)
    assert residual < 1e-8 and problem.factored > 1


def test_a_plank_that_is_loaded_beyond_its_end_is_refused():
    with pytest.raises(NoEquilibrium, match="do not hold the damper"):
        plank(1.5, [0.0, 0, 0]).solve()
