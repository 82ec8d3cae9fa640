"""Tables of the report, as plain text: the page escapes and sets them."""

from dataclasses import dataclass

import numpy as np

from tipdamp.report.results import Results
from tipdamp.report.summary import versions
from tipdamp.report.text import NOTHING, deviation, hertz, listing, micro, names_of_pairs, number, percent

_LINE = {"edge": "the lower edge line stands for them in the line model", "all": "all in the line model"}
SETS = {"full_area": "whole area", "full_line": "whole line", "tuned": "kept stations"}


@dataclass(frozen=True)
class Table:
    """columns (c,), rows of c texts; `left` - columns of words, set flush left, the others flush right."""

    caption: str
    columns: tuple
    rows: tuple
    left: tuple = (0,)


def key_figures(results: Results) -> Table:
    """What was computed beside the reference values of the study."""
    reference, rows = results.study.reference, []

    def add(what, value, key):
        given = reference.get(key)
        rows.append((what, hertz(value), hertz(given), deviation(value, given)))

    free = results["reduce"]["free_hz"]
    for name, hz in free.items():
        add(f"without damper, {name.replace('_', ' ')} (Hz)", hz, f"{name}_hz")
    if not free:
        add("without damper, lowest mode (Hz)", results["reduce"]["free_modes_hz"][0], "")
    if "tune" in results:
        stuck, kept = results["tune"]["stuck_hz"], results["tune"]["tuned_pairs"]
        table = results.whole
        rows_of = {s: len(np.unique(table.row[table.side == s])) for s in table.sides}
        detail = listing(f"{n} row{'s' * (n > 1)} on '{s}'" for s, n in rows_of.items())
        add(f"stuck, whole area: {detail} (Hz)", stuck["full_area"], "full_area_hz")
        add("stuck, whole line (Hz)", stuck["full_line"], "full_line_hz")
        target = results["tune"]["target_hz"]
        add(f"stuck, tuned to {target:g} Hz (Hz)" if target else "stuck, the given stations (Hz)", stuck["tuned"],
            "tuned_hz")
        for end in ("front", "back"):
            given = reference.get(end)
            rows.append((f"kept stations, {end}", f"{kept[end]}", NOTHING if given is None else f"{given:g}",
                         NOTHING if given is None else _change(kept[end] - given)))
    return Table("Key figures beside the reference values of the study.",
                 ("", "computed", "reference", "deviation"), tuple(rows))


def _change(count) -> str:
    return f"{count:+g}".replace("-", "\N{MINUS SIGN}") if count else "0"


def peaks(results: Results) -> Table:
    rows = []
    for case in results.cases:
        facts, back = case.facts, case.facts.get("back")
        per_newton = None if facts["peak_m"] is None else facts["peak_m"] / case.Fe
        rows.append((f"{case.H}", f"{case.Fe:g}", hertz(facts["peak_hz"]), micro(facts["peak_m"]),
                     micro(facts["min_peak_m"]), micro(per_newton), f"{facts['points']}",
                     f"{facts['failed_points']}" + ("" if facts["complete"] else ", incomplete"),
                     _other_way(facts, back), names_of_pairs(facts["slipping_pairs"])))
    kept = int(results.kept.carrying.sum()) if results.kept is not None else None
    caption = ("Peaks of blade 1, half of peak-to-peak along the force: largest and smallest over the nodes of the "
               "patch. From the other end: relative change of the peak when the band is followed the other way. "
               "Slipping or opening pairs are named by side and station" + (f", {kept} are kept." if kept else "."))
    return Table(caption, ("H", "Fe (N)", "peak (Hz)", "largest (µm)", "smallest (µm)", "largest per force (µm/N)",
                           "points", "failed", "from the other end", "slipping pairs"), tuple(rows), left=(9,))


def _other_way(facts, back) -> str:
    if not back:
        return "not followed"
    if back["peak_m"] is None or facts["peak_m"] is None:
        return "no peak"
    return number(abs(back["peak_m"] / facts["peak_m"] - 1), 1)


