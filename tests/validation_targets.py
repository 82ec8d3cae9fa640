"""Everything that was promised of hbm and of the statics, one row each: what is asked, what was measured, whether held.

A row takes its figure from the pages of rows or from results/ of tests/benchmarks; without either it says "not
measured". A promise that is missed says why where that is known; no limit is loosened for it.
"""

from dataclasses import dataclass, replace

from tests.benchmarks import hbm_truth_rig
from tests.benchmarks.hbm_truth_robustness import stored, summary
from tests.benchmarks.record import recorded
from tests.hbm.cases import MOST_HARMONICS

NOT_MEASURED = "not measured"
TABLE_IS_OFF = "the table is off by as much, see below"
CORNERS = "stiffer contacts turn the reversals into corners, whose harmonics fall as slowly as those of rigid friction"
NOTHING_HOLDS = ("nothing restrains a mean motion", "the damper rolls", "rigid-body drift")


@dataclass(frozen=True)
class Target:
    """what, asked : the promise; measured : the figure; held : True, False, or None where nothing was asked or
    measured; page : keys of its pages, the first is linked; why : the reason of a miss; note : behind yes or no
    """

    what: str
    asked: str
    measured: str
    held: bool | None
    page: str
    why: str = ""
    note: str = ""


def rows_against(keys, against, exactly=False):
    """Rows of some pages against some kind of reference."""
    from tests.validation import read_page
    return [row for key in keys.split() for row in (read_page(key) or ("", []))[1]
            if (row[5] == against if exactly else row[5].startswith(against))]


def worst(keys, against, exactly=False):
    """(error, case, H) of the worst of these rows; None where there is none."""
    rows = rows_against(keys, against, exactly)
    bad = [row for row in rows if row[4] == "nan"]
    return max(((float(row[4]), row[0], row[1]) for row in bad or rows), default=None)


def accuracy(what, asked, keys, against, limit, exactly=False, why="") -> Target:
    found = worst(keys, against, exactly)
    if found is None:
        return Target(what, asked, NOT_MEASURED, None, keys)
    error, case, H = found
    held = None if limit is None else bool(error <= limit)
    measured = f"{error:.1e} ({case}{f', H = {H}' if H else ''})"
    if held is False:
        rows = rows_against(keys, against, exactly)
        measured += f"; {sum(float(row[4]) <= limit for row in rows)} of {len(rows)} rows are within"
    return Target(what, asked, measured, held, keys, why)


def figure(what, asked, value, bound, page, layout=".3g", unit="", least=False) -> Target:
    """A benchmark's figure against its bound; value None: not measured; bound None: reported."""
    if bound is not None:
        asked = f"at {'least' if least else 'most'} {asked}"
    if value is None:
        return Target(what, asked, NOT_MEASURED, None, page)
    held = None if bound is None else bool(value >= bound if least else value <= bound)
    return Target(what, asked, f"{value:{layout}}{unit}", held, page)


def hbm() -> list[Target]:
    return [*reference_targets(), *rig_targets(), *robustness_targets(), *speed_targets()]


def reference_targets():
    tables = "table at equal H"
    yield accuracy("A, C, D: tables at equal H", "5e-6", "a c d", tables, 5e-6, exactly=True)
    yield accuracy("D1 at Om = 1.5: table, dof that moves more", "4e-5", "d", f"{tables}, Om = 1.5, larger", 4e-5)
    yield accuracy("D1 at Om = 1.5: table, the other dof", "4e-5", "d", f"{tables}, Om = 1.5, smaller", 4e-5,
                   why=TABLE_IS_OFF)
    yield accuracy("D: mean positions, table at equal H, of the largest X1", "5e-6", "d", f"mean, {tables}", 5e-6,
                   exactly=True)
    yield accuracy("D1 at Om = 1.5: mean positions, table at equal H", "4e-5", "d", "mean, table at equal H, Om = 1.5",
                   4e-5, why=TABLE_IS_OFF)
    yield accuracy("D: exact mean positions, H = 20, of the largest X1", "5e-6", "d", "mean, exact orbit, H = 20", 5e-6)
    yield accuracy("D1 at Om = 1.5: exact mean positions, H = 40", "5e-6", "d", "mean, exact orbit, H = 40", 5e-6)
    yield accuracy("closed forms", "1e-9", "a c", "closed form", 1e-9)
    yield accuracy("exact orbits, H = 20", "5e-6", "a c d", "exact orbit, H = 20", 5e-6)
    for H in (20, MOST_HARMONICS):
        yield accuracy(f"B1, every frequency and decade of kt/k: exact marching, H = {H}", "5e-6", "b",
                       f"exact marching, H = {H}", 5e-6, exactly=True, why=CORNERS)
    yield accuracy("exact orbits, H = 5", "0.05 %", "a c d", "exact orbit, H = 5", 5e-4)
    yield accuracy("C1 at Om = 1.15: solutions on one curve", "three", "c", "number of solutions", 0.0)
    yield accuracy("B1 falls as kt^-1/2: error of the exponent", "to be reported", "b", "kt^-1/2", None)
    yield accuracy("E1, coupled friction, 256 samples, of the limit force", "1e-3", "e",
                   "ODE, per limit force, 256", 1e-3)
    yield accuracy("change between 64 and 1024 samples, of the largest harmonic", "1e-6", "samples", "1024", 1e-6)
    yield accuracy("planar oscillator: tables, H = 1, 3, 5, 9", "0.02 %", "oscillator", tables, 2e-4)
    yield accuracy("planar oscillator: time integration, H = 9", "0.15 %", "oscillator", "time integration", 1.5e-3)
    yield accuracy("planar oscillator: amplitude of the peaks", "0.05 %", "oscillator", "peak", 5e-4)
    yield accuracy("planar oscillator: frequency of the peaks", "0.1 Hz of 163", "oscillator", "frequency", 0.1 / 163)
    yield accuracy("frictional beam: tables at equal H", "1e-5", "beam", tables, 1e-5)
    yield accuracy("frictional beam: share of points that failed, any curve", "none", "beam", "complete curve", 0.0)
    yield accuracy("light contact nodes in time integration, C1 and D1", "stated", "contact_nodes", "exact orbit", None)


