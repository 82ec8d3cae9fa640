"""Modes: none is missed, none is made up, whatever repeats; every back-solve answers for its
residual."""

import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from tipdamp.modal.eigen import Factor, SingularStiffness
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.solvers import arpack, inertia, petsc, slepc
from tipdamp.modal.solvers.cholesky import sparse_factor
from tipdamp.modal.solvers.inertia import modes_below

from .blocks import block
from .random_bodies import missed, random_body


@pytest.mark.parametrize("seed", [*range(24), *range(1000, 1009)])
def test_no_mode_of_a_random_body_is_missed(seed, monkeypatch):
    """Against the eigenvalues of the small problems that the body is made of; from 1000 on without
    PETSc."""
    if seed >= 1000:
        monkeypatch.setattr(petsc, "start", lambda: None)
    assert missed(seed) == 0


def fourteen_times():
    """448 dofs, every mode 14 times."""
    k = sp.diags([np.full(31, -1.0), np.full(32, 2.0), np.full(31, -1.0)], [-1, 0, 1]) * 1e6
    return sp.block_diag([k] * 14).tocsr(), sp.identity(448, format="csr")


@pytest.fixture(params=["SLEPc", "ARPACK", "without PETSc"])
def solver(request, monkeypatch):
    """Each of the ways to the lowest modes."""
    if request.param == "SLEPc":
        pytest.importorskip("slepc4py")
        return
    monkeypatch.setitem(sys.modules, "slepc4py", None)
    if request.param == "without PETSc":
        monkeypatch.setattr(petsc, "start", lambda: None)


def test_a_factor_lent_to_slepc_is_freed_with_its_owner():
    """Nothing that SLEPc leaves behind holds it: a factor of which the last reference is among what
    Python dropped stays in memory for good."""
    pytest.importorskip("slepc4py")
    K = sp.diags([np.full(599, -1.0), np.full(600, 2.0), np.full(599, -1.0)], [-1, 0, 1]) * 1e6
    factor = sparse_factor(K.tocsr())
    before = sys.getrefcount(factor.factor)
    slepc.lowest_with(factor, sp.identity(600, format="csr"), 5, 3)
    after = sys.getrefcount(factor.factor)
    assert after == before


def test_a_mode_repeated_fourteen_times(solver):
    K, M = fourteen_times()
    lowest = 4e6 * np.sin(np.pi / 66) ** 2  # fixed chain of 32: 4 k sin^2(pi / 2 / 33)
    assert modes_below(K, M, 1.01 * np.sqrt(lowest)) == 14
    omega, phi = Factor(K).lowest_modes(M, 14)
    assert omega**2 == pytest.approx(np.full(14, lowest), rel=1e-9)
    assert np.abs(phi.T @ phi - np.eye(14)).max() < 1e-9
    omega, _ = Factor(K).modes_below(M, 1.01 * np.sqrt(lowest) / (2 * np.pi))
    assert len(omega) == 14


@pytest.mark.parametrize("count", [1, 5, 40])
@pytest.mark.parametrize(
    "stiffness",
    [
        np.full(500, 1e6),
        np.where(np.arange(500) < 3, 1e6, 4e6),
        np.where(np.arange(500) % 50, 4e6, 1e6),
    ],
    ids=["one", "two", "mixed"],
)
def test_one_or_two_distinct_modes(solver, stiffness, count):
    """A diagonal K: a Krylov space of one vector holds no more than the distinct modes."""
    omega, phi = Factor(sp.diags(stiffness).tocsr()).lowest_modes(
        sp.identity(500, format="csr"), count
    )
    assert omega**2 == pytest.approx(np.sort(stiffness)[:count], rel=1e-12)
    assert np.abs(phi.T @ phi - np.eye(count)).max() < 1e-12


