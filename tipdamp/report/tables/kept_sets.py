"""Table: sets of stations that fit the target equally well."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import hertz, number

SHOWN = 20
HEAD = (
    "stations, front + back",
    "stuck frequency (Hz)",
    "off the target (Hz)",
    "energy-weighted MAC",
)


def tables(results: Results) -> Iterator[Table]:
    """One table, where the study states the scatter of its target."""
    tune = results.tune
    if tune is None or not tune.history or not tune.scatter_hz or not tune.target_hz:
        return
    sets = tune.equivalent
    scatter = (
        f"{number(tune.scatter_hz, 3)} Hz of the target of {tune.target_hz:g} Hz, its measured "
        "scatter"
    )
    if not sets:
        target = tune.target_hz
        yield Table(
            f"No set of whole stations lies within {scatter}; the nearest of {len(tune.history)}.",
            HEAD,
            (_row(min(tune.history, key=lambda s: abs(s.hz - target)), target),),
        )
        return
    more = f" The nearest {SHOWN} are shown." if len(sets) > SHOWN else ""
    yield Table(
        f"{len(sets)} of {len(tune.history)} sets of whole stations lie within {scatter}, and fit "
        f"equally well: the measurement does not tell them apart.{more}",
        HEAD,
        tuple(_row(s, tune.target_hz) for s in sets[:SHOWN]),
    )


def _row(step, target_hz):
    return (
        f"{step.front} + {step.back}",
        hertz(step.hz),
        f"{step.hz - target_hz:+.1f}".replace("-", "\N{MINUS SIGN}"),
        number(step.mac, 3),
    )
