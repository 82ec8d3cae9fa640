"""The two-blade rig's tuned set against time integration: at the peak and within 50 Hz of it, H = 5, 9 and 1.

    python -m tests.benchmarks.rig_integration [--levels 12 20 40]

Every H has its own curve; its points at the frequencies are solved on it, and each starts the integration at its own
displacement, velocity and sliders: pairs that stick all through keep their sliders where they are, so that there is a
continuum of steady states, and each orbit has its own. Where a curve passes a frequency several times, the largest
amplitude is taken. Modes above 50 times the excitation follow statically; at the peak the integration is repeated with
150 times. The first output is compared, harmonic 1. Hours.
"""

import argparse

import numpy as np

from hbm.response import follow_band
from hbm.solutions import points_at
from hbm.time.comparison import compare_point
from hbm.time.settings import IntegrationSettings
from tests.benchmarks.record import one_thread, record
from tests.hbm.cases import rig

HARMONICS, BAND = (5, 9, 1), (2300, 3300)
AROUND = (0.0, -50.0, -35.0, -20.0, -10.0, -5.0, 5.0, 10.0, 20.0, 35.0, 50.0)      # Hz from the peak at H = 5


def on_curve(curve, problem, row, hz):
    """(balance, point) of the largest amplitude of a curve at a frequency; None where it has no solution there."""
    balance, points = points_at(curve, problem, hz)
    points = [point for point in points if point.converged]
    amplitude = [abs((row @ (balance.receptance.shapes @ point.detail.modal))[1]) for point in points]
    return (balance, points[int(np.argmax(amplitude))]) if points else None


def against(balance, point, row, **settings) -> dict:
    """One point of one H beside the integration from its own orbit."""
    c = compare_point(balance, point, row[None], IntegrationSettings(tolerance=1e-5, max_periods=500, **settings))
    return {"difference": float(c.difference), "comparable": bool(c.steady.periodic and not c.left),
            "unstable": bool(c.steady.multiplier > 1 + 1e-6), "said": c.said}


def level_rows(case, Fe):
    """Rows of one level: all frequencies at every H."""
    problem, force, outputs = case
    name, output = next(iter(outputs.items()))
    force = Fe * force
    peak = follow_band(problem, force, BAND, harmonics=5, outputs=outputs).peak(name)[0]
    for H in HARMONICS:
        curve = follow_band(problem, force, BAND, harmonics=H, outputs={name: output},
                            at=peak + np.array(AROUND))
        for step in AROUND:
            row = {"Fe": Fe, "H": H, "hz": peak + step, "from_peak": step}
            found = on_curve(curve, problem, output, peak + step)
            if found is None:
                yield row | {"comparable": False, "said": f"no solution: {curve.ended}"}
                continue
            yield row | against(*found, output)
            if H == 5 and step == 0:
                yield row | {"masses_to": 150} | against(*found, output, massless_above=150.0)


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", type=float, nargs="+", default=(12.0, 20.0, 40.0))
    rows, case = [], rig()
    for Fe in parser.parse_args().levels:
        for row in level_rows(case, Fe):
            rows.append(row)
            print(row, flush=True)
            record("rig_integration", {"rows": rows})


if __name__ == "__main__":
    main()