@pytest.mark.parametrize("withheld", [0, 3, 9])
def test_a_withheld_mode_is_asked_for_again(monkeypatch, withheld):
    """The first answer lacks a mode and has a higher one instead: the count by inertia betrays
    it."""
    K, M, lam = random_body(2)
    asked, lowest = [], arpack.lowest

    def forgetful(self, M, count):
        found, phi = lowest(self._solver.solve, M, count + 3)
        return np.delete(found, withheld), np.delete(phi, withheld, axis=1)[:, :count]

    def completing(solve, M, count, known=None):
        asked.append(count)
        return lowest(solve, M, count, known)

    monkeypatch.setattr(Factor, "_lowest", forgetful)
    monkeypatch.setattr(arpack, "lowest", completing)
    assert Factor(K).lowest_modes(M, 10)[0] ** 2 == pytest.approx(lam[:10], rel=1e-9)
    assert len(asked) == 1


@pytest.mark.parametrize("with_petsc", [True, False])
def test_counts_of_a_chain(monkeypatch, with_petsc):
    """omega_j = 2 sqrt(k/m) sin(j pi / 2 / (n+1)) of a fixed chain; also where K itself is singular
    (free chain)."""
    if not with_petsc:
        monkeypatch.setattr(petsc, "start", lambda: None)
    n, k = 500, 1e4
    K = sp.diags([np.full(n - 1, -k), np.full(n, 2 * k), np.full(n - 1, -k)], [-1, 0, 1]).tocsr()
    M = sp.identity(n, format="csr")
    omega = 2 * np.sqrt(k) * np.sin(np.arange(1, n + 1) * np.pi / 2 / (n + 1))
    for j in (0, 1, 7, 300, n - 1):
        assert modes_below(K, M, omega[j] * (1 - 1e-5)) == j
        assert modes_below(K, M, omega[j] * (1 + 1e-5)) == j + 1
    free = K.tolil()
    free[0, 0] = free[-1, -1] = k  # one rigid motion; omega_j = 2 sqrt(k/m) sin(j pi / 2 / n)
    assert modes_below(free.tocsr(), M, 2 * np.sqrt(k) * np.sin(2.5 * np.pi / 2 / n)) == 3


def test_count_needs_a_factor_that_solves(monkeypatch):
    K, M = fourteen_times()
    monkeypatch.setattr(petsc, "start", lambda: None)
    monkeypatch.setattr(inertia, "_superlu", lambda A, b: (3, 2 * sp.linalg.spsolve(A.tocsc(), b)))
    with pytest.raises(RuntimeError, match="could not be counted"):
        modes_below(K, M, 100.0)


@pytest.mark.parametrize("columns", [1, 40])
def test_a_wrong_column_does_not_pass_the_probe(columns):
    """An error of 3e-8 in one column among many is an error of that column."""
    K, _, _ = random_body(0)
    factor = Factor(K)
    right = np.random.default_rng(0).standard_normal((K.shape[0], columns))
    solve = factor._solver.solve
    factor.solve(right)

    class Spoiled:
        def solve(self, b):
            x = solve(b)
            x[:, -1] *= 1 + 3e-8
            return x

    factor._solver = Spoiled()
    with pytest.raises(SingularStiffness, match="3.0e-08 of its load"):
        factor.solve(right)


def test_a_slender_body_is_not_taken_for_a_free_one():
    """1 m by 10 mm: the rounding of K x is 1e-7 of a load at its tip, whose deflection is that of a
    beam with shear."""
    length, depth, E = 1.0, 0.01, 207e9
    mesh = block("hexahedron20", (100, 1, 1), size=(length, depth, depth))
    body = elastic_body(mesh, Material(E, 0.0, 7850.0), "beam", clamp="clamp")
    tip = body.node_dofs(body.group("tip"))
    tip, f = tip[body.dof_direction[tip] == 1], np.zeros(body.dofs)
    f[tip] = 1 / len(tip)
    bending = length**3 / (3 * E * depth**4 / 12)
    shear = length / (5 / 6 * E / 2 * depth**2)
    assert Factor(body.K).solve(f)[tip].mean() == pytest.approx(bending + shear, rel=2e-5)


def test_a_load_that_is_no_number_is_said():
    K, _, _ = random_body(0)
    with pytest.raises(RuntimeError, match="a load of a linear solve is not a number"):
        Factor(K).solve(np.full(K.shape[0], np.nan))


