"""Hard contact of curved bodies: the closed form of Hertz, on two rungs of
tests/validation/hertz.py."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from tests.validation.hertz import COMBINED, LINE, PEAK, RADIUS, A, rung  # noqa: E402


@pytest.mark.slow
def test_cylinder_on_a_block():
    """16 elements over the half width: peak pressure and half width within 0.5 %; 8 elements are
    farther off."""
    # Hertz 1881; Johnson 1985, 4.2
    assert pytest.approx(np.sqrt(4 * LINE * RADIUS / (np.pi * COMBINED))) == A
    assert pytest.approx(np.sqrt(LINE * COMBINED / (np.pi * RADIUS))) == PEAK
    coarse, fine = rung(8), rung(16)
    assert fine.peak == pytest.approx(PEAK, rel=5e-3) and fine.half_width == pytest.approx(
        A, rel=5e-3
    )
    assert fine.pressure[0] == pytest.approx(PEAK, rel=5e-3)  # the node on the axis alone
    assert abs(coarse.half_width / A - 1) > abs(fine.half_width / A - 1)
    assert not fine.pressure[fine.x > 1.1 * A].any()
