"""What the trust in a curve costs: its estimate of the error, the stability of its points, the
search for curves beside it, and `compare` at its peak.

    python -m tests.benchmarks.trust [--repeats 5]

Estimate: share of a curve without it. Stability of every point: ms a point more, with the named
points located. CPU time of one thread, the least of the repeats, run alternately. The figures go to
build/benchmarks/trust.json.
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.benchmarks.record import one_thread, record
from tests.hbm.cases import beam, duffing, load, rig
from tests.hbm.curve.test_truncation_of_samples import ROW, blade
from tests.validation.trusted_curves import further_cases
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.response import follow_band

# case, level, harmonics, band
CURVES = {
    "B8, 20 N, H = 7": (lambda: beam("B8"), 20, 7, (700, 1200)),
    "C8, 40 N, H = 7": (lambda: beam("C8"), 40, 7, (700, 1200)),
    "rig, 12 N, H = 5": (rig, 12, 5, (2300, 3300)),
}


def cpu(call: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    found = call()
    return time.process_time() - began, found


def least(calls: dict[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """CPU s of each, after a first run of each that loads what it needs."""
    for call in calls.values():
        call()
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            times[name].append(cpu(call)[0])
    return {name: min(found) for name, found in times.items()}


def of_curves(repeats: int):
    for name, (case, level, H, band) in CURVES.items():
        problem, force, outputs = case()

        def curve(problem=problem, force=level * force, band=band, H=H, outputs=outputs, **more):
            plain = {"truncation": False, "stability": "none"}
            return follow_band(problem, force, band, harmonics=H, outputs=outputs, **plain | more)

        found = least(
            {
                "plain": curve,
                "estimate": lambda curve=curve: curve(truncation=True),
                "stable": lambda curve=curve: curve(truncation=True, stability="all"),
            },
            repeats,
        )
        points = len(curve().frequency)
        yield {
            "case": name,
            "points": points,
            "point_ms": 1e3 * found["plain"] / points,
            "estimate_share": found["estimate"] / found["plain"] - 1,
            "stability_ms": 1e3 * (found["stable"] - found["estimate"]) / points,
        }


def of_comparisons(repeats: int):
    """At the peak, of the upper branch where there are more."""
    p = load("I1")["parameters"]
    given = {
        "Duffing, H = 9": (
            duffing(p["c"], p["k3"]),
            np.array([p["F"]]),
            np.array([0.8, 2.0]) / (2 * np.pi),
            {"harmonics": 9, "outputs": {"x": [1.0]}},
        ),
        "friction in the plane, H = 5": (
            *further_cases()["E1"][:3],
            {"harmonics": 5, "outputs": {"x": [1.0, 0.0]}},
        ),
    }
    for name, (problem, force, band, options) in given.items():
        curve = follow_band(problem, force, band, **options)
        hz = curve.peak("x")[0]
        found = least({name: lambda c=curve, p=problem, at=hz: compare(c, p, at, 0)}, repeats)
        yield {"case": name, "compare_s": found[name]}
    sampled = blade()
    curve = sampled.follow_band((780, 840), outputs=ROW, harmonics=9)
    hz = curve.peak("tip")[0]
    name = "two sliders, sampled, H = 9"
    problem = sampled.contact_problem
    yield {
        "case": name,
        "compare_s": least({name: lambda: compare(curve, problem, hz)}, repeats)[name],
    }


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    rows = []
    for row in (*of_curves(repeats), *of_comparisons(repeats)):
        rows.append(row)
        print(row, flush=True)
    record("trust", {"repeats": repeats, "rows": rows})


if __name__ == "__main__":
    main()
