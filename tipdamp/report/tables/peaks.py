"""Table: the peak of every curve."""

from collections.abc import Iterator

from tipdamp.hbm.result import NOT_SEARCHED
from tipdamp.report.drawing.table import Table
from tipdamp.report.figures.amplitudes import reason
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import NOTHING, hertz, micro, names_of_pairs, number

CLOSE = 1e-6  # difference of two peaks below which they are equal


def tables(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    if not results.cases:
        return
    kept = (
        f"; {int(results.kept.carrying.sum())} pairs are kept." if results.kept is not None else "."
    )
    caption = (
        "Peaks of blade 1, half of peak-to-peak along the force: largest and smallest over the "
        "nodes of the patch. Other way: relative change of the peak when the band is followed "
        "from its other end. Truncation: estimated error of the largest peak by the harmonics "
        "above H. Unstable: motions of which a disturbance grows, of the peaks or of all points. "
        "Beside: further curves that a search found, such as detached resonances; none found is no "
        "proof that there is none. "
        "Energy: largest error of input = damping + friction over a period, relative to the "
        "input, of all points. Lift off: pairs that are closed at rest and open "
        "in a part of some cycle. Pairs are named by side and station, with the row where a side "
        "has several" + kept
    )
    if not all(case.has_peak for case in results.cases):
        caption += (
            " A curve that stopped before the end of the band, or whose highest point borders a "
            "gap, has no peak; it is at least the largest amplitude that was solved."
        )
    yield Table(
        caption,
        (
            "H",
            "Fe (N)",
            "peak (Hz)",
            "largest (µm)",
            "smallest (µm)",
            "largest per force (µm/N)",
            "points",
            "curve",
            "other way",
            "truncation",
            "unstable",
            "beside",
            "energy",
            "lift off",
            "pairs that slip or open",
        ),
        tuple(_row(case) for case in results.cases),
        left=(7, 14),
    )


def _row(case: ReportedCurve):
    facts = case.facts
    largest, per_newton = (
        (micro(facts.peak_m), micro(case.peak_per_newton))
        if case.has_peak
        else (_at_least(facts.at_least_m), _at_least(case.at_least_per_newton))
    )
    return (
        f"{case.H}",
        f"{case.Fe:g}",
        hertz(facts.peak_hz),
        largest,
        micro(facts.min_peak_m),
        per_newton,
        f"{facts.points}",
        _state(case),
        _other_way(facts),
        number(facts.truncation, 1),
        NOTHING if facts.unstable_points is None else f"{facts.unstable_points}",
        "not searched" if facts.searched == NOT_SEARCHED else f"{len(facts.beside)}",
        number(facts.energy_error, 1),
        f"{len(facts.lift_off_pairs)}" if case.curve.converged.any() else NOTHING,
        names_of_pairs(facts.slipping_pairs) if case.curve.converged.any() else NOTHING,
    )


def _at_least(value: float | None) -> str:
    return NOTHING if value is None else f"at least {micro(value)}"


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
        return "not followed"
    if facts.back.peak_m is None:
        return (
            "no peak"
            if facts.back.at_least_m is None
            else f"no peak, {_at_least(facts.back.at_least_m)} µm"
        )
    if facts.peak_m is None:
        return f"peak of {micro(facts.back.peak_m)} µm at {hertz(facts.back.peak_hz)} Hz"
    off = abs(facts.back.peak_m / facts.peak_m - 1)
    return "equal" if off < CLOSE else number(off, 1)
