"""Towards rigid friction (Den Hartog): a Jenkins element that becomes stiffer and stiffer."""

import numpy as np

from tests.hbm.cases import MAX_HARMONICS, den_hartog, load
from tests.validation import Miss, Subject, row


def rows():
    for known in load("B1")["results"]:
        name = f"Om = {known['Omega']:g}"
        for H in (20, MAX_HARMONICS):
            found, exponents = den_hartog(known, H)
            for kt, largest, expected in found:
                yield row(f"{name}, kt/k = {kt:g}", largest, expected, f"exact orbit, H = {H}")
        exact = np.log10([abs(e / known["X_DenHartog"] - 1) for *_, e in found])
        for (kt, *_), ours, expected in zip(found[1:], exponents, np.diff(exact), strict=True):
            case = f"{name}, exponent of the distance from rigid friction, to kt/k = {kt:g}"
            yield row(case, ours, -0.5, "kt^-1/2")
            yield row(case, ours, expected, "exponent of the exact orbits")


CORNERS = (
    "stiffer contacts turn the reversals into corners, whose harmonics fall as slowly as those "
    "of rigid friction: what is missing is in the harmonics that are left out"
)
SUBJECT = Subject(
    "Towards rigid friction",
    "Largest displacement; rigid friction (Den Hartog) is approached as kt^-1/2. "
    "tests/hbm/test_verification.py holds what 61 harmonics reach. Source: tests/reference/hbm/B1.",
    rows,
    {"exact orbit": 5e-6},
    {
        "exact orbit, H = 20": Miss(3.2e-3, 0, CORNERS),
        f"exact orbit, H = {MAX_HARMONICS}": Miss(1.04e-4, 10, CORNERS),
    },
)
