"""Table: how far each curve can be trusted."""

from collections.abc import Iterator

from tipdamp.hbm.result import NOT_SEARCHED
from tipdamp.report.drawing.table import Table
from tipdamp.report.figures.amplitudes import reason
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.tables.peaks import at_least
from tipdamp.report.text import NOTHING, hertz, micro, number, percent

CLOSE = 1e-6  # difference of two peaks below which they are equal


def tables(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    if not results.cases:
        return
    yield Table(
        "How far to trust this. Harmonics: estimated error of the largest peak by the orders above "
        "H. From fewer: change of the peak from the next smaller H. Energy: largest error of input "
        "= damping + friction over a period, relative to the input, of all points. Other way: the "
        "band followed from its other end; not needed where the solution there is found by itself, "
        "too, and the curve is one whole branch; else the change of the peak. Unstable: motions of "
        "which a disturbance grows, of the peaks or of all points. Beside: further curves that a "
        "search found, such as detached resonances; none found is no proof that there is none. "
        "Integration: difference from time integration that starts on the orbit of the peak, "
        "with [respond] compare = true." + _of_the_model(results),
        (
            "H",
            "Fe (N)",
            "curve",
            "points",
            "harmonics",
            "from fewer",
            "energy",
            "other way",
            "unstable",
            "beside",
            "integration",
        ),
        tuple(_row(results, case) for case in results.cases),
        left=(2,),
    )


def _of_the_model(results) -> str:
    """What the reduction changes in the stuck frequencies."""
    checks = results.tune.full_model_check.values() if results.tune else ()
    errors = [check.largest_error for check in checks]
    return (
        " Stuck frequencies are off those of the full model by "
        f"{number(max(errors), 1, 100)} % at most."
        if errors
        else ""
    )


def _row(results, case: ReportedCurve):
    facts = case.facts
    return (
        f"{case.H}",
        f"{case.Fe:g}",
        _state(case),
        f"{facts.points}",
        _share(facts.truncation),
        _from_fewer(results, case),
        number(facts.energy_error, 1),
        _other_way(facts),
        NOTHING if facts.unstable_points is None else f"{facts.unstable_points}",
        "not searched" if facts.searched == NOT_SEARCHED else f"{len(facts.beside)}",
        _integration(results, case),
    )


def _share(value: float | None) -> str:
    return NOTHING if value is None else f"{number(value, 1, 100)} %"


def _integration(results, case: ReportedCurve) -> str:
    cycles = results.cycles.curves if results.cycles else ()
    mine = [one.integration for one in cycles if (one.Fe_N, one.H) == (case.Fe, case.H)]
    if not mine or mine[0] is None:
        return NOTHING
    if not mine[0].agrees:
        return "leaves the orbit"
    return _share(mine[0].difference) + ", unstable" * (mine[0].stable is False)


def _from_fewer(results, case: ReportedCurve) -> str:
    fewer = [one for one in results.cases if one.Fe == case.Fe and one.H < case.H]
    if not fewer or not fewer[-1].has_peak or not case.has_peak:
        return NOTHING
    return percent(case.facts.peak_m / fewer[-1].facts.peak_m - 1, 2)


def _state(case: ReportedCurve) -> str:
    facts = case.facts
    failed = f"{case.facts.failed_points} points failed" if case.facts.failed_points else ""
    if facts.solved_nothing:
        return f"no solved point: {reason(case)}"
    if facts.complete:
        return failed or "complete"
    stopped = "" if case.curve.reached_end else reason(case)
    return ", ".join(filter(None, ("incomplete", failed, stopped)))


def _other_way(facts) -> str:
    if facts.back is None:
        return "not needed" if facts.alike_backwards else "not followed"
    if facts.back.peak_m is None:
        return (
            "no peak"
            if facts.back.at_least_m is None
            else f"no peak, {at_least(facts.back.at_least_m)} µm"
        )
    if facts.peak_m is None:
        return f"peak of {micro(facts.back.peak_m)} µm at {hertz(facts.back.peak_hz)} Hz"
    off = abs(facts.back.peak_m / facts.peak_m - 1)
    return "equal" if off < CLOSE else number(off, 1)
