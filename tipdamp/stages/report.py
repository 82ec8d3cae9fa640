"""Stage report: one HTML page, the figures and summary.json."""

from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Workers
from tipdamp.report.write import write_report
from tipdamp.results import ON_REQUEST, STAGES
from tipdamp.stages.stage import Stage, load_stage
from tipdamp.study.view import PARTS, Study

BEFORE = {name: load_stage(name) for name in STAGES if name != "report"}
MAY_LACK = "backbone"  # asked for at amplitudes where there is none it fails, and the rest is there


def report(study: Study, store: Store, tick: Tick, workers: Workers) -> list[str]:
    """Write the page of what the stages before it found."""
    return write_report(study, store, tick, said(study, store), workers)


def said(study: Study, store: Store) -> dict[str, list[str]]:
    """{stage: its warnings} of the stages that the study asks for and that have run; under 'report'
    which of them is left out."""
    from tipdamp.stages.run import stage_key  # which knows this stage

    asked = [
        name
        for name, stage in BEFORE.items()
        if not stage.lacks(study) and store.path(f"{name}.json").is_file()
    ]
    lacks = not BEFORE[MAY_LACK].lacks(study) and not store.is_current(
        MAY_LACK, stage_key(MAY_LACK, study, store)
    )
    found = {
        name: list(BEFORE[name].warnings(study, store))
        for name in asked
        if not (lacks and name == MAY_LACK)
    }
    if lacks:
        found["report"] = [
            f"'{MAY_LACK}' was not run with this study, or ended with an error: it is left out"
        ]
    return found


def line(store: Store) -> str:
    """Where the page is."""
    return str(store.path("report.html"))


STAGE = Stage(
    report,
    line,
    outputs=("report.html", "summary.json"),
    may_write=("figures/*.png", "figures/*.csv"),
    reads=PARTS,
    needs=tuple(name for name in BEFORE if name != MAY_LACK),
    uses=(*ON_REQUEST, MAY_LACK),
    parallel=True,
)
