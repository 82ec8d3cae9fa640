"""Tables: the peak of every curve, how far it can be trusted, with how many harmonics, and the
largest stresses there."""

from collections.abc import Iterator

from tipdamp.hbm.result import NOT_SEARCHED, SEARCH_STOPPED
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import reason
from tipdamp.report.text import MEGA, MM, NOTHING, hertz, micro, names_of_pairs, number, percent
from tipdamp.results.response_results import CurveResult, PeakStress, StressPlace

CLOSE = 1e-6  # difference of two peaks below which they are equal
Row = dict[str, str]


def peaks(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    if not results.cases:
        return
    kept = (
        f"; {int(results.kept.carrying.sum())} pairs are kept." if results.kept is not None else "."
    )
    caption = (
        "Peaks of blade 1, half of peak-to-peak along the force: largest and smallest over the "
        "nodes of the patch. Lift off, slip or open: anywhere on the curve, not only at the peak; "
        "of the first those that are closed at rest. Pairs are named by side and station, with the "
        "row where a side has several" + kept
    )
    if any(case.is_bound for case in results.cases):
        caption += (
            " A curve that stopped before the end of the band, or whose highest point borders a "
            "gap, has no peak, and one with holes may be higher in them: it is at least the "
            "largest amplitude that was solved."
        )
    yield Table(caption, [_peak(case) for case in results.cases], left=(7,))


def _of(H: int, Fe: float) -> Row:
    return {"H": f"{H}", "Fe (N)": f"{Fe:g}"}


def _peak(case: ReportedCurve) -> Row:
    facts, solved = case.facts, case.curve.converged.any()
    largest, per_newton = micro(facts.peak_m), micro(case.peak_per_newton)
    if case.is_bound:
        largest = at_least(facts.peak_m if case.has_peak else facts.at_least_m)
        per_newton = at_least(case.peak_per_newton if case.has_peak else case.at_least_per_newton)
    return _of(case.H, case.Fe) | {
        "peak (Hz)": hertz(facts.peak_hz),
        "largest (µm)": largest,
        "smallest (µm)": micro(facts.min_peak_m),
        "largest per force (µm/N)": per_newton,
        "lift off": f"{len(facts.lift_off_pairs)}" if solved else NOTHING,
        "slip or open anywhere on the curve": names_of_pairs(facts.slipping_pairs)
        if solved
        else NOTHING,
    }


def at_least(value: float | None) -> str:
    """A lower bound in m, in um, of a curve without a peak."""
    return NOTHING if value is None else f"at least {micro(value)}"


def trust(results: Results) -> Iterator[Table]:
    """How far each curve can be trusted, one row each."""
    if results.cases:
        yield Table(
            "Harmonics: estimated error of the peak by the orders above H, on the patch with the "
            "largest. From fewer: "
            "change of the peak from the next smaller H. Energy: largest error of input = damping "
            "+ friction over a period, relative to the input, of all "
            "points. Other way: the band followed from its other end; not needed where the "
            "solution there is found by itself, too, and the curve is one whole branch; else the "
            "change of the peak. Unstable: motions of which a disturbance grows, of the peaks or "
            "of all points. Beside: further curves that a search found, such as detached "
            "resonances; none found is no proof that there is none. Integration: difference from "
            "time integration that starts on the orbit of the peak, with [respond] compare = true."
            + _searches(results)
            + _of_the_model(results),
            [_trusted(results, case) for case in results.cases],
            left=(2,),
        )


def _of_the_model(results: Results) -> str:
    """What the reduction changes in the stuck frequencies."""
    checks = results.tune.full_model_check.values() if results.tune else ()
    errors = [check.largest_error for check in checks]
    return (
        " Stuck frequencies are off those of the full model by "
        f"{number(max(errors), 1, 100)} % at most."
        if errors
        else ""
    )


def _trusted(results: Results, case: ReportedCurve) -> Row:
    facts = case.facts
    return _of(case.H, case.Fe) | {
        "curve": _state(case),
        "points": f"{facts.points}",
        "harmonics": _share(facts.least_known[0] or facts.truncation),
        "from fewer": _from_fewer(results, case),
        "energy": number(facts.energy_error, 1),
        "other way": _other_way(facts),
        "unstable": _unstable(facts),
        "beside": _beside(facts),
        "integration": _integration(results, case),
    }


def _unstable(facts: CurveResult) -> str:
    if facts.unstable_points is None:
        return NOTHING
    peak = ", the peak too" if facts.unstable else ", not the peak"
    return f"{facts.unstable_points}" + peak * bool(facts.unstable_points)


def _beside(facts: CurveResult) -> str:
    if facts.searched == NOT_SEARCHED:
        return "not searched"
    stopped = ", search stopped" if SEARCH_STOPPED in facts.searched else ""
    return f"{len(facts.beside)}{stopped}"


def _searches(results: Results) -> str:
    """What a search that was stopped means."""
    if not any(SEARCH_STOPPED in one.facts.searched for one in results.cases):
        return ""
    return (
        " Search stopped: at its share of the cost of the curves, [respond] search, before all "
        "frequencies were looked at, as summary.json says of each curve; of the others nothing is "
        "known."
    )


def _share(value: float | None) -> str:
    return NOTHING if value is None else f"{number(value, 1, 100)} %"


def _integration(results: Results, case: ReportedCurve) -> str:
    cycles = results.cycles.curves if results.cycles else ()
    mine = [one.integration for one in cycles if (one.Fe_N, one.H) == (case.Fe, case.H)]
    if not mine or mine[0] is None:
        return NOTHING
    if not mine[0].agrees:
        return "leaves the orbit"
    return _share(mine[0].difference) + ", unstable" * (mine[0].stable is False)


def _from_fewer(results: Results, case: ReportedCurve) -> str:
    fewer = [one.facts.peak_m for one in results.cases if one.Fe == case.Fe and one.H < case.H]
    if not fewer or not fewer[-1] or not case.facts.peak_m:
        return NOTHING
    return percent(case.facts.peak_m / fewer[-1] - 1, 2)


def _state(case: ReportedCurve) -> str:
    facts = case.facts
    failed = f"{case.facts.failed_points} points failed" if case.facts.failed_points else ""
    if facts.solved_nothing:
        return f"no solved point: {reason(case)}"
    if facts.complete:
        return failed or "complete"
    stopped = "" if case.curve.reached_end else reason(case)
    return ", ".join(filter(None, ("incomplete", failed, stopped)))


def _other_way(facts: CurveResult) -> str:
    back = facts.back
    if back is None:
        return "not needed" if facts.alike_backwards else "not followed"
    if back.peak_m is None:
        return "no peak" + f", {at_least(back.at_least_m)} µm" * (back.at_least_m is not None)
    if facts.peak_m is None:
        return f"peak of {micro(back.peak_m)} µm at {hertz(back.peak_hz)} Hz"
    off = abs(back.peak_m / facts.peak_m - 1)
    return "equal" if off < CLOSE else number(off, 1)


def harmonics(results: Results) -> Iterator[Table]:
    """What harmonics = "auto" tried, one row for each level; none for a study that names its
    numbers."""
    found = [case.facts for case in results.finest if case.facts.tried]
    if found:
        yield Table(
            "Harmonics of each level: as many as the tolerance of "
            f"{results.study.respond.tolerance:g} needs. Error: what the harmonics above H would "
            "change by estimate, relative to the vibration of a point, on 99 % of the points of a "
            "curve at most.",
            [_tried(one) for one in found],
            left=(4,),
        )


def _tried(facts: CurveResult) -> Row:
    met = {True: "met", False: "not met", None: NOTHING}
    tried = (
        f"{number(one.error, 1)} with {one.H}" + ", incomplete" * (not one.complete)
        for one in facts.tried
    )
    return {
        "Fe (N)": f"{facts.Fe_N:g}",
        "H": f"{facts.H}",
        "error": number(next(one.error for one in facts.tried if one.H == facts.H), 1),
        "tolerance": met[facts.within_tolerance],
        "tried: error with H": "; ".join(tried),
    }


def stress(results: Results) -> Iterator[Table]:
    """All places of the largest level; of the others the largest of each body."""
    curves = sorted(results.stress.curves if results.stress else (), key=lambda one: one.Fe_N)
    if curves:
        yield Table(
            "Vibratory stress at the peak of blade 1, at the nodes where it is larger than all "
            "around them. Alternating: half of the largest von Mises range between two instants "
            "of a period. Mean: von Mises stress of the mean, at rest and by the vibration. At "
            "nodes where single forces act (contact pairs, excitation) stress depends on the "
            "mesh. vibration_*.vtu hold the whole fields." + _bounds(results),
            [
                _stress(results, one, place)
                for one in curves
                for i, place in enumerate(one.places)
                if one is curves[-1] or place.body not in [other.body for other in one.places[:i]]
            ],
            left=(3, 5),
        )


def safety(results: Results) -> Iterator[Table]:
    """Of each curve where the safety of each body is least."""
    curves = sorted(results.stress.curves if results.stress else (), key=lambda one: one.Fe_N)
    rows = [_stress(results, one, place) for one in curves for place in one.least]
    if rows:
        yield Table(
            "Least safety by Goodman of each body at the peak of blade 1: the factor on "
            "alternating and mean stress together at which alternating over fatigue_limit and mean "
            "over tensile_strength of the material add to 1. Means count as tension."
            + _bounds(results),
            rows,
            left=(3, 5),
        )


def _bounds(results: Results) -> str:
    """What 'at least' and 'at most' mean, where a row is a bound."""
    curves = results.stress.curves if results.stress else ()
    return (
        " At least, at most: the curve has no peak, or holes in which it may be higher, and the "
        "row is that of its highest solved point, a bound and no result."
        * any(results.is_bound(one.Fe_N, one.H) for one in curves)
    )


def _stress(results: Results, one: PeakStress, place: StressPlace) -> Row:
    bound = results.is_bound(one.Fe_N, one.H)
    return _of(one.H, one.Fe_N) | {
        "at (Hz)": hertz(one.hz),
        "body": place.body,
        "node": f"{place.node}",
        "x, y, z (mm)": ", ".join(f"{MM * x:.2f}" for x in place.position_m),
        "alternating (MPa)": "at least " * bound + number(place.alternating_Pa, 4, 1 / MEGA),
        "mean (MPa)": number(place.mean_Pa, 4, 1 / MEGA),
        "amplitude (µm)": micro(place.amplitude_m),
        **(
            {} if place.safety is None else {"safety": "at most " * bound + number(place.safety, 3)}
        ),
    }
