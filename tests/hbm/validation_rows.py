"""Rows of the validation pages for the harmonic balance against tables, closed forms and exact orbits.

Each function yields (case, H, ours, reference, relative error, against); references: tests/reference/hbm.
"""

import numpy as np

from hbm import fourier
from hbm.laws import DryFriction2T
from hbm.response import follow_band
from hbm.solutions import solutions_at
from hbm.time.comparison import compare_point
from tests.hbm import test_frictional_beam, test_oscillator
from tests.hbm.cases import MOST_HARMONICS, beam, coupled, den_hartog, jenkins, load, solve, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.hbm.plain_balance import harmonic_one
from tests.hbm.test_sampled import prescribed
from tests.validation import Section, relative

REFINED = 2**18         # samples of the plain computation


def row(case, H, ours, reference, against):
    return case, H, ours, reference, relative(ours, reference), against


def jenkins_rows():
    for case in ("A1", "A2"):
        data = load(case)
        problem, force = jenkins(data["parameters"])
        for known in data["steady_state"]:
            name = f"{case}, Om = {known['Omega']:g}"
            for H, expected in known["HB_X1_by_H"].items():
                ours = abs(solve(problem, force, known["Omega"], int(H))[0][0, 1])
                yield row(name, H, ours, expected, "table at equal H")
            for H in (5, 20):
                ours = abs(solve(problem, force, known["Omega"], H)[0][0, 1])
                yield row(name, H, ours, known["X1"], f"exact orbit, H = {H}")
        peak = data["HB1_peaks"][0]
        band = np.array([0.7, 1.3]) * peak["Omega"] / (2 * np.pi)
        curve = follow_band(problem, force, band, harmonics=1, outputs={"x": [1.0]})
        yield row(f"{case}, peak", 1, curve.peak("x", "harmonic")[1], peak["X"], "closed form")


def den_hartog_rows():
    """Every frequency and decade of the reference, at the least H for which the promise stands and at the most."""
    for known in load("B1")["results"]:
        name = f"B1, Om = {known['Omega']:g}"
        for H in (20, MOST_HARMONICS):
            rows, exponents = den_hartog(known, H)
            for kt, largest, expected in rows:
                yield row(f"{name}, kt/k = {kt:g}", H, largest, expected, f"exact marching, H = {H}")
        exact = np.log10([abs(e / known["X_DenHartog"] - 1) for _, _, e in rows])
        for (kt, *_), ours, marched in zip(rows[1:], exponents, np.diff(exact), strict=True):
            case = f"{name}, exponent of the distance from rigid friction, to {kt:g}"
            yield row(case, MOST_HARMONICS, ours, -0.5, "kt^-1/2")
            yield row(case, MOST_HARMONICS, ours, marched, "exponent of exact marching")


def lift_off_rows():
    for case in ("C1", "C2"):
        data = load(case)
        problem, force = unilateral(data["parameters"])
        omega = [known["Omega"] for known in data["results"]]
        band = np.array([min(omega) - 0.05, max(omega) + 0.05]) / (2 * np.pi)
        for H in (1, 5, 20):
            curve = follow_band(problem, force, band, harmonics=H, outputs={"x": [1.0]},
                                at=np.array(omega) / (2 * np.pi))
            for known in data["results"]:
                found = np.abs(solutions_at(curve, problem, known["Omega"] / (2 * np.pi))[:, 0, 1])
                name = f"{case}, Om = {known['Omega']:g}"
                if H < 20:
                    expected = known["HB_by_H"][str(H)]["X1"]
                    yield row(name, H, _nearest(found, expected), expected, "table at equal H")
                if H > 1:
                    yield row(name, H, _nearest(found, known["X1"]), known["X1"], f"exact orbit, H = {H}")
                if H == 1 and known["Omega"] == 1.15 and case == "C1":
                    every = known["HB01_all_solutions"]
                    yield row(f"{name}, solutions on one curve", H, len(found), len(every), "number of solutions")
                    for s in every:
                        yield row(name, H, _nearest(found, s["X1"]), s["X1"], "closed form")


def _nearest(found, expected):
    return found[np.abs(found - expected).argmin()]


