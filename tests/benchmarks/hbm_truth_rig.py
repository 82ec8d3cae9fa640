"""The two-blade rig's tuned set against time integration: at the peak and within 50 Hz of it, H = 1, 5 and 9.

    tipdamp run docs/studies/two_blade_rig/asymmetric.toml --out RIG
    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/benchmarks/hbm_truth_rig.py RIG [--levels 12 20 40]

Every point starts the integration at its own displacement, velocity and sliders: pairs that stick all through keep
their sliders where they are, so that there is a continuum of steady states, and each orbit has its own. H = 1 at the
peak only. Modes above 50 times the excitation follow statically; at the peak the integration is repeated with 150
times. The first output is compared, harmonic 1. The figures go to results/truth_rig.json beside this file; what is
there is not computed again.
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


def against(problem, force, outputs, balance, point, **settings):
    """Figures of one point of one H: amplitudes by harmonic balance and by integration from its own orbit."""
    if not point.converged:
        return {"said": "the harmonic balance did not converge"}
    rows, began = np.array(list(outputs.values())), time.process_time()
    c = compare(balance, point, rows, tolerance=1e-5, most_periods=500, **settings)
    truth = abs(c.steady.harmonics[0, 1])
    ours = abs((rows @ (balance.receptance.shapes @ point.detail.modal))[0, 1])
    return {"balance": ours, "integration": truth, "error": ours / truth - 1, "periodic": c.steady.periodic,
            "left": c.left, "said": c.said, "periods": c.steady.periods, "change": c.steady.period_change,
            "seconds": time.process_time() - began}


def level(problem, force, Fe, outputs, rows, save):
    """Fill rows {place: {H or 'masses to 150': figures}} of a level, those that are not there."""
    curve = follow_band(problem, Fe * force, (2300, 3300), harmonics=5, outputs=outputs, contact=True)
    peak, _ = curve.peak(curve.output_names[0], "harmonic")
    for H in (5, 9, 1):
        for step in (0.0, *AROUND) if H != 1 else (0.0,):
            row = rows.setdefault(f"{step:+g} Hz", {"hz": peak + step})
            if str(H) in row:
                continue
            middle, point = point_on(curve, problem, Fe * force, peak + step)
            balance, point = (middle, point) if H == 5 else solve(
                problem, Fe * force, point.parameter, H, point.x, 5)
            row[str(H)] = against(problem, Fe * force, outputs, balance, point)
            if H == 5 and step == 0:
                row["5, masses to 150"] = against(problem, Fe * force, outputs, balance, point, massless_above=150.0)
            print(Fe, step, H, row[str(H)], flush=True)
            save()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("rig", type=Path)
    parser.add_argument("--levels", type=float, nargs="+", default=[12.0, 20.0, 40.0])
    arguments = parser.parse_args()
    problem, force, outputs = rig(arguments.rig)
    figures = json.loads(RESULTS.read_text()) if RESULTS.is_file() else {}
    for Fe in arguments.levels:
        rows = figures.setdefault(f"{Fe:g}", {})
        level(problem, force, Fe, outputs, rows, lambda: RESULTS.write_text(json.dumps(figures, indent=1) + "\n"))


if __name__ == "__main__":
    main()