def test_solves_after_modes():
    """The factor stays usable: error estimates solve after the modes."""
    K, M, _ = random_body(2)
    factor = Factor(K)
    factor.lowest_modes(M, 5)
    assert K @ factor.solve(np.ones(K.shape[0])) == pytest.approx(np.ones(K.shape[0]), abs=1e-8)


def resident():
    """Memory of this process, kB."""
    status = Path("/proc/self/status").read_text()
    return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1])


def grid(n, width=70):
    """A five-point stencil: n dofs in rows of `width`."""
    k = sp.diags([np.full(n - 1, -1.0), np.full(n, 4.0), np.full(n - 1, -1.0)], [-1, 0, 1])
    return (k + sp.diags([np.full(n - width, -1.0)] * 2, [-width, width], (n, n))).tocsr()


@pytest.fixture
def with_petsc():
    if petsc.start() is None:
        pytest.skip("SuperLU frees itself")


@pytest.mark.slow
def test_factors_and_counts_free_their_memory(with_petsc):
    """Resident memory after ten counts and factors of 5 000 dofs is that after two, to less than
    one factor (4 MB); and a count of 40 000 dofs, 8 MB of factor and 4 MB of matrices, leaves less
    than the allocator keeps anyway."""
    M, used = sp.identity(5000, format="csr"), []
    for _ in range(10):
        modes_below(grid(5000), M, 0.1)
        Factor(grid(5000))
        used.append(resident())
    assert used[-1] - used[2] < 4000
    K, M = grid(40000, 200), sp.identity(40000, format="csr")
    modes_below(K, M, 0.1)
    before = resident()
    modes_below(K, M, 0.1)
    block = np.ones(3 * 10**7)
    del block
    assert resident() - before < 6000


def test_a_matrix_of_petsc_outlives_its_arrays(with_petsc):
    """It lies on the memory of SciPy's arrays and must hold on to them."""
    PETSc = petsc.start()
    matrix = petsc.matrix(PETSc, grid(5000))
    others = [np.full(25000, 7.0) for _ in range(20)]  # where the arrays were, if they are gone
    x, y = matrix.createVecs()
    x.set(1.0)
    matrix.mult(x, y)
    assert y.getArray()[2500] == 0.0 and y.getArray()[0] == 2.0 and len(others) == 20


@pytest.fixture
def joined_chain(solver):
    """A chain whose ends are softened and joined: factor and matrices."""
    n = 600
    K = sp.diags([np.full(n - 1, -1e4), np.full(n, 2e4), np.full(n - 1, -1e4)], [-1, 0, 1]).tocsr()
    M = sp.diags(np.linspace(1.0, 1.5, n)).tocsr()
    rows = sp.csr_matrix(
        ([1.0, 1.0, -1.0, 1.0], ([0, 1, 1, 2], [3, 10, n - 9, n - 2])), shape=(3, n)
    )
    k = np.array([-2e3, 7e4, 0.0])
    K = (K + rows.T @ sp.diags(k) @ rows).tocsr()
    return Factor(K), K, M


@pytest.mark.parametrize("withheld", [None, 0, 4])
def test_upper_bounds_betray_a_missed_mode(joined_chain, monkeypatch, withheld):
    """Frequencies of a reduction lie above those of the body: only where one is exceeded are the
    modes counted."""
    factor, K, M = joined_chain
    true = Factor(K).lowest_modes(M, 6)[0]
    counted, lowest, count_below = [], Factor._lowest, modes_below

    def forgetful(self, M, count):
        found, phi = lowest(self, M, count + 3)
        kept = np.delete(np.arange(len(found)), [] if withheld is None else withheld)
        return found[kept], phi[:, kept[kept < phi.shape[1]]][:, :count]

    def counting(*args):
        counted.append(args)
        return count_below(*args)

    monkeypatch.setattr(Factor, "_lowest", forgetful)
    monkeypatch.setattr("tipdamp.modal.eigen.modes_below", counting)
    found = factor.modes(M, 6, at_most=true * (1 + 1e-4))
    assert found.omega == pytest.approx(true, rel=1e-9)
    assert bool(counted) == (withheld is not None)
