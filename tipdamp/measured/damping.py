"""Modal damping of a resonance from its frequency response: half-power bandwidth and circle fit
(Ewins 2000, ch. 4)."""

from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.errors import InputError

FLAT = 3  # equal highest values that no sampled resonance has: the signal was clipped
WIDE = 1e-4  # of the frequency: over less than this, samples of a resonance may be equal
RISE = 0.05  # of the highest sample: what a parabola may add to it between samples
CIRCLE_POINTS = 6  # five unknowns of the fit and one more


@dataclass(frozen=True)
class Resonance:
    """A peak and its damping ratio. peak_hz Hz; peak m/N; low_hz, high_hz - half-power points;
    zeta."""

    peak_hz: float
    peak: float
    low_hz: float
    high_hz: float
    zeta: float


def half_power(hz: np.ndarray, amplitude: np.ndarray) -> Resonance:
    """Damping ratio (f2 - f1) / (2 fp) from the half-power points of the highest peak.

    hz, amplitude : (n,) ascending, of one branch - the curve is linked by PCHIP
    Raises InputError where the peak is cut off by the end of the record, clipped, or its half-power
    points are not in the record.

    >>> hz = np.linspace(600, 1000, 400)
    >>> found = half_power(hz, abs(1 / (1 - (hz / 800) ** 2 + 0.04j * hz / 800)))
    >>> print(f"{found.peak_hz:.0f} Hz, {found.zeta:.3f}")
    800 Hz, 0.020
    """
    from scipy.interpolate import PchipInterpolator
    from scipy.optimize import brentq

    curve = PchipInterpolator(hz, amplitude)
    peak_hz, peak = highest_peak(hz, amplitude)
    level, ends = peak / np.sqrt(2.0), []
    for way, side in (
        ("below", np.flatnonzero(hz < peak_hz)[::-1]),
        ("above", np.flatnonzero(hz > peak_hz)),
    ):
        under = side[amplitude[side] < level]
        if not len(under):
            raise InputError(
                f"no half-power point {way} the peak at {peak_hz:.2f} Hz: the record "
                f"{hz[0]:g}..{hz[-1]:g} Hz is too narrow for a damping ratio"
            )
        inner = under[0] + 1 if way == "below" else under[0] - 1
        ends.append(brentq(lambda f: curve(f) - level, *sorted((hz[under[0]], hz[inner]))))
    return Resonance(peak_hz, peak, ends[0], ends[1], (ends[1] - ends[0]) / (2 * peak_hz))


def highest_peak(hz: np.ndarray, amplitude: np.ndarray) -> tuple[float, float]:
    """Frequency and height of the highest point, refined by the parabola through it and its
    neighbours.

    Raises InputError where it is cut off by the end of the record, or clipped.
    """
    k = int(amplitude.argmax())
    check_clipped(hz, amplitude)
    if k in (0, len(hz) - 1):
        raise InputError(
            f"the highest value lies at the end of the record, {hz[k]:g} Hz: no peak, and no "
            "damping"
        )
    x, y = hz[k - 1 : k + 2] - hz[k], amplitude[k - 1 : k + 2]
    a, b, c = np.polyfit(x, y, 2)
    at, height = -b / (2 * a), c - b * b / (4 * a)
    # uneven or noisy samples: the highest one stands for itself
    trusted = x[0] < at < x[2] and height <= (1 + RISE) * amplitude[k]
    return (float(hz[k] + at), float(height)) if trusted else (float(hz[k]), float(amplitude[k]))


def check_clipped(hz: np.ndarray, amplitude: np.ndarray) -> None:
    """InputError where the highest values of a signal, as it was measured, are equal over a part of
    the record."""
    k = int(amplitude.argmax())
    top = np.flatnonzero(np.isclose(amplitude, amplitude[k], rtol=1e-9, atol=0.0))
    if len(top) >= FLAT and np.ptp(hz[top]) > WIDE * hz[k]:
        raise InputError(
            f"the peak at {hz[k]:.2f} Hz is clipped: {FLAT} or more highest values are equal"
        )


def circle_fit(hz: np.ndarray, response: np.ndarray) -> float:
    """Damping ratio from the circle of the mobility, Ewins (2000) section 4.3.

    The points within the half-power bandwidth lie on a circle (viscous damping, neighbouring modes
    as a constant). On it the angle runs as theta0 - 2 atan((f/fr - fr/f) / (2 zeta)), which is
    fitted.

    hz (n,), response (n,) complex m/N
    Raises InputError where the phase is not known, the peak is refused by `half_power`, or too few
    points lie on the circle.
    """
    from scipy.optimize import least_squares

    if not np.iscomplexobj(response):
        raise InputError("a circle fit needs the phase")
    start = half_power(hz, np.abs(response))
    on = (hz >= start.low_hz) & (hz <= start.high_hz)
    if on.sum() < CIRCLE_POINTS:
        raise InputError(
            f"only {on.sum()} points within the half-power bandwidth, a circle fit needs "
            f"{CIRCLE_POINTS}"
        )
    f, z = hz[on], 2j * np.pi * hz[on] * response[on]
    z = z / np.abs(z).max()
    angle = np.unwrap(np.angle(z - _circle(z)))
    middle = int(np.abs(f - start.peak_hz).argmin())

    def off(unknown: np.ndarray) -> np.ndarray:
        fr, zeta, theta = unknown
        return theta - 2 * np.arctan((f / fr - fr / f) / (2 * zeta)) - angle

    fit = least_squares(
        off,
        [start.peak_hz, start.zeta, angle[middle]],
        x_scale=[start.peak_hz * start.zeta, start.zeta, 1.0],
    )
    if not fit.success or not 0 < fit.x[1] < 1:
        raise InputError(f"the points around {start.peak_hz:.1f} Hz do not lie on a circle")
    return float(fit.x[1])


def _circle(z: np.ndarray) -> complex:
    """Centre of the circle through points, algebraic least squares (Kasa 1976)."""
    matrix = np.column_stack([2 * z.real, 2 * z.imag, np.ones(len(z))])
    (x, y, _), *_ = np.linalg.lstsq(matrix, np.abs(z) ** 2, rcond=None)
    return x + 1j * y
