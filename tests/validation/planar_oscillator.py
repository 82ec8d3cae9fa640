"""Planar blade-damper-blade oscillator: published tables, peaks and time integration, and our own
integration."""

import numpy as np

from tests.hbm.cases import solve
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.validation import Subject, row
from tipdamp.hbm.comparison import compare_point
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.response import follow_band

# Hz: H = 1, 3, 5, 9, time integration
TABLE = {
    150: [2.79185e-5] * 4 + [2.79164e-5],
    155: [5.57187e-5] * 4 + [5.57125e-5],
    160: [1.98684e-4, 1.99790e-4, 2.00076e-4, 2.00064e-4, 1.99888e-4],
    162: [2.58829e-4, 2.21221e-4, 2.24989e-4, 2.25018e-4, 2.25009e-4],
    163: [2.41374e-4, 2.25083e-4, 2.27324e-4, 2.27274e-4, 2.27307e-4],
    165: [1.52150e-4] * 4 + [1.52172e-4],
    170: [7.11574e-5] * 4 + [7.11621e-5],
    180: [4.01802e-5] * 4 + [4.01806e-5],
}
# H: Hz, m
PEAK = {1: (161.8, 2.5924e-4), 3: (163.1, 2.2519e-4), 5: (163.0, 2.2733e-4), 9: (163.0, 2.2728e-4)}


def rows():
    for column, (H, (hz, amplitude)) in enumerate(PEAK.items()):
        for f, known in TABLE.items():
            ours = abs(solve(oscillator(), FORCE, 2 * np.pi * f, H, start="zero_force")[0][3, 1])
            yield row(f"{f} Hz, H = {H}", ours, known[column], "table at equal H")
            if H == 9:
                yield row(f"{f} Hz, H = 9", ours, known[4], "published time integration")
        for band in ((150, 180), (180, 150)):
            curve = follow_band(
                oscillator(), FORCE, band, harmonics=H, outputs=Y2, start="zero_force"
            )
            found = find_peaks(curve, oscillator(), "y2", "harmonic")[0]
            yield row(
                f"{band[0]} to {band[1]} Hz, H = {H}", float(curve.complete), 1.0, "complete curve"
            )
            yield row(f"peak, Hz, H = {H}", found[0], hz, "frequency of the peak (to 0.1 Hz)")
            yield row(f"peak, m, H = {H}", found[1], amplitude, "peak, table at equal H")
    for hz, published in TABLE.items():
        _, point, balance = solve(oscillator(), FORCE, 2 * np.pi * hz, 9, start="zero_force")
        found = compare_point(balance, point, [Y2["y2"]])
        ours = abs(found.steady.harmonics[0, 1])
        yield row(
            f"{hz} Hz, comparable", float(found.agrees), 1.0, "our time integration is periodic"
        )
        yield row(f"{hz} Hz, H = 9", found.difference * ours, 0.0, "our time integration", ours)
        yield row(
            f"{hz} Hz, our time integration", ours, published[4], "published time integration"
        )


SUBJECT = Subject(
    "Planar blade-damper-blade oscillator",
    "First harmonic of y2 in m; free damper, static part solved with the rest. "
    "Source: tests/reference/hbm/oscillator.md.",
    rows,
    {
        "table at equal H": 2e-4,
        "published time integration": 1.5e-3,
        "frequency": 0.1 / 163,
        "peak": 5e-4,
        "complete curve": 0.0,
        "our time integration is periodic": 0.0,
        "our time integration": 1.5e-3,
    },
)
