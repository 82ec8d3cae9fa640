"""Stage report: one HTML page, the figures and summary.json."""

from tipdamp.progress import Tick
from tipdamp.stages.stage import Stage
from tipdamp.store import Store
from tipdamp.study.view import PARTS, Study


def report(study: Study, store: Store, tick: Tick) -> list[str]:
    """Write the page of what the stages before it found."""
    from tipdamp.report.page import write_report

    return write_report(study, store, tick)


def line(store: Store) -> str:
    """Where the page is."""
    return str(store.path("report.html"))


def warnings(_: Study, __: Store) -> list[str]:
    """None: those of the report stand on its page."""
    return []


STAGE = Stage(report, line, warnings, outputs=("report.html", "summary.json"), reads=PARTS,
              needs=("inspect", "reduce", "preload", "tune", "respond"))
