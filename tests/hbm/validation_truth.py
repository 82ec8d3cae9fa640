"""Rows of the validation pages for the time integration, and for the harmonic balance against it.

Each function yields (case, H, ours, reference, relative error, against); references: tests/reference/hbm. The rig and
the random oscillators are what tests/benchmarks/hbm_truth_rig.py and hbm_truth_robustness.py last wrote.
"""

import numpy as np

from hbm.time import shooting
from hbm.time.comparison import compare_point
from hbm.time.exact import March
from tests.benchmarks import hbm_truth_rig
from tests.benchmarks.hbm_truth_robustness import AGREES, COUNT, STATES, stored, summary
from tests.hbm import test_oscillator
from tests.hbm.cases import coupled, jenkins, load, solve, unilateral
from tests.hbm.contact_nodes import with_node
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.validation import Section, relative

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
            found = compare_point(balance, point, [Y2["y2"]])
            truth = abs(found.steady.harmonics[0, 1])
            if found.agrees or H == 1:
                yield row(f"{hz} Hz", H, abs(q[3, 1]), truth, f"our time integration, H = {H}")
        yield row(f"{hz} Hz, our integration", "", truth, published[4], "published time integration")


def rig_rows():
    """The rig's tuned set, harmonic 1 of the first output, where the integration is periodic and stayed."""
    for Fe, step, hz, H, found in hbm_truth_rig.points():
        if hbm_truth_rig.comparable(found):
            kind = "at the peak" if float(step) == 0 else "within 50 Hz of it"
            unstable = ", unstable" if found["unstable"] else ""
            yield (f"{Fe} N, {hz:.2f} Hz ({step}{unstable})", H, found["balance"], found["integration"],
                   abs(found["error"]), f"time integration {kind}, {Fe} N, H = {H}")


def rig_notes():
    """The points that could not be compared, in a table of their own; the repetition with more masses."""
    points = list(hbm_truth_rig.points())
    rows = [f"| {Fe} N | {hz:.2f} Hz ({step}) | {H} | " + (f"{found['error']:+.1e}" if "error" in found else "")
            + f" | {found['said']} |" for Fe, step, hz, H, found in points
            if not hbm_truth_rig.comparable(found)]
    lines = [f"{len(points)} points, {len(rows)} of them not comparable: the integration did not become periodic, left "
             "for another orbit, or there is no solution. The difference beside them is that at the end of the "
             "integration and no error." if rows else f"{len(points)} points, all comparable.", ""]
    if rows:
        lines += ["| level | frequency (from the peak) | H | difference | what was found |", "|---|---|---|---|---|",
                  *rows, ""]
    masses = [f"{Fe} N {found['masses_to_150']['error']:+.2e} instead of {found['error']:+.2e}"
              for Fe, _, _, _, found in points if "masses_to_150" in found]
    return "\n".join([*lines, "With masses up to 150 times the excitation instead of 50, at the peak, H = 5: "
                      + ("; ".join(masses) or "not measured") + "."])


def oscillator_points(state):
    return [r for r in stored()[1] if r["state"] == state]


def robustness_rows():
    """The worst point of every oscillator, on stable and on unstable orbits apart, and the share that agrees."""
    for kind in ("stable", "unstable"):
        found = oscillator_points(kind)
        for i in sorted({r["oscillator"] for r in found}):
            mine = [r for r in found if r["oscillator"] == i]
            r = max(mine, key=lambda r: r["difference"])
            yield (f"oscillator {i}, {r['hz']:.2f} Hz, worst of {len(mine)}", r["H"], "", "", r["difference"],
                   f"time integration, {kind} orbits")


def robustness_notes():
    """How many points are in which state, and every miss with the H at which it is none."""
    header, rows = stored()
    if header is None:
        return "Not measured: run tests/benchmarks/hbm_truth_robustness.py."
    s = summary(rows)
    lines = [f"{s['points']} points of {s['oscillators']} oscillators of {COUNT}; code {header['code']}.", "",
             "| state of the integration | points | within 0.5 % | only with more harmonics | worst |",
             "|---|---|---|---|---|"]
    for state, text in STATES.items():
        figures = ("", "", "")
        if state in s["agree"]:
            figures = s["agree"][state], s["agree_with_more"][state], f"{s['worst'][state] or 0:.1e}"
        lines.append(f"| {text} | {s['states'][state]} | " + " | ".join(map(str, figures)) + " |")
    missed = [r for k in ("stable", "unstable") for r in oscillator_points(k) if r["difference"] > AGREES]
    lines += ["", "Points that differ by more than 0.5 % at the H that the rule finds. *again*: the next H that the "
              "rule passes too and that agrees: the smaller one only looked sufficient, as a doubling from an odd H to "
              "an even one may add nothing.", "",
              "| oscillator | Hz | orbit | H | difference | again at H | difference |", "|---|---|---|---|---|---|---|"]
    lines += [f"| {r['oscillator']} | {r['hz']:.2f} | {r['state']} | {r['H']} | {r['difference']:.1e} | "
              + (f"{r['H_again']} | {r['difference_again']:.1e} |" if r["H_again"] else "none | |") for r in missed]
    others = {k: [f"{r['oscillator']}: {r['hz']:.2f}" for r in oscillator_points(k)] for k in STATES
              if k not in ("stable", "unstable")}
    for k, found in others.items():
        lines += ["", f"**{k}** (oscillator: Hz): " + (", ".join(found) or "none") + "."]
    return "\n".join(lines)


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
            "Harmonic 1 of the first output in m, from the orbit of each H, at frequencies counted from the peak at "
            "H = 5. Made by tests/benchmarks/hbm_truth_rig.py.", rig_rows,
            {f"time integration {kind}, {Fe} N, H = {H}": allowed for Fe in (12, 20) for kind, H, allowed in (
                ("at the peak", 5, 3e-3), ("within 50 Hz of it", 5, 1.5e-2), ("at the peak", 9, 5e-3),
                ("within 50 Hz of it", 9, 5e-3))}, "truth_rig", rig_notes),
    Section("robustness_truth", "Random oscillators against time integration",
            "5 % of the points of the curves of the [robustness](robustness.md) page. Relative difference of abs X1 of "
            "y2 at the smallest H whose doubling changes it by less than 0.25 %, from its orbit. Made by "
            "tests/benchmarks/hbm_truth_robustness.py, which writes every point.", robustness_rows,
            {"time integration, stable": AGREES, "time integration, unstable": AGREES}, "truth_robustness",
            robustness_notes))
