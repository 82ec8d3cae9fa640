"""Flat punch with rounded edges on a half-space, per unit length: load, half-width of contact,
pressure.

One punch covers the three shapes of the paper (section 7.1, figure 5): flat part of half-width b,
edges of radius R. b = 0 is the Hertz line (cylinder), R = 0 the sharp flat punch. Symbols: P load
per length N/m, a half-width of contact m, E* combined modulus Pa; s = sqrt(a^2 - b^2).

    P = E*/(2R) [ a^2 atan(s/b) - b s ]          dP/da = (E* a/R) atan(s/b)
    p(x) = E*/(pi R) integral over a' from max(b, |x|) to a of  a' atan(s'/b) / sqrt(a'^2 - x^2)

The pressure is the sum of the flat-punch pressures dP / (pi sqrt(a'^2 - x^2)) of the growing
contact: positive terms only, so that both limits stay exact. Closed form of the same: Ciavarella,
Hills & Monno, Proc IMechE C 212 (1998) 319.

Hertz line [Hertz 1881; Johnson, Contact Mechanics (1985), section 4.2]: a^2 = 4 P R / (pi E*), p0 =
2 P / (pi a). The plane problem has no stiffness of its own; that of a cylinder of length L on
half-spaces is the stiffness of a flat punch of L x 2a."""

import numpy as np
from scipy.optimize import brentq

from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness.elastic_constants import (
    MaterialPair,
    Stiffness,
    Values,
    positive,
    require,
)
from tipdamp.static_contact.stiffness.flat_punch import rectangle_stiffness
from tipdamp.static_contact.stiffness.load_displacement import graded_nodes


def punch_load(
    half_width: Values, flat_half_width: Values, radius: Values, e_star: Values
) -> np.ndarray:
    """Load per length P (N/m) that opens the contact to `half_width` a >= b (m); R > 0."""
    a = np.asarray(require("half_width", half_width, 0, unit="m"), dtype=float)
    b = flat_half_width
    require("flat_half_width", b, 0, unit="m")
    positive("radius", radius, "m")
    if np.any(a < b):
        raise InputError(
            f"half_width = {half_width!r} is out of range: allowed >= flat_half_width = {b:g} m, "
            "the flat part is always in contact"
        )
    s = np.sqrt((a - b) * (a + b))
    if b == 0:
        return (np.pi * e_star * s**2 / (4 * radius))[()]
    return e_star * b**2 / (2 * radius) * _opening(s / b)


def punch_half_width(
    load: Values, flat_half_width: Values, radius: Values, e_star: Values
) -> np.ndarray:
    """Half-width of contact a (m) under P (N/m), scalar or array; 0 <= b, 0 <= R, not both zero."""
    return np.hypot(flat_half_width, _rim(load, flat_half_width, radius, e_star))


def punch_pressure(
    x: Values, load: Values, flat_half_width: Values, radius: Values, e_star: Values
) -> np.ndarray:
    """Pressure (Pa) at `x` (m, scalar or array, measured from the centre) under P (N/m, scalar); 0
    outside."""
    rim, b = _rim(load, flat_half_width, radius, e_star), flat_half_width
    x = np.abs(np.asarray(require("x", x, -np.inf, unit="m"), dtype=float))
    beyond = (x - b) * (x + b)  # x^2 - b^2, below rim^2 inside the contact
    inside = beyond < rim**2 if radius else x < b
    if radius == 0:
        return np.where(inside, load / (np.pi * np.sqrt(np.where(inside, -beyond, 1.0))), 0.0)[()]
    over_flat = np.asarray(x < b)
    # one variable for both zones, free of the root at its lower end: v^2 = a'^2 - max(b, x)^2
    top = np.where(over_flat, rim, np.sqrt(np.where(inside & ~over_flat, rim**2 - beyond, 0.0)))
    v, weight = graded_nodes(0.0, top)
    offset = np.sqrt(np.abs(beyond))[..., None]
    from_edge = np.where(over_flat[..., None], v, np.hypot(v, offset))  # s' = sqrt(a'^2 - b^2)
    ratio = np.where(over_flat[..., None], v / np.hypot(v, np.where(offset > 0, offset, 1.0)), 1.0)
    integral = np.sum(weight * np.arctan2(from_edge, b) * ratio, axis=-1)
    return np.where(inside, e_star / (np.pi * radius) * integral, 0.0)[()]


