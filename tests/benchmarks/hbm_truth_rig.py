"""The two-blade rig's tuned set against time integration: at the peak and within 50 Hz of it, H = 1, 5 and 9.

    tipdamp run docs/studies/two_blade_rig/asymmetric.toml --out RIG
    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/benchmarks/hbm_truth_rig.py RIG [--levels 12 20 40]

Every point of H = 5 that is compared starts the integration at its displacement, velocity and sliders; H = 1 and 9 are
compared with the same integration. Masses: modes above 50 times the excitation follow statically; at the peak of every
level the integration is repeated with 150 times and with a tolerance ten times finer. The first output is compared,
harmonic 1. The figures go to results/truth_rig.json beside this file.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from hbm import continuation
from hbm.comparison import compare
from hbm.contact import ContactTable
from hbm.laws import DryFriction2T
from hbm.model import ReducedModel
from hbm.residual import HarmonicBalance
from hbm.response import contact_problem, follow_band
from static_contact.carry import with_springs
from tipdamp import jobs
from tipdamp.study import load_study

AROUND = (-50.0, -35.0, -20.0, -10.0, -5.0, 5.0, 10.0, 20.0, 35.0, 50.0)      # Hz from the peak
HARMONICS = (1, 5, 9)
STUDY = Path(__file__).parents[2] / "docs" / "studies" / "two_blade_rig" / "asymmetric.toml"
RESULTS = Path(__file__).parent / "results" / "truth_rig.json"


def rig(folder):
    """(problem, force per newton, {name: row}) of the kept pairs of a run of the study."""
    study = load_study(STUDY)
    model, table = ReducedModel.load(folder / "model.npz"), ContactTable.load(folder / "kept.csv")
    model = with_springs(model, table, jobs.declared_springs(study, table))
    problem, _ = contact_problem(model, table.select(table.carrying), DryFriction2T(),
                                 damping_ratio=jobs.ratio(study["respond"]["damping_ratio"]))
    rows = jobs.outputs(study, model)
    name = next(iter(rows))
    return problem, jobs.excitation(study, model), {name: rows[name]}


def solve(problem, force, w, H, guess, H_guess):
    """(balance, point) at H from the harmonics of another H."""
    balance = HarmonicBalance(problem, {1: force}, H, "zero_slider")
    x = np.zeros((balance.n_components, balance.nh))
    n = min(balance.nh, 2 * H_guess + 1)
    x[:, :n] = guess.reshape(len(x), -1)[:, :n]
    return balance, continuation.solve_at(balance.evaluate, x.ravel(), w, balance.weights)


def point_on(curve, problem, force, hz):
    """(balance, point) of the curve (with contact motion) at a frequency, solved from the nearest point."""
    i = int(np.abs(np.where(curve.converged, curve.frequency, np.inf) - hz).argmin())
    motion = curve.contact_motion[i].reshape(-1, curve.H + 1)
    x = np.empty((len(motion), 2 * curve.H + 1))
    x[:, 0], x[:, 1::2], x[:, 2::2] = motion[:, 0].real, motion[:, 1:].real, motion[:, 1:].imag
    return solve(problem, force, 2 * np.pi * hz, curve.H, x, curve.H)


def row_at(curve, problem, force, hz, outputs, **settings):
    """Figures of one frequency: amplitude by integration from the orbit of the curve, and the error of each H."""
    rows, began = np.array(list(outputs.values())), time.process_time()
    balance, point = point_on(curve, problem, force, hz)
    if not point.converged:
        return {"hz": hz, "said": "the harmonic balance did not converge"}
    c = compare(balance, point, rows, tolerance=1e-5, most_periods=600, **settings)
    truth = abs(c.steady.harmonics[0, 1])
    row = {"hz": hz, "integration": truth, "periodic": c.steady.periodic, "left": c.left, "said": c.said,
           "periods": c.steady.periods, "change": c.steady.period_change, "seconds": time.process_time() - began,
           "error": {}}
    for H in HARMONICS:
        b, p = solve(problem, force, point.parameter, H, point.x, curve.H) if H != curve.H else (balance, point)
        q = abs((rows @ (b.receptance.shapes @ p.detail.modal))[0, 1]) if p.converged else float("nan")
        row["error"][H] = q / truth - 1
    return row


def level_rows(problem, force, Fe, outputs, save):
    """Rows of a level, the first at the peak of H = 5, the next two its repetitions with finer settings."""
    curve = follow_band(problem, Fe * force, (2300, 3300), harmonics=5, outputs=outputs, contact=True)
    hz, amplitude = curve.peak(curve.output_names[0], "harmonic")
    found = {"Fe": Fe, "peak_hz": hz, "peak_amplitude": amplitude, "ended": curve.ended, "rows": []}
    top = row_at(curve, problem, Fe * force, hz, outputs)
    save(found | {"rows": [top]})
    found["rows"] = [top]
    for step in AROUND:
        found["rows"].append(row_at(curve, problem, Fe * force, hz + step, outputs))
        save(found)
    again = row_at(curve, problem, Fe * force, hz, outputs, massless_above=150.0)
    found["peak_with_masses_to_150"] = again
    save(found)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("rig", type=Path)
    parser.add_argument("--levels", type=float, nargs="+", default=[12.0, 20.0, 40.0])
    arguments = parser.parse_args()
    problem, force, outputs = rig(arguments.rig)
    figures = json.loads(RESULTS.read_text()) if RESULTS.is_file() else {}
    for Fe in arguments.levels:
        def save(found, Fe=Fe):
            figures[f"{Fe:g}"] = found
            RESULTS.write_text(json.dumps(figures, indent=1) + "\n")
            print(json.dumps(found["rows"][-1]), flush=True)

        level_rows(problem, force, Fe, outputs, save)


if __name__ == "__main__":
    main()
