"""The two-blade rig's tuned set against time integration, at the peak and within 50 Hz of it."""

import numpy as np

from tests.hbm.cases import rig
from tests.validation import Row, Subject
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.time.settings import IntegrationSettings

BAND = (2300, 3300)
# Hz from the peak at H = 5
AROUND = (0.0, -50.0, -35.0, -20.0, -10.0, -5.0, 5.0, 10.0, 20.0, 35.0, 50.0)


def rows(levels=(12, 20), harmonics=(5, 9), around=(0.0,)):
    problem, force, outputs = rig()
    name = next(iter(outputs))
    outputs = {name: outputs[name]}
    for level in levels:
        given = dict(outputs=outputs, truncation=False)
        first = follow_band(problem, level * force, BAND, harmonics=5, **given)
        peak = find_peaks(first, problem, name, "harmonic")[0, 0]
        for H in harmonics:
            curve = follow_band(
                problem,
                level * force,
                BAND,
                harmonics=H,
                at=peak + np.array(around),
                **given,
            )
            for step in around:
                yield _beside(
                    curve,
                    problem,
                    peak + step,
                    f"{'within 50 Hz' if step else 'at the peak'}, {level} N",
                )


def _beside(curve, problem, hz, where):
    """The solution of the largest amplitude beside the integration from its own orbit.

    Contacts that stick all through keep their sliders where they are: a continuum of steady states,
    each on its orbit."""
    case = f"{hz:.2f} Hz, H = {curve.H}"
    found = np.abs(solutions_at(curve, problem, hz)[:, 0, 1])
    if not len(found):
        return Row(case, "no solution", "", np.nan, f"not comparable, {where}, H = {curve.H}")
    c = compare(
        curve,
        problem,
        hz,
        int(found.argmax()),
        IntegrationSettings(tolerance=1e-5, max_periods=500),
    )
    against = f"{where}, H = {curve.H}" if c.agrees else f"not comparable, {where}, H = {curve.H}"
    return Row(case, found.max(), abs(c.steady.harmonics[0, 1]), float(c.difference), against)


SUBJECT = Subject(
    "Two-blade rig against time integration",
    "Harmonic 1 of the first output in m, from the orbit of each H, at frequencies counted from "
    "the peak of harmonic 1 at H = 5; where a curve passes a frequency several times, the "
    "largest amplitude. Modes above 50 times the excitation follow statically. Not comparable: "
    "the integration is not periodic within 500 periods, or leads to another orbit. With --long, "
    "the frequencies beside the peak.",
    rows,
    {
        f"{where}, {level} N, H = {H}": limit
        for level in (12, 20)
        for where, H, limit in (
            ("at the peak", 5, 3e-3),
            ("within 50 Hz", 5, 1.5e-2),
            ("at the peak", 9, 5e-3),
            ("within 50 Hz", 9, 5e-3),
        )
    },
    long=lambda: rows(around=AROUND),
)
