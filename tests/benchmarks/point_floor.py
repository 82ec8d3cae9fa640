"""CPU time of a point beside its floor: the contact forces and the linear solves that the same run
makes.

    python -m tests.benchmarks.point_floor [--repeats 9]

The floor is what the compiled contact kernels and LAPACK take, each call timed where it is made,
less the cost of the clock; all else is modal products, matrices made, steps, peaks and Python. The
cases are followed in turn and the medians taken. The figures go to
build/benchmarks/point_floor.json.
"""

import argparse
import time
from contextlib import contextmanager
from itertools import groupby

import numpy as np

from tests.benchmarks import contact_beam
from tests.benchmarks.record import one_thread, record
from tests.hbm.cases import beam, rig
from tipdamp.hbm.balance import newton
from tipdamp.hbm.laws.uncoupled import events, integrals
from tipdamp.hbm.response import follow_band

CASES = {
    "rig, 12 N, H = 5": (rig, 12, 5, (2300, 3300)),
    "C8, 40 N, H = 7": (lambda: beam("C8"), 40, 7, (700, 1200)),
    "B8, 20 N, H = 7": (lambda: beam("B8"), 20, 7, (700, 1200)),
    "B32, 20 N, H = 7": (lambda: contact_beam.in_modes(contact_beam.plane(32)), 20, 7, (700, 1200)),
}
FLOOR = {
    "contact forces": ((events, "find_pieces"), (integrals, "add_forces")),
    "linear solves": ((newton, "getrf"), (newton, "getrs")),
}


@contextmanager
def on_the_clock(spent):
    """Seconds in the functions of the floor, added to `spent`; the clock's own cost is taken
    off."""
    kept = {pair: getattr(*pair) for group in FLOOR.values() for pair in group}

    def timed(group, function):
        def call(*args, **options):
            began = time.thread_time()
            found = function(*args, **options)
            spent[group] += time.thread_time() - began - TICK
            return found

        return call

    for group, pairs in FLOOR.items():
        spent[group] = 0.0
        for module, name in pairs:
            setattr(module, name, timed(group, kept[module, name]))
    try:
        yield
    finally:
        for (module, name), function in kept.items():
            setattr(module, name, function)


def _tick():
    """CPU seconds between two looks at the clock."""
    return float(np.median(np.diff([time.thread_time() for _ in range(1001)])))


TICK = _tick()


def followed(case):
    """(points, residual calls, CPU seconds, seconds of the floor) of one curve, its peaks solved as
    a study shows them: the largest and the smallest of each patch."""
    (problem, force, outputs), level, H, band = case
    patches = [list(names) for _, names in groupby(outputs, lambda name: name.partition(":")[0])]
    options = {"harmonics": H, "outputs": outputs, "peaks": patches}
    began = time.process_time()
    curve = follow_band(problem, level * force, band, **options)
    whole, spent = time.process_time() - began, {}
    with on_the_clock(spent):
        follow_band(problem, level * force, band, **options)
    return len(curve.frequency), curve.residual_calls, whole, *spent.values()


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=9)
    cases = {label: (make(), *rest) for label, (make, *rest) in CASES.items()}
    found = {label: [] for label in cases}
    for _ in range(parser.parse_args().repeats + 1):  # the first one loads the kernels
        for label, case in cases.items():
            found[label].append(followed(case))
    rows = {}
    for label, runs in found.items():
        points, calls, whole, forces, solves = np.median(runs[1:], axis=0)
        rows[label] = {
            "points": points,
            "calls": calls / points,
            "ms": 1e3 * whole / points,
            "forces_ms": 1e3 * forces / points,
            "solves_ms": 1e3 * solves / points,
            "ratio": whole / (forces + solves),
        }
        print(label, ", ".join(f"{k} {v:.4g}" for k, v in rows[label].items()), flush=True)
    record("point_floor", {"rows": rows})


if __name__ == "__main__":
    main()
