"""Random bodies with repeated and close modes whose frequencies are known from small problems.

    .venv/bin/python -m tests.modal.random_bodies [--bodies 500] [--scipy]

asks every body for its lowest modes, for all below a frequency, and counts what is missed.
"""

import argparse

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp


def random_body(seed: int):
    """(K, M, omega^2 ascending) of 420 to 1000 dofs, in one of three kinds; numbering shuffled.

    copies - up to 14 equal, unconnected pieces: each mode is there that often
    near   - the same with pieces that differ by 1e-9 to 1e-3
    square - a square membrane: lam_i + lam_j of its edge, most of them twice
    """
    rng = np.random.default_rng(seed)
    kind = ("copies", "near", "square")[seed % 3]
    if kind == "square":
        n = int(rng.integers(21, 30))
        k, m = _chain(n, rng)
        lam = sl.eigh(k.toarray(), m.toarray(), eigvals_only=True)
        K, M = sp.kron(k, m) + sp.kron(m, k), sp.kron(m, m)
        lam = (lam[:, None] + lam).ravel()
    else:
        number = int(rng.integers(2, 15))
        n = int(rng.integers(420 // number + 1, 1000 // number))
        k, m = _chain(n, rng, links=2 * n)
        spread = 10.0 ** rng.uniform(-9, -3) if kind == "near" else 0.0
        factors = 1 + spread * rng.standard_normal(number)
        K, M = sp.block_diag([f * k for f in factors]), sp.block_diag([m] * number)
        lam = np.concatenate(
            [sl.eigh(f * k.toarray(), m.toarray(), eigvals_only=True) for f in factors]
        )
    order = rng.permutation(K.shape[0])
    return K.tocsr()[order][:, order].tocsr(), M.tocsr()[order][:, order].tocsr(), np.sort(lam)


def _chain(n, rng, links=0):
    """Springs to ground at one end and between neighbours, and `links` more at random; tridiagonal
    mass."""
    low, high = np.arange(n - 1), np.arange(1, n)
    if links:
        more = rng.integers(0, n, (2, links))
        more = more[:, more[0] != more[1]]
        low, high = np.concatenate([low, more[0]]), np.concatenate([high, more[1]])
    stiff = 10.0 ** rng.uniform(6, 8, len(low))
    end = np.arange(len(low))
    B = sp.csr_matrix((np.ones(len(low)), (end, low)), (len(low), n)) - sp.csr_matrix(
        (np.ones(len(low)), (end, high)), (len(low), n)
    )
    ground = sp.csr_matrix(([1e7], ([0], [0])), (n, n))
    mass = rng.uniform(0.5, 2.0, n)
    return (B.T @ sp.diags(stiff) @ B + ground).tocsr(), sp.diags(
        [np.full(n - 1, 0.1), mass, np.full(n - 1, 0.1)], [-1, 0, 1]
    ).tocsr()


def missed(seed: int) -> int:
    """How many of the lowest modes of a random body are not found, as `count` modes and as all
    below a frequency."""
    from tipdamp.modal.eigen import Factor

    K, M, lam = random_body(seed)
    count = int(np.random.default_rng(seed + 10**6).integers(1, 40))
    factor = Factor(K)
    wrong = int((np.abs(factor.lowest_modes(M, count)[0] ** 2 / lam[:count] - 1) > 1e-7).sum())
    below = lam[lam < lam[count - 1] * (1 + 1e-6)]
    omega, _ = factor.modes_below(M, np.sqrt(lam[count - 1] * (1 + 1e-6)) / (2 * np.pi))
    return (
        wrong
        + abs(len(omega) - len(below))
        + int((np.abs(omega**2 / below[: len(omega)] - 1) > 1e-7).sum())
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bodies", type=int, default=500)
    parser.add_argument("--scipy", action="store_true", help="as where PETSc is not installed")
    arguments = parser.parse_args()
    if arguments.scipy:
        from tipdamp.modal.solvers import petsc

        petsc.start = lambda: None
    found = {seed: missed(seed) for seed in range(arguments.bodies)}
    bad = [seed for seed, n in found.items() if n]
    print(
        f"{arguments.bodies} bodies, {sum(found.values())} modes missed"
        + (f", seeds {bad}" if bad else "")
    )


if __name__ == "__main__":
    main()