def load_cases(results: Results) -> Table:
    """Side forces of the pull and of every further load case."""
    def side(facts):
        return number(facts["sum_N"]), number(facts["max_N"]), f"{facts['detached']}"

    found = results["preload"]
    names = results.whole.sides
    case = results.study.preload.case
    rest = (f"the response's ({case})", "") if case else ("the pull", f"{results.study.driver.pull:g}")
    rows = [(*rest, *(t for n in names for t in side(found["sides"][n])))]
    for case, facts in found["cases"].items():
        given = results.study.loads[case]
        pull = results.study.driver.pull if given.pull is None else given.pull
        rows.append((f"{case}: {_of_case(given)}", f"{pull:g}", *(t for n in names for t in side(facts["sides"][n]))))
    columns = ("load case", "pull (N)", *(f"{what}" for n in names for what in (f"'{n}', sum (N)", "largest (N)",
                                                                                 "open")))
    return Table("Preload of the whole patch under every load case: sum and largest of the nodes of each side, and "
                 "the number of open ones.", columns, tuple(rows))


def _of_case(given) -> str:
    """What a load case holds beside the pull."""
    parts = [f"{given.speed:g} rad/s"] if given.speed else []
    if any(given.gravity):
        parts.append(f"gravity ({', '.join(f'{v:g}' for v in given.gravity)}) m/s²")
    for key, rows in (("forces", given.forces), ("pressure", given.pressure), ("traction", given.traction)):
        parts += [f"{key} on {body}, '{group}'" for body, group, *_ in rows]
    return listing(parts) or "another pull"


def assumptions(results: Results) -> Table:
    """What the study declares: not computed, and worth knowing."""
    rows = [*_load(results), *_contact(results)]
    if "tune" in results:
        rows += _tuning(results)
    if "respond" in results.study:
        rows += _response(results)
    return Table("Declared in the study, or fixed by the method.", ("", "value"), tuple(rows), left=(0, 1))


def _load(results):
    study, drive = results.study, results.study.driver
    yield "pull Fc", f"{drive.pull:g} N along ({', '.join(f'{v:g}' for v in drive.pull_direction)})"
    places = results["reduce"].get("pull_positions_m")
    if places:
        shares = ", ".join(f"{s:g}" for s in drive.shares) if drive.shares else "equal shares"
        where = listing(f"{1e3 * v:.1f}" for v in places)
        yield "pull acts at", f"{where} mm along the axis, {shares}"
    if "material" in study:
        m = study.material
        yield "material", f"E = {m.E / 1e9:g} GPa, nu = {m.nu:g}, density {m.density:g} kg/m³"


def _contact(results):
    study, table = results.study, results.whole
    if table is not None:
        mu = np.unique(table.mu)
        yield "friction coefficient mu", f"{mu[0]:g}" if len(mu) == 1 else f"{mu[0]:g} to {mu[-1]:g}"
    for side, (kn, kt) in results["preload"]["kn_kt_N_per_m"].items():
        said = dict(study.sides[side]) if side in study.sides else {}
        rows = results["reduce"]["rows"][side]
        kept = f", {_LINE[said['rows']]}" if rows > 1 and said else ""
        yield (f"side '{side}'", f"{said.get('shape', 'given pairs')}; kn = {kn / 1e6:.3g}, kt = {kt / 1e6:.3g} N/µm "
               f"per node, {_origin(results, side)}; {rows} row{'s' * (rows > 1)} in the patch{kept}"
               + ("; initial gap given along the axis" if said.get("gap") else ""))


def _origin(results, side) -> str:
    """Where the stiffness of a side comes from: the table of pairs, given, or the model with what it was made from."""
    made = results["preload"].get("stiffness", {}).get(side)
    if not made:
        return f"from {results.study.contact.pairs}"
    if made["model"] == "given":
        return "given"
    theory = {"halfspace_3d": "smooth half-spaces", "plane_depth": "plane strain", "rough_series": "half-spaces in "
              "series with a rough interface"}[made["model"]]
    parts = [f"{theory} ({made['model']})",
             f"{made['kind']} at {number(made['load_N'])} N on {1e3 * made['length_m']:g} mm",
             f"half-width of contact {micro(made['half_width_m'])} µm",
             f"E* = {number(made['E_star_Pa'] / 1e9)} GPa",
             f"kt along {made['kt_along_N_per_m'] / 1e6:.3g}, across {made['kt_across_N_per_m'] / 1e6:.3g} N/µm"]
    if made["depth_m"]:
        parts.append(f"depths {listing(f'{1e3 * d:g}' for d in made['depth_m'])} mm")
    if made["h_rms_m"]:
        parts.append(f"h_rms {micro(made['h_rms_m'])} µm, gamma {made['gamma']:g}")
    if made["scale"] != 1:
        parts.append(f"times {made['scale']:g}")
    if made["shares"] == "tributary":
        parts.append("shared by tributary area (mean)")
    return ", ".join(parts)


