"""Peaks and folds that are followed over a parameter."""

import numpy as np

from tests.hbm.cases import beam, duffing, duffing_peak
from tests.hbm.following.test_follow import (
    FORCE,
    ON_THE_OSCILLATOR,
    ON_THE_RIG,
    TIP,
    DuffingFolds,
    beside_sweeps,
    oscillator,
    rig_alone,
)
from tests.validation import Subject, row
from tipdamp import follow_peak

SWEPT, CLOSED = "peak of a whole curve", "closed form, H = 1"


def rows():
    yield from _duffing()
    yield from _oscillator(("level", "preload"))
    for case in ("B8", "C8"):
        problem, force, outputs = beam(case)
        given = dict(outputs=outputs, band=(500, 1400), harmonics=3)
        yield from _beside(case, (problem, force, given), "level", (1.0, 60.0))
    yield from _rig("preload")


def quick():
    """Without what tests of the room hold to 1e-8: the other parameters, beams, and the rig."""
    yield from _duffing()
    yield from _oscillator(("level",))


def long():
    """With oscillator and rig over every parameter."""
    yield from rows()
    yield from _oscillator(("mu", "damping"))
    for parameter in ("level", "mu"):
        yield from _rig(parameter)


def _oscillator(parameters):
    given = dict(outputs=TIP, band=(600, 1200), harmonics=3)
    for parameter in parameters:
        between = dict(ON_THE_OSCILLATOR)[parameter]
        yield from _beside("oscillator", (oscillator(), FORCE, given), parameter, between)


def _rig(parameter):
    yield from _beside("rig", rig_alone(), parameter, dict(ON_THE_RIG)[parameter], 3)


def _beside(name, case, parameter, between, places=4):
    problem, force, given = case
    peaks = follow_peak(problem, force, parameter, between, **given)
    yield row(f"{name}, {parameter}, followed to", peaks.parameter[-1], between[1], "last value")
    for value, ours, whole in beside_sweeps(peaks, *case[:2], parameter, given, places):
        where = f"{name}, {parameter} = {value:.3g}"
        yield row(f"{where}, height", ours[1], whole[1], SWEPT)
        yield row(f"{where}, Hz", ours[0], whole[0], f"frequency of the {SWEPT}")


def _duffing():
    given = dict(outputs={"x": [1.0]}, band=(0.05, 1.0), harmonics=1)
    at = [0.5, 1.0, 2.0]
    peaks = follow_peak(duffing(0.1), np.ones(1), "level", (0.05, 3.0), at=at, **given)
    for level in at:
        i, (w, A) = peaks.at(level), duffing_peak(0.1, level)
        yield row(f"Duffing, peak at {level:g} N", peaks.height[i], A, CLOSED)
        case = f"Duffing, peak at {level:g} N, rad/s"
        yield row(case, 2 * np.pi * peaks.frequency[i], w, f"frequency in {CLOSED}")
    exact = DuffingFolds()
    fold = exact.followed()
    w, s = 2 * np.pi * fold.frequency, fold.height**2
    name = f"Duffing, {len(fold)} places of a fold"
    yield row(f"{name}, N", np.sqrt(exact.squared(s, w)), fold.parameter, f"fold, {CLOSED}")
    slope = np.abs(exact.slope(s, w) / s**2).max()
    yield row(f"{name}, slope of the level", slope, 0.0, f"slope of a fold, {CLOSED}", 1.0)
    level, w = exact.meet(fold)
    yield row("Duffing, two folds meet, N", fold.parameter[-1], level, f"two folds, {CLOSED}")
    yield row(
        "Duffing, two folds meet, rad/s",
        2 * np.pi * fold.frequency[-1],
        w,
        f"place of two folds, {CLOSED}",
    )


SUBJECT = Subject(
    "Peaks and folds over a parameter",
    "Height and frequency of a followed peak beside the highest one of a whole curve at the same "
    "value, H = 3, from stuck to slip, and that the last value is reached; folds of Duffing's "
    "oscillator until two of them meet. Where two meet the frequency is flat in the level: known "
    "to the square root of that.",
    rows,
    {
        SWEPT: 1e-6,
        f"frequency of the {SWEPT}": 1e-6,
        "last value": 0.0,
        CLOSED: 1e-6,
        f"frequency in {CLOSED}": 1e-6,
        "fold, ": 1e-6,
        "slope of a fold": 1e-5,
        "two folds": 1e-6,
        "place of two folds": 1e-4,
    },
    long=long,
    quick=quick,
)