def rig_targets():
    rows = (recorded("rig") or {}).get("rows", ())
    for roll, label in ((True, "with roll stiffness: complete"),
                        (False, "without: complete, or what nothing holds is said")):
        these = [r for r in rows if r["roll"] == roll]
        good = [r for r in these if r["complete"] or (not roll and any(words in r["ended"] for words in NOTHING_HOLDS))]
        said = sum(not r["complete"] for r in good)
        yield Target(f"rig's curves {label}", f"all {len(these) or 24}", f"{len(good)} of {len(these)}" + (
            f", {said} of them by saying so" if said else "") if these else NOT_MEASURED,
            len(good) == len(these) if these else None, "rig")
    for Fe in (12, 20):
        for kind, H, asked, limit in (("at the peak", 5, "0.3 %", 3e-3), ("within 50 Hz of it", 5, "1.5 %", 1.5e-2),
                                      ("at the peak", 9, "0.5 %", 5e-3), ("within 50 Hz of it", 9, "0.5 %", 5e-3)):
            yield rig_truth(Fe, H, kind, asked, limit)
    for Fe, H in ((12, 1), (20, 1), (40, 1), (40, 5), (40, 9)):
        yield rig_truth(Fe, H, "at the peak", "to be reported", None)


def rig_truth(Fe, H, kind, asked, limit) -> Target:
    """The worst of the points that can be compared, and how many these are of all that are asked for."""
    found = accuracy(f"rig against time integration, {Fe} N, H = {H}, {kind}", asked, "rig_truth",
                     f"time integration {kind}, {Fe} N, H = {H}", limit, exactly=True)
    asked_for = 1 if kind == "at the peak" else len(hbm_truth_rig.AROUND) - 1
    these = [figures for level, step, _, harmonics, figures in hbm_truth_rig.points()
             if (float(level), harmonics) == (Fe, H) and (float(step) == 0) == (kind == "at the peak")]
    compared = sum(map(hbm_truth_rig.comparable, these))
    if not these:
        return found
    return replace(found, measured=f"{found.measured}; {compared} of {asked_for} points compared",
                   note="" if compared == asked_for or found.held is None else ", of those compared")


def robustness_targets():
    r = recorded("robustness")
    yield figure("random oscillators complete, of 200", "198", r and r["complete"], 198, "robustness", least=True)
    yield figure("of these one branch from end to end", "to be reported", r and r["one_branch"], None, "robustness")
    yield figure("widest gap between solved points where a branch was left", "to be reported",
                 r and r.get("widest_gap_hz"), None, "robustness", unit=" Hz")
    header, rows = stored()
    if header is None:
        yield Target("5 % of their points against time integration", "0.5 %", NOT_MEASURED, None, "robustness_truth")
        return
    s = summary(rows)
    for kind in ("stable", "unstable"):
        n, agree = s["states"][kind], s["agree"][kind]
        why = f"of the others {s['agree_with_more'][kind]} agree with more harmonics"
        yield Target(f"5 % of their points against time integration: {kind} orbits within 0.5 %", f"all {n}",
                     f"{agree} of {n} compared, worst {s['worst'][kind] or 0:.1e}; {n - agree} not in agreement, "
                     "listed", agree == n, "robustness_truth", why)
    rest = {k: v for k, v in s["states"].items() if k not in ("stable", "unstable")}
    yield Target("the points that could not be compared", "listed", f"{sum(rest.values())} of {s['points']} drawn: "
                 + ", ".join(f"{v} {k if k != 'left' else 'left for another orbit'}" for k, v in rest.items()), None,
                 "robustness_truth")
    yield figure("oscillators whose points were drawn", "200", s["oscillators"], 200, "robustness_truth", least=True)


