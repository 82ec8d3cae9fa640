"""Error bound of reduced frequencies: how far they lie above those of the full model, which is not
solved.

In the coordinates (q_B, eta, eta_t), eta_t the fixed-interface modes that were left out, the full
model is

    K_r q - lambda (M_r q + M_rt eta_t) = 0,      (Lambda_t - lambda) eta_t = lambda M_tr q.

Below the lowest omega_t^2 left out, eta_t can be eliminated, and the reduced problem gets the term
-lambda^2 M_rt (Lambda_t - lambda)^-1 M_tr. It is at most lambda a(lambda) G with

    G = M_rt Lambda_t^-1 M_tr,      a(lambda) = lambda / (1 - lambda / omega_t^2),

and by Sylvester's law of inertia the full model has, below any lambda, at most as many modes as
K_r - lambda (M_r + a G). Its k-th frequency therefore lies between the k-th root of

    K_r q = nu (M_r + a(lambda_k) G) q

and the reduced lambda_k [Rayleigh-Ritz], for any springs on the master dofs. No mode that was left
out is needed: with R the part of M_II Psi + M_IB that the kept modes do not carry, G = R' K_II^-1
R, one back-solve per master dof."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_files import open_npz, save_npz


@dataclass(frozen=True)
class Truncation:
    """What the reduced bodies of a model leave out, in the order of their dofs.

    body : (n,) str; size : (n,) int - dofs of each reduced body
    omega : (n,) rad/s - no fixed-interface mode that was left out lies below it
    G : n matrices (b, b) kg s2 over the master dofs, which stand first in each body
    highest : (n,) rad/s - about the highest frequency of each whole body, with which the rounding
    inside its reduction grows
    """

    body: np.ndarray
    size: np.ndarray
    omega: np.ndarray
    G: tuple
    highest: np.ndarray

    def save(self, path: str | Path) -> Path:
        """Write a .npz file."""
        save_npz(
            path,
            body=self.body,
            size=self.size,
            omega=self.omega,
            highest=self.highest,
            **{f"G{i}": g for i, g in enumerate(self.G)},
        )
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> "Truncation":
        """Read what `save` has written."""
        with open_npz(path) as z:
            return cls(
                z["body"],
                z["size"],
                z["omega"],
                tuple(z[f"G{i}"] for i in range(len(z["body"]))),
                z["highest"],
            )

    def mass(self, lam: float) -> np.ndarray | None:
        """a(lam) G over all dofs, (r, r) kg; None at and beyond the lowest mode that was left
        out."""
        if (lam >= self.omega**2).any():
            return None
        blocks = []
        for size, omega, G in zip(self.size, self.omega, self.G, strict=True):
            block = np.zeros((size, size))
            block[: len(G), : len(G)] = lam / (1 - lam / omega**2) * G
            blocks.append(block)
        return sl.block_diag(*blocks)


def join(*parts: Truncation) -> Truncation:
    """Bodies side by side, as `craig_bampton.assemble` joins their models."""
    columns = ("body", "size", "omega", "highest")
    return Truncation(
        G=sum((p.G for p in parts), ()),
        **{name: np.concatenate([vars(p)[name] for p in parts]) for name in columns},
    )


def highest_frequency(K: sp.csr_matrix, M: sp.csr_matrix) -> float:
    """rad/s: about the highest of the pencil of a body, K and M (n, n): the largest row sum of K
    over the diagonal of M [Gershgorin], massless dofs left out."""
    mass = M.diagonal()
    scale = sp.diags(np.where(mass > 0, 1 / np.sqrt(np.where(mass > 0, mass, 1.0)), 0.0))
    return float(np.sqrt(abs(scale @ K @ scale).sum(axis=1).max()))


def lowest_possible(
    K: np.ndarray, M: np.ndarray, truncation: Truncation, omega: np.ndarray
) -> np.ndarray:
    """For the lowest reduced frequencies omega (n,) rad/s of (K, M) the bound below which the full
    one cannot lie.

    K, M (r, r): reduced model with any springs on master dofs. NaN where the reduced frequency
    reaches a mode that was left out: nothing can be said of it. A rigid motion (0) stays 0.
    """
    if truncation.size.sum() != len(K):
        raise InputError(
            f"the truncation is of {truncation.size.sum()} dofs, the model has {len(K)}"
        )
    out = np.full(len(omega), np.nan)
    for k, value in enumerate(omega):
        left_out = truncation.mass(value**2)
        if left_out is not None:
            out[k] = np.sqrt(
                max(0.0, sl.eigh(K, M + left_out, subset_by_index=(k, k), eigvals_only=True)[0])
            )
    return out


def rounding(K: np.ndarray, M: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """(n,) relative error that rounding leaves in the frequencies omega (n,) rad/s of (K, M): eps
    cond / 2, where cond is the highest omega^2 of the pencil over the frequency's own. A dense
    solver of symmetric pencils errs by eps times the highest in every omega^2 [LAPACK Users' Guide,
    1999, sec. 4.9, with its p(n) taken as 1, as it advises]."""
    n = len(K)
    highest = sl.eigh(K, M, subset_by_index=(n - 1, n - 1), eigvals_only=True)[0]
    return _rounded(highest, omega)


def _rounded(highest: float, omega: np.ndarray) -> np.ndarray:
    """eps / 2 of the highest omega^2 over a frequency's own; a rigid motion stands for itself."""
    squared = np.asarray(omega, dtype=float) ** 2
    over = np.divide(highest, squared, out=np.ones(len(squared)), where=squared > 0)
    return np.finfo(float).eps / 2 * over


def error_bound(
    K: np.ndarray, M: np.ndarray, truncation: Truncation, omega: np.ndarray
) -> np.ndarray:
    """(n,) largest possible omega / omega_full - 1 of the lowest reduced frequencies, with what
    rounding adds to it, here and in the reduction of the whole bodies; inf where nothing can be
    said, 0 of rigid motions."""
    low = lowest_possible(K, M, truncation, omega)
    rigid = np.asarray(omega) <= 1e-6 * np.max(omega, initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        bound = np.asarray(omega) / low - 1
    noise = rounding(K, M, omega) + _rounded(truncation.highest.max() ** 2, omega)
    return np.where(
        rigid, 0.0, np.where(np.isfinite(bound), np.maximum(bound, 0.0) + noise, np.inf)
    )
