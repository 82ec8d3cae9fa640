"""The two-blade rig's tuned set against time integration: at the peak and within 50 Hz of it, H = 1, 5 and 9.

    python -m tests.benchmarks.hbm_truth_rig [--minutes 10] [--fresh]

Every H has its own curve; its points at the frequencies are solved on it, and each starts the integration at its own
displacement, velocity and sliders: pairs that stick all through keep their sliders where they are, so that there is a
continuum of steady states, and each orbit has its own. Where a curve passes a frequency several times, the largest
amplitude is taken. Modes above 50 times the excitation follow statically; at the peak the integration is repeated with
150 times. The first output is compared, harmonic 1.

results/truth_rig.json beside this file, with day, versions and code. A run that was cut off, or stopped after
--minutes, goes on where it stopped as long as the code of hbm is the same; with other code it refuses, and --fresh
begins anew.
"""

import argparse
import json
import time

import numpy as np

from hbm.balance.residual import HarmonicBalance
from hbm.continuation.corrector import solve_fixed
from hbm.response import follow_band
from hbm.time.comparison import compare_point
from tests.benchmarks.record import RESULTS, fingerprint, made, one_thread, recorded
from tests.hbm.cases import rig

LEVELS, HARMONICS, BAND = (12.0, 20.0, 40.0), (5, 9, 1), (2300, 3300)
AROUND = (0.0, -50.0, -35.0, -20.0, -10.0, -5.0, 5.0, 10.0, 20.0, 35.0, 50.0)      # Hz from the peak at H = 5
STORE = RESULTS / "truth_rig.json"


def points():
    """(Fe, Hz from the peak, Hz, H, figures) of every point in the store; the first two as text."""
    for Fe, level in (recorded("truth_rig") or {}).get("levels", {}).items():
        for step, at in level.get("rows", {}).items():
            for H in sorted(at, key=int):
                yield Fe, step, level["peak"] + float(step), int(H), at[H]


def comparable(figures) -> bool:
    """Whether the integration became periodic and stayed on the orbit from which it started."""
    return bool(figures.get("periodic") and not figures["left"])


def on_curve(curve, problem, force, hz):
    """(balance, point, passages) of a curve (with contact motion) at a frequency; point None where it has none."""
    at = np.flatnonzero(curve.converged & (np.abs(curve.frequency - hz) < 1e-6))
    if not len(at):
        return None, None, 0
    i = at[curve.amplitude("harmonic")[at, 0].argmax()]
    motion = curve.contact_motion[i].reshape(-1, curve.H + 1)
    x = np.empty((len(motion), 2 * curve.H + 1))
    x[:, 0], x[:, 1::2], x[:, 2::2] = motion[:, 0].real, motion[:, 1:].real, motion[:, 1:].imag
    balance = HarmonicBalance(problem, {1: force}, curve.H, "zero_slider")
    point = solve_fixed(balance.evaluate, x.ravel(), 2 * np.pi * hz, balance.weights)
    return balance, point if point.converged else None, len(at)


def against(balance, point, row, **settings) -> dict:
    """Figures of one point of one H: amplitudes by harmonic balance and by integration from its own orbit."""
    began = time.process_time()
    c = compare_point(balance, point, row[None], tolerance=1e-5, most_periods=500, **settings)
    truth = float(abs(c.steady.harmonics[0, 1]))
    ours = float(abs((row @ (balance.receptance.shapes @ point.detail.modal))[1]))
    return {"balance": ours, "integration": truth, "error": ours / truth - 1, "periodic": bool(c.steady.periodic),
            "left": bool(c.left), "unstable": bool(c.steady.multiplier > 1 + 1e-6), "said": c.said,
            "periods": c.steady.periods, "change": float(c.steady.period_change),
            "seconds": round(time.process_time() - began, 2)}


def at_place(curve, problem, force, hz, row, twice, save):
    """Fill what is to be known of one H at one frequency; `twice`: with more masses too."""
    balance, point, passages = on_curve(curve, problem, force, hz)
    if point is None:
        save({"said": f"no solution: {curve.ended}"})
        return
    found = against(balance, point, row) | {"passages": passages}
    if twice:
        found["masses_to_150"] = against(balance, point, row, massless_above=150.0)
    save(found)


def one_level(case, Fe, level, save, late):
    """Fill level {"peak": Hz, "rows": {Hz from it: {H: figures}}}; False where it became too late."""
    problem, force, outputs = case
    name, row = next(iter(outputs.items()))
    force = Fe * force
    if "peak" not in level:
        level["peak"] = follow_band(problem, force, BAND, harmonics=5, outputs=outputs).peak(name, "harmonic")[0]
    rows = level.setdefault("rows", {f"{step:+g}": {} for step in AROUND})
    for H in HARMONICS:
        missing = [step for step in AROUND if str(H) not in rows[f"{step:+g}"]]
        if not missing:
            continue
        curve = follow_band(problem, force, BAND, harmonics=H, outputs={name: row}, contact=True,
                            at=level["peak"] + np.array(missing))
        for step in missing:
            if late():
                return False
            def put(figures, at=rows[f"{step:+g}"], H=H):
                at[str(H)] = figures
                save()
            at_place(curve, problem, force, level["peak"] + step, row, H == 5 and step == 0, put)
            print(Fe, step, H, rows[f"{step:+g}"][str(H)], flush=True)
    return True


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", type=float, nargs="+", default=LEVELS)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so many, to go on in another call")
    parser.add_argument("--fresh", action="store_true", help="begin anew")
    arguments = parser.parse_args()
    figures = json.loads(STORE.read_text()) if STORE.is_file() and not arguments.fresh else made("truth_rig") | {
        "levels": {}}
    if figures.get("code") != fingerprint("hbm"):
        parser.error(f"{STORE.name} is of other code of hbm; --fresh begins anew")
    began, case = time.monotonic(), rig()
    for Fe in arguments.levels:
        if not one_level(case, Fe, figures["levels"].setdefault(f"{Fe:g}", {}),
                         lambda: STORE.write_text(json.dumps(figures, indent=1) + "\n"),
                         lambda: time.monotonic() - began > 60 * arguments.minutes):
            print("stopped; the next call goes on")
            break


if __name__ == "__main__":
    main()
