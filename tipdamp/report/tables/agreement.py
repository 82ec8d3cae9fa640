"""Tables: measured curves with their damping, and how far the computed ones agree."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, hertz, micro, number, percent
from tipdamp.results.response_results import MeasuredDamping


def tables(results: Results) -> Iterator[Table]:
    """The measured curves; then a row for each computed curve beside one of them."""
    if results.measured is None:
        return
    yield Table(
        "Measured curves: mean over the repeats, with one standard deviation. Damping by "
        "half-power bandwidth and by circle fit; a dash where the method was refused.",
        (
            "curve",
            "Fe (N)",
            "repeats",
            "points",
            "peak (Hz)",
            "peak (µm/N)",
            "half-power",
            "circle fit",
        ),
        tuple(_measured(name, one) for name, one in results.measured.curves.items()),
    )
    found = results.agreement
    if found and found.curves:
        yield Table(
            "Computed beside measured curves. Inside: share of the common measured frequencies "
            "at which the computed curve lies in the measured band. Half-power of the computed "
            f"curve is read at the measured frequencies, as on a measured one. {found.zeta:g} was "
            "put into the computation; bias is what half-power makes of it: friction and "
            "neighbouring modes count as damping.",
            ("measured", "Fe (N)", "H", "inside", "peak", "frequency", "half-power", "bias"),
            tuple(_computed(one, found.zeta) for one in found.curves),
        )


def _measured(name, one):
    return (
        name,
        f"{one.level_N:.4g}",
        f"{one.repeats}",
        f"{one.points}",
        _plus_minus(hertz(one.peak_hz), hertz(one.peak_hz_deviation)),
        _plus_minus(micro(one.peak_m_per_N), number(one.peak_m_per_N_deviation, 2, 1e6)),
        _zeta(one.half_power),
        _zeta(one.circle_fit),
    )


def _computed(one, zeta):
    identified = one.half_power.zeta
    return (
        one.measured,
        f"{one.Fe_N:g}",
        f"{one.H}",
        percent(one.share_inside, 0).lstrip("+"),
        percent(one.peak),
        percent(one.frequency),
        _zeta(one.half_power),
        percent(identified / zeta - 1 if identified else None, 1),
    )


def _zeta(damping: MeasuredDamping) -> str:
    return _plus_minus(number(damping.zeta), number(damping.deviation, 2))


def _plus_minus(value: str, deviation: str) -> str:
    return value if NOTHING in (value, deviation) else f"{value} ± {deviation}"
