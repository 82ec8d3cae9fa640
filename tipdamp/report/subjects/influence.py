"""What a peak depends on: a bar for each setting, and a map of the pairs whose friction counts."""

from collections.abc import Iterator
from dataclasses import replace

from tipdamp.hbm.drawing.figure import Figure, Panel
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import level_title


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
        "pair, where it stands, as the area of a disk; blue where more friction lowers the peak. "
        "Levels whose curve has no smooth peak inside the band have none.",
        [panel for case in cases for panel in _panels(results, case)],
        row_height=300,
    )


def _panels(results: Results, case: ReportedCurve) -> Iterator[Panel]:
    (by,) = case.curve.derivatives.values()
    title = level_title(case)
    yield replace(by.tornado_panel("amplitude"), title=title)
    assert results.kept is not None
    panel = by.map_panel(results.kept, "mu", "amplitude")
    yield replace(panel, title=f"{title}: {panel.title}")
