"""The damper over one period at the peaks, with what its contacts do."""

from collections.abc import Iterator

import numpy as np

from tipdamp.bodies import DAMPER
from tipdamp.fields.animation import GAP, SLIP, STICK, nearest, states
from tipdamp.fields.surface import OuterSurface
from tipdamp.hbm import fourier
from tipdamp.hbm.drawing.figure import BLUE, INK, ORANGE
from tipdamp.report.drawing.moving import MovingBodies, MovingContacts, PeriodicMotion
from tipdamp.report.results import Results
from tipdamp.report.subjects.modes import drawn_amplitude
from tipdamp.report.subjects.surroundings import view_of
from tipdamp.results.loops import Loops
from tipdamp.results.response_results import PeakCycle

INSTANTS = 64  # of a period: colours of the contacts
SEEN = 2e-3  # of the largest displacement: an order below it is not drawn
SHOWN = 4  # levels at most, for the size of the page
COLORS = {STICK: ("sticks", BLUE), SLIP: ("slips", ORANGE), GAP: ("open", INK)}


def figure(results: Results) -> Iterator[MovingBodies]:
    """One picture with a choice of levels; none where the damper has no mesh."""
    surface = results.surfaces.get(DAMPER)
    if surface is None or results.kept is None or results.whole is None:
        return
    pairs = results.kept.select(results.kept.carrying)
    every = results.periods
    if not every:
        return
    some = np.unique(np.linspace(0, len(every) - 1, SHOWN).round().astype(int))
    motions = [_motion(every[k], surface, results.loops[every[k].file]) for k in some]
    yield MovingBodies(
        "damper_motion",
        "Motion of the damper",
        "One period of the damper at the highest point of a curve, about its mean and magnified; "
        "each mark is a kept pair, coloured by whether it sticks, slips or is open. Drag to turn.",
        {DAMPER: surface},
        motions,
        len(motions) - 1,
        *view_of(results.whole, results.axis),
        MovingContacts(
            pairs.position, DAMPER, nearest(surface, pairs.position), dict(COLORS.values())
        ),
    )


def _motion(one: PeakCycle, surface: OuterSurface, loops: Loops) -> PeriodicMotion:
    real = fourier.to_real(loops.damper)[:, 1:]
    shapes = np.array([surface.displacement(column) for column in real.T])
    H = loops.damper.shape[1] - 1
    tau = 2 * np.pi * np.arange(INSTANTS) / INSTANTS
    over_period = np.tensordot(fourier.basis(tau, H)[:, 1:], shapes, 1)
    largest = np.linalg.norm(over_period, axis=2).max()
    seen = np.abs(shapes).max(axis=(1, 2)) > SEEN * largest
    orders = np.repeat(np.arange(1, H + 1), 2) * np.tile([1, -1], H)
    every = states(loops.force, loops.sliders, loops.components)
    return PeriodicMotion(
        "peak",
        f"Fe = {one.Fe_N:g} N, H = {one.H}, {one.hz:.1f} Hz",
        one.hz,
        tuple(orders[seen].tolist()),
        {DAMPER: shapes[seen] / largest},
        drawn_amplitude([surface]),
        states=every[np.arange(INSTANTS) * len(every) // INSTANTS],
    )
