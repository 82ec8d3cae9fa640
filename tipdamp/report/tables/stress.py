"""Table: the largest vibratory stresses, with the mean stress there."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import MEGA, MM, hertz, micro, number
from tipdamp.results.response_results import PeakStress, StressPlace


def tables(results: Results) -> Iterator[Table]:
    """All places of the largest level; of the others the largest of each body."""
    curves = sorted(results.stress.curves if results.stress else (), key=lambda one: one.Fe_N)
    if not curves:
        return
    rows = [
        _row(one, place)
        for one in curves
        for i, place in enumerate(one.places)
        if one is curves[-1] or place.body not in [before.body for before in one.places[:i]]
    ]
    yield Table(
        "Vibratory stress at the peak of blade 1, at the nodes where it is larger than all "
        "around them. Alternating: half of the largest von Mises range between two instants of a "
        "period. Mean: von Mises stress of the mean, at rest and by the vibration. At nodes "
        "where single forces act (contact pairs, excitation) stress depends on the mesh. "
        "vibration_*.vtu hold the whole fields.",
        (
            "H",
            "Fe (N)",
            "at (Hz)",
            "body",
            "node",
            "x, y, z (mm)",
            "alternating (MPa)",
            "mean (MPa)",
            "amplitude (µm)",
        ),
        tuple(rows),
        left=(3, 5),
    )


def _row(one: PeakStress, place: StressPlace) -> tuple[str, ...]:
    return (
        f"{one.H}",
        f"{one.Fe_N:g}",
        hertz(one.hz),
        place.body,
        f"{place.node}",
        ", ".join(f"{MM * x:.2f}" for x in place.position_m),
        number(place.alternating_Pa, 4, 1 / MEGA),
        number(place.mean_Pa, 4, 1 / MEGA),
        micro(place.amplitude_m),
    )
