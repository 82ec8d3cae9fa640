"""Tables: where the results come from: bodies as read, stages with their time, versions."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, listing, number
from tipdamp.report.versions import versions
from tipdamp.stages import STAGES
from tipdamp.stages.results import InspectedBody


def tables(results: Results) -> Iterator[Table]:
    """Bodies where the study was inspected, stages before the report, versions of what is installed."""
    if results.inspect is not None:
        pairs = listing(f"{n} on '{side}'" for side, n in results.inspect.pairs.items())
        yield Table(f"Bodies as read. Contact pairs of the whole patch: {pairs}.",
                    ("body", "from", "nodes", "free dofs", "moving mass (kg)", "rigid modes"),
                    tuple(_body(name, body) for name, body in results.inspect.bodies.items()), left=(0, 1))
    yield Table(f"Stages before this report, {sum(results.seconds.values()):.1f} s in total.",
                ("stage", "what it does", "seconds"),
                tuple((name, STAGES[name], f"{seconds:.1f}") for name, seconds in results.seconds.items()),
                left=(0, 1))
    found = versions()
    yield Table("Versions.", tuple(found), (tuple(found.values()),), left=tuple(range(len(found))))


def _body(name: str, body: InspectedBody) -> tuple[str, ...]:
    if body.moving_mass_kg is None:
        return name, "matrices", NOTHING, f"{body.dofs}", NOTHING, NOTHING
    cells = listing(f"{n} {kind}" for kind, n in body.cells.items())
    return (name, f"{body.file}: {cells}", f"{body.nodes}", f"{body.free_dofs}", number(body.moving_mass_kg[0]),
            f"{body.rigid_modes}")