def _tuning(results):
    tune, settings = results["tune"], results.study.tune
    yield ("roll stiffness of the kept edge lines",
           f"{number(tune['roll_stiffness_Nm_per_rad'], 3)} N m/rad, for the rows that the line model leaves out")
    carried = tune["redistribution"]
    if settings.preload == "scaled":
        scale = ", ".join(f"{k:.3f} on side '{s}'" for s, k in carried["scale"].items())
        yield "preload of the kept stations", f"scaled to the whole pull: {scale}"
        yield ("moment taken up in the reference state",
               f"{number(carried['moment_Nm'], 3)} N m about the damper's axis: each station's force is moved to "
               "its kept row")
    else:
        yield "preload of the kept stations", "static contact solved again on them"
    for name, load in carried.get("reactions", {}).items():
        yield "load taken up in the reference state", f"{number(load, 3)} along '{name}'"


def _response(results):
    settings, free = results.study.respond, results.study.free
    zetas = listing(f"{z:g}" for z in settings.damping_ratio)
    yield "damping ratio of the stuck modes", zetas + (" (one value for all)" if len(settings.damping_ratio) == 1
                                                       else " (from the lowest mode)")
    yield "damping ratio without damper", listing(f"{z:g}" for z in free.damping_ratio)
    if results.cases:
        one = results.cases[0].facts
        origin = {"preloaded": "the preloaded state", "unloaded": "the unloaded state"}[one["origin"]]
        start = {"zero_slider": "unstrained in the preloaded state", "zero_force": "without force at the first instant"}
        yield "displacements count from", origin
        yield "sliders start", start.get(one["start"], one["start"])
    yield "harmonics", f"orders 0 to H, H = {listing(settings.harmonics)}"
    yield ("contact law", "Coulomb friction with two tangents and elastic springs, variable normal load, "
           "slip and lift-off")


def reduction(results: Results) -> Table:
    """Stuck frequencies of the reduced model beside those of the full one."""
    checks = results["tune"]["full_model_check"]
    columns, cells = ["mode"], []
    for name, check in checks.items():
        columns += [f"{SETS.get(name, name)}, reduced (Hz)", "full (Hz)", "error", "bound"]
        bounds = check.get("error_bound") or [None] * len(check["full_hz"])
        cells.append([(hertz(a), hertz(b), percent(a / b - 1, 3), NOTHING if c is None else percent(c, 3))
                      for a, b, c in zip(check["reduced_hz"], check["full_hz"], bounds, strict=True)])
    rows = [(f"{i + 1}", *(text for column in cells for text in (column[i] if i < len(column) else ("",) * 4)))
            for i in range(max(map(len, cells)))]
    worst = max(check["largest_error"] for check in checks.values())
    r = results["reduce"]["reduction"]
    return Table(f"Stuck frequencies of the reduced model ({r['masters']} contact and response dofs, "
                 f"{sum(r['modes'].values())} fixed-interface modes) beside the full finite-element model "
                 f"({r['dofs']} dofs), up to 5 kHz; largest error {100 * worst:.3f} %. The bound, which the error "
                 "cannot pass, comes from the reduction alone.", tuple(columns), tuple(rows), left=())


def bodies(results: Results) -> Table:
    """What the meshes or matrices hold."""
    rows = []
    for name, body in results["inspect"]["bodies"].items():
        if body.get("nodes") is None:
            rows.append((name, "matrices", NOTHING, f"{body['dofs']}", NOTHING, NOTHING))
            continue
        cells = listing(f"{n} {kind}" for kind, n in body["cells"].items())
        rows.append((name, f"{body['file']}: {cells}", f"{body['nodes']}", f"{body['free_dofs']}",
                     number(body["moving_mass_kg"][0]), f"{body['rigid_modes']}"))
    pairs = listing(f"{n} on '{side}'" for side, n in results["inspect"]["pairs"].items())
    return Table(f"Bodies as read. Contact pairs of the whole patch: {pairs}.",
                 ("body", "from", "nodes", "free dofs", "moving mass (kg)", "rigid modes"), tuple(rows), left=(0, 1))


def stages(results: Results) -> Table:
    from tipdamp.stages import STAGES

    rows = [(name, STAGES[name], f"{seconds:.1f}") for name, seconds in results.seconds.items()]
    total = sum(results.seconds.values())
    return Table(f"Stages before this report, {total:.1f} s in all.", ("stage", "what it does", "seconds"), tuple(rows),
                 left=(0, 1))


def software() -> Table:
    found = versions()
    return Table("Versions.", tuple(found), (tuple(found.values()),), left=tuple(range(len(found))))
