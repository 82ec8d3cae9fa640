"""Tables: key figures beside the reference values that the study states; stuck frequencies of the
reduced model beside those of the full one."""

from collections.abc import Iterator, Mapping

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, deviation, hertz, listing, number, percent, true_minus
from tipdamp.results.static_results import FullModelCheck, KeptArea, ReduceResult, TuneResult

Row = dict[str, str]


def key_figures(results: Results) -> Iterator[Table]:
    """One table; columns of reference and deviation only where the study has reference values."""
    if results.reduce is None:
        return
    rows = [*_free(results, results.reduce)]
    if results.tune is not None and results.whole is not None:
        rows += _stuck(results, results.reduce, results.tune, results.whole)
    if results.study.reference:
        yield Table("Key figures beside the reference values of the study.", rows)
    else:
        yield Table("Key figures.", [{k: row[k] for k in ("", "computed")} for row in rows])


def _figure(what: str, computed: str, reference: str = NOTHING, off: str = NOTHING) -> Row:
    return {"": what, "computed": computed, "reference": reference, "deviation": off}


def _frequency(results: Results, what: str, hz: float, key: str) -> Row:
    given = results.study.reference.get(key)
    return _figure(f"{what} (Hz)", hertz(hz), hertz(given), deviation(hz, given))


def _free(results: Results, reduce: ReduceResult) -> Iterator[Row]:
    free = reduce.free_hz
    for name, hz in free.items():
        what = f"without damper, {name.replace('_', ' ')}"
        yield _frequency(results, what, hz, f"{name}_hz")
    if not free:
        lowest = reduce.free_modes_hz[0]
        yield _frequency(results, "without damper, lowest mode", lowest, "")


def _stuck(
    results: Results, reduce: ReduceResult, tune: TuneResult, whole: ContactTable
) -> Iterator[Row]:
    reference = results.study.reference
    opened = {
        name: f", {n} pair{'s' * (n > 1)} open at rest" if n else "" for name, n in tune.open_pairs
    }
    kept = _kept(tune)
    stuck, sets = dict(tune.stuck_hz), dict[tuple, list[tuple[str, str]]]()
    for key, name in (
        ("full_area", f"whole area: {_whole(whole)}"),
        ("full_line", "whole line"),
        ("tuned", kept),
    ):
        if key == "full_line" and tune.line_is_whole and "full_line_hz" not in reference:
            continue
        sets.setdefault((round(stuck[key], 6), reference.get(f"{key}_hz")), []).append((key, name))
    for same in sets.values():  # one row where the sets are the same
        key, names = same[0][0], ", ".join(name for _, name in same)
        yield _frequency(results, f"stuck, {names}{opened[key]}", stuck[key], f"{key}_hz")
    for name, mode in tune.other_modes.items():
        free = reduce.free_hz.get(name)
        without = f"; without: {hertz(free)}" if free else ""
        yield _figure(f"{name.replace('_', ' ')} with damper, {kept}{without} (Hz)", hertz(mode.hz))
    yield from _area(tune.area) if tune.area else _stations(tune, reference)


def _whole(table: ContactTable) -> str:
    """What the whole patch holds, in words."""
    if table.on_surface.all():
        return f"{len(table)} contact points"
    rows_of = {s: len(np.unique(table.row[table.side == s])) for s in table.sides}
    return listing(f"{n} row{'s' * (n > 1)} on '{s}'" for s, n in rows_of.items())


def _kept(tune: TuneResult) -> str:
    if tune.table:
        return "own table"
    if tune.target_hz:
        return f"tuned to {tune.target_hz:g} Hz"
    return "given share of the area" if tune.area else "given stations"


def _area(area: KeptArea) -> Iterator[Row]:
    for name, side in area.sides.items():
        what = "area" if side.unit == "mm2" else "length"
        yield _figure(
            f"kept part of the closed {what}, side '{name}' ({side.unit.replace('2', '²')})",
            f"{number(side.kept)} of {number(side.closed)}",
        )
    yield _figure(
        "stuck frequency for a percent of the closed area (Hz)",
        number(area.hz_per_percent, 3),
    )


def _stations(tune: TuneResult, reference: Mapping[str, float]) -> Iterator[Row]:
    pairs = tune.closed_pairs, tune.open_pairs
    if not reference and tune.kept_pairs == sum(every.full_area for every in pairs):
        yield _figure("kept stations", f"all {tune.tuned_pairs.front + tune.tuned_pairs.back}")
        return
    for end, count in (("front", tune.tuned_pairs.front), ("back", tune.tuned_pairs.back)):
        given = reference.get(end)
        beside = () if given is None else (f"{given:g}", _change(count - given))
        yield _figure(f"kept stations, {end}", f"{count}", *beside)
    if tune.graded:
        what = f"part of its area that station {tune.graded.station} keeps"
        yield _figure(what, f"{tune.graded.part:.4g}")


def _change(count: float) -> str:
    return true_minus(f"{count:+g}") if count else "0"


def reduction_check(results: Results) -> Iterator[Table]:
    """One row for each mode of each set of stuck pairs, where the full model was solved."""
    if results.tune is None or results.reduce is None or not results.tune.full_model_check:
        return
    tune, size = results.tune, results.reduce.reduction
    words = {"full_area": "whole area", "full_line": "whole line", "tuned": tune.kept_name}
    checks = {
        name: check
        for name, check in tune.full_model_check.items()
        if name != "full_line" or not tune.line_is_whole
    }
    worst = max(check.largest_error for check in checks.values())
    sets: dict[tuple, list[str]] = {}
    for name, check in checks.items():  # sets of the same pairs have the same frequencies
        sets.setdefault((check.reduced_hz, check.full_hz), []).append(name)
    bound = (
        "Its contact shapes are of tractions, so that no bound follows from the reduction alone."
        if size.tractions
        else "The bound of the error follows from the reduction alone."
    )
    yield Table(
        f"Stuck frequencies of the reduced model ({size.in_words}, fixed-interface ones) beside "
        f"the full finite-element model ({size.dofs} dofs), up to 5 kHz, or "
        f"half as much again as the tracked mode; largest error {100 * worst:.3f} %. {bound}",
        [
            row
            for same in sets.values()
            for row in _modes(
                ", ".join(words[name] for name in same), checks[same[0]], not size.tractions
            )
        ],
    )


def _modes(name: str, check: FullModelCheck, bounded: bool) -> Iterator[Row]:
    bounds = check.error_bound or (None,) * len(check.full_hz)
    for i, (reduced, full, bound) in enumerate(
        zip(check.reduced_hz, check.full_hz, bounds, strict=True)
    ):
        error = None if reduced is None or full is None else reduced / full - 1
        yield {
            "stuck": "" if i else name,
            "mode": f"{i + 1}",
            "reduced (Hz)": hertz(reduced),
            "full (Hz)": hertz(full),
            "error": percent(error, 3),
        } | ({"bound": percent(bound, 3)} if bounded else {})
