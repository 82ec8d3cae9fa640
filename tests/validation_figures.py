"""Tables of speed and robustness for the validation pages, from what tests/benchmarks last wrote."""

import json
from pathlib import Path

RESULTS = Path(__file__).parent / "benchmarks" / "results"
# case and H -> (column, largest value allowed, unit), of the benchmark table
ALLOWED = {("B8, 20 N", 7): ("ratio", 10, "times faster than pyHarm-os"),
           ("B8 with 32 contacts, all free to slip, 20 N", 7): ("ratio", 20, "times faster than pyHarm-os"),
           ("C8, 40 N", 7): ("ms", 6, "ms a point"), ("C8, 200 N", 7): ("ms", 6, "ms a point")}


def read(name):
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def pages() -> dict:
    """{name of a page: markdown}."""
    return {"speed": speed(), "robustness": robustness()}


def front():
    """(missed promises, section) of the front page: one line per figure that has a target, and the notes."""
    rows = [*speed_figures(), *robustness_figures()]
    lines = ["## Speed and robustness", "", "[Speed](validation/speed.md), [robustness](validation/robustness.md): all "
             "figures. Benchmarks run by hand; CPU time on one thread.", "", "| what | measured | asked | when |",
             "|---|---|---|---|"]
    lines += [f"| {what} | {value} | {asked if met else f'**{asked}**'} | {when} |" for what, value, asked, met, when
              in rows]
    missed = [f"- {what}: {value}, asked {asked}" for what, value, asked, met, _ in rows if not met]
    return missed, "\n".join(lines) + "\n"


def speed_figures():
    """(what, value, asked, met, when) of the speeds that have a target, then of the notes."""
    found = read("speed") or {"rows": (), "notes": ()}
    when = found.get("date", "")
    for r in found["rows"]:
        column, bound, unit = ALLOWED.get((r["case"], r["H"]), ("", 0, ""))
        if column == "ms":
            yield f"{r['case']}, H = {r['H']}", f"{r['ms']:.3g} {unit}", f"at most {bound}", r["ms"] <= bound, when
        elif column == "ratio" and r.get("peer_ms"):
            ratio = r["peer_ms"] / r["ms"]
            yield f"{r['case']}, H = {r['H']}", f"{ratio:.3g} {unit}", f"at least {bound}", ratio >= bound, when
    if found["rows"]:
        most = max(found["rows"], key=lambda r: r["calls"])
        yield (f"residual calls a point, most of all curves ({most['case']}, H = {most['H']})", f"{most['calls']:.2f}",
               "at most 3", most["calls"] <= 3, when)
    for note in found["notes"]:
        what, value = note.rsplit(":", 1)
        yield what, value.strip(), "", True, when


def robustness_figures():
    r = read("robustness")
    if r:
        yield (f"random oscillators complete, of {r['count']}", r["complete"], "at least 198", r["complete"] >= 198,
               r.get("date", ""))


def speed() -> str:
    found = read("speed")
    if not found:
        return "# Speed\n\nNot measured: run tests/benchmarks/hbm_speed.py.\n"
    lines = ["# Speed", "", f"{found['processor']}; {found['versions']}; one thread, CPU time, {found['date']}. The "
             "machine was shared: ratios within one run say more than milliseconds. Made by "
             "tests/benchmarks/hbm_speed.py. [All sections](../validation.md)", "",
             "| case | H | ms a point | residual calls a point | points | complete | pyHarm-os, ms a point | ratio |",
             "|---|---|---|---|---|---|---|---|"]
    for r in found["rows"]:
        peer = (f"{r['peer_ms']:.1f}", f"{r['peer_ms'] / r['ms']:.0f}") if r.get("peer_ms") else ("", "")
        lines.append(f"| {r['case']} | {r['H']} | {r['ms']:.2f} | {r['calls']:.2f} | {r['points']} | {r['complete']} | "
                     f"{peer[0]} | {peer[1]} |")
    lines += ["", *(f"- {line}" for line in found["notes"])]
    return "\n".join(lines) + "\n"


def robustness() -> str:
    r = read("robustness")
    if not r:
        return "# Robustness\n\nNot measured: run tests/benchmarks/hbm_robustness.py.\n"
    lines = ["# Robustness", "", f"{r['complete']} of {r['count']} random oscillators are complete from 60 to 300 Hz "
             f"with default settings, {r['one_branch']} of them as one branch; {r['residual_calls_per_point']:.2f} "
             f"residual calls a point over {r['points']} points. Made by tests/benchmarks/hbm_robustness.py. "
             "[All sections](../validation.md)", "", "The others:", ""]
    lines += [f"- {text}" for text in r["incomplete"] + r["leaps"]]
    if r["checked"]:
        settled = [c for c in r["checked"] if c[2] is not None]
        stayed = [c for c in settled if c[3] < 3e-2]
        agree = [c for c in stayed if c[3] <= 5e-3]
        lines += ["", f"{len(r['checked'])} points of the first {r['checked'][-1][0] + 1} oscillators drawn at random. "
                  f"{len(settled)} settle below H = 80 (harmonic 1 changes by less than 0.25 % when H doubles). From "
                  f"the orbit, time integration stays within 3 % at {len(stayed)} of these; {len(agree)} of them agree "
                  "to 0.5 %. Where it leaves, the orbit is unstable or another is near: such points, and those that "
                  "disagree, follow.", "", "| oscillator | Hz | H | difference |", "|---|---|---|---|"]
        lines += [f"| {c[0]} | {c[1]:.2f} | {c[2]} | {c[3]:.1%} |" for c in settled if c[3] > 5e-3]
    return "\n".join(lines) + "\n"
