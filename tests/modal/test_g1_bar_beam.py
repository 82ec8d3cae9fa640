"""Craig-Bampton of a bar and a beam with a spring at the tip, for each number of modes, and the bound of its error."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.polynomial import Legendre

from modal.body import Body
from modal.craig_bampton import craig_bampton
from modal.truncation import error_bound

G1 = json.loads((Path(__file__).parents[1] / "reference" / "modal" / "G1-cms-bar-beam.json").read_text())
TERMS = 48  # polynomials between the ends: 20 fixed-interface modes to 1e-12


def spectral_body(order):
    """A bar (order 1) or beam (2) of unit length clamped at 0: node 1 is the tip, every further node one polynomial
    that vanishes (with its slope) at both ends; the slope of the tip stands as its y displacement."""
    x, w = np.polynomial.legendre.leggauss(200)
    x, w = (x + 1) / 2, w / 2
    tip = [Legendre([0, 1], domain=[0, 1], window=[0, 1])]
    if order == 2:
        X = tip[0]
        tip = [3 * X**2 - 2 * X**3, X**3 - X**2]
    inner = []
    for k in range(order, order + TERMS):
        shape = Legendre.basis(k, domain=[0, 1])
        for _ in range(order):
            shape = shape.integ(lbnd=0)
        inner.append(shape / np.sqrt(w @ shape(x) ** 2))
    value = np.array([s(x) for s in [*tip, *inner]])
    slope = np.array([s.deriv(order)(x) for s in [*tip, *inner]])
    node = np.concatenate([np.zeros(order, int), np.arange(1, TERMS + 1)])
    direction = np.concatenate([np.arange(order), np.zeros(TERMS, int)])
    K, M = (slope * w) @ slope.T, (value * w) @ value.T
    return Body.from_matrices("g1", (K + K.T) / 2, (M + M.T) / 2, np.arange(1, TERMS + 2),
                              np.zeros((TERMS + 1, 3)), node, direction)


@pytest.mark.parametrize("name, order", [("bar", 1), ("beam", 2)])
def test_every_row_of_the_table(name, order):
    body = spectral_body(order)
    for row in G1[name]:
        reduction = craig_bampton(body, [1], row["N"])
        K, M = reduction.model.K.copy(), reduction.model.M
        K[0, 0] += row["kappa"]
        omega = np.sqrt(sl.eigh(K, M, eigvals_only=True))
        told = np.array(row["omega"] if order == 1 else row["betaL"]) ** order
        assert omega[:len(told)] == pytest.approx(told, rel=1e-8), row
        exact = np.array(row["exact"]) ** order
        error = omega[:len(exact)] / exact[:len(omega)] - 1
        bound = error_bound(K, M, reduction.truncation, omega)[:len(error)]
        assert (bound >= error * (1 - 1e-9) - 1e-10).all(), row
        near = (error < 0.01) & (error > 1e-8) & (omega[:len(error)] < 0.7 * reduction.truncation.omega[0])
        assert (bound[near] < 1.5 * error[near]).all(), row


@pytest.mark.parametrize("name, order", [("bar", 1), ("beam", 2)])
def test_fixed_interface_modes(name, order):
    """n pi, and the roots of cos b cosh b = 1 squared (Blevins)."""
    told = {"bar": np.arange(1, 11) * np.pi, "beam": np.array(G1["fixed_interface"]["clamped_clamped_betaL"]) ** 2}
    assert craig_bampton(spectral_body(order), [1], 10).omega == pytest.approx(told[name], rel=1e-8)
