"""Partial slip of a contact under constant normal load P and a tangential force Q: displacement,
loop, loss.

With stick where the reduced load P - Q/mu would make contact (Ciavarella 1998, Jaeger 1998;
Cattaneo and Mindlin for the sphere and the Hertz line) everything follows from the tangential
compliance C(p) of the unslipped contact at p:

    delta_t(Q) = mu integral of C(p) dp from P - Q/mu to P,      gross slip at Q = mu P
    loop (Masing): delta = -delta_t(Q0) + 2 delta_t((Q + Q0)/2) on the way up, its mirror image on
    the way down loss per cycle W = 8 mu^2 integral of (p_mid - p) C(p) dp over the same range,
    p_mid its middle

    as a law Q(delta): the inverse of delta_t(Q), and mu P beyond the displacement of gross slip;
    the loop between displacements +-delta_0: Q = -Q0 + 2 Q((delta + delta_0)/2), and every metre
    beyond gross slip costs 4 mu P a cycle

W is 4 Q delta_t(Q) - 8 integral of delta_t dQ, integrated by parts so that small amplitudes do not
cancel. Loads in N and C in m/N, or per unit length N/m and m2/N. `compliance(loads (n,)) -> (n,)`.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import toms748

from tipdamp.static_contact.stiffness.elastic_constants import positive, require
from tipdamp.static_contact.stiffness.load_displacement import approach, graded_nodes

Loop = tuple[np.ndarray, np.ndarray]


def stick_load(load: float, mu: float, tangential: float) -> float:
    """Reduced load P - Q/mu whose contact is the region that sticks; 0 at gross slip, 0 <= Q <= mu
    P."""
    positive("load", load, "N or N/m")
    positive("mu", mu)
    require(
        "tangential", tangential, 0, mu * load, unit="N or N/m (gross slip at mu times the load)"
    )
    return max(load - tangential / mu, 0.0)


def slip_displacement(compliance: Callable, load: float, mu: float, tangential: float) -> float:
    """Tangential displacement delta_t (m) under Q = `tangential`, loaded from zero."""
    return float(mu * approach(compliance, load, start=stick_load(load, mu, tangential)))


def slip_force(compliance: Callable, load: float, mu: float, displacement: float) -> float:
    """Tangential force Q (N or N/m) that belongs to delta_t = `displacement` (m >= 0), loaded from
    zero: the inverse of `slip_displacement` below gross slip, mu P above."""
    require("displacement", displacement, 0, unit="m")
    if displacement >= slip_displacement(compliance, load, mu, mu * load):
        return mu * load
    if displacement == 0:
        return 0.0
    return toms748(
        lambda q: slip_displacement(compliance, load, mu, q) / displacement - 1,
        0.0,
        mu * load,
        xtol=1e-17 * mu * load,
        rtol=1e-15,
    )


def masing_loop(
    compliance: Callable, load: float, mu: float, amplitude: float, points: int = 64
) -> Loop:
    """Steady hysteresis loop at force amplitude Q0: arrays Q and delta_t (2 points,), up from -Q0
    and down again."""
    up = -amplitude * np.cos(np.pi * np.arange(points) / (points - 1))
    largest = slip_displacement(compliance, load, mu, amplitude)
    rise = np.array([slip_displacement(compliance, load, mu, (q + amplitude) / 2) for q in up])
    rising = -largest + 2 * rise
    return np.concatenate([up, -up]), np.concatenate([rising, -rising])


def loop_energy(compliance: Callable, load: float, mu: float, amplitude: float) -> float:
    """Energy lost per full cycle at force amplitude Q0, J (J/m for a line)."""
    low = stick_load(load, mu, amplitude)
    loads, weights = graded_nodes(low, load)
    return float(8 * mu**2 * np.sum(weights * (0.5 * (low + load) - loads) * compliance(loads)))


def displacement_loop(
    compliance: Callable, load: float, mu: float, amplitude: float, points: int = 64
) -> Loop:
    """Steady hysteresis loop at displacement amplitude delta_0 (m): arrays delta and Q (2 points,),
    up from -delta_0 and down again; beyond gross slip the force stays at mu P."""
    up = -amplitude * np.cos(np.pi * np.arange(points) / (points - 1))
    rise = np.array([slip_force(compliance, load, mu, max((d + amplitude) / 2, 0.0)) for d in up])
    rising = -slip_force(compliance, load, mu, amplitude) + 2 * rise
    return np.concatenate([up, -up]), np.concatenate([rising, -rising])


def displacement_loop_energy(
    compliance: Callable, load: float, mu: float, amplitude: float
) -> float:
    """Energy lost per full cycle at displacement amplitude delta_0 (m), J (J/m for a line)."""
    force = slip_force(compliance, load, mu, amplitude)
    beyond = amplitude - slip_displacement(compliance, load, mu, force)
    return loop_energy(compliance, load, mu, force) + 4 * mu * load * max(beyond, 0.0) * (
        force == mu * load
    )
