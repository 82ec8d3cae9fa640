"""docs/validation.md from the numbers of the tests: every case beside its reference.

    OMP_NUM_THREADS=1 PYTHONPATH=. .venv/bin/python tests/validation.py > docs/validation.md

Two minutes. The section on speed and robustness is filled from what tests/benchmarks last wrote.
"""

import json
from pathlib import Path

import numpy as np

from hbm import fourier, march
from hbm.response import follow_band
from tests.hbm import test_frictional_beam, test_oscillator
from tests.hbm.cases import beam, coupled, jenkins, load, solve, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.hbm.test_sampled import prescribed

BENCHMARKS = Path(__file__).parent / "benchmarks" / "results"


def jenkins_rows():
    for case in ("A1", "A2"):
        data = load(case)
        problem, force = jenkins(data["parameters"])
        for row in data["steady_state"]:
            for H, expected in row["HB_X1_by_H"].items():
                ours = abs(solve(problem, force, row["Omega"], int(H))[0][0, 1])
                yield f"{case}, Om = {row['Omega']:g}", H, ours, expected, "table at equal H"
            for H in (5, 31):
                ours = abs(solve(problem, force, row["Omega"], H)[0][0, 1])
                yield f"{case}, Om = {row['Omega']:g}", H, ours, row["X1"], f"exact orbit at H = {H}"
        peak = data["HB1_peaks"][0]
        band = np.array([0.7, 1.3]) * peak["Omega"] / (2 * np.pi)
        curve = follow_band(problem, force, band, harmonics=1, outputs={"x": [1.0]})
        yield f"{case}, peak", 1, curve.peak("x", "harmonic")[1], peak["X"], "closed form"


def den_hartog_rows():
    data = load("B1")
    p, row = data["parameters"], data["results"][3]
    for kt, expected in row["Jenkins_by_kt_over_k"].items():
        settings = dict(m=p["m"], c=p["c"], k=p["k"], kt=float(kt), slip_limit_muN=p["Ff"], F=p["P"])
        H = 181 if kt == "10000.0" else 61
        q = solve(*jenkins(settings), row["Omega"], H)[0]
        yield f"B1, kt/k = {float(kt):g}", H, float(fourier.half_peak_to_peak(q[0])), expected["xmax"], "exact marching"


def lift_off_rows():
    for case in ("C1", "C2"):
        data = load(case)
        problem, force = unilateral(data["parameters"])
        omega = [row["Omega"] for row in data["results"]]
        band = np.array([min(omega) - 0.05, max(omega) + 0.05]) / (2 * np.pi)
        for H in (1, 5, 20):
            curve = follow_band(problem, force, band, harmonics=H, outputs={"x": [1.0]},
                                at=np.array(omega) / (2 * np.pi))
            for row in data["results"]:
                found = np.abs(curve.solutions_at(row["Omega"] / (2 * np.pi))[:, 0, 1])
                name = f"{case}, Om = {row['Omega']:g} ({len(found)} on the curve)"
                if H < 20:
                    expected = row["HB_by_H"][str(H)]["X1"]
                    yield name, H, _nearest(found, expected), expected, "table at equal H"
                if H > 1:
                    yield name, H, _nearest(found, row["X1"]), row["X1"], f"exact orbit at H = {H}"


def _nearest(found, expected):
    return found[np.abs(found - expected).argmin()]


def coupled_rows():
    for case in ("D1", "D2"):
        data = load(case)
        problem, force = coupled(data["parameters"])
        for row in data["results"]:
            exact = np.abs(np.array(row["X1_cos"]) + 1j * np.array(row["X1_sin"]))
            worst = exact.argmax()
            for H, expected in row["HB_by_H"].items():
                ours = np.abs(solve(problem, force, row["Omega"], int(H))[0][:, 1])
                yield (f"{case}, Om = {row['Omega']:g}", H, ours[worst], expected["X1"][worst],
                       "table at equal H" + (" (4e-5 of its own: opens)" if row["Omega"] == 1.5 else ""))
            for H in (5, 40):
                ours = np.abs(solve(problem, force, row["Omega"], H)[0][:, 1])
                yield f"{case}, Om = {row['Omega']:g}", H, ours[worst], exact[worst], f"exact orbit at H = {H}"