def coupled_rows():
    for case in ("D1", "D2"):
        data = load(case)
        problem, force = coupled(data["parameters"])
        for known in data["results"]:
            exact = np.abs(np.array(known["X1_cos"]) + 1j * np.array(known["X1_sin"]))
            opens = case == "D1" and known["Omega"] == 1.5
            for dof in range(len(exact)):
                name = f"{case}, Om = {known['Omega']:g}, dof {dof + 1}"
                kind = "table at equal H"
                if opens:
                    kind += ", Om = 1.5, " + ("larger" if dof == exact.argmax() else "smaller") + " dof"
                for H, expected in known["HB_by_H"].items():
                    ours = np.abs(solve(problem, force, known["Omega"], int(H))[0][:, 1])
                    yield row(name, H, ours[dof], expected["X1"][dof], kind)
                for H in (5, 20):
                    ours = np.abs(solve(problem, force, known["Omega"], H)[0][:, 1])
                    yield row(name, H, ours[dof], exact[dof], f"exact orbit, H = {H}")
            yield from mean_rows(case, problem, force, known, ", Om = 1.5" if opens else "")
            for H in (1, 3, 5, 9, 20) if opens else ():
                ours = np.abs(solve(problem, force, known["Omega"], H)[0][:, 1])
                coarse, fine = (harmonic_one(data["parameters"], known["Omega"], H, n) for n in (4096, REFINED))
                for dof in range(len(exact)):
                    name = f"{case}, Om = {known['Omega']:g}, dof {dof + 1}"
                    yield row(name, H, ours[dof], fine[dof], f"refined: plain sampling, {REFINED} samples")
                    yield row(f"{name}: plain sampling, not ours", H, coarse[dof], known["HB_by_H"][str(H)]["X1"][dof],
                              "the table is plain sampling at 4096")


def mean_rows(case, problem, force, known, special):
    """Mean positions of every dof, of the largest X1; where nothing slips they are free in a range and left out."""
    if known["state_fraction_stick_slipP_slipM_sep"][0][0] > 1 - 1e-12:
        return
    largest = np.hypot(known["X1_cos"], known["X1_sin"]).max()
    against = [(int(H), table["X0"], f"mean, table at equal H{special}") for H, table in known["HB_by_H"].items()]
    against += [(H, known["X0"], f"mean, exact orbit, H = {H}") for H in ((20, 40) if special else (5, 20))]
    for H, means, kind in against:
        ours = solve(problem, force, known["Omega"], H)[0][:, 0].real
        for dof, (mine, told) in enumerate(zip(ours, means, strict=True), start=1):
            yield f"{case}, Om = {known['Omega']:g}, mean of dof {dof}", H, mine, told, abs(mine - told) / largest, kind


def plane_rows():
    for known in load("E1")["ellipses"]:
        X, Y = complex(known["X"]), known["Y"] * np.exp(1j * known["phi"])
        name = f"E1, {known['X']:g} x {known['Y']:g}, phase {known['phi']:.2f}"
        for n in (64, 256, 1024):
            F = prescribed(X, Y, known["kt"], known["L"], n, H=1)
            for d, key in enumerate(("Tx1", "Ty1")):
                expected = complex(*known["coupled"][key])
                yield (f"{name}, {key}", 1, abs(F[d, 1]), abs(expected), abs(F[d, 1] - expected) / known["L"],
                       f"ODE, per limit force, {n} samples")
            work = np.pi * (F[0, 1] * np.conj(X) + F[1, 1] * np.conj(Y)).imag
            if n == 256:
                yield row(name, 1, work, known["coupled"]["dissipation"], "work per cycle, 256 samples")
        F = prescribed(X, Y, known["kt"], known["L"], 64, law=DryFriction2T())
        work = np.pi * (F[0, 1] * np.conj(X) + F[1, 1] * np.conj(Y)).imag
        yield row(name, 3, work, known["uncoupled"]["dissipation"], "work of two crossed elements")
    yield from rotating_rows()


def rotating_rows():
    """A force that rotates in the plane: the radius of the orbit in closed form."""
    from tests.hbm.test_sampled import rotating
    for known in load("E1")["rotating_force_oscillator"]:
        found = rotating(known)
        exact = min(known["R_exact"], key=lambda R: abs(R - found))
        yield row(f"E1, rotating force, Om = {known['Omega']:g}", 1, found, exact, "exact radius, 256 samples")


def oscillator_rows():
    problem = oscillator()
    for H, (hz, amplitude) in test_oscillator.PEAK.items():
        column = list(test_oscillator.PEAK).index(H)
        for f, known in test_oscillator.TABLE.items():
            ours = abs(solve(problem, FORCE, 2 * np.pi * f, H, start="zero_force")[0][3, 1])
            yield row(f"{f} Hz", H, ours, known[column], "table at equal H")
            if H == 9:
                yield row(f"{f} Hz", H, ours, known[4], "time integration, H = 9")
        found = follow_band(problem, FORCE, (150, 180), harmonics=H, outputs=Y2).peak("y2", "harmonic")
        yield row("peak, Hz", H, found[0], hz, "frequency of the peak (to 0.1 Hz)")
        yield row("peak, m", H, found[1], amplitude, "peak, table at equal H")
    _, point, balance = solve(problem, FORCE, 2 * np.pi * 163, 9, start="zero_force")
    steady = compare_point(balance, point, [Y2["y2"]]).steady
    yield row("163 Hz, our integration", 9, abs(steady.harmonics[0, 1]), test_oscillator.TABLE[163][4],
              "time integration, H = 9")


