"""Table: the scaled preload of what is kept beside the one that static contact gives it."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import force_along, listing, moment, number


def tables(results: Results) -> Iterator[Table]:
    """One row for each side, where scaling leaves more than a small moment."""
    tune = results.tune
    if tune is None or tune.redistribution.resolved is None:
        return
    done, again = tune.redistribution, tune.redistribution.resolved
    taken = listing(force_along(motion, load) for motion, load in again.reactions.items())
    said = (
        f"refused: {again.refused}"
        if again.refused
        else f"with a constraint against {taken}"
        if taken
        else "without a constraint"
    )
    sides = {side: again.sides.get(side) for side in tune.preload_kept}
    share = number(100 * (done.moment_share or 0.0), 2)
    yield Table(
        f"Preload of the {tune.kept_name}, scaled to the whole load and solved again. Scaling "
        f"leaves a moment "
        f"of {moment(done, results.axis)}, {share} % of the load times the length of "
        f'the contact; preload = "resolved" has none: {said}.',
        (
            "side",
            "scaled (N)",
            "largest (N)",
            "open pairs",
            "solved again (N)",
            "largest (N)",
            "open pairs",
        ),
        tuple(
            (
                side,
                number(s.sum_N, 4),
                number(s.max_N, 4),
                f"{s.detached}",
                *(
                    (number(r.sum_N, 4), number(r.max_N, 4), f"{r.detached}")
                    if (r := sides[side])
                    else ("", "", "")
                ),
            )
            for side, s in tune.preload_kept.items()
        ),
    )
