"""Punch and plane compliance against second routes: closed forms, quadrature of point solutions,
the limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair, Stiffness
from tipdamp.static_contact.stiffness.flat_punch import ellipse_integrals, ellipse_stiffness
from tipdamp.static_contact.stiffness.load_displacement import (
    approach,
    graded_nodes,
    secant_stiffness,
)
from tipdamp.static_contact.stiffness.plane_strain import plane_compliance, plane_stiffness
from tipdamp.static_contact.stiffness.rounded_punch import (
    hertz_half_width,
    punch_half_width,
    punch_load,
    punch_peak,
    punch_pressure,
)

STEEL = MaterialPair(210e9, 0.3, 210e9, 0.3)
UNLIKE = MaterialPair(210e9, 0.3, 114e9, 0.342)
E = STEEL.E_star
P = 5e4  # N/m
FLATS = (0.0, 1e-7, 1e-5, 1e-3)  # half widths in m: the cylinder and rounded punches


def closed_pressure(x, load, b, radius, e_star):
    """Ciavarella, Hills & Monno (1998), with sin(f) = x/a and sin(f0) = b/a (README of the
    reference cases, R2)."""
    a = punch_half_width(load, b, radius, e_star)
    f, f0 = np.arcsin(x / a), np.arcsin(b / a)
    logs = np.sin(f) * np.log(abs(np.sin(f + f0) / np.sin(f - f0)))
    logs += np.sin(f0) * np.log(abs(np.tan((f + f0) / 2) * np.tan((f - f0) / 2)))
    angle = np.pi - 2 * f0
    return load / a * (2 / np.pi) / (angle - np.sin(2 * f0)) * (angle * np.cos(f) + logs)


@pytest.mark.parametrize("b", [1e-3, 1e-4, 1e-5])
def test_pressure_is_the_closed_form(b):
    a = punch_half_width(P, b, 5e-3, E)
    x = np.array([0.1, 0.4, 0.7, 0.97, 0.999]) * a
    assert punch_pressure(x, P, b, 5e-3, E) == pytest.approx(
        closed_pressure(x, P, b, 5e-3, E), rel=1e-10
    )


@pytest.mark.parametrize("b", [0.0, 1e-6, 1e-3])
def test_pressure_integral_and_place_of_its_peak(b):
    a = punch_half_width(P, b, 5e-3, E)
    pieces = ((0, b), (b, a)) if b else ((0, a),)
    total = sum(
        quad(punch_pressure, *piece, args=(P, b, 5e-3, E), epsabs=0, epsrel=1e-9, limit=200)[0]
        for piece in pieces
    )
    assert 2 * total == pytest.approx(P, rel=1e-8)
    x, peak = punch_peak(P, b, 5e-3, E)
    around = punch_pressure(x + np.linspace(-0.01, 0.01, 21) * a, P, b, 5e-3, E)
    assert around.max() == pytest.approx(peak, rel=1e-12)
    assert punch_pressure([1.0001 * a, -0.5 * a], P, b, 5e-3, E)[0] == 0


@pytest.mark.parametrize("load", [1e-6, 1.0, 1e4, 1e8])
@pytest.mark.parametrize("b", [1e-12, 1e-6, 1e-3])
def test_load_and_half_width_are_inverse(load, b):
    a = punch_half_width(load, b, 5e-3, E)
    back = punch_load(a, b, 5e-3, E)
    rounding = 3 * np.finfo(float).eps / max(1 - b / a, 1e-16)  # a - b in floating point
    assert back == pytest.approx(load, rel=max(1e-12, rounding)) or a == b
    assert punch_half_width(np.array([load, 2 * load]), b, 5e-3, E)[1] >= a


def punch_limits():
    """(what, value, limit): b -> 0 gives the cylinder; R -> 0 the flat punch, a -> b, p -> P / (pi
    sqrt(b^2 - x^2))."""
    a = hertz_half_width(P, 5e-3, E)
    x = np.linspace(0, 0.999, 7)[:-1] * a
    hertz = 2 * P / (np.pi * a) * np.sqrt(1 - (x / a) ** 2)
    for b in (1e-12, 1e-14, 1e-40):
        yield f"flat {b:g} m, half width", punch_half_width(P, b, 5e-3, E), a
        yield f"flat {b:g} m, pressure", punch_pressure(x, P, b, 5e-3, E), hertz
    b = 1e-3
    x = np.array([0, 0.3, 0.9, 0.99]) * b
    for radius in (1e-12, 1e-16, 1e-30):
        yield f"radius {radius:g} m, half width", punch_half_width(P, b, radius, E), b
        yield (
            f"radius {radius:g} m, pressure",
            punch_pressure(x, P, b, radius, E),
            P / (np.pi * np.sqrt(b**2 - x**2)),
        )


def test_limits_are_continuous():
    """To 1e-6, of narrow flats to 1e-8 and 1e-12."""
    tolerance = {"flat 1e-14 m": 1e-8, "flat 1e-40 m": 1e-12}
    for name, value, limit in punch_limits():
        assert value == pytest.approx(limit, rel=tolerance.get(name.split(",")[0], 1e-6)), name


def test_the_limits_themselves():
    """b = 0 is the cylinder, up to its border; R = 0 the flat punch."""
    a = hertz_half_width(P, 5e-3, E)
    x = np.linspace(0, 0.999, 7) * a
    hertz = 2 * P / (np.pi * a) * np.sqrt(1 - (x / a) ** 2)
    assert punch_pressure(x, P, 0.0, 5e-3, E) == pytest.approx(hertz, rel=1e-12)
    x = np.array([0, 0.3, 0.9, 0.99]) * 1e-3
    sharp = P / (np.pi * np.sqrt(1e-6 - x**2))
    assert punch_pressure(x, P, 1e-3, 0.0, E) == pytest.approx(sharp, rel=1e-14)
    assert punch_half_width(P, 1e-3, 0.0, E) == 1e-3


def test_wide_and_narrow_flats_join_without_a_step():
    """The half-width changes by less than 1e-6 of itself between neighbours over 30 decades of flat
    width."""
    b = np.logspace(-35, -2, 200)
    for value in b:
        pair = [punch_half_width(P, value * factor, 5e-3, E) for factor in (1, 1 + 1e-7)]
        assert 0 <= pair[1] / pair[0] - 1 < 1.01e-7 or pair[1] == pytest.approx(pair[0], rel=1e-14)


def kernel_average(half_width, depth, E, nu):
    """Compliance from the line-load kernels under the traction 1/(pi sqrt(a^2 - x^2)), by Chebyshev
    quadrature."""
    x = half_width * np.cos((np.arange(4000) + 0.5) * np.pi / 4000)
    r2 = x**2 + depth**2
    surface, shape = 2 * np.log(2 / half_width), depth**2 / ((1 - nu) * r2)
    plane = (1 - nu**2) / (np.pi * E)
    return (
        plane * np.mean(surface + np.log(r2) - shape),
        plane * np.mean(surface + np.log(r2) + shape),
        np.mean(surface + np.log(r2)) / (2 * np.pi * E / (2 * (1 + nu))),
    )


@pytest.mark.parametrize("ratio", [0.03, 0.5, 3.0, 1e3])
def test_plane_compliance_is_exact_at_any_depth(ratio):
    assert plane_compliance(1e-3, ratio * 1e-3, 114e9, 0.342) == pytest.approx(
        kernel_average(1e-3, ratio * 1e-3, 114e9, 0.342), rel=1e-10
    )


def test_plane_stiffness_adds_the_compliance_of_both_bodies():
    k = plane_stiffness(UNLIKE, 1e-4, 5e-3, 1e-3)
    bodies = [plane_compliance(1e-4, 5e-3, 210e9, 0.3), plane_compliance(1e-4, 1e-3, 114e9, 0.342)]
    assert 1 / np.array([k.normal, k.across, k.along]) == pytest.approx(
        np.sum(bodies, axis=0), rel=1e-14
    )


def test_hertz_approach_is_the_closed_form():
    """The compliance integrated by hand for b = 0, P = pi E* a^2 / (4 R), both bodies alike; and
    Johnson's eq. 5.56."""
    d, radius = 5e-3, 5e-3
    for load in (1e-3, 1e3, 1e9):  # from a << d to a > d
        a = hertz_half_width(load, radius, E)
        s = np.hypot(a, d)
        one = (
            (1 - 0.3**2)
            / 210e9
            * E
            / (2 * radius)
            * (a**2 * np.arcsinh(d / a) + d * (s - d) * (1 - 1 / 0.7))
        )
        found = approach(
            lambda p: 1 / plane_stiffness(STEEL, hertz_half_width(p, radius, E), d, d).normal, load
        )
        assert found == pytest.approx(2 * one, rel=1e-13)
    a = hertz_half_width(1e-3, radius, E)
    johnson = 2 * (1 - 0.3**2) * 1e-3 / (np.pi * 210e9) * (2 * np.log(2 * d / a) - 0.3 / 0.7)
    found = approach(
        lambda p: 1 / plane_stiffness(STEEL, hertz_half_width(p, radius, E), d, d).normal, 1e-3
    )
    assert found == pytest.approx(johnson, rel=1e-10)