def beam_rows():
    for (name, level, hz), table in test_frictional_beam.TABLE.items():
        problem, force, outputs = beam(name)
        for H, expected in table.items():
            used = 15 if H == "time" else H
            q = solve(problem, level * force, 2 * np.pi * hz, used)[0]
            yield row(f"{name}, {level} N, {hz} Hz", used, float(fourier.half_peak_to_peak(outputs["tip"] @ q)),
                      expected, "time integration, H = 15" if H == "time" else "table at equal H")
    for name, levels in (("B8", (1, 20, 80)), ("C8", (1, 40, 200))):
        problem, force, outputs = beam(name)
        for level in levels:
            for H in (1, 3, 7):
                curve = follow_band(problem, level * force, (700, 1200), harmonics=H, outputs=outputs)
                solved = float(curve.converged.mean()) * curve.complete
                yield row(f"{name}, {level} N, share of the {len(curve.frequency)} points solved, 700 to 1200 Hz", H,
                          solved, 1.0, "complete curve")


def sample_rows():
    """The largest harmonic, and beside it the largest change of any between 64 and 1024 samples, relative to it."""
    cases = [(case, *build(load(case)["parameters"]), 1.05) for case, build in (("A1", jenkins), ("D1", coupled))]
    cases += [(name, problem, level * force, 2 * np.pi * hz) for name, level, hz in test_frictional_beam.TABLE
              for problem, force, _ in [beam(name)]]
    for case, problem, force, w in cases:
        for H in (1, 3, 7):
            coarse, fine = (solve(problem, force, w, H, samples=n)[0] for n in (64, 1024))
            at = np.unravel_index(np.abs(fine).argmax(), fine.shape)
            change = np.abs(coarse - fine).max() / abs(fine[at])
            yield (f"{case}, Om = {w:.6g}, dof {at[0] + 1}, order {at[1]}", H, abs(coarse[at]), abs(fine[at]),
                   change, "1024 samples, per largest harmonic")


TABLES = {"table at equal H": 5e-6, "exact orbit, H = 5": 5e-4, "exact orbit": 5e-6}
EXACT = TABLES | {"closed form": 1e-9}
SECTIONS = (
    Section("a", "A: one dof with a Jenkins element", "Abs X1. Source: tests/reference/hbm/A1, A2.", jenkins_rows,
            EXACT),
    Section("b", "B: towards rigid friction", "Largest displacement; rigid friction (Den Hartog) is approached as "
            "kt^-1/2. The stiffer the contact, the more the reversals are corners, and the more slowly the harmonics "
            "fall: the promise of 5e-6 at H >= 20 is missed at H = 20, and with the most harmonics that are allowed by "
            "the stiffest contacts. Source: tests/reference/hbm/B1.", den_hartog_rows,
            {"exact marching": 5e-6}),
    Section("c", "C: lift-off and gap", "Abs X1 of the solution on the curve that is nearest. Source: "
            "tests/reference/hbm/C1, C2.", lift_off_rows, EXACT | {"number": 0.0}),
    Section("d", "D: coupled tangential and normal contact", "Abs X1 of each dof. The table was sampled 4096 times; at "
            "Om = 1.5 the pair opens, and it is good to 4e-5 of the larger dof by its own account. Rows 'refined' are "
            "a third, plain computation (tests/hbm/plain_balance.py). Source: tests/reference/hbm/D1, D2.",
            coupled_rows, TABLES | {"table at equal H, Om = 1.5, larger dof": 4e-5,
                                    "table at equal H, Om = 1.5, smaller dof": 1.2e-4, "refined": 2e-6,
                                    "the table is": 1e-12}),
    Section("e", "E: coupled friction in the plane", "Prescribed ellipses: harmonic 1 of the force; and the work of a "
            "cycle. Source: tests/reference/hbm/E1.", plane_rows,
            {"ODE, per limit force, 64": 1e-2, "ODE": 1e-3, "work per cycle": 1e-3, "work of two": 1e-8,
             "exact radius": 1e-3}),
    Section("oscillator", "Planar blade-damper-blade oscillator", "Abs X1 of y2 in m; free damper, static part solved "
            "with the rest. Source: tests/reference/hbm/oscillator.md.", oscillator_rows,
            {"table at equal H": 2e-4, "time integration": 1.5e-3, "frequency": 0.1 / 163, "peak": 5e-4}),
    Section("beam", "Cantilever on eight contacts", "Half of peak to peak of the tip in m, and whether every curve is "
            "complete with default settings. Source: tests/reference/hbm/frictional-beam.md.", beam_rows,
            {"table at equal H": 1e-5, "time integration": 1e-5, "complete": 0.0}),
    Section("samples", "Independence of the samples", "The largest harmonic; the error is the largest change of any "
            "harmonic of any dof when 64 samples become 1024.", sample_rows, {"1024": 1e-6}))