def plane_rows():
    for row in load("E1")["ellipses"]:
        X, Y = complex(row["X"]), row["Y"] * np.exp(1j * row["phi"])
        F = prescribed(X, Y, row["kt"], row["L"], 256, H=1)
        work = np.pi * (F[0, 1] * np.conj(X) + F[1, 1] * np.conj(Y)).imag
        name = f"E1, {row['X']:g} x {row['Y']:g}, phase {row['phi']:.2f}"
        yield name, 1, abs(F[0, 1]), abs(complex(*row["coupled"]["Tx1"])), "abs T1, ODE (256 samples)"
        yield name, 1, work, row["coupled"]["dissipation"], "work per cycle, ODE (256 samples)"


def oscillator_rows():
    problem = oscillator()
    for H, (hz, amplitude) in test_oscillator.PEAK.items():
        column = list(test_oscillator.PEAK).index(H)
        for f, row in test_oscillator.TABLE.items():
            ours = abs(solve(problem, FORCE, 2 * np.pi * f, H, start="zero_force")[0][3, 1])
            yield f"{f} Hz", H, ours, row[column], "table at equal H"
            if H == 9:
                yield f"{f} Hz", H, ours, row[4], "time integration"
        found = follow_band(problem, FORCE, (150, 180), harmonics=H, outputs=Y2).peak("y2", "harmonic")
        yield "peak, Hz", H, found[0], hz, "table at equal H (to 0.1 Hz)"
        yield "peak, m", H, found[1], amplitude, "table at equal H"
    _, point, balance = solve(problem, FORCE, 2 * np.pi * 163, 9, start="zero_force")
    steady, _ = march.compare(balance, point, [Y2["y2"]], steps=4096)
    yield "163 Hz, our integration", 9, abs(steady.harmonics[0, 1]), test_oscillator.TABLE[163][4], "time integration"


def beam_rows():
    for (name, level, hz), table in test_frictional_beam.TABLE.items():
        problem, force, outputs = beam(name)
        for H, expected in table.items():
            used = 15 if H == "time" else H
            q = solve(problem, level * force, 2 * np.pi * hz, used)[0]
            yield (f"{name}, {level} N, {hz} Hz", used, float(fourier.half_peak_to_peak(outputs["tip"] @ q)), expected,
                   "time integration" if H == "time" else "table at equal H")


SECTIONS = (
    ("A: one dof with a Jenkins element", "Abs X1. Source: tests/reference/hbm/A1, A2.", jenkins_rows),
    ("B: towards rigid friction", "Largest displacement. Den Hartog's rigid friction is approached as kt^-1/2. "
     "Source: tests/reference/hbm/B1.", den_hartog_rows),
    ("C: lift-off and gap", "Abs X1 of the solution on the curve that is nearest. "
     "Source: tests/reference/hbm/C1, C2.", lift_off_rows),
    ("D: coupled tangential and normal contact", "Abs X1 of the dof that moves most. The table rows at Om = 1.5 were "
     "sampled and are good to 4e-5 by their own account (on the other dof ours differ by 1e-4 of its smaller value); "
     "ours meet the exact orbit at H = 40. Source: tests/reference/hbm/D1, D2.", coupled_rows),
    ("E: coupled friction in the plane", "Prescribed ellipses. Source: tests/reference/hbm/E1.", plane_rows),
    ("Planar blade-damper-blade oscillator", "Abs X1 of y2 in m; free damper, static part solved with the rest. "
     "Source: tests/reference/hbm/oscillator.md.", oscillator_rows),
    ("Cantilever on eight contacts", "Half of peak to peak of the tip in m. "
     "Source: tests/reference/hbm/frictional-beam.md.", beam_rows))


def error(ours, reference):
    return abs(ours - reference) / max(abs(reference), 1e-300)


