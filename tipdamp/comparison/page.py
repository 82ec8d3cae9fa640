"""comparison.html, its figures, and comparison.csv of every peak."""

import csv
import time
from collections.abc import Iterator
from dataclasses import fields
from fnmatch import fnmatchcase
from pathlib import Path

from tipdamp.comparison import doubts, figures, stress, tables, wear
from tipdamp.comparison.figures import in_words
from tipdamp.comparison.optimum import Optimum
from tipdamp.comparison.peaks import ComparedPeak, Phase, motion_beyond
from tipdamp.comparison.record import ComparedStudies
from tipdamp.engine.store import Store
from tipdamp.hbm.drawing.figure import Figure
from tipdamp.report.drawing import table
from tipdamp.report.page import Parts, filled, page
from tipdamp.report.text import MICRO, listing, number
from tipdamp.report.write import draw
from tipdamp.study.view import Study

SECTIONS: Parts[ComparedStudies] = (
    (
        "optimisation",
        "Optimisation curves",
        (figures.optimisation, tables.best, tables.differences),
    ),
    ("along", "Along the curves", (tables.events, figures.places)),
    ("studies", "The studies", (tables.studies,)),
    ("preload", "Preload", (figures.preloads,)),
    ("wear", "Wear", (wear.figures,)),
    ("stress", "Stress", (stress.table,)),
    ("response", "Forced response", (figures.responses,)),
    ("cases", "Every case", (tables.cases,)),
)


STAGE = "compare"  # name of its record in the folder
FILES = ("comparison.html", "comparison.csv")
FIGURES = "figures/*.png", "figures/*.csv"


def write_comparison(comparison: ComparedStudies, folder: Path, mark: str) -> Path:
    """Write comparison.html, comparison.csv and figures/ (PNG and CSV) into the folder, in place of
    those of another comparison; returns the page. mark - of all that it follows from."""
    store, began = Store(folder), time.perf_counter()
    with store.running(STAGE) as before:
        files = _write(comparison, store)
        before = {f: m for f, m in before.items() if any(fnmatchcase(f, own) for own in FIGURES)}
        store.finish(STAGE, mark, files, time.perf_counter() - began, before)
    return store.path(FILES[0])


def is_drawn(folder: Path, mark: str) -> bool:
    """Whether the page of what has this mark stands in the folder."""
    return Store(folder).is_current(STAGE, mark)


def _write(comparison: ComparedStudies, store: Store) -> list[str]:
    """The files."""
    sections = filled(SECTIONS, comparison)
    studies = dict.fromkeys(one.results.study.name for one in comparison.computed)
    text = page(
        "comparison.html",
        f"Compared: {listing(studies)}",
        ", ".join(dict.fromkeys(_file(one.results.study) for one in comparison.computed)),
        sections,
        introduction=list(introduction(comparison)),
        warnings=doubts.warnings(comparison),
    )
    with store.writing(FILES[0]) as path:
        path.write_text(text, encoding="utf-8")
    with store.writing(FILES[1]) as path:
        write_csv(comparison, path)
    files = list(FILES)
    for figure in (b for s in sections for b in s.blocks if isinstance(b, Figure)):
        files += draw(figure, store)
    return files


def _file(study: Study) -> str:
    """'da.toml (wedge 35/35)'."""
    return study.path.name + f" ({study.title})" * (study.title != study.name)


def introduction(comparison: ComparedStudies) -> Iterator[str]:
    """For each phase, which study is best and at which pull, or that friction takes nothing; and
    why the pulls of a study draw a curve each, of which the best counts."""
    for phase in comparison.phases:
        yield from _winner(comparison.by_study, phase)
    for name, why in comparison.apart.items():
        mine = (one for one in comparison.computed if one.of == name)
        pulls = dict.fromkeys(one.results.study.driver.pull for one in mine)
        yield (
            f"{name}: {listing(f'{pull:g}' for pull in pulls)} N draw a curve each, since {why}, "
            "and so Fc/Fe alone does not tell the response per newton; as one study it has at "
            "every Fc/Fe the lowest of its pulls."
        )


