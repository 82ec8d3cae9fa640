"""Figure: linear response of both blades without damper."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import BLUE, GREY, INK, VERMILION, Curve, Figure, Line, Panel
from tipdamp.report.results import Results
from tipdamp.report.text import hertz, listing

STILL = 1e-6  # of the largest amplitude: less is a blade that nothing excites
STYLES = ((BLUE, "solid"), (VERMILION, "dash"))


def figures(results: Results) -> Iterator[Figure]:
    """One figure, where the study has response patches."""
    if results.reduce is None or results.reduce.free_response is None:
        return
    response, free = results.reduce.free_response, results.reduce.free_hz
    hz = np.array(response.hz, dtype=float)
    curves = [
        Curve(hz, np.array(y, dtype=float), f"blade {k + 1} ({patch})", *style)
        for k, ((patch, y), style) in enumerate(zip(response.m_per_N.items(), STYLES, strict=False))
    ]
    highest = max(c.y.max() for c in curves)
    moving = [c for c in curves if c.y.max() > STILL * highest]
    lowest = min(c.y.min() for c in moving)
    still = "".join(
        f" Not shown: {c.name}, which the excitation does not reach (less than {STILL:g} of the "
        "other)."
        for c in curves
        if c.y.max() <= STILL * highest
    )
    lines = [
        line for line in _lines(free, results.study.reference) if hz[0] <= line.value <= hz[-1]
    ]
    zeta = listing(f"{100 * z:g} %" for z in results.study.free.damping_ratio)
    where = (
        f"Out of phase the blades vibrate at {hertz(free['out_of_phase'])} Hz, in phase at "
        f"{hertz(free['in_phase'])} Hz."
        if free
        else "No mode involves both blades."
    ) + still
    caption = (
        "Linear response of the two blades without damper to the excitation of Fe = 1 N: largest "
        f"amplitude over each response patch, damping ratio {zeta}. {where}"
        + results.beside_paper("Corresponds to figure 2")
    )
    yield Figure(
        "linear_without_damper",
        "Response without damper",
        caption,
        (
            Panel(
                "",
                "frequency (Hz)",
                "amplitude per force (m/N)",
                (*moving, *lines),
                log_y=True,
                x_range=(hz[0], hz[-1]),
                y_range=(0.7 * lowest, 3 * highest),
            ),
        ),
        columns=1,
    )


def _lines(free, reference) -> Iterator[Line]:
    """The named modes, and their reference values."""
    for name, hz in free.items():
        left = hz == min(free.values())
        yield Line("x", hz, f"{name.replace('_', ' ')} {hertz(hz)} Hz", INK, "dot", left=left)
        given = reference.get(f"{name}_hz")
        if given:
            yield Line("x", given, f"reference {given:g} Hz", GREY, "dash", "low", left)
