"""Results of NLvib, the Matlab tool of Krack and Gross, and ours for it.

A column of its X is a solution: Q_0 of all dofs, then for each order k the coefficients of
cos k W t of all dofs and those of sin k W t, and last the angular frequency W of the excitation:

    q(t) = Q_0 + sum_k Q_ck cos k W t + Q_sk sin k W t = Q_0 + Re sum_k (Q_ck - i Q_sk) exp(i k W t)

Krack, Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), appendix C; HB_residual.m of
NLvib 1.3, analysis type 'frf'.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.validation import check_harmonics, numbers


class Solutions(NamedTuple):
    """Of a curve: hz (p,) of the excitation; harmonics (p, dofs, H+1) complex, m, as those of
    `ForcedResponse`."""

    hz: np.ndarray
    harmonics: np.ndarray


def from_nlvib(X: "ArrayLike", harmonics: int) -> Solutions:
    """X (dofs (2 H + 1) + 1, p) or one column of it; harmonics : H of the script.

    Raises InputError where X has another number of rows, is not finite, or a frequency in its last
    row is not positive.

    >>> cosine = [0.0, 1.0, 0.0, 2 * np.pi * 60]  # mean, cosine and sine of one dof, rad/s
    >>> found = from_nlvib(cosine, harmonics=1)
    >>> print(found.hz.round(6), abs(found.harmonics[0, 0]))
    [60.] [0. 1.]
    """
    H, allowed = check_harmonics(harmonics), "must be real numbers, a solution each column"
    table = numbers("X", X, allowed)
    table = table.reshape(len(table), -1) if table.ndim in (1, 2) else np.empty((0, 0))
    dofs, more = divmod(len(table) - 1, 2 * H + 1)
    if more or dofs < 1:
        raise InputError(
            f"X has {len(table)} rows, with harmonics = {H} it must have dofs * {2 * H + 1} + 1"
        )
    if not np.isfinite(table).all():
        raise InputError("X has entries that are not finite")
    if (table[-1] <= 0).any():
        k = int((table[-1] <= 0).argmax())
        raise InputError(
            f"X, solution {k + 1}: the angular frequency in its last row is {table[-1, k]:g}: must "
            "be greater than 0; is X of another analysis than 'frf', or harmonics another number?"
        )
    blocks = table[:-1].T.reshape(-1, 2 * H + 1, dofs)
    found = np.empty((len(blocks), dofs, H + 1), dtype=complex)
    found[:, :, 0] = blocks[:, 0]
    found[:, :, 1:] = (blocks[:, 1::2] - 1j * blocks[:, 2::2]).transpose(0, 2, 1)
    return Solutions(table[-1] / (2 * np.pi), found)


def to_nlvib(hz: "ArrayLike", harmonics: "ArrayLike") -> np.ndarray:
    """X (dofs (2 H + 1) + 1, p) of solutions at hz (p,) with harmonics (p, dofs, H+1): of a curve
    with an output for each dof `to_nlvib(curve.frequency, curve.harmonics)`.

    >>> X = to_nlvib([60.0], [[[0.0, 1.0 - 2.0j]]])  # cos + 2 sin
    >>> print(X[:3, 0])
    [0. 1. 2.]
    """
    values = np.asarray(harmonics, dtype=complex)
    p, dofs, orders = values.shape
    blocks = np.empty((p, 2 * orders - 1, dofs))
    blocks[:, 0] = values[:, :, 0].real
    blocks[:, 1::2] = values[:, :, 1:].real.transpose(0, 2, 1)
    blocks[:, 2::2] = -values[:, :, 1:].imag.transpose(0, 2, 1)
    return np.vstack([blocks.reshape(p, -1).T, 2 * np.pi * np.atleast_1d(hz)])


def read_nlvib(path: str | Path, harmonics: int, name: str = "X_HB") -> Solutions:
    """The variable `name` of a .mat file that Matlab or Octave saved (`save('X.mat', 'X_HB')`).

    Raises InputError where the file cannot be read or has no such variable, and as `from_nlvib`.

    >>> from scipy.io import savemat
    >>> savemat("X.mat", {"X_HB": to_nlvib([60.0], [[[0.0, 1.0 - 2.0j]]])})
    >>> read_nlvib("X.mat", harmonics=1).hz.round(6)
    array([60.])
    """
    from scipy.io import loadmat

    if not Path(path).is_file():
        raise InputError(f"file not found: {path}")
    try:
        found = loadmat(path)
    except NotImplementedError:
        raise InputError(f"{path}: is of version 7.3; save it with '-v7'") from None
    except Exception as error:  # scipy raises many kinds on what is no such file
        raise InputError(f"{path}: is no .mat file, or is cut off ({error})") from None
    variables = [key for key in found if not key.startswith("__")]
    if name not in variables:
        raise InputError(f"{path}: has no variable '{name}'; {nearest(name, variables)}")
    return from_nlvib(found[name], harmonics)