def _winner(comparison: ComparedStudies, phase: Phase) -> Iterator[str]:
    optima = comparison.optima(phase)
    lacking = [n for n in comparison.names if comparison.of(n, phase) and n not in optima]
    if lacking:
        yield (
            f"{in_words(phase).capitalize()} there is no best pull, which needs peaks at two "
            f"levels, of {listing(lacking)}."
        )
    if not optima:
        return
    yield " ".join(
        (
            _least(comparison, phase, optima),
            *_ranked(comparison, phase),
            *_without_friction(optima),
            *_beyond(comparison, phase, optima),
        )
    )


def _least(comparison: ComparedStudies, phase: Phase, optima: dict[str, Optimum]) -> str:
    (first, least), *others = optima.items()
    place = f" at Fc/Fe = {tables.best_ratio(comparison, phase, first, least)}"
    place += f" (Fc = {least.peak.pull:g} N)" * (first in comparison.several_pulls)
    if least.flat:
        place = ", and within 5 % of that at every level"
    if least.idle:
        place = ", where friction takes nothing"
    whose = f"that of {first}, " * (len(comparison.names) > 1)
    best = listing(f"{name} {doubts.height(one.peak, 'µm/N')}" for name, one in others)
    return (
        f"{in_words(phase).capitalize()} the least response is {whose}"
        f"{doubts.height(least.peak, 'µm/N')}{place}."
        + f" The others at their best: {best}."
        * bool(best)
    )


def _ranked(comparison: ComparedStudies, phase: Phase) -> Iterator[str]:
    """Which share the first rank, and which has it where the least lies where not all reach."""
    ranks, common = comparison.ranks(phase), comparison.common(phase)
    if common is None:
        yield "There is no Fc/Fe that all reach, and so no rank."
        return
    unknown = comparison.interpolated(phase)
    ends = " to ".join(number(end, 3) for end in common)
    where = f"From Fc/Fe = {ends}, which all reach: " if comparison.is_cut(phase) else ""
    first = listing(name for name, rank in ranks.items() if rank == 1)
    if list(ranks.values()).count(1) > 1:
        within = "within their errors, their scatter or what a flat curve varies by"
        yield f"{where}{first} are equal {within}."
    elif where and first:
        others = " of the others" * bool(unknown)
        yield f"{where}{first} is the lowest{others}."
    for name, (low, high) in unknown.items():
        yield (
            f"Between Fc/Fe = {ends} the least of {name} is only interpolated, between "
            f"{number(low, 3, MICRO)} and {number(high, 3, MICRO)} µm/N at levels that lie apart: "
            "it has no rank."
        )


def _without_friction(optima: dict[str, Optimum]) -> Iterator[str]:
    idle = [name for name, one in optima.items() if one.idle]
    if idle:
        yield f"No pull is best for {listing(idle)}, whose least is that without friction."


def _beyond(comparison: ComparedStudies, phase: Phase, optima: dict[str, Optimum]) -> Iterator[str]:
    """Of those whose least may lie beyond the first or the last level."""
    moved = {
        name: motion
        for name, one in optima.items()
        if (motion := motion_beyond(comparison.of(name, phase), one.ratio))
    }
    open_ends = (name for name, one in optima.items() if one.of_end and not one.idle)
    if ends := listing(name for name in open_ends if name not in moved):
        yield f"Least at the first or last level, where more levels are needed: {ends}."
    for name, said in moved.items():
        yield f"Below the least of {name} {said}."


def write_csv(comparison: ComparedStudies, path: Path) -> None:
    """Every peak in a row: the fields of ComparedPeak, friction_W of all pairs together, and Fc/Fe;
    SI units, m per N."""
    names = [one.name for one in fields(ComparedPeak)]
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow((*names, "ratio"))
        for peak in comparison.peaks:
            content = vars(peak) | {"friction_W": sum(peak.friction_W) if peak.friction_W else None}
            row = (*(content[name] for name in names), peak.ratio)
            out.writerow(table.plain(v) if isinstance(v, str) else v for v in row)
