import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.modal.damping import half_power


@pytest.mark.parametrize("zeta", [0.005, 0.022])
def test_half_power_of_a_single_oscillator(zeta):
    """Exact half-power points of one oscillator give zeta to order zeta^2 (textbook)."""
    f = np.linspace(0.8, 1.2, 20001)
    assert half_power(f, 1 / np.abs(1 - f**2 + 2j * zeta * f)) == pytest.approx(zeta, rel=3 * zeta)


def test_clipped_peak_is_refused():
    f = np.linspace(1.0, 1.2, 200)
    with pytest.raises(InputError, match="cut off by the band"):
        half_power(f, 1 / np.abs(1 - f**2 + 0.044j * f))
