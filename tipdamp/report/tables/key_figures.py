"""Table: key figures, beside the reference values that the study states."""

from collections.abc import Iterator

import numpy as np

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, deviation, hertz, listing, number


def tables(results: Results) -> Iterator[Table]:
    """One table; columns of reference and deviation only where the study has reference values."""
    if results.reduce is None:
        return
    rows = [*_free(results), *_stuck(results)]
    if results.study.reference:
        yield Table(
            "Key figures beside the reference values of the study.",
            ("", "computed", "reference", "deviation"),
            tuple(rows),
        )
    else:
        yield Table("Key figures.", ("", "computed"), tuple(row[:2] for row in rows))


def _free(results):
    free = results.reduce.free_hz
    for name, hz in free.items():
        yield _frequency(
            results, f"without damper, {name.replace('_', ' ')} (Hz)", hz, f"{name}_hz"
        )
    if not free:
        yield _frequency(
            results, "without damper, lowest mode (Hz)", results.reduce.free_modes_hz[0], ""
        )


def _stuck(results):
    tune, reference = results.tune, results.study.reference
    if tune is None:
        return
    table = results.whole
    rows_of = {s: len(np.unique(table.row[table.side == s])) for s in table.sides}
    detail = listing(f"{n} row{'s' * (n > 1)} on '{s}'" for s, n in rows_of.items())
    if table.on_surface.all():
        detail = f"{len(table)} contact points"
    opened = {
        name: f", {n} pair{'s' * (n > 1)} open at rest" if n else "" for name, n in tune.open_pairs
    }
    kept = (
        "own table"
        if tune.table
        else f"tuned to {tune.target_hz:g} Hz"
        if tune.target_hz
        else "given share of the area"
        if tune.area
        else "given stations"
    )
    stuck, sets = dict(tune.stuck_hz), dict[tuple, list[tuple[str, str]]]()
    for key, name in (
        ("full_area", f"whole area: {detail}"),
        ("full_line", "whole line"),
        ("tuned", kept),
    ):
        if key == "full_line" and tune.line_is_whole and "full_line_hz" not in reference:
            continue
        sets.setdefault((round(stuck[key], 6), reference.get(f"{key}_hz")), []).append((key, name))
    for same in sets.values():  # one row where the sets are the same
        key, names = same[0][0], ", ".join(name for _, name in same)
        yield _frequency(results, f"stuck, {names}{opened[key]} (Hz)", stuck[key], f"{key}_hz")
    for name, mode in tune.other_modes.items():
        free = results.reduce.free_hz.get(name)
        without = f"; without: {hertz(free)}" if free else ""
        yield (
            f"{name.replace('_', ' ')} with damper, {kept}{without} (Hz)",
            hertz(mode.hz),
            NOTHING,
            NOTHING,
        )
    yield from _area(tune) if tune.area else _stations(tune, reference)


def _area(tune):
    for name, side in tune.area.sides.items():
        unit = side.unit.replace("2", "²")
        yield (
            f"kept part of the closed {'area' if side.unit == 'mm2' else 'length'}, side '{name}' "
            f"({unit})",
            f"{number(side.kept)} of {number(side.closed)}",
            NOTHING,
            NOTHING,
        )
    yield (
        "stuck frequency for a percent of the closed area (Hz)",
        number(tune.area.hz_per_percent, 3),
        NOTHING,
        NOTHING,
    )


def _stations(tune, reference):
    for end, count in (("front", tune.tuned_pairs.front), ("back", tune.tuned_pairs.back)):
        given = reference.get(end)
        yield (
            f"kept stations, {end}",
            f"{count}",
            NOTHING if given is None else f"{given:g}",
            NOTHING if given is None else _change(count - given),
        )
    if tune.graded:
        yield (
            f"part of its area that station {tune.graded.station} keeps",
            f"{tune.graded.part:.4g}",
            NOTHING,
            NOTHING,
        )


def _frequency(results, what, value, key):
    given = results.study.reference.get(key)
    return what, hertz(value), hertz(given), deviation(value, given)


def _change(count) -> str:
    return f"{count:+g}".replace("-", "\N{MINUS SIGN}") if count else "0"