def speed_targets():
    found = recorded("speed") or {}
    rows = {(r["case"], r["H"]): r for r in found.get("rows", ())}

    def ratio(case):
        r = rows.get((case, 7), {})
        return r["peer_ms"] / r["ms"] if r.get("peer_ms") else None

    def ms(case):
        return rows.get((case, 7), {}).get("ms")

    rig = recorded("rig") or {}
    forty = next((r["ms"] for r in rig.get("rows", ()) if r["roll"] and (r["Fe"], r["H"]) == (40, 5)), None)
    yield figure("B8, H = 7: times faster than pyHarm-os", "10", ratio("B8, 20 N"), 10, "speed", least=True)
    yield figure("the same with 32 contacts", "20", ratio("B8 with 32 contacts, 20 N"), 20, "speed", least=True)
    for level in (40, 200):
        yield figure(f"C8, {level} N, H = 7", "6 ms a point", ms(f"C8, {level} N"), 6, "speed", unit=" ms")
    yield figure("rig, H = 5, mean of 1, 6, 10, 12 and 20 N", "5 ms a point", rig.get("mean_ms_H5"), 5, "rig",
                 unit=" ms")
    yield figure("rig, H = 5, 40 N", "20 ms a point", forty, 20, "rig", unit=" ms")
    curves = [*rows.values(), *rig.get("rows", ()), *rig.get("beam", ())]
    ended = [r["calls"] for r in curves if not r.get("complete", True)]
    yield figure("residual calls a point, most of the curves of beam and rig that reach the end", "3",
                 max((r["calls"] for r in curves if r.get("complete", True)), default=None), 3, "rig")
    yield figure("most of those that end where the damper rolls", "to be reported", max(ended, default=None), None,
                 "rig")
    yield figure("points of a curve, most of these", "300", max((r["points"] for r in curves), default=None), 300,
                 "rig", layout="d")
    r = recorded("robustness")
    yield figure("residual calls a point over all random oscillators", "3", r and r["residual_calls_per_point"], 3,
                 "robustness")
    sizes = found.get("growth_held_sizes", [8, 256])
    yield figure(f"exponent of the time per point, {sizes[0]} to {sizes[-1]} contacts, 8 slip, 1-D", "1.3",
                 found.get("growth_held"), 1.3, "speed")
    sizes = found.get("growth_eighth_sizes", [8, 128])
    yield figure(f"the same with one in eight slipping, 3-D, {sizes[0]} to {sizes[-1]}", "to be reported",
                 found.get("growth_eighth"), None, "speed")
    yield figure(f"{found.get('memory_contacts', 256)} contacts in 3-D, H = 7", "1 GiB", found.get("memory_GiB"), 1,
                 "speed", unit=" GiB")
    yield figure("first curve in a fresh process, kernels compiled before", "3 s", found.get("first_curve_warm_s"), 3,
                 "speed", unit=" s")
    yield figure("the same with nothing compiled", "30 s", found.get("first_curve_cold_s"), 30, "speed", unit=" s")
    these = rig.get("damping", ())
    yield figure("rig with a damping matrix that couples the modes: times the modal one", "to be reported",
                 these[-1]["ms"] / these[0]["ms"] if these else None, None, "damping")


def statics() -> list[Target]:
    return [*static_accuracy(), *static_cost()]


