"""Partial slip: Mindlin's and Cattaneo's closed forms, the area of the loop itself, small and gross
slip."""

import numpy as np
import pytest
from scipy.integrate import quad, trapezoid

from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair
from tipdamp.static_contact.stiffness.flat_punch import ellipse_stiffness
from tipdamp.static_contact.stiffness.partial_slip import (
    displacement_loop,
    displacement_loop_energy,
    loop_energy,
    masing_loop,
    slip_displacement,
    slip_force,
    stick_load,
)
from tipdamp.static_contact.stiffness.plane_strain import plane_stiffness
from tipdamp.static_contact.stiffness.rounded_punch import punch_half_width
from tipdamp.static_contact.stiffness.side_stiffness import ContactSide, side_compliance

UNLIKE = MaterialPair(210e9, 0.3, 114e9, 0.342)
MU, LOAD, RADIUS = 0.6, 80.0, 5e-3


def sphere(load):
    """Tangential compliance of a sphere, a^3 = 3 P R / (4 E*)."""
    a = np.cbrt(3 * load * RADIUS / (4 * UNLIKE.E_star))
    return 1 / ellipse_stiffness(UNLIKE, a, a).along


def line(load):
    """Rounded punch, across, reference depths 5 and 2 mm; load per length."""
    a = punch_half_width(load, 1e-5, RADIUS, UNLIKE.E_star)
    return 1 / plane_stiffness(UNLIKE, a, 5e-3, 2e-3).across


def finite(load):
    """The default model of the damper's round side, along its axis."""
    return side_compliance(ContactSide("cylinder", 0.07, UNLIKE, radius=RADIUS), load)[1]


BODIES = pytest.mark.parametrize("compliance", [sphere, line, finite])


@pytest.mark.parametrize("q", [0.05, 0.5, 0.9, 1.0])
def test_sphere_is_mindlin(q):
    """delta_t = (3 mu P / 16 a) (sum of (2 - nu)/G) [1 - (1 - q)^(2/3)]; loss of Mindlin &
    Deresiewicz (1953)."""
    a = np.cbrt(3 * LOAD * RADIUS / (4 * UNLIKE.E_star))
    bodies = (2 - 0.3) / UNLIKE.G1 + (2 - 0.342) / UNLIKE.G2
    delta = 3 * MU * LOAD / (16 * a) * bodies * (1 - (1 - q) ** (2 / 3))
    loss = 9 * (MU * LOAD) ** 2 / (10 * a) * bodies
    loss *= 1 - (1 - q) ** (5 / 3) - 5 / 6 * q * (1 + (1 - q) ** (2 / 3))
    assert slip_displacement(sphere, LOAD, MU, q * MU * LOAD) == pytest.approx(delta, rel=1e-12)
    assert loop_energy(sphere, LOAD, MU, q * MU * LOAD) == pytest.approx(loss, rel=1e-9)


@pytest.mark.slow
@BODIES
@pytest.mark.parametrize("q", [0.3, 1.0])
def test_loss_is_the_area_of_the_loop(compliance, q):
    top = q * MU * LOAD
    masing = 4 * top * slip_displacement(compliance, LOAD, MU, top)
    masing -= (
        8
        * quad(
            lambda v: slip_displacement(compliance, LOAD, MU, v), 0, top, epsrel=1e-9, limit=200
        )[0]
    )
    assert loop_energy(compliance, LOAD, MU, top) == pytest.approx(masing, rel=1e-6)
    force, delta = masing_loop(compliance, LOAD, MU, top, points=400)
    assert trapezoid(force, delta) == pytest.approx(
        loop_energy(compliance, LOAD, MU, top), rel=2e-3
    )
    assert (force[0], force[399]) == (-top, top)
    assert delta[399] == pytest.approx(slip_displacement(compliance, LOAD, MU, top), rel=1e-12)


@BODIES
def test_small_forces_stick(compliance):
    """The initial slope is the stuck compliance, and the loss falls with the cube of the
    amplitude."""
    small = 1e-5 * MU * LOAD
    stuck = small * compliance(np.array([LOAD]))[0]
    assert slip_displacement(compliance, LOAD, MU, small) == pytest.approx(stuck, rel=1e-5)
    ratio = loop_energy(compliance, LOAD, MU, 2 * small) / loop_energy(compliance, LOAD, MU, small)
    assert ratio == pytest.approx(8, rel=1e-4)
    assert slip_displacement(compliance, LOAD, MU, 0.0) == 0


def test_stick_region_shrinks_to_nothing_at_gross_slip():
    assert stick_load(LOAD, MU, MU * LOAD) == 0
    assert stick_load(LOAD, MU, 0.75 * MU * LOAD) == pytest.approx(0.25 * LOAD, rel=1e-14)
    for wrong in (1.01 * MU * LOAD, -1.0, np.nan):
        with pytest.raises(InputError, match="tangential"):
            stick_load(LOAD, MU, wrong)
    with pytest.raises(InputError, match="mu"):
        stick_load(LOAD, 0.0, 0.0)


@BODIES
@pytest.mark.parametrize("q", [1e-4, 0.05, 0.5, 0.9, 0.999])
def test_force_of_a_displacement_and_back(compliance, q):
    """Q(delta_t(Q)) = Q to 1e-10; mu P at and beyond gross slip."""
    force = q * MU * LOAD
    found = slip_force(compliance, LOAD, MU, slip_displacement(compliance, LOAD, MU, force))
    assert found == pytest.approx(force, rel=1e-10)
    gross = slip_displacement(compliance, LOAD, MU, MU * LOAD)
    assert (
        slip_force(compliance, LOAD, MU, 1.5 * gross) == MU * LOAD
        and slip_force(compliance, LOAD, MU, 0.0) == 0
    )
    with pytest.raises(InputError, match="displacement = -1"):
        slip_force(compliance, LOAD, MU, -1.0)


@pytest.mark.slow
@BODIES
@pytest.mark.parametrize("part", [0.4, 2.5])
def test_loop_over_displacement(compliance, part):
    """Below gross slip it is the loop over the force, point by point; its area is the loss, with
    the sliding beyond."""
    gross = slip_displacement(compliance, LOAD, MU, MU * LOAD)
    delta, force = displacement_loop(compliance, LOAD, MU, part * gross, points=80)
    loss = displacement_loop_energy(compliance, LOAD, MU, part * gross)
    assert trapezoid(force, delta) == pytest.approx(loss, rel=2e-3)
    assert delta[79] == pytest.approx(part * gross) and abs(force).max() <= MU * LOAD * (1 + 1e-14)
    assert force[79] == pytest.approx(slip_force(compliance, LOAD, MU, part * gross), rel=1e-12)
    if part < 1:
        others, way = masing_loop(compliance, LOAD, MU, force[79], points=60)
        top = np.interp(way[:60], delta[:80], force[:80])
        assert top == pytest.approx(others[:60], abs=1e-3 * MU * LOAD)
        assert loss == pytest.approx(loop_energy(compliance, LOAD, MU, force[79]), rel=1e-9)
    else:
        assert loss == pytest.approx(
            loop_energy(compliance, LOAD, MU, MU * LOAD) + 4 * MU * LOAD * (part - 1) * gross,
            rel=1e-9,
        )
