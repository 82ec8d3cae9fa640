"""Draws docs/images/duffing_tip.png: the tip of a lightly damped Duffing curve, followed from both
ends of its band.

    python docs/theory/duffing_tip.py [FILE]

m = k = cubic = 1, c = 0.03, F = 0.2, H = 1; the closed form of the curve is (1 - w^2 + 3/4 A^2)^2 +
c^2 w^2 = (F/A)^2."""

import sys
from pathlib import Path

import numpy as np

from tipdamp import ContactProblem, Contacts, CubicSpring, follow_band

C, F = 0.03, 0.2
PEAK = 2.508937161, 2.657120165  # rad/s, m, by the closed form


def closed_form(A):
    """rad/s of both sides of the curve at amplitudes A (n,); NaN above the peak."""
    b = 1 + 0.75 * A**2 - C**2 / 2
    with np.errstate(invalid="ignore"):
        half = np.sqrt(b**2 - (1 + 0.75 * A**2) ** 2 + (F / A) ** 2)
        return np.sqrt(b - half), np.sqrt(b + half)


def main(file=Path(__file__).parents[1] / "images" / "duffing_tip.png"):
    """Write the picture."""
    import matplotlib.pyplot as plt

    one = np.eye(1)
    problem = ContactProblem(
        one, C * one, one, one, CubicSpring(cubic=1.0), Contacts([0.0], [0.0], [0.0], [0.0])
    )
    figure, sides = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    A = PEAK[1] * (1 - np.linspace(1, 0, 4000)[:-1] ** 3 * 0.995)
    left, right = closed_form(A)
    for plot in sides:
        plot.plot(
            np.r_[left, right[::-1]],
            np.r_[A, A[::-1]],
            color="0.75",
            lw=3,
            zorder=1,
            label="closed form",
        )
        for band, marker, size, label in (
            ((0.5, 3.1), "o", 7, "upwards"),
            ((3.1, 0.5), "x", 5, "downwards"),
        ):
            curve = follow_band(
                problem,
                np.array([F]),
                np.array(band) / (2 * np.pi),
                harmonics=1,
                outputs={"x": [1.0]},
            )
            plot.plot(
                2 * np.pi * curve.frequency,
                curve.amplitude()[:, 0],
                marker,
                ms=size,
                mfc="none",
                lw=0,
                label=f"{label}: peak {curve.peak('x')[1]:.9f}",
            )
        plot.set_xlabel("frequency, rad/s")
    sides[0].set_ylabel("amplitude, m")
    sides[0].set_xlim(0.5, 3.1)
    sides[0].set_ylim(0, 3.6)
    sides[0].legend(loc="upper left", frameon=False, fontsize=9)
    sides[1].set_xlim(PEAK[0] - 6e-4, PEAK[0] + 3e-4)
    sides[1].set_ylim(PEAK[1] - 1.1e-3, PEAK[1] + 1e-4)
    sides[1].set_title(f"tip; closed form of the peak {PEAK[1]:.9f}", fontsize=10)
    sides[1].ticklabel_format(useOffset=False)
    sides[1].tick_params(axis="x", rotation=20)
    figure.savefig(file, dpi=130)


if __name__ == "__main__":
    main(*sys.argv[1:2])
