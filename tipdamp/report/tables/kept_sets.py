"""Table: sets of stations that fit the target equally well."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import hertz, number

SHOWN = 20


def tables(results: Results) -> Iterator[Table]:
    """One table, where the study states the scatter of its target."""
    tune = results.tune
    if tune is None or not tune.scatter_hz or not tune.target_hz:
        return
    sets = tune.equivalent
    rows = [(f"{s.front} + {s.back}", hertz(s.hz), f"{s.hz - tune.target_hz:+.1f}".replace("-", "\N{MINUS SIGN}"),
             number(s.mac, 3)) for s in sets[:SHOWN]]
    more = f" The nearest {SHOWN} are shown." if len(sets) > SHOWN else ""
    yield Table(f"{len(sets)} of {len(tune.history)} sets of whole stations lie within {tune.scatter_hz:g} Hz of the "
                f"target of {tune.target_hz:g} Hz, its measured scatter, and fit equally well: the measurement does "
                f"not tell them apart.{more}", ("stations, front + back", "stuck frequency (Hz)", "off the target (Hz)",
                                           "energy-weighted MAC"), tuple(rows))
