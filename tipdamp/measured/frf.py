"""Frequency response functions and the mean of repeated measurements; every response is a
receptance in m/N."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tipdamp.hbm.errors import InputError

GRAVITY = 9.80665  # m/s2, standard acceleration (CGPM 1901)
# quantity: power of i omega that leads from displacement to it, and its units in SI
QUANTITIES = {
    "receptance": (0, {"m": 1.0, "mm": 1e-3, "um": 1e-6}),
    "mobility": (1, {"m/s": 1.0, "mm/s": 1e-3}),
    "accelerance": (2, {"m/s2": 1.0, "mm/s2": 1e-3, "g": GRAVITY}),
}
BAND_COLUMNS = "frequency (Hz),mean (m/N),low (m/N),high (m/N),standard deviation (m/N)"
SAME_GRID = 1e-9  # relative difference of frequencies that come from text with ten digits


@dataclass(frozen=True)
class Frf:
    """One measurement. hz (n,) ascending; response (n,) m/N, complex, or real where no phase was
    measured; force_N - amplitude of the force, its median over the frequencies; source - file and
    record, for messages clipped - why the signal as it was measured has no peak, or empty"""

    hz: np.ndarray
    response: np.ndarray
    force_N: float
    source: str
    clipped: str = ""

    @property
    def amplitude(self) -> np.ndarray:
        """(n,) m/N."""
        return np.abs(self.response)

    @property
    def with_phase(self) -> bool:
        """Whether the phase was measured."""
        return np.iscomplexobj(self.response)


@dataclass(frozen=True)
class MeasuredCurve:
    """Mean of repeats on the frequencies that all of them cover.

    hz, mean, deviation : (n,) Hz, m/N - sample standard deviation of the amplitude, NaN for a
    single measurement repeats - the measurements themselves
    """

    hz: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
    repeats: tuple[Frf, ...]

    def band(self, scatter: float) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bound (n,) m/N: two standard deviations of the repeats, at least
        `scatter` times the mean."""
        half = np.fmax(2.0 * self.deviation, scatter * self.mean)
        return np.maximum(self.mean - half, 0.0), self.mean + half


def receptance(quantity: str, hz: np.ndarray, response: np.ndarray) -> np.ndarray:
    """(n,) m/N from a mobility or accelerance in SI units: division by (i omega)^k; amplitudes stay
    real."""
    omega = 2 * np.pi * hz
    power, _ = QUANTITIES[quantity]
    return response / (1j * omega if np.iscomplexobj(response) else omega) ** power


def average(repeats: Sequence[Frf]) -> MeasuredCurve:
    """Mean and deviation of the amplitudes. Repeats on other frequencies are interpolated to those
    of the first.

    Raises InputError where the repeats have no frequencies in common.
    """
    first = repeats[0]
    low, high = max(r.hz[0] for r in repeats), min(r.hz[-1] for r in repeats)
    inside = (first.hz >= low * (1 - SAME_GRID)) & (first.hz <= high * (1 + SAME_GRID))
    if inside.sum() < 2:
        raise InputError(
            f"{first.source}: the repeats have no frequencies in common (they share "
            f"{low:g}..{high:g} Hz)"
        )
    hz = first.hz[inside]
    amplitudes = np.array([_on(hz, r) for r in repeats])
    deviation = amplitudes.std(axis=0, ddof=1) if len(repeats) > 1 else np.full(len(hz), np.nan)
    return MeasuredCurve(hz, amplitudes.mean(axis=0), deviation, tuple(repeats))


def _on(hz: np.ndarray, frf: Frf) -> np.ndarray:
    exact = len(frf.hz) == len(hz) and np.allclose(frf.hz, hz, rtol=SAME_GRID, atol=0.0)
    return frf.amplitude if exact else np.interp(hz, frf.hz, frf.amplitude)


def write_band(path: Path, curve: MeasuredCurve, scatter: float) -> None:
    """Mean and band of the repeats of a measured curve, as CSV."""
    table = np.column_stack([curve.hz, curve.mean, *curve.band(scatter), curve.deviation])
    np.savetxt(path, table, delimiter=",", fmt="%.12g", header=BAND_COLUMNS, comments="")


def load_band(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """hz, mean, low, high (n,) Hz and m/N of the CSV of a measured curve."""
    return tuple(np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2).T[:4])
