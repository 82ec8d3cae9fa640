"""Table: force per length, half-width and peak pressure of round sides, station by station."""

from collections.abc import Iterator

import numpy as np

from tipdamp.fields.line_contact import LineContact, line_contacts
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import MM, number


def lines_of(results: Results) -> list[LineContact]:
    """Of the round sides whose radius and elastic constants are known, where the strip in contact
    is narrower than a row of pairs."""
    if results.whole is None or results.preload is None:
        return []
    known = {
        name: (side.radius, made.E_star_Pa)
        for name, side in results.study.sides.items()
        if side.shape == "cylinder"
        and side.radius
        and (made := results.preload.stiffness.get(name)) is not None
        and made.E_star_Pa
    }
    lines = line_contacts(results.whole, np.asarray(results.axis), known)
    force = results.whole.preload
    return [one for one in lines if 2 * one.half_width(force).max() < one.spacing]


def tables(results: Results) -> Iterator[Table]:
    """One table for each of these sides."""
    for line in lines_of(results):
        force = results.whole.preload  # type: ignore[union-attr]
        rows = zip(
            line.along, line.load(force), line.half_width(force), line.peak(force), strict=True
        )
        yield Table(
            f"Line contact on side '{line.side}', R = {MM * line.radius:.4g} mm: force per length "
            "under the preload, and half-width and peak pressure of Hertz for it. A strip in "
            "contact so narrow lies between the nodes: nodal force over area is no pressure.",
            ("along the axis (mm)", "N/mm", "half-width (mm)", "peak pressure (MPa)"),
            tuple(
                (number(MM * at), number(1e-3 * load), number(MM * half), number(1e-6 * peak))
                for at, load, half, peak in rows
            ),
        )
