"""Frequency and damping ratio of nonlinear modes, and the peaks that follow from them."""

import numpy as np

from tests.hbm.modes.test_backbone import (
    J1,
    X,
    at_phase_resonance,
    at_the_peak,
    cantilever,
    friction_oscillator,
)
from tests.hbm.modes.test_synthesis import CASES, LEVELS, RIG, RIG_LEVELS, peaks
from tests.validation import Miss, Subject, row
from tipdamp import Jenkins1D, backbone

MUCH = ", damping up to 9 %"


def rows():
    yield from _oscillator()
    yield from _friction_beam(2.0, 0.1, (0.08, 0.15, 0.4, 1.0), "")
    yield from _friction_beam(10.0, 0.5, (0.08, 0.3), MUCH)
    yield from _cubic_beam()
    for name, levels in LEVELS.items():
        yield from _synthesis(name, CASES[name], levels, "peak of a whole curve")
    yield from _synthesis("rig", RIG, RIG_LEVELS, "peak of a whole curve, rig")


def quick():
    """What is missed alone: tests of the room hold all else, to as little or less."""
    yield from _friction_beam(10.0, 0.5, (0.08, 0.3), MUCH)


def _oscillator():
    known = J1["results"]
    for H in (1, 3, 9, 21):
        at = [one["a"] for one in known]
        mode = backbone(friction_oscillator(), 1, at, outputs=X, harmonics=H)
        against = "closed form" if H == 1 else "table at equal H"
        for one in known:
            i = np.flatnonzero(mode.amplitude == one["a"])[0]
            there = one.get(f"EPMC_H{H}", one)  # everything sticks: the closed form
            case = f"J1, a = {one['a']:g}, H = {H}"
            w, zeta = 2 * np.pi * mode.frequency[i], mode.damping_ratio[i]
            yield row(f"{case}, w", w, there["omega"], against)
            scale = J1["max_damping"]["zeta"]
            yield row(f"{case}, zeta", zeta, there["zeta"], against, scale)


def _friction_beam(kt, limit, amplitudes, much):
    problem, tip = cantilever(Jenkins1D(), kt=kt, mu=1.0, preload=limit)
    mode = backbone(problem, 1, (0.02, *amplitudes), outputs={"x": tip}, harmonics=3)
    for a in amplitudes:
        i = np.flatnonzero(mode.amplitude == a)[0]
        ours, case = (mode.frequency[i], mode.damping_ratio[i]), f"friction beam, a = {a:g} m"
        forced = at_phase_resonance(problem, tip, mode, i)
        yield from _both(case, ours, forced, "force at the tip at phase resonance", much)


def _cubic_beam():
    for level in (1e-3, 3e-3, 8e-3):
        yield from _both(f"cubic beam, {level:g} N", *at_the_peak(level), "forced peak", "")


def _both(case, ours, reference, against, much):
    for name, one, other in zip(("frequency", "damping"), ours, reference, strict=True):
        yield row(f"{case}, {name}", one, other, f"{against}, {name}{much}")


def _synthesis(name, case, levels, against):
    for level, _, peak, whole in peaks(case, levels):
        yield row(f"{name}, {level:g} N, height", peak[1], whole[1], against)
        yield row(f"{name}, {level:g} N, Hz", peak[0], whole[0], f"frequency of the {against}")


OTHERS = (
    "a force at one point drives the other modes too, and the mode does not know of them: at the "
    "same motion of that mode they answer by more where the damping is larger"
)
SUBJECT = Subject(
    "Nonlinear modes",
    "Frequency and damping ratio over the amplitude: the oscillator of J1 (tests/reference/hbm; "
    "the ratio relative to the largest), a cantilever with friction and with a cubic spring at the "
    "tip beside forced motions, H = 3. Then the peaks that the modes predict, the other modes "
    "stuck and linear, beside those of whole curves.",
    rows,
    {
        "closed form": 1e-6,
        "table at equal H": 1e-6,
        "force at the tip at phase resonance, frequency": 1e-4,
        "force at the tip at phase resonance, damping": 1e-3,
        "forced peak, frequency": 1e-4,
        "forced peak, damping": 1e-3,
        "peak of a whole curve": 0.02,
        "peak of a whole curve, rig": 0.05,
        "frequency of the peak": 0.002,
    },
    {
        f"force at the tip at phase resonance, frequency{MUCH}": Miss(1e-3, 0, OTHERS),
        f"force at the tip at phase resonance, damping{MUCH}": Miss(4e-3, 0, OTHERS),
    },
    quick=quick,
)