def static_accuracy():
    yield accuracy("ten stiffness cases, in their tolerances", "1", "stiffness", "case", 1.0)
    yield accuracy("limits of the punch, cylinder and sharp flat, continuous", "1e-6", "contact_laws", "limit", 1e-6)
    yield accuracy("dP/d(delta) = K(a)", "1e-10", "contact_laws", "slope", 1e-10)
    yield accuracy("rectangles, length/width 1 to 5000", "1e-5", "contact_laws", "boundary elements", 1e-5)
    yield accuracy("F1, F2: forces", "1e-8", "f", "closed form", 1e-8)
    yield accuracy("F1, F2: same detached set", "same", "f", "detached set", 0.0)
    yield accuracy("G1", "1e-8", "reduction", "table", 1e-8)
    yield accuracy("G1: bound of the reduction error falls short by", "never", "reduction", "bound", 1e-10)
    yield accuracy("rig, every stuck mode below 5 kHz: the bound falls short by", "never", "stuck_bound", "bound", 0.0)
    yield accuracy("H1: frequencies and tuning", "1e-6", "h", "table", 1e-6)
    yield accuracy("5 000 random beams: same set", "all", "random_beams", "detached set", 0.0)
    yield accuracy("5 000 random beams: forces", "1e-8", "random_beams", "Macaulay", 1e-8)
    r = recorded("random_bodies")
    yield Target("modes missed in 500 random bodies", "none", f"{r['missed']} in {r['bodies']}" if r else NOT_MEASURED,
                 r["missed"] == 0 and r["bodies"] >= 500 if r else None, "missed")
    yield accuracy("Hertz: peak and half width, 16 elements and more", "0.5 %", "hertz", "Hertz, 16", 5e-3)
    yield accuracy("NAFEMS FV32", "0.1 %", "fv32", "published", 1e-3, exactly=True)
    yield accuracy("NAFEMS FV52 on hard supports: exact solution (Graff), three-dimensional", "0.1 %", "fv52", "exact",
                   1e-3, exactly=True)
    yield accuracy("NAFEMS FV52 on its lower edges, as published: the mode in the plane, 193.59 Hz", "0.1 %", "fv52",
                   "published, lower edges, in the plane", 1e-3, exactly=True)
    for support in ("hard", "faces", "lower edges"):
        yield accuracy(f"NAFEMS FV52, support: {support}; the other published values", "to be reported", "fv52",
                       f"published, {support}", None, exactly=True)
    yield accuracy("CalculiX, same mesh: modes", "1e-6", "calculix_modes", "CalculiX", 1e-6)
    yield accuracy("CalculiX, same mesh: preload, of the pull", "1e-4", "calculix_preload", "CalculiX", 1e-4)
    yield accuracy("CalculiX, same mesh: detached set", "same", "calculix_preload", "detached set", 0.0)
    yield accuracy("1, 2 and 4 ranks: preloads and frequencies", "1e-9", "mpi_ranks", "one rank", 1e-9)


def static_cost():
    p, m = recorded("calculix") or {}, recorded("calculix_modes") or {}
    size = f"{p['dofs']} dofs" if p else "100k dofs"
    yield figure(f"preload, {size}: times faster than CalculiX", "4",
                 p["ccx_s"] / (p["prepared_s"] + p["each_s"]) if p else None, 4, "calculix_preload", least=True)
    yield figure("each further load case", "20 ms", 1e3 * p["each_s"] if p else None, 20, "calculix_preload",
                 unit=" ms")
    size = f"{m['dofs']} dofs" if m else "100k dofs"
    yield figure(f"20 modes, {size}: times faster than CalculiX", "5", m.get("ratio"), 5, "calculix_modes", least=True)
    c = recorded("cost_floor") or {}
    yield figure("assembly, reduction and preload, of their floor", "1.3 times", c.get("ratio"), 1.3, "cost_floor",
                 unit=" times")
    g = (recorded("growth") or {}).get("rows", ())
    largest = max(g, key=lambda r: r["dofs"], default=None)
    if largest is None or largest["dofs"] < 290_000:
        reached = f" (only up to {largest['dofs']} dofs)" if largest else ""
        yield Target("300k dofs: largest memory", "8 GiB", NOT_MEASURED + reached, None, "growth")
    else:
        yield figure(f"{largest['dofs']} dofs: largest memory", "8 GiB", largest["peak_GiB"], 8, "growth", unit=" GiB")


def lines(targets, marks=()) -> list[str]:
    """Markdown table of targets; what is not held is bold and says so. marks : {page: what to say of its code}"""
    said = {True: "yes", False: "**NO**", None: ""}
    out = ["| target | asked | measured | held | code |", "|---|---|---|---|---|"]
    for t in targets:
        missing = t.measured.startswith(NOT_MEASURED)
        measured = f"**{t.measured}**" if t.held is False or missing else t.measured
        code = "" if missing else ", ".join(sorted({dict(marks).get(key, "") for key in t.page.split()} - {""}))
        link = f"[{t.what}](validation/{t.page.split()[0]}.md)"
        out.append(f"| {link} | {t.asked} | {measured} | {said[t.held]}{t.note} | {code} |")
    return [*out, ""]


def short(targets) -> list[str]:
    """A line for each target that is missed or was not measured."""
    missed = [f"- **missed**: {t.what}: {t.measured}; asked: {t.asked}{f' ({t.why})' if t.why else ''}"
              for t in targets if t.held is False]
    return missed + [f"- {t.measured}: {t.what}; asked: {t.asked}" for t in targets if
                     t.measured.startswith(NOT_MEASURED)]
