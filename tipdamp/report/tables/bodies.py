"""Table: what the meshes or matrices hold."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, listing, number


def tables(results: Results) -> Iterator[Table]:
    """One row for each body, where the study was inspected."""
    if results.inspect is None:
        return
    pairs = listing(f"{n} on '{side}'" for side, n in results.inspect.pairs.items())
    yield Table(f"Bodies as read. Contact pairs of the whole patch: {pairs}.",
                ("body", "from", "nodes", "free dofs", "moving mass (kg)", "rigid modes"),
                tuple(_row(name, body) for name, body in results.inspect.bodies.items()), left=(0, 1))


def _row(name, body):
    if body.nodes is None:
        return name, "matrices", NOTHING, f"{body.dofs}", NOTHING, NOTHING
    cells = listing(f"{n} {kind}" for kind, n in body.cells.items())
    return (name, f"{body.file}: {cells}", f"{body.nodes}", f"{body.free_dofs}", number(body.moving_mass_kg[0]),
            f"{body.rigid_modes}")
