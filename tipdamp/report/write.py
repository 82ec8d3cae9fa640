"""The stage `report`: summary.json, figures/*.png, what they show as figures/*.csv, and
report.html."""

import time
from collections.abc import Callable
from functools import partial

from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Report, Workers
from tipdamp.hbm.drawing.figure import Figure
from tipdamp.report.contents import contents
from tipdamp.report.drawing import matplotlib, table
from tipdamp.report.introduction import introduction
from tipdamp.report.libraries import need
from tipdamp.report.page import page
from tipdamp.report.results import load_results
from tipdamp.report.summary import summarise
from tipdamp.study.view import Study

LIBRARIES = ("jinja2", "plotly", "matplotlib")


def write_report(
    study: Study, store: Store, tick: Tick, said: dict[str, list[str]], workers: Workers
) -> list[str]:
    """Write summary.json, the figures as PNG and CSV, and report.html into the results folder;
    returns their names.

    said - {stage: its warnings} of the stages that the study asks for; workers - processes that
    make the page and draw the figures. Where a library of the report is missing, summary.json is
    written all the same, then InputError says what to install.
    """
    began = time.perf_counter()
    results = load_results(study, store, said)
    summary = summarise(results)
    store.write_json("summary.json", summary)
    for library in LIBRARIES:
        need(library)
    sections = contents(results)
    figures = [
        block for section in sections for block in section.blocks if isinstance(block, Figure)
    ]
    text = partial(
        page,
        "report.html",
        study.title,
        study.path.name,
        sections,
        introduction=introduction(results),
        warnings=summary["warnings"],
    )
    # the page takes longest
    tasks = [partial(_page, text), *(partial(draw, figure) for figure in figures)]
    files = ["report.html", *(f"figures/{figure.name}.png" for figure in figures)]
    for count, i in enumerate(workers.spread(_write, store, tasks, lambda *_: None), 1):
        tick(count / len(tasks), files[i])
    summary["seconds"]["report"] = round(time.perf_counter() - began, 3)
    store.write_json("summary.json", summary)
    return [f"figures/{figure.name}.{kind}" for figure in figures for kind in ("png", "csv")]


def _write(store: Store, task: Callable[[Store], object], _: Report) -> None:
    task(store)


def _page(text: Callable[[], str], store: Store) -> None:
    with store.writing("report.html") as path:
        path.write_text(text(), encoding="utf-8")


def draw(figure: Figure, store: Store) -> list[str]:
    """One figure as PNG, and what it shows as CSV; returns their names."""
    drawn, shown = files = [f"figures/{figure.name}.{kind}" for kind in ("png", "csv")]
    with store.writing(drawn) as path:
        matplotlib.draw(figure, path)
    with store.writing(shown) as path:
        table.write(figure, path)
    return files
