"""comparison.html, its figures, and comparison.csv of every peak."""

import csv
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from tipdamp.comparison import figures, tables, wear
from tipdamp.comparison.figures import in_words
from tipdamp.comparison.peaks import ComparedPeak, Phase
from tipdamp.comparison.record import ComparedStudies
from tipdamp.engine.store import Store
from tipdamp.hbm.drawing.figure import Figure
from tipdamp.report.drawing import matplotlib, table
from tipdamp.report.page import Block, Section, page
from tipdamp.report.text import listing, micro, number

SECTIONS = (
    (
        "optimisation",
        "Optimisation curves",
        (figures.optimisation, tables.best, tables.differences),
    ),
    ("along", "Along the curves", (tables.events, figures.places)),
    ("studies", "The studies", (tables.studies,)),
    ("preload", "Preload", (figures.preloads,)),
    ("wear", "Wear", (wear.figures,)),
    ("response", "Forced response", (figures.responses,)),
    ("cases", "Every case", (tables.cases,)),
)


def write_comparison(comparison: ComparedStudies, folder: Path) -> Path:
    """Write comparison.html, comparison.csv and figures/ (PNG and CSV) into the folder; returns the
    page."""
    store = Store(folder)
    sections: list[Section[Block]] = [
        Section(name, title, [block for part in parts for block in part(comparison)])
        for name, title, parts in SECTIONS
    ]
    text = page(
        "comparison.html",
        f"Compared: {listing(comparison.names)}",
        ", ".join(dict.fromkeys(one.results.study.path.name for one in comparison.computed)),
        [section for section in sections if section.blocks],
        introduction=list(introduction(comparison)),
    )
    with store.writing("comparison.html") as path:
        path.write_text(text, encoding="utf-8")
    with store.writing("comparison.csv") as path:
        write_csv(comparison, path)
    for figure in (b for s in sections for b in s.blocks if isinstance(b, Figure)):
        with store.writing(f"figures/{figure.name}.png") as path:
            matplotlib.draw(figure, path)
        with store.writing(f"figures/{figure.name}.csv") as path:
            table.write(figure, path)
    return store.path("comparison.html")


def introduction(comparison: ComparedStudies) -> Iterator[str]:
    """For each phase, which study is best and at which pull."""
    for phase in comparison.phases:
        yield from _winner(comparison, phase)


def _winner(comparison: ComparedStudies, phase: Phase) -> Iterator[str]:
    optima = comparison.optima(phase)
    if not optima:
        return
    order = list(optima)
    least = optima[order[0]]
    others = listing(f"{name} {micro(optima[name].m_per_N)}" for name in order[1:])
    ends = listing(name for name in order if optima[name].of_end)
    yield (
        f"{in_words(phase).capitalize()} the least response is that of {order[0]}, "
        f"{micro(least.m_per_N)} µm/N at Fc/Fe = {number(least.ratio, 3)}"
        + (f" ({others} µm/N at their best)." if others else ".")
        + (f" Least at the first or last level, where more levels are needed: {ends}." * bool(ends))
    )


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
