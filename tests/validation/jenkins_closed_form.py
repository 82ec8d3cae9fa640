"""One dof with a Jenkins element: tables at equal H, exact orbits, the peak of one harmonic in
closed form."""

import numpy as np

from tests.hbm.cases import jenkins, load, solve
from tests.validation import Subject, row
from tipdamp.hbm.response import follow_band


def rows():
    for case in ("A1", "A2"):
        data = load(case)
        problem, force = jenkins(data["parameters"])
        for known in data["steady_state"]:
            name = f"{case}, Om = {known['Omega']:g}"
            for H, expected in known["HB_X1_by_H"].items():
                ours = abs(solve(problem, force, known["Omega"], int(H))[0][0, 1])
                yield row(f"{name}, H = {H}", ours, expected, "table at equal H")
            for H in (5, 20):
                ours = abs(solve(problem, force, known["Omega"], H)[0][0, 1])
                yield row(name, ours, known["X1"], f"exact orbit, H = {H}")
        peak = data["HB1_peaks"][0]
        band = np.array([0.7, 1.3]) * peak["Omega"] / (2 * np.pi)
        curve = follow_band(problem, force, band, harmonics=1, outputs={"x": [1.0]})
        hz, amplitude = curve.peak("x")
        yield row(f"{case}, peak, H = 1", amplitude, peak["X"], "closed form")
        yield row(
            f"{case}, frequency of the peak, H = 1",
            2 * np.pi * hz,
            peak["Omega"],
            "frequency in closed form",
        )


SUBJECT = Subject(
    "One dof with a Jenkins element",
    "Amplitude of the first harmonic. Source: tests/reference/hbm/A1, A2.",
    rows,
    {
        "table at equal H": 5e-6,
        "exact orbit, H = 5": 5e-4,
        "exact orbit, H = 20": 5e-6,
        "closed form": 1e-9,
        "frequency in closed form": 1e-6,
    },
)