def derivative(function, x):
    """Eighth-order central difference, relative step 0.02."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    step = 0.02 * x
    return (
        sum(w * (function(x + k * step) - function(x - k * step)) for k, w in weights.items())
        / step
    )


def compliance_of(b, component):
    """Compliance at a load, of a punch with flat half width b between the bodies of UNLIKE."""
    return lambda load: (
        1
        / getattr(
            plane_stiffness(UNLIKE, punch_half_width(load, b, 5e-3, UNLIKE.E_star), 5e-3, 2e-3),
            component,
        )
    )


def slope_and_stiffness(b, component):
    """(dP/d(delta) by differences of the approach, K(a)) at 1 kN/m."""
    compliance = compliance_of(b, component)
    return 1 / derivative(lambda load: approach(compliance, load), 1e3), 1 / compliance(1e3)


@pytest.mark.parametrize("b", FLATS)
@pytest.mark.parametrize("component", Stiffness._fields)
def test_tangent_stiffness_is_the_slope_of_the_approach(b, component):
    """dP/d(delta) = K(a) to 1e-10, cylinder and rounded punch; the secant from zero load is
    softer."""
    slope, stiffness = slope_and_stiffness(b, component)
    assert slope == pytest.approx(stiffness, rel=1e-10)
    assert secant_stiffness(compliance_of(b, component), 1e3) < stiffness


def test_graded_quadrature_is_exact_for_roots_and_logs():
    x, w = graded_nodes(0.0, 3.0)
    assert w @ np.log(x) == pytest.approx(3 * np.log(3) - 3, rel=1e-13)
    assert w @ np.sqrt(x) == pytest.approx(2 / 3 * 3**1.5, rel=1e-14)
    x, w = graded_nodes(1.0, 3.0)
    assert w @ np.log(x) == pytest.approx(3 * np.log(3) - 2, rel=1e-13)


def test_ellipse_integrals_and_limits():
    a, b = 3e-3, 1e-3
    expected = [
        quad(
            lambda t, f=f: f(t) / np.sqrt((b * np.cos(t)) ** 2 + (a * np.sin(t)) ** 2), 0, np.pi / 2
        )[0]
        for f in (lambda t: 1, lambda t: np.cos(t) ** 2, lambda t: np.sin(t) ** 2)
    ]
    assert ellipse_integrals(a, b) == pytest.approx(expected, rel=1e-12)
    k, turned = ellipse_stiffness(UNLIKE, a, b), ellipse_stiffness(UNLIKE, b, a)
    assert (turned.normal, turned.along, turned.across) == pytest.approx(
        (k.normal, k.across, k.along), rel=1e-14
    )
    circle = ellipse_stiffness(UNLIKE, a, a)
    near = ellipse_stiffness(UNLIKE, a, a * (1 + 1e-7))
    assert circle.normal == pytest.approx(2 * a * UNLIKE.E_star, rel=1e-14)
    assert near == pytest.approx(circle, rel=1e-6)
    mindlin = 1 / sum((2 - nu) / (8 * a * g) for nu, g in ((0.3, UNLIKE.G1), (0.342, UNLIKE.G2)))
    assert circle.along == pytest.approx(mindlin, rel=1e-14)


@pytest.mark.parametrize(
    "call",
    [
        lambda: punch_half_width(-1.0, 1e-3, 5e-3, E),
        lambda: punch_half_width(1.0, 0.0, 0.0, E),
        lambda: punch_half_width(np.nan, 1e-3, 5e-3, E),
        lambda: punch_half_width(1.0, -1e-3, 5e-3, E),
        lambda: punch_load(0.9e-3, 1e-3, 5e-3, E),
        lambda: punch_peak(1.0, 1e-3, 0.0, E),
        lambda: plane_stiffness(STEEL, 0.0, 1e-3, 1e-3),
        lambda: plane_stiffness(STEEL, 1e-3, 1e-3, 0.0),
        lambda: ellipse_stiffness(STEEL, 1e-3, 0.0),
        lambda: MaterialPair(-1.0, 0.3, 2e11, 0.3),
        lambda: MaterialPair(2e11, 0.6, 2e11, 0.3),
        lambda: MaterialPair("210e9", 0.3, 2e11, 0.3),
        lambda: approach(lambda p: p, -1.0),
        lambda: secant_stiffness(lambda p: p, 0.0),
    ],
)
def test_values_out_of_range_are_refused(call):
    with pytest.raises(InputError, match="allowed|above"):
        call()
