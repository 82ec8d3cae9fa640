"""Table: energy of a period at the peak of every curve."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import MICRO, hertz, number, percent


def tables(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    if results.cycles is None or not results.cycles.curves:
        return
    yield Table(
        "Energy of one period at the highest point of each curve: what the excitation puts in is "
        "lost in the damping of the structure and in friction. Friction is taken from the slip "
        "of each contact in time, not from harmonics, so that the error of the balance is a "
        "check of the solution.",
        (
            "H",
            "Fe (N)",
            "at (Hz)",
            "input (µJ)",
            "damping (µJ)",
            "friction (µJ)",
            "friction share",
            "error",
        ),
        tuple(_row(one) for one in sorted(results.cycles.curves, key=lambda c: (c.H, c.Fe_N))),
    )


def _row(one):
    return (
        f"{one.H}",
        f"{one.Fe_N:g}",
        hertz(one.hz),
        number(one.input_J, 4, MICRO),
        number(one.damping_J, 4, MICRO),
        number(sum(one.friction_J.values()), 4, MICRO),
        percent(one.friction_share, 1).lstrip("+"),
        number(one.error, 1),
    )
