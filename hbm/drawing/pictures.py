"""The pictures that results draw of themselves, on given axes or on new ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.drawing.axes import SETTINGS, draw_panel, plain_text
from tipdamp.hbm.drawing.branches import (
    BIFURCATIONS,
    CONTACTS,
    Place,
    between_points,
    branch_lines,
    error_band,
    failures,
    named_amplitudes,
    named_marks,
    outermost,
    peak_mark,
)
from tipdamp.hbm.drawing.figure import (
    BLUE,
    COMPONENTS,
    GREEN,
    GREY,
    INK,
    ORANGE,
    VERMILION,
    Band,
    Curve,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.hbm.drawing.preload_items import lowest_shown, row_items
from tipdamp.hbm.errors import InputError, library, nearest

if TYPE_CHECKING:
    from tipdamp.hbm.contact import ContactTable
    from tipdamp.hbm.result import ForcedResponse

BAR = 0.3  # half the thickness of a bar
LINE = 0.006  # of the height of a picture: a line, behind which a thinner band is not seen
LARGEST_DISK = 22.0  # points across
CYCLE = (BLUE, VERMILION, GREEN, ORANGE, INK)
UNITS = {"m": 1.0, "mm": 1e3, "um": 1e6}
KEPT_STATIONS = "kept stations on each side"
SHOWN = {"m": "m", "mm": "mm", "um": "µm"}
KIND = {"half_peak_to_peak": "amplitude", "rms": "rms", "harmonic": "harmonic"}


def on_axes(panel: Panel, ax: Any = None) -> Any:
    """The axes with the panel drawn on them; new ones of pyplot without any given. What was on them
    keeps its entries of the legend."""
    if ax is None:
        pyplot = library("matplotlib.pyplot", "a picture")
        with pyplot.rc_context(SETTINGS):
            ax = pyplot.subplots(layout="constrained")[1]
    handles: dict[str, Any] = {}
    draw_panel(ax, panel, handles)
    known = ax.get_legend_handles_labels()[1]
    for name, handle in handles.items():
        if plain_text(name) not in known:
            handle.set_label(plain_text(name))
    if len(known) + len(handles) > 1:
        ax.legend(frameon=False, fontsize=9)
    return ax


def free_color(ax: Any, k: int = 0) -> str:
    """The k-th colour after those of the solid lines that the axes have."""
    used = 0 if ax is None else sum(line.get_linestyle() == "-" for line in ax.lines)
    return CYCLE[(used + k) % len(CYCLE)]


def factor_of(unit: str) -> float:
    """What metres are multiplied by; InputError where the unit is none."""
    if unit not in UNITS:
        raise InputError(f"unit = '{unit}': {nearest(unit, tuple(UNITS))}")
    return UNITS[unit]


def response(
    curve: ForcedResponse,
    names: Sequence[str],
    amplitude: tuple[str, int | None],
    unit: str,
    styles: Iterable[tuple[str, str, float]],
    ax: Any,
) -> Any:
    """Amplitudes (kind, order) of outputs along a curve; styles : (label, colour, width) of
    each."""
    items: list[Item] = []
    for name, style in zip(names, styles, strict=False):
        items += _amplitude_items(curve, name, amplitude, factor_of(unit), style)
    over = "frequency (Hz)" if curve.parameter_name == "frequency" else curve.over
    return on_axes(Panel("", over, f"{KIND[amplitude[0]]} ({SHOWN[unit]})", tuple(items)), ax)


def _amplitude_items(
    curve: ForcedResponse,
    name: str,
    amplitude: tuple[str, int | None],
    factor: float,
    style: tuple[str, str, float],
) -> Iterator[Item]:
    kind, order = amplitude
    label, color, width = style
    j = curve.column(name)
    a = factor * curve.amplitude(kind, order)[:, j]
    solved = kind == "half_peak_to_peak"
    named = factor * named_amplitudes(curve)[:, j] if solved else between_points(curve, a)
    yield from branch_lines(curve, a, named, label, color, width)
    if curve.truncation.size:
        share = 1.0 if kind == "rms" else np.sqrt(2)
        error = factor * share * curve.truncation[:, j]
        band = error_band(curve, a, error, color)
        seen = 2 * np.nanmax(error, initial=0.0) > LINE * np.nanmax(a, initial=0.0)
        yield band if seen else replace(band, name="")
    yield from _named_marks(curve, named, color)
    if solved and curve.peak_points.size and np.isfinite(a).any():
        top = int(np.nanargmax(a))
        if curve.peak_points[top, j]:
            yield peak_mark(float(curve.parameter[top]), float(a[top]), color)
    yield from failures(curve, a, curve.complete)


def _named_marks(curve: ForcedResponse, heights: np.ndarray, color: str) -> Iterator[Item]:
    places = [
        Place(one.kind, one.parameter, height)
        for one, height in zip(curve.named_points, heights, strict=True)
    ]
    yield from named_marks(places, BIFURCATIONS, color)
    yield from named_marks(outermost(places), CONTACTS, color)


def period(
    seconds: float, motions: Mapping[str, np.ndarray], unit: str, dashes: Sequence[str], ax: Any
) -> Any:
    """Motions {name: (H+1,) harmonics} over a period; dashes : of each."""
    tau = np.linspace(0, 2 * np.pi, 401)
    items = tuple(
        Curve(
            tau / (2 * np.pi) * seconds,
            factor_of(unit) * fourier.basis(tau, len(X) - 1) @ fourier.to_real(X),
            name,
            free_color(ax, k),
            dash,
        )
        for k, ((name, X), dash) in enumerate(zip(motions.items(), dashes, strict=True))
    )
    return on_axes(Panel("", "time (s)", f"motion ({SHOWN[unit]})", items), ax)


def loop(
    motion: np.ndarray,
    force: np.ndarray,
    components: Sequence[str],
    unit: str,
    label: str,
    ax: Any,
) -> Any:
    """Force over motion (n, nd) of one contact about its mean; label : '' for names and colours of
    the components alone."""
    items = tuple(
        Curve(
            factor_of(unit) * (motion[:, k] - motion[:-1, k].mean()),
            force[:, k],
            f"{label} {name}" if label and len(components) > 1 else label or name,
            free_color(ax, k) if label else COMPONENTS.get(name, BLUE),
        )
        for k, name in enumerate(components)
    )
    return on_axes(Panel("", f"relative motion ({SHOWN[unit]})", "force (N)", items), ax)


def over_frequency(hz: np.ndarray, amplitude: np.ndarray, name: str, unit: str, ax: Any) -> Any:
    """An amplitude (n,) m over the frequency (n,) Hz that goes with it, between curves of a
    response."""
    line = Curve(hz, factor_of(unit) * amplitude, name, INK, "dashdot")
    return on_axes(Panel("", "frequency (Hz)", f"amplitude ({SHOWN[unit]})", (line,)), ax)


def bars(rows: Sequence[tuple[str, float]], label: str, ax: Any) -> Any:
    """A bar for each (name, value), the first below."""
    return on_axes(bar_panel(rows, label), ax)


def bar_panel(rows: Sequence[tuple[str, float]], label: str) -> Panel:
    """What `bars` draws."""
    items: list[Item] = [Curve([0.0, 0.0], [0.0, len(rows)], "", INK, width=0.8)]
    for i, (_, value) in enumerate(rows):
        low, high = np.full(2, i + 0.45 - BAR), np.full(2, i + 0.45 + BAR)
        color = VERMILION if value > 0 else BLUE
        items.insert(i, Band(np.array([0.0, value]), low, high, "", color, 0.9))
    return Panel("", label, "", tuple(items), y_names=[name for name, _ in rows])


def pair_panel(pairs: ContactTable, values: np.ndarray, title: str) -> Panel:
    """Pairs where they stand, in the two directions in which they are farthest apart: a disk of the
    area of each value (P,), vermilion above zero; the largest with its number."""
    low, high = pairs.position.min(axis=0), pairs.position.max(axis=0)
    across, along = np.argsort(high - low, kind="stable")[-2:]
    x, y = (1e3 * pairs.position[:, k] for k in (along, across))
    largest = max(float(np.abs(values).max()), 1e-300)
    items: list[Item] = []
    for i, value in enumerate(values):
        color = VERMILION if value > 0 else BLUE
        label = (f"{value:+.2g}",) if abs(value) == largest else ()
        size = LARGEST_DISK * np.sqrt(abs(value) / largest)
        items.append(Marks(x[[i]], y[[i]], "", GREY, size=2.0))
        items.append(Marks(x[[i]], y[[i]], "", color, size=size, labels=label))
    wide, tall = (0.08 * (np.ptp(one) or 1.0) for one in (x, y))
    return Panel(
        title,
        f"{'xyz'[along]} (mm)",
        f"{'xyz'[across]} (mm)",
        tuple(items),
        x_range=(x.min() - wide, x.max() + wide),
        y_range=(y.min() - 2 * tall, y.max() + 2 * tall),
    )


def preload_map(pairs: ContactTable, side: str, ax: Any) -> Any:
    """Normal preload of one side along the coordinate that the rows of all sides follow most;
    several sides can share axes."""
    rows = {name: 1 + int(pairs.row[pairs.side == name].max()) for name in pairs.sides}
    before = sum(rows[name] for name in pairs.sides[: pairs.sides.index(side)])
    mine, along = pairs.select(pairs.side == side), _along_rows(pairs, rows)
    low = lowest_shown(pairs.preload)
    items: list[Item] = [Line("y", 0.0, color=GREY, dash="solid")]
    for row in np.unique(mine.row):
        of_row = mine.row == row
        name = f"{side}, row {row}" if len(pairs.sides) > 1 else f"row {row}"
        place = 1e3 * mine.position[of_row, along]
        items += row_items(place, mine.preload[of_row], name, int(row), low, before)
    at = f"{'xyz'[along]} (mm)"
    return on_axes(Panel(f"side '{side}'", at, "normal preload (N)", tuple(items)), ax)


def _along_rows(pairs: ContactTable, rows: Mapping[str, int]) -> int:
    """Number of the coordinate that the rows of all sides, so many of each, follow most."""
    places = (
        pairs.position[(pairs.side == name) & (pairs.row == row)]
        for name, count in rows.items()
        for row in range(count)
    )
    spans = [np.ptp(place, axis=0) for place in places if len(place) > 1]
    return int(np.sum([*spans, 1e-9 * np.ptp(pairs.position, axis=0)], axis=0).argmax())


def sets_tried(
    count: np.ndarray, hz: np.ndarray, chosen: int, target: float | None, ax: Any
) -> Any:
    """Stuck frequencies of sets of kept stations, the chosen one filled, and the target."""
    items: list[Item] = [
        Marks(count, hz, "sets tried", GREY, filled=False, size=6),
        Marks(count[[chosen]], hz[[chosen]], "chosen", BLUE),
    ]
    if target is not None:
        items.append(Line("y", target, f"target {target:g} Hz", VERMILION))
    panel = Panel("", KEPT_STATIONS, "stuck frequency (Hz)", tuple(items), whole_x=True)
    return on_axes(panel, ax)
