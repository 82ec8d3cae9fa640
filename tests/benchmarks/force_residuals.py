"""Forces at every stored point: I1, C1, 40 random Duffing oscillators and the 200 random
oscillators of `robustness`.

    python -m tests.benchmarks.force_residuals [--count 200]

The residual of the plain equation of motion, from the harmonics of every dof alone, over the force
scale; both directions of the smooth ones. Points that are not solved are counted; what was left out
is listed with its reason."""

import argparse

import numpy as np

from tests.benchmarks.record import one_thread, record
from tests.benchmarks.robustness import BAND, draw
from tests.hbm.cases import duffing, duffing_peak, load, unilateral
from tests.hbm.curve.test_equilibrium import every_dof, largest_residual
from tests.hbm.oscillator import FORCE, oscillator
from tipdamp.hbm.response import follow_band


def smooth(count=40):
    """(problem, force, band, H) of I1, C1 and random Duffing oscillators, upward and downward."""
    rng = np.random.default_rng(1)
    cases = [
        (duffing(0.03), np.array([0.2]), (0.08, 0.5), 15),
        (*unilateral(load("C1")["parameters"]), (0.1, 0.3), 15),
    ]
    for _ in range(count):
        c, F, cubic = 10 ** rng.uniform([-2.3, -1.5, -1.0], [-0.7, 0.3, 1.0])
        top = duffing_peak(c, F, cubic)[0] * rng.uniform(1.15, 1.6)
        band = np.array([0.3, top]) / (2 * np.pi)
        cases.append((duffing(c, cubic), np.array([F]), band, int(rng.integers(1, 10))))
    for problem, force, band, H in cases:
        for direction in (1, -1):
            yield problem, force, band[::direction], H


def contacts(count):
    """The same of random oscillators with contacts."""
    for mu, kn, kt, level, H in draw(count):
        yield oscillator(mu, kn, kt), level * FORCE, BAND, H


def residuals(cases):
    """Figures of cases: points, the largest residual and error of the energy balance, and points
    that were left out."""
    found = {"curves": 0, "points": 0, "not_solved": 0, "worst": 0.0, "energy": 0.0, "said": []}
    for problem, force, band, H in cases:
        curve = follow_band(
            problem, force, band, harmonics=H, outputs=every_dof(problem), start="zero_force"
        )
        found["curves"] += 1
        found["points"] += int(curve.converged.sum())
        found["not_solved"] += int((~curve.converged).sum())
        found["worst"] = max(found["worst"], largest_residual(curve, problem, force))
        found["energy"] = max(found["energy"], float(np.nanmax(curve.energy_error)))
        if "left out" in curve.ended:
            found["said"].append(curve.ended)
    return found


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    figures = {
        "smooth": residuals(smooth()),
        "contacts": residuals(contacts(parser.parse_args().count)),
    }
    print(figures)
    record("force_residuals", figures)


if __name__ == "__main__":
    main()
