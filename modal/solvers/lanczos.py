"""Block Lanczos with full reorthogonalisation for the lowest modes, on a factor that solves many columns at once.

A block sees modes that are repeated up to its own width; those repeated more often are found by asking again with the
known ones held out.
"""

import numpy as np

BLOCK = 8
TOLERANCE = 1e-8


def block_lanczos(solve, M, count: int, known=None):
    """The `count` lowest modes of K phi = omega^2 M phi that are not in `known`.

    solve(B) -> K^-1 B for (d, b); known : (d, m) M-orthonormal modes, held out
    Returns omega^2 (count + BLOCK,) ascending, of which those beyond `count` are estimates from above; what each of
    them may fall to, (count + BLOCK,); and M-orthonormal shapes (d, count). A mode is converged when
    |K^-1 M phi - phi / omega^2| is 1e-8 of 1 / omega^2 in the M norm. [Golub and Van Loan, ch. 10]
    """
    size = M.shape[0]
    held = np.empty((size, 0)) if known is None else known
    basis = np.empty((size, min(size, count + 16 * BLOCK)), order="F")
    T = np.zeros((0, 0))
    start = np.random.default_rng(held.shape[1]).standard_normal((size, BLOCK))
    X, MX, _ = _orthonormal(solve(M @ start), (held,), M)
    used, check_at = 0, count + BLOCK
    while True:
        width = X.shape[1]
        if used + width > basis.shape[1]:
            basis = np.asfortranarray(np.pad(basis, ((0, 0), (0, basis.shape[1] // 2 + width))))
        basis[:, used:used + width] = X
        used += width
        V = basis[:, :used]
        Y = solve(MX)
        MY = M @ Y
        H = V.T @ MY
        T = np.pad(T, ((0, width), (0, width)))
        T[:, -width:], T[-width:, :] = H, H.T
        T[-width:, -width:] = (H[-width:] + H[-width:].T) / 2
        X, MX, coupling = _orthonormal(Y - V @ H - held @ (held.T @ MY), (held, V), M)
        exhausted = X.shape[1] == 0 or used + held.shape[1] + X.shape[1] > size
        if used >= check_at or exhausted:
            check_at = used + used // 16
            theta, S = np.linalg.eigh(T)
            theta, S = theta[::-1], S[:, ::-1]
            theta, residual = theta[:count + BLOCK], np.linalg.norm(coupling @ S[-width:, :count + BLOCK], axis=0)
            if exhausted or (residual[:count] <= TOLERANCE * theta[:count]).all():
                # K^-1 M (V s) = theta V s + X (coupling s): one step of inverse iteration, without a back-solve
                step = coupling @ S[-width:, :count] / theta[:count]
                return 1 / theta, 1 / (theta + residual), V @ S[:, :count] + X @ step


def _orthonormal(X, against, M):
    """(Q, M Q, R) with X = Q R + its part in `against`; Q M-orthonormal, fewer columns where X loses rank.

    Another pass where the columns of X are nearly dependent: making them orthonormal magnifies what was left over.
    """
    R = np.eye(X.shape[1])
    for _ in range(3):
        for V in against:
            if V.shape[1]:
                X = X - V @ (V.T @ (M @ X))
        MX = M @ X
        gram = X.T @ MX
        scale = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
        value, U = np.linalg.eigh(gram / np.outer(scale, scale))
        good = value > 1e-12
        clean = value[0] > 1e-4
        value, U = np.sqrt(value[good]), U[:, good]
        turn = (U / value) / scale[:, None]
        X, MX, R = X @ turn, MX @ turn, (value[:, None] * U.T * scale) @ R
        if clean or not good.any():
            break
    return X, MX, R
