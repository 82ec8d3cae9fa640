"""Partial slip: Mindlin's and Cattaneo's closed forms, the area of the loop itself, small and gross slip."""

import numpy as np
import pytest
from scipy.integrate import quad

from hbm.errors import InputError
from static_contact.ellipse import ellipse_stiffness
from static_contact.halfspace import ContactSide, side_compliance
from static_contact.moduli import MaterialPair
from static_contact.partial_slip import loop_energy, masing_loop, slip_displacement, stick_load
from static_contact.plane import plane_stiffness
from static_contact.punch import punch_half_width

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
    """delta_t = (3 mu P / 16 a) (sum of (2 - nu)/G) [1 - (1 - q)^(2/3)]; loss of Mindlin & Deresiewicz (1953)."""
    a = np.cbrt(3 * LOAD * RADIUS / (4 * UNLIKE.E_star))
    bodies = (2 - 0.3) / UNLIKE.G1 + (2 - 0.342) / UNLIKE.G2
    delta = 3 * MU * LOAD / (16 * a) * bodies * (1 - (1 - q) ** (2 / 3))
    loss = 9 * (MU * LOAD) ** 2 / (10 * a) * bodies
    loss *= 1 - (1 - q) ** (5 / 3) - 5 / 6 * q * (1 + (1 - q) ** (2 / 3))
    assert slip_displacement(sphere, LOAD, MU, q * MU * LOAD) == pytest.approx(delta, rel=1e-12)
    assert loop_energy(sphere, LOAD, MU, q * MU * LOAD) == pytest.approx(loss, rel=1e-9)


@BODIES
@pytest.mark.parametrize("q", [0.3, 1.0])
def test_loss_is_the_area_of_the_loop(compliance, q):
    top = q * MU * LOAD
    masing = 4 * top * slip_displacement(compliance, LOAD, MU, top)
    masing -= 8 * quad(lambda v: slip_displacement(compliance, LOAD, MU, v), 0, top, epsrel=1e-9, limit=200)[0]
    assert loop_energy(compliance, LOAD, MU, top) == pytest.approx(masing, rel=1e-6)
    force, delta = masing_loop(compliance, LOAD, MU, top, points=400)
    assert np.trapz(force, delta) == pytest.approx(loop_energy(compliance, LOAD, MU, top), rel=2e-3)
    assert (force[0], force[399]) == (-top, top)
    assert delta[399] == pytest.approx(slip_displacement(compliance, LOAD, MU, top), rel=1e-12)


@BODIES
def test_small_forces_stick(compliance):
    """The initial slope is the stuck compliance, and the loss falls with the cube of the amplitude."""
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
