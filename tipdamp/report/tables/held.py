"""Table: the force on what holds a rigid motion of the damper."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import MICRO, NOTHING, amount, hertz, number


def tables(results: Results) -> Iterator[Table]:
    """One row for each curve and motion."""
    rows = [
        (
            name,
            f"{case.H}",
            f"{case.Fe:g}",
            hertz(one.hz),
            f"{number(one.mean)} {one.unit}",
            f"{number(one.amplitude)} {one.unit}",
            *(
                (
                    number(case.facts.held_change, 2),
                    number(case.facts.held_reaction_change, 2),
                    _moved(one),
                )
                if one.spring
                else (NOTHING,) * 3
            ),
        )
        for case in results.cases
        for name, one in case.facts.held.items()
    ]
    if rows:
        rest = results.preload.held if results.preload is not None else {}
        at_rest = "".join(
            f" At rest: {amount(force, 'N m' if 'roll' in name else 'N')} ({name})."
            for name, force in rest.items()
        )
        yield Table(
            "Force of the damper on what holds it, at the highest amplitude of blade 1: mean, "
            "and half of peak-to-peak of its vibration, which is the spring's own; beside the "
            "force at rest. With a spring ten times as stiff: largest relative change of peak "
            "and mean force, the latter beside the excitation, and change of a mean force that "
            "follows the stiffness, as sticking contacts carry it, beside itself. Displaced: "
            f"mean of the spring.{at_rest}",
            (
                "motion",
                "H",
                "Fe (N)",
                "at (Hz)",
                "mean",
                "vibration",
                "ten times",
                "of the mean force",
                "displaced",
            ),
            tuple(rows),
            left=(0,),
        )


def _moved(one) -> str:
    return f"{number(one.moved, 3, MICRO)} µm" if one.unit == "N" else f"{number(one.moved, 3)} rad"
