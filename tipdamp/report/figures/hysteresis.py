"""Figure: hysteresis loops and normal forces of the pairs at the peak of the largest level."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import BLUE, INK, VERMILION, Curve, Figure, Item, Panel
from tipdamp.report.results import Results
from tipdamp.report.text import MICRO, listing

SHOWN = 12  # pairs with the largest friction work; the files of the stage `cycles` hold all
COLORS = {"t1": BLUE, "t2": VERMILION, "n": INK}


def figures(results: Results) -> Iterator[Figure]:
    """A panel for each pair that takes most energy, tangential force over motion; and their normal
    forces in time."""
    if not results.periods:
        return
    one = results.periods[-1]
    loops = results.loops[one.file]
    work = np.array([one.friction_J[name] for name in loops.pairs])
    chosen = [
        i for i in map(int, np.argsort(-work, kind="stable")[:SHOWN]) if work[i] > 1e-3 * work.max()
    ] or [0]
    chosen.sort()
    what = f"at the highest point of Fe = {one.Fe_N:g} N, H = {one.H} ({one.hz:.1f} Hz)"
    tangents = [k for k, name in enumerate(loops.components) if name != "n"]
    if tangents:
        yield Figure(
            "hysteresis",
            "Hysteresis loops",
            f"Tangential force over the relative motion about its mean {what}, of the "
            f"{len(chosen)} pairs in which friction takes most: "
            f"{listing(loops.components[k] for k in tangents)} (t1 along the axis of the damper, "
            "t2 across). The area of a loop is the friction work of a period. The files "
            "cycles/*.npz hold every pair and level.",
            tuple(_loop(loops, i, tangents) for i in chosen),
            columns=4,
            row_height=230,
        )
    if "n" in loops.components:
        yield Figure(
            "normal_force",
            "Normal force of the pairs",
            f"Normal force over one period {what}; 0 where a pair is open.",
            tuple(_normal(loops, i) for i in chosen),
            columns=4,
            row_height=200,
        )


def _loop(loops, i, tangents) -> Panel:
    motion = MICRO * (loops.motion[:, i] - loops.motion[:-1, i].mean(axis=0))
    items: list[Item] = [
        Curve(motion[:, k], loops.force[:, i, k], loops.components[k], COLORS[loops.components[k]])
        for k in tangents
    ]
    return Panel(loops.pairs[i], "motion (µm)", "force (N)", tuple(items))


def _normal(loops, i) -> Panel:
    n, share = loops.components.index("n"), loops.time / loops.time[-1]
    force = loops.force[:, i, n]
    return Panel(
        loops.pairs[i],
        "time (periods)",
        "force (N)",
        (Curve(share, force, "normal force", INK),),
        x_range=(0.0, 1.0),
        y_range=(min(0.0, 1.1 * float(force.min())), max(0.0, 1.15 * float(force.max())) or 1.0),
    )
