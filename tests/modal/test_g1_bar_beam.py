"""Craig-Bampton of a bar and a beam with a spring at the tip, for each number of modes, and the
bound of its error."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import legval

from tipdamp.modal.body import Body
from tipdamp.modal.craig_bampton import craig_bampton
from tipdamp.modal.truncation import error_bound

G1 = json.loads(
    (Path(__file__).parents[1] / "reference" / "modal" / "G1-cms-bar-beam.json").read_text()
)
TERMS = 48  # polynomials between the ends: 20 fixed-interface modes to 1e-12


def spectral_body(order):
    """A bar (order 1) or beam (2) of unit length clamped at 0: node 1 is the tip, every further
    node one polynomial that vanishes (with its slope) at both ends; the slope of the tip stands as
    its y displacement."""
    x, w = np.polynomial.legendre.leggauss(200)
    x, w = (x + 1) / 2, w / 2
    tip = (
        [Polynomial([0, 1])]
        if order == 1
        else [Polynomial([0, 0, 3, -2]), Polynomial([0, 0, -1, 1])]
    )
    value, slope = [t(x) for t in tip], [t.deriv(order)(x) for t in tip]
    for k in range(order, order + TERMS):  # Legendre polynomials, integrated once or twice
        shape = np.zeros(order + TERMS + 3)
        shape[k] = 1.0
        for _ in range(order):
            # the integral of P_n is (P_n+1 - P_n-1) / (2 n + 1), in -1..1
            n = np.arange(1, len(shape) - 1)
            up = np.zeros_like(shape)
            up[2:] += shape[1:-1] / (2 * n + 1)
            up[:-2] -= shape[1:-1] / (2 * n + 1)
            shape = up / 2
        value.append(legval(2 * x - 1, shape))
        slope.append(legval(2 * x - 1, np.eye(k + 1)[k]))
    value, slope = np.array(value), np.array(slope)
    size = np.sqrt(value[order:] ** 2 @ w)[:, None]
    value[order:], slope[order:] = value[order:] / size, slope[order:] / size
    node = np.concatenate([np.zeros(order, int), np.arange(1, TERMS + 1)])
    direction = np.concatenate([np.arange(order), np.zeros(TERMS, int)])
    K, M = (slope * w) @ slope.T, (value * w) @ value.T
    return Body.from_matrices(
        "g1",
        (K + K.T) / 2,
        (M + M.T) / 2,
        np.arange(1, TERMS + 2),
        np.zeros((TERMS + 1, 3)),
        node,
        direction,
    )


def table(name, order):
    """(row, omega, told, error, bound, lowest left out) of each row of the table: frequencies as we
    find and as it tells them, the true error of the reduction and its bound, the lowest
    fixed-interface mode that was left out."""
    body = spectral_body(order)
    for row in G1[name]:
        reduction = craig_bampton(body, [1], row["N"])
        K, M = reduction.model.K.copy(), reduction.model.M
        K[0, 0] += row["kappa"]
        omega = np.sqrt(sl.eigh(K, M, eigvals_only=True))
        told = np.array(row["omega"] if order == 1 else row["betaL"]) ** order
        exact = np.array(row["exact"]) ** order
        error = omega[: len(exact)] / exact[: len(omega)] - 1
        bound = error_bound(K, M, reduction.truncation, omega)[: len(error)]
        yield row, omega, told, error, bound, reduction.truncation.omega[0]


@pytest.mark.parametrize("name, order", [("bar", 1), ("beam", 2)])
def test_every_row_of_the_table(name, order):
    for row, omega, told, error, bound, left_out in table(name, order):
        assert omega[: len(told)] == pytest.approx(told, rel=1e-8), row
        assert (bound >= error).all(), row
        near = (error < 0.01) & (error > 1e-8) & (omega[: len(error)] < 0.7 * left_out)
        assert (bound[near] < 1.5 * error[near]).all(), row


@pytest.mark.parametrize("name, order", [("bar", 1), ("beam", 2)])
def test_fixed_interface_modes(name, order):
    """n pi, and the roots of cos b cosh b = 1 squared (Blevins)."""
    told = {
        "bar": np.arange(1, 11) * np.pi,
        "beam": np.array(G1["fixed_interface"]["clamped_clamped_betaL"]) ** 2,
    }
    assert craig_bampton(spectral_body(order), [1], 10).omega == pytest.approx(told[name], rel=1e-8)
