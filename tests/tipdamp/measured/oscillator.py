"""Receptance of an oscillator as it would be measured, in closed form."""

import numpy as np

PEAK_HZ, ZETA, MASS = 2800.0, 0.022, 0.4


def receptance(hz, zeta=ZETA, natural_hz=PEAK_HZ):
    w, w0 = 2 * np.pi * np.asarray(hz), 2 * np.pi * natural_hz
    return 1 / (MASS * (w0**2 - w**2 + 2j * zeta * w0 * w))


def grid(first=2500.0, last=3100.0, step=2.0):
    return np.arange(first, last + step / 2, step)
