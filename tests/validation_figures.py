"""Pages of the benchmarks for docs/validation, from what tests/benchmarks last wrote into results/.

A page whose benchmark has not been run says so. What is promised stands beside each figure; the promises themselves are
in tests/validation_targets.py.
"""

from tests import validation_code
from tests.benchmarks.record import RUNS, recorded

STORES = {"speed": "speed", "rig": "rig", "damping": "rig", "robustness": "robustness", "cost_floor": "cost_floor",
          "growth": "growth"}
"""{page: store of its figures}"""

BACK = "[All sections](../validation.md)"


def table(heads, rows) -> list[str]:
    return ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads),
            *("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows), ""]


def page(title, name, script, text, body) -> str:
    """Markdown of a page: where its figures come from, then body(figures) where there are any."""
    found = recorded(name)
    if not found:
        return f"# {title}\n\nNot measured: run `{script}`. {BACK}\n"
    when = validation_code.described(found)
    lines = [f"# {title}", "", f"{text} Made by `{script}`. {BACK}", "", f"Measured {when}.", "",
             *validation_code.warning(when, RUNS[name], validation_code.now())]
    return "\n".join([*lines, *body(found)]).rstrip() + "\n"


def pages() -> dict:
    """{name of a page: markdown}."""
    return {"speed": speed(), "rig": rig(), "damping": damping(), "robustness": robustness(),
            "cost_floor": cost_floor(), "growth": growth()}


def speed() -> str:
    def body(found):
        rows = [(r["case"], r["H"], r.get("dofs", ""), r.get("moving", ""), f"{r['ms']:.2f}", f"{r['calls']:.2f}",
                 r["points"], _yes(r["complete"])) for r in found["rows"]]
        lines = table(("case", "H", "dofs", "pairs that slip or open at the peak", "ms a point",
                       "residual calls a point", "points", "complete"), rows)
        peers = [r for r in found["rows"] if r.get("peer_ms")]
        lines += ["## Beside pyHarm-os", ""]
        if not peers:
            return [*lines, "Not measured: the run was made without it."]
        name = peers[0].get("peer", "pyHarm-os, version not noted")
        lines += [f"{name} on the same matrices, its 128 samples a period, in a process and a venv of its own in the "
                  "same run. *apart*: relative difference of the two amplitudes of the tip, harmonic 1, at the "
                  "frequency where the peer's curve is highest; more than 1e-3 stops the benchmark.", ""]
        heads = ("case", "H", "ms a point here", "ms a point there", "times faster", "points there", "apart")
        return lines + table(heads, [
            (r["case"], r["H"], f"{r['ms']:.2f}", f"{r['peer_ms']:.1f}", f"{r['peer_ms'] / r['ms']:.0f}",
             r["peer_points"], f"{r['apart']:.1e} at {r['apart_hz']:.1f} Hz") for r in peers])
    return page("Speed", "speed", "python -m tests.benchmarks.hbm_speed", "CPU time on one thread, of a machine that "
                "may be shared: ratios within one run say more than milliseconds. For the growth exactly 8 pairs, "
                "or one in eight, slip or open at every point, or the run stops.", body)


def rig() -> str:
    def body(found):
        heads = ("Fe, N", "H", "complete", "points", "residual calls a point", "ms a point", "peak, Hz", "peak, m")

        def rows(these):
            return [(*((r["case"],) if "case" in r else ()), r["Fe"], r["H"], _yes(r["complete"]), r["points"],
                     f"{r['calls']:.2f}", f"{r['ms']:.2f}", f"{r['peak'][0]:.2f}", f"{r['peak'][1]:.5g}")
                    for r in these]

        lines = []
        for roll, title in ((True, "With the flat's roll stiffness"), (False, "Without it")):
            these = [r for r in found["rows"] if r["roll"] == roll]
            lines += [f"## {title}", "", *table(heads, rows(these))]
            lines += [f"- {r['Fe']} N, H = {r['H']}: {r['ended']}" for r in these if not r["complete"]] + [""]
        lines += ["## Cantilever on eight contacts", ""]
        beams = found.get("beam", [])
        return lines + (table(("beam", *heads), rows(beams)) if beams else ["Not measured."])
    return page("Curves of the two-blade rig and of the beam", "rig", "python -m tests.benchmarks.hbm_rig", "Tuned set "
                "of 18 pairs, 2300 to 3300 Hz, and the frictional beam, 700 to 1200 Hz, with default settings. Peak: "
                "harmonic 1 of the first output, refined.", body)


def damping() -> str:
    def body(found):
        these = found.get("damping", [])
        if not these:
            return ["Not measured."]
        first = these[0]
        return table(("damping", "ms a point", "times the first", "residual calls a point", "points", "complete",
                      "peak, m"),
                     [(r["case"], f"{r['ms']:.2f}", f"{r['ms'] / first['ms']:.1f}", f"{r['calls']:.2f}", r["points"],
                       _yes(r["complete"]), f"{r['peak'][1]:.7g}") for r in these])
    return page("A general damping matrix", "rig", "python -m tests.benchmarks.hbm_rig", "The rig's tuned set at 20 N, "
                "H = 5, 651 modes. As a matrix the modal damping must give the same curve; one that couples the modes "
                "needs the complex modes.", body)


def robustness() -> str:
    def body(r):
        lines = [f"{r['complete']} of {r['count']} random oscillators are complete from 60 to 300 Hz with default "
                 f"settings; {r['one_branch']} of {r['count']} as one branch; where a branch was left, the widest gap "
                 f"between solved points is {r['widest_gap_hz']:.3g} Hz. "
                 f"{r['residual_calls_per_point']:.2f} residual calls a point over the {r['points']} points of all "
                 "curves, the incomplete ones among them.", ""]
        curves = r.get("curves", [])
        if curves:
            each = sorted(c["calls"] / c["points"] for c in curves)
            lines += [f"By curve: median {each[len(each) // 2]:.2f} calls a point, most {each[-1]:.2f}; median "
                      f"{sorted(c['points'] for c in curves)[len(curves) // 2]} points, most "
                      f"{max(c['points'] for c in curves)}.", ""]
        return [*lines, "## Not complete", "", *_bullets(r["incomplete"]), "", "## Complete, but not one branch", "",
                *_bullets(r["leaps"])]
    return page("Robustness", "robustness", "python -m tests.benchmarks.hbm_robustness", "Oscillators drawn with a "
                "seed: mu 0.1 to 0.8, kn and kt 1e5 to 1e8 N/m, excitation 0.05 to 5, H 1 to 9.", body)


def cost_floor() -> str:
    def body(r):
        rows = [(f"the way: {k}", f"{t:.2f}") for k, t in r["way"].items()]
        rows += [(f"the floor: {k}", f"{t:.2f}") for k, t in r["floor"].items()]
        return [f"{r['dofs']} dofs, {r['master_dofs']} master dofs, {r['modes']} modes: **{r['ratio']:.2f} times the "
                f"floor** (asked: at most 1.3); {r['ratio_without_bound']:.2f} without the bound of the reduction "
                f"error. Largest memory {r['peak_GiB']:.2f} GiB.", "", *table(("part", "CPU s"), rows)]
    return page("Cost floor of assembly, reduction and preload", "cost_floor", "python -m tests.benchmarks.cost_floor",
                "Three bodies, 62 pairs. The floor: one factorisation of K_II a body, one LDL' at the top shift, the "
                "back-solves of all master dofs, the modes; measured in the same run.", body)


def growth() -> str:
    def body(found):
        rows = found["rows"]
        parts = ("assembly", "factor", "count", "modes", "error_bound", "reduction")
        return table(("dofs", *(f"{p.replace('_', ' ')}, CPU s" for p in parts), "entries of the factor",
                      "largest memory, GiB", "foretold, GiB"),
                     [(r["dofs"], *(f"{r[p]:.2f}" for p in parts), f"{r['fill']:.3g}", f"{r['peak_GiB']:.2f}",
                       f"{r['predicted_GiB']:.2f}") for r in rows])
    return page("Growth of factor and modes with size", "growth", "python -m tests.benchmarks.growth", "One body of "
                "8-node hexahedra, 62 masters, 20 modes, a process for each size.", body)


def _bullets(texts):
    return [f"- {t}" for t in texts] or ["- none"]


def _yes(flag):
    return "yes" if flag else "**no**"
