"""Table: side forces at rest and in every further load case."""

from collections.abc import Iterator

from tipdamp.bodies.loads import case_pull
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import listing, number


def tables(results: Results) -> Iterator[Table]:
    """One table, where the study has further load cases."""
    preload, whole = results.preload, results.whole
    if preload is None or whole is None or not results.loads:
        return
    names, case = whole.sides, results.study.preload.case
    rest = (
        (f"{case} (of the response)", "")
        if case
        else ("the pull", f"{results.study.driver.pull:g}")
    )
    rows = [(*rest, *_sides(preload.sides, names))]
    for name, facts in preload.cases.items():
        load, pull = results.study.loads[name], case_pull(results.study, name)
        rows.append((f"{name}: {_content(load)}", f"{pull:g}", *_sides(facts.sides, names)))
    columns = (
        "load case",
        "pull (N)",
        *(what for n in names for what in (f"'{n}', sum (N)", "largest (N)", "open")),
    )
    yield Table(
        "Preload of the whole patch in every load case: sum and largest force of the pairs of "
        "each side, and the number of open pairs.",
        columns,
        tuple(rows),
    )


def _sides(found, names):
    return [
        text
        for n in names
        for text in (number(found[n].sum_N), number(found[n].max_N), f"{found[n].detached}")
    ]


def _content(load) -> str:
    """What a load case holds beside the pull."""
    parts = [f"{load.speed:g} rad/s"] if load.speed else []
    if any(load.gravity):
        parts.append(f"gravity ({', '.join(f'{v:g}' for v in load.gravity)}) m/s²")
    for what, given in (
        ("forces", load.forces),
        ("pressure", load.pressure),
        ("traction", load.traction),
    ):
        parts += [f"{what} on {body}, '{group}'" for body, group, *_ in given]
    return listing(parts) or "another pull"
