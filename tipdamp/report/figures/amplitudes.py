"""What the figures of the forced response share: panels of amplitude, marks of failed points, lists of levels."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.report.drawing.figure import VERMILION, Curve, Item, Marks, Panel
from tipdamp.report.results import Case, Results
from tipdamp.report.text import listing


def amplitude_panel(results: Results, title: str, label: str, items: Sequence[Item]) -> Panel:
    """Amplitude from zero over the band."""
    top = max((np.nanmax(i.y) for i in items if isinstance(i, Curve) and np.isfinite(i.y).any()), default=1.0)
    return Panel(title, "frequency (Hz)", label, tuple(items), x_range=tuple(results.study.respond.band),
                 y_range=(0.0, 1.06 * top))


def failures(case: Case, amplitude: np.ndarray) -> Iterator[Item]:
    """A mark on the gap of each failed point, at the height of its neighbours, and where a curve stops early."""
    hz, bad = case.curve.frequency, ~np.isfinite(amplitude)
    if not case.facts.complete and not bad.any():
        yield Marks(hz[-1:], amplitude[-1:], "curve stops", VERMILION, "diamond", filled=False, size=10)
    if bad.any():
        at = np.arange(len(hz))
        height = np.interp(at[bad], at[~bad], amplitude[~bad]) if not bad.all() else np.zeros(bad.sum())
        yield Marks(hz[bad], height, "failed point", VERMILION, "x", size=9)


def levels_of(cases: Sequence[Case]) -> str:
    """'Fe = 1, 6 and 20 N'."""
    return f"Fe = {listing(f'{c.Fe:g}' for c in cases)} N"
