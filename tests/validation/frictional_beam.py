"""Cantilever on eight contacts: published amplitudes, and whether every curve is complete with
default settings."""

import numpy as np

from tests.hbm.cases import beam, coupled, jenkins, load, solve
from tests.validation import Row, Subject, row
from tipdamp.hbm import fourier
from tipdamp.hbm.response import follow_band

TABLE = {
    ("B8", 20, 930.6): {
        1: 9.14515e-5,
        3: 9.14730e-5,
        7: 9.14525e-5,
        15: 9.14524e-5,
        "time": 9.14529e-5,
    },
    ("C8", 40, 932.1): {
        1: 1.59843e-4,
        3: 1.57963e-4,
        7: 1.57987e-4,
        15: 1.57987e-4,
        "time": 1.57986e-4,
    },
}


def rows():
    for (name, level, hz), table in TABLE.items():
        problem, force, outputs = beam(name)
        for H, expected in table.items():
            used = 15 if H == "time" else H
            q = solve(problem, level * force, 2 * np.pi * hz, used)[0]
            yield row(
                f"{name}, {level} N, {hz} Hz, H = {used}",
                float(fourier.half_peak_to_peak(outputs["tip"] @ q)),
                expected,
                "time integration" if H == "time" else "table at equal H",
            )
    for name, levels in (("B8", (1, 20, 80)), ("C8", (1, 40, 200))):
        problem, force, outputs = beam(name)
        for level in levels:
            for H in (1, 3, 7):
                yield from _curves(
                    f"{name}, {level} N, 700 to 1200 Hz, H = {H}",
                    problem,
                    level * force,
                    H,
                    outputs,
                )
    yield from _samples()


def _curves(name, problem, force, H, outputs):
    """Up and down: complete, few points, few calls of the residual, and the same peak."""
    peaks = []
    for band in ((700, 1200), (1200, 700)):
        curve = follow_band(problem, force, band, harmonics=H, outputs=outputs)
        solved = float(curve.converged.mean()) * curve.complete
        points = len(curve.frequency)
        yield row(f"{name}, share of {points} points", solved, 1.0, "complete curve")
        yield row(f"{name}, points beyond 300", max(points - 300, 0), 0, "number of points", 300)
        yield row(
            f"{name}, calls of the residual beyond 3 a point",
            max(curve.residual_calls - 3 * points, 0),
            0,
            "calls of the residual",
            points,
        )
        peaks.append(curve.peak("tip"))
    yield row(f"{name}, peak, up and down, m", peaks[0][1], peaks[1][1], "the same peak both ways")
    yield row(
        f"{name}, peak, up and down, Hz", peaks[0][0], peaks[1][0], "the same frequency both ways"
    )


def _samples():
    """The largest harmonic, and the largest change of any between 64 and 1024 samples, relative to
    it."""
    cases = [
        (case, *build(load(case)["parameters"]), 1.05)
        for case, build in (("A1", jenkins), ("D1", coupled))
    ]
    for name, level, hz in TABLE:
        problem, force, _ = beam(name)
        cases.append((name, problem, level * force, 2 * np.pi * hz))
    for case, problem, force, w in cases:
        for H in (1, 3, 7):
            coarse, fine = (solve(problem, force, w, H, samples=n)[0] for n in (64, 1024))
            largest = np.abs(fine).max()
            yield Row(
                f"{case}, Om = {w:.6g}, H = {H}",
                np.abs(coarse).max(),
                largest,
                np.abs(coarse - fine).max() / largest,
                "1024 samples instead of 64",
            )


SUBJECT = Subject(
    "Cantilever on eight contacts",
    "Half of peak to peak of the tip in m; whether every curve is complete with the "
    "default settings; the change of any harmonic when 64 samples become 1024. Source: "
    "tests/reference/hbm/frictional-beam.md.",
    rows,
    {
        "table at equal H": 1e-5,
        "time integration": 1e-5,
        "complete curve": 0.0,
        "number of points": 0.0,
        "calls of the residual": 0.0,
        "the same peak": 1e-8,
        "the same frequency": 1e-6,
        "1024 samples": 1e-10,
    },
)
