"""One dof on a unilateral spring, preloaded or with a gap: curves with folds, tables, closed forms,
exact orbits."""

import numpy as np

from tests.hbm.cases import load, unilateral
from tests.validation import Subject, row
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.response import follow_band


def rows():
    for case in ("C1", "C2"):
        data = load(case)
        problem, force = unilateral(data["parameters"])
        omega = np.array([known["Omega"] for known in data["results"]])
        band = np.array([omega.min() - 0.05, omega.max() + 0.05]) / (2 * np.pi)
        for H in (1, 5, 20):
            curve = follow_band(
                problem, force, band, harmonics=H, outputs={"x": [1.0]}, at=omega / (2 * np.pi)
            )
            yield row(f"{case}, H = {H}", float(curve.complete), 1.0, "complete curve")
            for known in data["results"]:
                found = np.abs(solutions_at(curve, problem, known["Omega"] / (2 * np.pi))[:, 0, 1])
                yield from _at(f"{case}, Om = {known['Omega']:g}", H, known, found)


def _at(name, H, known, found):
    """Every solution of one harmonic that is known at C1, 1.15; elsewhere the nearest."""

    def nearest(expected):
        return found[np.abs(found - expected).argmin()]

    if H < 20:
        expected = known["HB_by_H"][str(H)]["X1"]
        yield row(f"{name}, H = {H}", nearest(expected), expected, "table at equal H")
    if H > 1:
        yield row(name, nearest(known["X1"]), known["X1"], f"exact orbit, H = {H}")
    every = known["HB01_all_solutions"]
    if H == 1 and len(every) == 3:
        yield row(
            f"{name}, H = 1, solutions on one curve", len(found), len(every), "number of solutions"
        )
        for s in every:
            yield row(f"{name}, H = 1", nearest(s["X1"]), s["X1"], "closed form")


SUBJECT = Subject(
    "Lift-off and gap",
    "Amplitude of the first harmonic, of the solution on the curve that is nearest. Source: "
    "tests/reference/hbm/C1, C2.",
    rows,
    {
        "table at equal H": 5e-6,
        "exact orbit, H = 5": 5e-4,
        "exact orbit, H = 20": 5e-6,
        "closed form": 1e-9,
        "number of solutions": 0.0,
        "complete curve": 0.0,
    },
)
