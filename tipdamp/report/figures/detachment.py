"""Figure: history of detachment, the stuck frequency and the MAC over the number of kept stations."""

from collections.abc import Iterator

import numpy as np

from tipdamp.report.drawing.figure import BLUE, INK, VERMILION, Curve, Figure, Item, Line, Marks, Panel
from tipdamp.report.results import Results
from tipdamp.report.text import hertz

STATIONS = "kept stations on each side"


def figures(results: Results) -> Iterator[Figure]:
    """One figure, where stations were detached to meet a target."""
    if results.tune is None or not results.tune.target_hz:
        return
    steps = sorted(results.tune.history, key=lambda s: s.front + s.back)
    count = np.array([s.front + s.back for s in steps], dtype=float)
    hz, mac = np.array([s.hz for s in steps]), np.array([s.mac for s in steps])
    known = _reference(results.study.reference, count.max())
    seen = [*hz, results.tune.target_hz, *known[:, 1]]
    low, high = min(seen) - 0.12 * np.ptp(seen), max(seen) + 0.06 * np.ptp(seen)
    mode = results.study.tune.follow.replace("_", "-")
    caption = (f"Stations are detached from the middle outwards. Left: frequency of the {mode} mode of the stuck "
               "assembly. Right: its energy-weighted MAC with the mode without damper (MAC of the blades times their "
               "share of the kinetic energy), by which it is tracked through changes of order; a dip marks a crossing "
               "with another mode." + results.beside_paper("Corresponds to the tuning in section 8"))
    yield Figure("tuning", "Tuning by detachment", caption, (
        Panel("", STATIONS, "stuck frequency (Hz)", tuple(_frequency(results.tune, count, hz, known)),
              y_range=(low, high)),
        Panel("", STATIONS, "energy-weighted MAC", (Curve(count, mac, "", BLUE), Marks(count, mac, "", BLUE, size=5)),
              y_range=(0, 1))))


def _frequency(tune, count, hz, known) -> Iterator[Item]:
    kept = tune.tuned_pairs
    yield Curve(count, hz, "", BLUE)
    yield Marks(count, hz, "tracked mode", BLUE, size=5)
    yield Line("y", tune.target_hz, f"target {tune.target_hz:g} Hz", VERMILION)
    yield Marks(np.array([kept.front + kept.back]), np.array([tune.stuck_hz.tuned]), "chosen", VERMILION, "diamond",
                size=11, labels=(f"{kept.front} + {kept.back}: {hertz(tune.stuck_hz.tuned)} Hz",))
    if len(known):
        yield Marks(known[:, 0], known[:, 1], "reference", INK, "square", filled=False, size=9)


def _reference(reference, most) -> np.ndarray:
    """(n, 2): stations and Hz of the whole line and of the kept stations, as far as the study states them."""
    stations = sum(reference.get(k, 0) for k in ("front", "back"))
    found = [(most, reference.get("full_line_hz")), (stations, reference.get("tuned_hz"))]
    return np.array([(n, f) for n, f in found if n and f], dtype=float).reshape(-1, 2)
