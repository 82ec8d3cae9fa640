"""The rectangle's table against a fresh boundary-element solve, slender theory, the known square,
its own limits."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import dblquad

from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness import rectangular_punch_bem
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair
from tipdamp.static_contact.stiffness.flat_punch import (
    TABLE,
    ellipse_stiffness,
    rectangle_compliance,
    rectangle_stiffness,
    table_nodes,
)

UNLIKE = MaterialPair(210e9, 0.3, 114e9, 0.342)
# length/width, nu: no table nodes
FRESH = ((1.27, 0.17), (6.1, 0.42), (49.0, 0.3), (830.0, 0.23), (4900.0, 0.48))


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.3, 0.0), (1.5, -0.7), (40.0, 3.0)])
def test_cell_integrals_are_those_of_the_kernels(x, y):
    """Closed form near, Gauss far, against adaptive quadrature over quadrants of the cell seen from
    the origin."""
    a, b = 1.0, 0.4
    for place, power in enumerate(((2, 0), (0, 2))):

        def kernel(v, u, p=power):
            return u ** p[0] * v ** p[1] / (u * u + v * v) ** 1.5 if u or v else 0.0

        cuts = [
            sorted({low, high} | ({0.0} if low < 0 < high else set()))
            for low, high in ((x - a, x + a), (y - b, y + b))
        ]
        expected = sum(
            dblquad(kernel, *u, *v, epsabs=1e-11, epsrel=1e-9)[0]
            for u in pairwise(cuts[0])
            for v in pairwise(cuts[1])
        )
        assert rectangular_punch_bem._cell(x, y, a, b)[place] == pytest.approx(expected, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("aspect", "nu"), FRESH)
def test_table_is_a_fresh_solve_between_its_nodes(aspect, nu):
    """Coarser meshes than the table's, at points that are none of its nodes; the target is 1e-5."""
    fresh, error = rectangular_punch_bem.compliance(aspect, nu, meshes=(8, 12, 16, 24))
    assert np.all(error < 5e-5 * fresh)
    assert rectangle_compliance(aspect, nu) == pytest.approx(fresh, rel=3e-6)


def test_table_states_its_error():
    table = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    assert len(table) == np.prod([nodes.size for nodes in table_nodes()])
    assert np.max(table[:, 4:6] / table[:, 2:4]) < 2e-6
    for aspect, nu, *values in table[::23, :4]:  # the polynomial passes through the nodes
        assert rectangle_compliance(aspect, nu) == pytest.approx(values, rel=1e-12)


def test_collocation_converges_quadratically():
    values = [rectangular_punch_bem.mesh_compliance(3.0, 0.0, n)[0] for n in (8, 16, 32)]
    errors = np.array(values) / rectangle_compliance(3.0, 0.0)[0] - 1
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2, abs=0.15)


def test_square_has_the_known_capacity():
    """Capacity of the unit square 0.366788 (README of the reference cases): Kn = pi E* times it,
    all digits given."""
    capacity = rectangle_stiffness(UNLIKE, 1.0, 1.0).normal / (np.pi * UNLIKE.E_star)
    assert capacity == pytest.approx(0.366788, abs=5e-7)


def slender_compliance(aspect, n):
    """The rectangle as a line of density lambda(x), spread over the width (1) like 1/sqrt(1/4 -
    y^2).

    The potential averaged over the width with the same profile is 1. Its kernel is the mean of
    1/sqrt(X^2 + D^2), D = sin u sin v with u, v uniform; collocation with constant elements. Exact
    but for the end zones.
    """
    angle = (np.arange(60) + 0.5) / 60 * np.pi / 2
    d2 = np.outer(np.sin(angle), np.sin(angle)).ravel() ** 2

    def antiderivative(x):  # odd; mean of asinh(x/D), mean of log D = -2 log 2
        far = np.log(2 * np.maximum(np.abs(x), 1)) + 1 / (16 * np.maximum(np.abs(x), 1) ** 2)
        near = np.abs(x) < 30
        far[near] = [np.mean(np.log(v + np.sqrt(v * v + d2))) for v in np.abs(x[near])]
        return np.sign(x) * (far + 2 * np.log(2))

    stretch = np.arcsinh(np.sqrt(aspect))
    edges = 0.5 * aspect * (np.sinh(stretch * np.arange(n + 1) / n) / np.sinh(stretch)) ** 2
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    matrix = np.diff(antiderivative(edges - middle)) - np.diff(
        antiderivative(aspect - edges - middle)
    )
    return aspect / (2 * np.pi * np.linalg.solve(matrix, np.ones(n)) @ np.diff(edges))


@pytest.mark.parametrize("aspect", [5e3, 1e5, 1e7])
def test_slender_rectangle_is_the_line(aspect):
    """A second theory with other unknowns: agrees to 0.015/aspect (end zones) and 1e-6."""
    coarse, fine = (slender_compliance(aspect, n) for n in (60, 120))
    assert rectangle_compliance(aspect, 0.0)[0] == pytest.approx(
        (4 * fine - coarse) / 3, rel=0.015 / aspect + 1.5e-6
    )


def test_sides_change_places_without_a_step():
    k = rectangle_stiffness(UNLIKE, 3.0, 2.0)
    turned = rectangle_stiffness(UNLIKE, 2.0, 3.0)
    assert (turned.normal, turned.across, turned.along) == pytest.approx(k, rel=1e-14)
    square = rectangle_stiffness(UNLIKE, 1.0, 1.0)
    assert square.along == pytest.approx(square.across, rel=1e-8)
    assert rectangle_stiffness(UNLIKE, 1.0, 1.0 + 1e-8) == pytest.approx(square, rel=1e-7)
    many = rectangle_stiffness(UNLIKE, 2.0, np.array([1.0, 3.0]))
    assert many.along == pytest.approx(
        [rectangle_stiffness(UNLIKE, 2.0, w).along for w in (1.0, 3.0)], rel=1e-14
    )


def test_beyond_the_table_the_compliance_goes_on_straight():
    one, two, three = (rectangle_compliance(10.0**power, 0.3) for power in (8, 9, 10))
    for a, b, c in zip(one, two, three, strict=True):
        assert c - b == pytest.approx(b - a, rel=1e-9)
    below, above = (
        np.array(rectangle_compliance(1e8 * factor, 0.3)) for factor in (1 - 1e-6, 1 + 1e-6)
    )
    assert np.all((above > below) & (above - below < 1e-5))
    # the slender limit: each factor e in length adds 2/pi (normal and along), 2 (1 - nu)/pi across
    assert np.array(two) - one == pytest.approx(
        2 / np.pi * np.log(10) * np.array([1, 0.7]), rel=0.02
    )


def test_rectangle_lies_between_its_ellipses():
    """More contact is stiffer: the inscribed ellipse is softer, the circumscribed one stiffer."""
    for width in (1.0, 0.1, 1e-3):
        inner = ellipse_stiffness(UNLIKE, 0.5, width / 2)
        outer = ellipse_stiffness(UNLIKE, 0.5 * 2**0.5, width / 2 * 2**0.5)
        for low, k, high in zip(inner, rectangle_stiffness(UNLIKE, 1.0, width), outer, strict=True):
            assert low < k < high


@pytest.mark.parametrize("sides", [(0.0, 1.0), (1.0, -1.0), (np.inf, 1.0), ("a", 1.0)])
def test_values_out_of_range_are_refused(sides):
    with pytest.raises(InputError, match="allowed"):
        rectangle_stiffness(UNLIKE, *sides)