def section(title, text, rows):
    """(markdown of a section, its worst row for each kind of reference)."""
    rows = list(rows())
    lines = [f"## {title}", "", text, "", "| case | H | ours | reference | error | against |",
             "|---|---|---|---|---|---|"]
    lines += [f"| {name} | {H} | {ours:.9g} | {reference:.9g} | {error(ours, reference):.1e} | {kind} |"
              for name, H, ours, reference, kind in rows]
    worst = {}
    for row in rows:
        if row[4] not in worst or error(*row[2:4]) > error(*worst[row[4]][2:4]):
            worst[row[4]] = row
    return "\n".join(lines) + "\n", [(title, *row) for row in worst.values()]


def speed():
    path = BENCHMARKS / "speed.json"
    if not path.exists():
        return "Not measured: run tests/benchmarks/hbm_speed.py.\n"
    found = json.loads(path.read_text())
    lines = [f"{found['processor']}; {found['versions']}; one thread, CPU time, {found['date']}. The machine was "
             "shared: ratios within one run say more than milliseconds.", "",
             "| case | H | ms a point | residual calls a point | points | complete | pyHarm-os, ms a point | ratio |",
             "|---|---|---|---|---|---|---|---|"]
    for r in found["rows"]:
        peer = (f"{r['peer_ms']:.1f}", f"{r['peer_ms'] / r['ms']:.0f}") if r.get("peer_ms") else ("", "")
        lines.append(f"| {r['case']} | {r['H']} | {r['ms']:.2f} | {r['calls']:.2f} | {r['points']} | {r['complete']} | "
                     f"{peer[0]} | {peer[1]} |")
    lines += ["", *(f"- {line}" for line in found["notes"])]
    return "\n".join(lines) + "\n"


def robustness():
    path = BENCHMARKS / "robustness.json"
    if not path.exists():
        return "Not measured: run tests/benchmarks/hbm_robustness.py.\n"
    r = json.loads(path.read_text())
    lines = [f"{r['complete']} of {r['count']} random oscillators are complete from 60 to 300 Hz with default "
             f"settings, {r['one_branch']} of them as one branch; {r['residual_calls_per_point']:.2f} residual calls a "
             f"point over {r['points']} points. The others:", ""]
    lines += [f"- {text}" for text in r["incomplete"] + r["leaps"]]
    if r["checked"]:
        settled = [c for c in r["checked"] if c[2] is not None]
        stayed = [c for c in settled if c[3] < 3e-2]
        agree = [c for c in stayed if c[3] <= 5e-3]
        lines += ["", f"{len(r['checked'])} points of the first {r['checked'][-1][0] + 1} oscillators "
                  f"drawn at random. {len(settled)} settle below H = 80 (harmonic 1 "
                  "changes by less than 0.25 % when H doubles). From the orbit, time integration stays within 3 % at "
                  f"{len(stayed)} of these; {len(agree)} of them agree to 0.5 %. Where it leaves, the orbit is "
                  "unstable or another is near: such points, and those that disagree, follow (oscillator, Hz, H, "
                  "difference).", ""]
        lines += [f"- {c[0]}, {c[1]:.2f} Hz, {c[2]}, {c[3]:.1%}" for c in settled if c[3] > 5e-3]
    return "\n".join(lines) + "\n"


def main():
    parts, worst = [], []
    for title, text, rows in SECTIONS:
        markdown, worst_rows = section(title, text, rows)
        parts.append(markdown)
        worst += worst_rows
    print("# Validation of the harmonic balance\n\nMade by `tests/validation.py` from the cases of the tests; not "
          "edited by hand. Every number is computed when this page is made; references and their sources are in "
          "`tests/reference/hbm`.\n\n## The worst row of each\n\n| section | case | H | error | against |\n"
          "|---|---|---|---|---|")
    for title, name, H, ours, reference, kind in worst:
        print(f"| {title} | {name} | {H} | {error(ours, reference):.1e} | {kind} |")
    print("\n" + "\n".join(parts) + "\n## Robustness\n\n" + robustness() + "\n## Speed\n\n" + speed(), end="")


if __name__ == "__main__":
    main()