def punch_peak(
    load: Values, flat_half_width: Values, radius: Values, e_star: Values
) -> tuple[float, float]:
    """Position x >= 0 (m) and value (Pa) of the largest pressure; R > 0 (a sharp edge has no finite
    peak).

    With w = sqrt(a^2/x^2 - 1) b/s the condition dp/dx = 0 reads  w atanh(w) = (b/s) atan(s/b),  0 <
    w < 1.
    """
    positive("radius", radius, "m")
    positive("load", load, "N/m")
    b, s = flat_half_width, _rim(load, flat_half_width, radius, e_star)
    x = 0.0
    if b > 0:
        level = b / s * np.arctan2(s, b)
        w = brentq(lambda w: w * np.arctanh(w) - level, 0.0, 1 - 1e-15, xtol=1e-300, rtol=1e-14)
        x = float(np.hypot(b, s) * b / np.hypot(b, w * s))
    return x, float(punch_pressure(x, load, b, radius, e_star))


def hertz_half_width(load: Values, radius: Values, e_star: Values) -> np.ndarray:
    """Half-width (m) of the line contact of relative radius R (m) under P (N/m)."""
    return np.sqrt(4 * np.asarray(load) * radius / (np.pi * e_star))


def hertz_peak_pressure(load: Values, half_width: Values) -> Values:
    """Pressure (Pa) on the centre line."""
    return 2 * load / (np.pi * half_width)


def hertz_stiffness(pair: MaterialPair, length: Values, radius: Values, force: Values) -> Stiffness:
    """Tangent stiffness (N/m), normal and tangential, of a cylinder of `length` and relative
    `radius` (m) under a normal `force` (N)."""
    return rectangle_stiffness(
        pair, length, 2 * hertz_half_width(force / length, radius, pair.E_star)
    )


def _rim(load: Values, flat_half_width: Values, radius: Values, e_star: Values) -> np.ndarray:
    """s = sqrt(a^2 - b^2), m, without the cancellation of a - b: the flat part b at s = 0, Hertz at
    s = a."""
    b = require("flat_half_width", flat_half_width, 0, unit="m")
    require("radius", radius, 0, unit="m")
    positive("e_star", e_star, "Pa")
    load = np.asarray(require("load", load, 0, unit="N/m"), dtype=float)
    if b == 0 and radius == 0:
        raise InputError("flat_half_width = 0 and radius = 0: a punch needs one of them above 0 m")
    if radius == 0:
        return (0 * load)[()]
    cylinder = hertz_half_width(load, radius, e_star)
    if b == 0:
        return cylinder[()]
    with np.errstate(over="ignore"):
        target = 2 * load * radius / e_star / b / b
    hertz = target > 1e24  # the flat part is below 1e-12 of the contact
    return np.where(hertz, cylinder, b * _opening_root(np.where(hertz, 1.0, target)))[()]


def _opening(t: Values) -> np.ndarray:
    """m(t) = (1 + t^2) atan t - t, the load of the punch over E* b^2 / (2R) at t = s/b; series
    where it cancels."""
    t = np.asarray(t, dtype=float)
    small = np.minimum(t, 0.3)
    series = sum(
        (-1) ** (k + 1) * 2 * small ** (2 * k + 1) / ((2 * k - 1) * (2 * k + 1))
        for k in range(1, 16)
    )
    return np.where(t < 0.3, series, (1 + t**2) * np.arctan(t) - t)


def _opening_root(target: np.ndarray) -> np.ndarray:
    """t with m(t) = target. m is convex and rising, m' = 2 t atan t: Newton ends from any start
    above zero."""
    target = np.asarray(target, dtype=float)
    t = np.cbrt(1.5 * target) + np.sqrt(2 * target / np.pi)
    for _ in range(60):
        slope = 2 * t * np.arctan(t)
        step = np.where(t > 0, (_opening(t) - target) / np.where(slope > 0, slope, 1.0), 0.0)
        t = t - step
        if np.all(np.abs(step) <= 4e-16 * t):
            break
    if np.any(np.abs(_opening(t) - target) > 1e-13 * target):
        raise ArithmeticError(f"half-width of the rounded punch: no root found for {target}")
    return t
