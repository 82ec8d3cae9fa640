"""Damping ratio from a resonance peak by the half-power method."""

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError


def half_power(frequency: ArrayLike, amplitude: ArrayLike) -> float:
    """zeta = (f2 - f1) / (2 f0) between the half-power points of the highest peak of a curve.

    frequency (n,) Hz ascending, amplitude (n,) >= 0. Raises InputError when the peak is cut off by
    the band before it falls to 1/sqrt(2): no damping is read from a clipped peak.
    """
    frequency, amplitude = np.asarray(frequency, float), np.asarray(amplitude, float)
    top = int(amplitude.argmax())
    level = amplitude[top] / np.sqrt(2)
    below = np.flatnonzero(amplitude[:top] < level)
    above = np.flatnonzero(amplitude[top:] < level)
    if not len(below) or not len(above):
        raise InputError(
            "the peak is cut off by the band before it falls to half power: widen the band"
        )
    i, j = below[-1], top + above[0]
    f1 = np.interp(level, amplitude[i : i + 2], frequency[i : i + 2])
    f2 = np.interp(-level, -amplitude[j - 1 : j + 1], frequency[j - 1 : j + 1])
    return float((f2 - f1) / (2 * frequency[top]))
