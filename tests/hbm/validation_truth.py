"""Rows of the validation pages for the time integration, and for the harmonic balance against it.

Each function yields (case, H, ours, reference, relative error, against); references: tests/reference/hbm. The rig and
the random oscillators are what tests/benchmarks/hbm_truth_rig.py and hbm_truth_robustness.py last wrote.
"""

import json
from pathlib import Path

import numpy as np

from hbm import shooting
from hbm.comparison import compare
from hbm.march import March
from tests.benchmarks.hbm_truth_robustness import summary
from tests.hbm import test_oscillator
from tests.hbm.cases import coupled, jenkins, load, solve, unilateral
from tests.hbm.contact_nodes import with_node
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.validation import Section, relative

RESULTS = Path(__file__).parents[1] / "benchmarks" / "results"
CASES = (("A1", jenkins), ("A2", jenkins), ("C1", unilateral), ("C2", unilateral), ("D1", coupled), ("D2", coupled))


def row(case, H, ours, reference, against):
    return case, H, ours, reference, relative(ours, reference), against


def steady(problem, force, omega, H=9, **settings):
    """Abs X1 of every dof by shooting from the harmonic balance."""
    q, point, balance = solve(problem, force, omega, H)
    march = March(balance, omega, **settings)
    found = shooting.shoot(march, march.on_orbit(point), np.eye(len(q)))
    assert found.periodic
    return np.abs(found.harmonics[:, 1])


def orbit_rows():
    """Time integration against the exact orbits of A, C and D; C1 at 1.15 has three and is left to its own test."""
    for case, build in CASES:
        data = load(case)
        problem, force = build(data["parameters"])
        for known in data.get("results", data.get("steady_state")):
            if (case, known["Omega"]) == ("C1", 1.15):
                continue
            exact = np.atleast_1d(known["X1"])
            i = exact.argmax()
            name = f"{case}, Om = {known['Omega']:g}"
            yield row(name, "", steady(problem, force, known["Omega"])[i], exact[i], "exact orbit, tolerance 1e-7")
            for steps in (32, 128):
                ours = steady(problem, force, known["Omega"], tolerance=0, steps=steps)[i]
                yield row(name, "", ours, exact[i], f"exact orbit, {steps} equal steps")


def node_rows():
    """C1 and D1 with a contact node of a millionth of the mass, whose modes follow statically."""
    for case, build, omegas in (("C1", unilateral, (1.2, 1.25, 1.3)), ("D1", coupled, (0.9, 1.0, 1.2, 1.5))):
        data = load(case)
        problem, force = build(data["parameters"])
        node = with_node(problem, 1e-6)
        for omega in omegas:
            exact = np.atleast_1d(next(r for r in data["results"] if r["Omega"] == omega)["X1"])
            i = exact.argmax()
            ours = steady(node, np.r_[force, np.zeros(len(node.K) - len(problem.K))], omega, 20)[i]
            yield row(f"{case} with a light contact node, Om = {omega:g}", "", ours, exact[i],
                      "exact orbit, node without mass")


def oscillator_rows():
    """The harmonic balance against our integration from its orbit, and that against the published one."""
    for hz, published in test_oscillator.TABLE.items():
        for H in (1, 3, 5, 9, 31):
            q, point, balance = solve(oscillator(), FORCE, 2 * np.pi * hz, H, start="zero_force")
            found = compare(balance, point, [Y2["y2"]])
            truth = abs(found.steady.harmonics[0, 1])
            if found.agrees or H == 1:
                yield row(f"{hz} Hz", H, abs(q[3, 1]), truth, f"our time integration, H = {H}")
        yield row(f"{hz} Hz, our integration", "", truth, published[4], "published time integration")


def rig_rows():
    """The rig's tuned set, harmonic 1 of the first output: errors as stored."""
    for Fe, rows in _stored("truth_rig.json", {}).items():
        for step, at in rows.items():
            kind = "at the peak" if step == "+0 Hz" else "within 50 Hz of it"
            for H in ("1", "5", "9"):
                found = at.get(H, {})
                if "error" not in found or found["left"]:
                    continue
                state = "" if found["periodic"] else f", change of a period {found['change']:.0e}"
                yield (f"{Fe} N, {at['hz']:.2f} Hz ({step} from the peak{state})", int(H), found["balance"],
                       found["integration"], abs(found["error"]), f"time integration {kind}, {Fe} N, H = {H}")


def robustness_rows():
    """The random oscillators, point by point where the integration stayed on the orbit."""
    file = RESULTS / "truth_robustness.jsonl"
    stored = [json.loads(line) for line in file.read_text().splitlines()] if file.is_file() else []
    for r in stored:
        if r["H"] and r["periodic"] and not r["left"]:
            yield (f"oscillator {r['oscillator']}, {r['hz']:.2f} Hz", r["H"], "", "", r["difference"],
                   "time integration where it stayed, settled H")
    if stored:
        s = summary(stored)
        share = s["agree"] / s["stayed"]
        yield (f"share of the {s['stayed']} points where it stayed that agree to 0.5 %", "", share, 1.0, 1 - share,
               "all agree")


def _stored(name, otherwise):
    file = RESULTS / name
    return json.loads(file.read_text()) if file.is_file() else otherwise


SECTIONS = (
    Section("integration", "Time integration against exact orbits",
            "Abs X1 of the dof that moves most, by shooting. Fourth order in the step through stick, slip, lift-off "
            "and contact. Contact nodes are taken without mass: modes above 50 times the excitation follow statically, "
            "as far as springs other than the contacts' hold them. Source: tests/reference/hbm/A1 to D2.", orbit_rows,
            {"exact orbit, tolerance": 5e-6, "exact orbit, 128": 5e-6}),
    Section("contact_nodes", "Light contact nodes in time integration",
            "Abs X1. C1 and D1 with a node of a millionth of the mass between body and contact, on springs three times "
            "as stiff; both in series are those of the reference, so that its exact orbit is the answer. With the mass "
            "kept, the node chatters and the period map does not repeat.", node_rows, {"exact orbit": 1e-5}),
    Section("oscillator_truth", "Planar oscillator: harmonic balance against our time integration",
            "Abs X1 of y2 in m, from the orbit of each H.", oscillator_rows,
            {"our time integration, H = 9": 1.5e-3, "published": 1.5e-3}),
    Section("rig_truth", "The rig's tuned set against time integration",
            "Harmonic 1 of the first output in m, as tests/benchmarks/hbm_truth_rig.py found it.", rig_rows,
            {f"time integration {kind}, {Fe} N, H = {H}": allowed for Fe in (12, 20) for kind, H, allowed in (
                ("at the peak", 5, 3e-3), ("within 50 Hz of it", 5, 1.5e-2), ("at the peak", 9, 5e-3),
                ("within 50 Hz of it", 9, 5e-3))}),
    Section("robustness_truth", "Random oscillators against time integration",
            "Relative difference of abs X1 of y2 at the smallest H whose doubling changes it by less than 0.25 %, as "
            "tests/benchmarks/hbm_truth_robustness.py found it. Points where the integration left the orbit or is not "
            "periodic are in the file that it wrote.", robustness_rows, {"time integration where it stayed": 5e-3}))
