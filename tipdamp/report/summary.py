"""summary.json: the results of a run in one plain file, put together from the records of the
stages."""

from tipdamp.report.checks import warnings_of
from tipdamp.report.libraries import versions
from tipdamp.report.results import Results
from tipdamp.results.response_results import CurveResult
from tipdamp.results.static_results import PreloadResult, TuneResult

# of a curve: what only the program needs, and what stands here otherwise
NOT_COPIED = {
    "file",
    "origin",
    "start",
    "residual_calls",
    "further",
    "left_out",
    "unsolved",
    "hold_doubts",
    "slipping_pairs",
    "lift_off_pairs",
    "back",
}
OF_TUNE = {
    "target_hz",
    "scatter_hz",
    "table",
    "stuck_hz",
    "tuned_pairs",
    "graded",
    "open_pairs",
    "equivalent",
    "preload_kept",
}


def summarise(results: Results) -> dict:
    """The content of summary.json; keys of stages that the study has no section for are left out.

    peak_m - m, half of peak-to-peak along the force, largest over the patch of blade 1;
    slipping_pairs - number of those that slip or open; lift_off_pairs - of those that open
    somewhere in the band and are closed at rest; truncation, worst_truncation - estimated error of
    the peak and the largest of the points by the harmonics left out, relative; tried,
    within_tolerance - with harmonics = 'auto': the error that 99 % of the points keep with every
    number that was tried, and whether that of the curve is within the tolerance; unstable - whether
    the largest amplitude is that of an unstable motion, unstable_points - how many are;
    searched - what was looked for beside the curve, beside - the curves that were found;
    named - its named points, with stability = "all"; alike_backwards - whether the curve
    followed from the other end of the band would be the same, back - that curve otherwise;
    held - force on what holds a motion; bound - of a stress: the curve has no peak, or holes in
    which it may be higher.
    A curve that stopped, or whose highest point borders a gap, has no peak: at_least_m is the
    largest amplitude that was solved, ended the reason.
    """
    summary: dict = {
        "title": results.study.title,
        "study": results.study.path.name,
        "pull_N": results.study.driver.pull,
    }
    if results.reduce is not None:
        free = {"free_hz"} if results.reduce.free_hz else set()
        summary |= results.reduce.model_dump(include={"reduction", *free})
    if results.preload is not None:
        summary |= _preload(results.preload)
    if results.full is not None:
        summary["full_preload"] = results.full.model_dump(exclude={"of", "warnings"})
    if results.tune is not None:
        summary |= _tune(results.tune)
        errors = [check.largest_error for check in results.tune.full_model_check.values()]
        if errors:
            summary["reduction"] = {**summary["reduction"], "largest_error": max(errors)}
    if results.respond is not None:
        summary["tolerance"] = results.study.respond.tolerance
        summary["responses"] = [_response(case.facts) for case in results.cases]
    if results.backbone is not None:
        summary["backbone"] = results.backbone.model_dump(exclude={"warnings"})
    if results.stress is not None:
        summary["stress"] = [
            one.model_dump() | {"bound": results.is_bound(one.Fe_N, one.H)}
            for one in results.stress.curves
        ]
    return {
        **summary,
        "seconds": dict(results.seconds),
        "versions": versions(),
        "warnings": warnings_of(results),
    }


def _preload(found: PreloadResult) -> dict:
    return {
        "preload": found.model_dump(include={"sides"})["sides"],
        "stiffness": {
            side: [way.model_dump() for way in made.ways] for side, made in found.stiffness.items()
        },
    }


def _tune(found: TuneResult) -> dict:
    """Area that is detached leaves no stations at the ends to count."""
    if not found.area:
        return found.model_dump(include=OF_TUNE)
    area = found.area.model_dump(exclude={"history"})
    return {**found.model_dump(include=OF_TUNE - {"tuned_pairs"}), "area": area}


def _response(facts: CurveResult) -> dict:
    back = set() if facts.back is None else {"back"}
    return {
        **facts.model_dump(exclude=NOT_COPIED),
        "slipping_pairs": len(facts.slipping_pairs),
        "slipping": list(facts.slipping_pairs),
        "lift_off_pairs": len(facts.lift_off_pairs),
        "lift_off": list(facts.lift_off_pairs),
        **facts.model_dump(include=back),
    }
