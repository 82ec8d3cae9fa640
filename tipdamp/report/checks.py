"""Warnings: what a reader must know before trusting the figures, each as one sentence."""

import math

from tipdamp.free_modes import tracking_warnings
from tipdamp.report.results import Results
from tipdamp.report.text import names_of_pairs, number, sentence
from tipdamp.sanity_checks import expectations
from tipdamp.stages.results import InspectResult, TuneResult

REDUCTION = 1e-3          # largest error of a stuck frequency of the reduced model
REFERENCE = 0.03          # deviation from a reference frequency that is worth a word
TARGET = 0.0125           # about half of what one pair is worth near the target [Zucca 2016, section 8: 35 of 2800 Hz]
BALANCE = 1e-6            # contact forces against the pull
STUCK_CURVE = 1e-6        # curve without slip against the linear response
STUCK_PEAK = 0.003        # its peak against the stuck frequency
BOTH_WAYS = 1e-3          # peaks of the two ways through the band
SMALL_MOMENT = 1e-6       # N m


def warnings_of(results: Results) -> list[str]:
    """Sentences in the order of the stages; empty when there is nothing to say."""
    found = []
    for stage, check in _CHECKS.items():
        if stage in results:
            found += check(results)
    return found


def _inspect(results):
    for name, body in results["inspect"]["bodies"].items():
        if body.get("not_read"):
            yield f"Of the mesh of the {name} was not read: {', '.join(map(str, body['not_read']))}."
    yield from map(sentence, [*results["inspect"].get("warnings", ()),
                              *expectations(results.study, InspectResult.model_validate(results["inspect"]))])


def _reduce(results):
    reference = results.study.reference
    for name, hz in results["reduce"]["free_hz"].items():
        yield from _off_reference(f"The free {name.replace('_', '-')} frequency", hz, reference.get(f"{name}_hz"))
    yield from map(sentence, results["reduce"].get("warnings", ()))


def _preload(results):
    yield from map(sentence, results["preload"].get("warnings", ()))
    yield from _balance("the preload of the whole patch", results["preload"]["sides"])
    if results["preload"]["residual"] > BALANCE:
        yield f"The static contact is solved to a residual of {results['preload']['residual']:.1e} only."


def _tune(results):
    tune, reference = results["tune"], results.study.reference
    for name, label in (("full_area", "on the whole area"), ("full_line", "on the whole line"),
                        ("tuned", "on the kept stations")):
        yield from _off_reference(f"The stuck frequency {label}", tune["stuck_hz"][name], reference.get(f"{name}_hz"))
    yield from map(sentence, tracking_warnings(results.study, TuneResult.model_validate(tune)))
    kept = tune["tuned_pairs"]
    if {"front", "back"} <= set(reference) and (kept["front"], kept["back"]) != (reference["front"], reference["back"]):
        yield (f"Tuning keeps {kept['front']} + {kept['back']} stations, the reference is "
               f"{reference['front']:g} + {reference['back']:g}.")
    target = tune["target_hz"]
    if target and abs(tune["stuck_hz"]["tuned"] / target - 1) > TARGET:
        yield (f"The stuck frequency on the kept stations misses the target of {target:g} Hz by "
               f"{100 * (tune['stuck_hz']['tuned'] / target - 1):+.1f} %.")
    yield from _monotone(tune["history"])
    for name, check in tune["full_model_check"].items():
        if check["largest_error"] > REDUCTION:
            yield (f"Reduced against full model ({name.replace('_', ' ')}): a stuck frequency is off by "
                   f"{100 * check['largest_error']:.2g} %, more than {100 * REDUCTION:g} %: keep more modes.")
    yield from _carried(results)


def _monotone(history):
    steps = sorted(history, key=lambda s: s["front"] + s["back"])
    rises = [b for a, b in zip(steps, steps[1:], strict=False) if b["hz"] < a["hz"]]
    if rises:
        yield (f"Detaching is not monotone: with {rises[0]['front']} + {rises[0]['back']} stations the frequency is "
               "below that of the next smaller set.")


