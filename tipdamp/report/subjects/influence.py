"""What a peak depends on: a bar for each setting, and a map of the pairs whose friction counts."""

from collections.abc import Iterator
from dataclasses import replace

from tipdamp.hbm.drawing.figure import Figure, Panel
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import level_title
from tipdamp.report.text import listing


def figure(results: Results) -> Iterator[Figure]:
    """A row for each level of the largest H."""
    cases = [case for case in results.finest if case.curve.derivatives]
    if not cases or results.kept is None:
        return
    yield Figure(
        "derivatives",
        "What the peak depends on",
        "Left: by how many per cent the peak on the first patch changes with one per cent more of "
        "a setting, of all pairs together. Right: the same for the friction coefficient of each "
        "pair, where it stands, as the area of a disk; blue where more friction lowers the peak."
        + lacking(results),
        [panel for case in cases for panel in _panels(results, case)],
        row_height=300,
    )


def _panels(results: Results, case: ReportedCurve) -> Iterator[Panel]:
    (by,) = case.curve.derivatives.values()
    title = level_title(case)
    yield replace(by.tornado_panel("amplitude"), title=title)
    assert results.kept is not None
    panel = by.map_panel(results.kept, "mu", "amplitude")
    slips = by.relative("mu").any()
    yield replace(panel, title=f"{title}: {panel.title if slips else 'nothing slips'}")


def lacking(results: Results) -> str:
    """A sentence on the levels of the largest H that have no derivatives, and why; empty where all
    have them."""
    without = [case for case in results.finest if not case.curve.derivatives]
    kinked = listing(level_title(case) for case in without if case.has_peak)
    peakless = listing(level_title(case) for case in without if not case.has_peak)
    parts = [f"{kinked} (the curve has a kink at its peak)"] * bool(kinked)
    parts += [f"{peakless} (no peak inside the band)"] * bool(peakless)
    return f" Left out: {'; '.join(parts)}." if parts else ""