def _carried(results):
    yield from _balance("the preload of the kept stations", results["tune"]["preload_kept"])
    carried = results["tune"]["redistribution"]
    if abs(carried.get("moment_Nm") or 0.0) > SMALL_MOMENT:
        yield (f"A load moment of {number(carried['moment_Nm'], 3)} N m about the damper's axis is left by moving each "
               "station's force to its kept row; it is taken up in the reference state.")
    for name, load in carried.get("reactions", {}).items():
        yield (f"A load of {number(load, 3)} along '{name}', which no contact holds, is taken up in the reference "
               "state.")
    kept = results.kept.select(results.kept.carrying)
    open_pairs = [f"{kept.side[i]} {kept.station[i]}" for i in (kept.preload <= 0).nonzero()[0]]
    if open_pairs:
        yield f"{len(open_pairs)} of {len(kept)} kept pairs are open at rest: {names_of_pairs(open_pairs)}."


def _balance(what, sides):
    for side, s in sides.items():
        if abs(s["sum_N"] - s["equilibrium_N"]) > BALANCE * abs(s["equilibrium_N"]):
            yield (f"The sum of {what} on side '{side}' is {number(s['sum_N'])} N, not the {number(s['equilibrium_N'])}"
                   " N of equilibrium.")
    worst = max((s["balance_error"] or 0.0 for s in sides.values()), default=0.0)
    if worst > BALANCE:
        yield f"Loads and {what} are not in equilibrium: {worst:.1e} of the pull is left over."


def _respond(results):
    for case in results.cases:
        facts, name = case.facts, f"Fe = {case.Fe:g} N, H = {case.H}"
        for way, one in (("", facts), (" followed from the other end", facts.get("back"))):
            if one and (one["failed_points"] or not one["complete"]):
                yield f"The curve {name}{way} is incomplete, {one['failed_points']} failed points: {one['ended']}."
        if _finite(facts["peak_hz"]) and not facts["peak_inside_band"]:
            yield f"The peak of {name} lies at the edge of the band: widen [respond] band."
        yield from _both_ways(name, facts)
        yield from _no_slip(results, name, facts)
    if results.cases and all(c.facts["slipping_pairs"] for c in results.cases if c.Fe == results.cases[0].Fe):
        yield (f"Pairs slip at the lowest level, {results.cases[0].Fe:g} N, already: a damping ratio that was read "
               "from this level counts friction twice.")


def _both_ways(name, facts):
    back = facts.get("back")
    if not back or not (back["complete"] and facts["complete"]):
        return
    off = [back[k] / facts[k] - 1 for k in ("peak_m", "peak_hz")]
    if max(map(abs, off)) > BOTH_WAYS:
        yield (f"The two ways through the band disagree on the peak of {name}: {100 * off[0]:+.2g} % in amplitude, "
               f"{100 * off[1]:+.2g} % in frequency; there may be two branches.")


def _no_slip(results, name, facts):
    if facts["slipping_pairs"]:
        return
    difference = results["respond"]["stuck_difference"].get(facts["file"])
    if difference is not None and difference > STUCK_CURVE:
        yield f"No pair slips at {name}, yet the curve differs from the linear response by {difference:.1e}."
    if "tune" in results and _finite(facts["peak_hz"]):
        off = facts["peak_hz"] / results["tune"]["stuck_hz"]["tuned"] - 1
        if abs(off) > STUCK_PEAK:
            yield (f"No pair slips at {name}, yet the peak lies {100 * off:+.2f} % from the stuck frequency: "
                   "another mode is near.")


def _off_reference(what, hz, reference):
    if reference and abs(hz / reference - 1) > REFERENCE:
        yield f"{what} is {hz:.0f} Hz, {100 * (hz / reference - 1):+.1f} % from the reference {reference:g} Hz."


def _finite(value) -> bool:
    return value is not None and math.isfinite(value)


_CHECKS = {"inspect": _inspect, "reduce": _reduce, "preload": _preload, "tune": _tune, "respond": _respond}
