"""Peaks and folds of oscillators and of random systems, followed over a band from both ends.

Closed forms exist for few of them, but the largest maximum of a branch does not depend on the end
from which it is followed, nor do the solutions beside a fold.
"""

import warnings
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from tests.hbm.cases import duffing, duffing_peak, jenkins, load, unilateral
from tests.validation import Row, Subject, row
from tests.validation.random_systems import System, contact_systems, smooth_systems
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.response import follow_band

SAME = 1e-8  # of the height: difference up to which two peaks are one
BESIDE = 1e-4  # of its frequency, inside of a fold


class Found(NamedTuple):
    """What one system gives.

    difference : of the two peaks, relative; named : why one of them is no solved peak, in words;
    apart : whether the two lie on branches of their own
    folds : of both curves; lost : those beside which the curve lacks a solution that its own points
    enclose;
    one_sided : those beside which the curve from the other end has another number of solutions
    """

    difference: float
    named: str
    apart: bool
    folds: int
    lost: int
    one_sided: int


def compare(system: System) -> Found:
    """Peaks and folds of one system from both ends."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # `why_unsolved` has them
        curves = [
            follow_band(
                system.problem,
                system.force,
                band,
                harmonics=system.H,
                outputs=system.outputs,
                truncation=False,
            )
            for band in (system.band, system.band[::-1])
        ]
        peaks = np.array([curve.peak("x") for curve in curves])
        # at the border of the band the largest amplitude is no maximum, but a solved point
        named = "; ".join(
            curve.ended
            if np.isnan(top)
            else ""
            if curve.at_border("x")
            else curve.why_unsolved("x")
            for curve, (_, top) in zip(curves, peaks, strict=True)
        ).strip("; ")
        difference, apart = abs(peaks[0, 1] / peaks[1, 1] - 1), False
        if difference > SAME and not named:
            low = int(peaks[0, 1] > peaks[1, 1])
            apart = not _passes(curves[low], system, peaks[1 - low, 0], curves[1 - low])
            if apart:  # then the lower one must lie on the other's branch, or alone
                tops = find_peaks(curves[1 - low], system.problem, "x")[:, 1]
                passes = _passes(curves[1 - low], system, peaks[low, 0], curves[low])
                difference = np.abs(tops / peaks[low, 1] - 1).min() if passes else 0.0
        turns = list(_turns(curves))
        counts = [
            [len(solutions_at(curve, system.problem, hz)) for hz in turns] for curve in curves
        ]
        enclosed = [
            [np.count_nonzero(np.diff(np.sign(curve.frequency - hz))) for hz in turns]
            for curve in curves
        ]
    return Found(
        float(difference),
        named,
        apart,
        len(turns),
        int((np.array(counts) < enclosed).sum()),
        int(np.not_equal(*counts).sum()),
    )


def _passes(curve, system, hz, other):
    """Whether a curve passes through the highest point of another one."""
    X = other.harmonics[int(np.nanargmax(other.amplitude()[:, 0]))]
    return any(
        np.linalg.norm(Y - X) <= 1e-5 * np.linalg.norm(X)
        for Y in solutions_at(curve, system.problem, hz)
    )


def _turns(curves):
    """Hz a little inside of every fold of the curves."""
    low, high = np.sort(curves[0].frequency[[0, -1]])
    for curve in curves:
        f = curve.frequency
        way = np.sign(np.diff(f))
        for i in np.flatnonzero(way[:-1] * way[1:] < 0) + 1:
            hz = f[i] * (1 - way[i - 1] * BESIDE)
            if low < hz < high:
                yield hz


def oscillators() -> Iterable[System]:
    """I1 (Duffing), C1 (lift-off), and a Jenkins element of a million times the stiffness of its
    oscillator."""
    I1, C1 = load("I1")["parameters"], load("C1")["parameters"]
    for name, (problem, force), band, orders in (
        ("I1", (duffing(I1["c"], I1["k3"]), np.array([I1["F"]])), (0.3, 2.5), (1, 5, 15)),
        ("C1", unilateral(C1), (0.5, 1.9), (1, 9)),
        (
            "Jenkins, kt/k = 1e6",
            jenkins(dict(m=1.0, k=1.0, c=0.02, kt=1e6, slip_limit_muN=1.0, F=1.2)),
            (0.3, 2.0),
            (9,),
        ),
    ):
        for H in orders:
            yield System(f"{name}, H = {H}", problem, force, np.array(band) / (2 * np.pi), H)


def closed_form() -> Row:
    """The peak of I1 at H = 1."""
    p = load("I1")["parameters"]
    problem, known = duffing(p["c"], p["k3"]), duffing_peak(p["c"], p["F"], p["k3"])[1]
    curve = follow_band(
        problem,
        np.array([p["F"]]),
        np.array([0.3, 2.5]) / (2 * np.pi),
        harmonics=1,
        outputs={"x": [1.0]},
    )
    return row("I1, H = 1", curve.peak("x")[1], known, "closed form")


def together(name: str, systems: Iterable[System]) -> Iterable[Row]:
    """One row each: peaks, unsolved ones, branches of their own, and folds of many systems."""
    found = [compare(system) for system in systems]
    plain = [one.difference for one in found if not one.named]
    name = f"{len(found)} {name}"
    yield Row(
        f"{name}: largest difference of two peaks",
        "",
        "",
        max(plain, default=np.inf),
        "peak from the other end",
    )
    unsolved = sum(bool(one.named) for one in found)
    yield Row(
        f"{name}: named unsolved", unsolved, 0, unsolved / len(found), "share of unsolved peaks"
    )
    apart = sum(one.apart for one in found)
    yield Row(
        f"{name}: peaks on two branches",
        apart,
        0,
        apart / len(found),
        "share of peaks on two branches",
    )
    folds, lost, one_sided = (
        sum(counts) for counts in zip(*(one[-3:] for one in found), strict=True)
    )
    yield Row(
        f"{name}: both solutions {BESIDE:g} beside {folds} folds",
        folds - lost,
        folds,
        float(lost),
        "solutions that the points enclose",
    )
    yield Row(
        f"{name}: folds with other solutions from the other end",
        one_sided,
        0,
        one_sided / max(folds, 1),
        "share of folds seen from one end",
    )


def rows(smooth: int = 40, contact: int = 200) -> Iterable[Row]:
    """The oscillators, and so many random systems."""
    yield closed_form()
    for system in oscillators():
        yield from together(system.name, [system])
    yield from together("smooth systems (seed 1)", smooth_systems(smooth))
    yield from together("contact systems (seed 2)", contact_systems(contact))


SUBJECT = Subject(
    "Peaks and folds from both ends of a band",
    "Half peak to peak of the first mass. A peak that is named unsolved is counted, not "
    "compared. Where the two directions stay on branches of their own (shown by the solutions of "
    "one curve at the peak of the other), the peak of the lower is compared with a maximum of "
    "the other that passes it. Folds seen from one end only lie on parts of the branch outside "
    "of the band, or are smaller than a step. Systems: tests/validation/random_systems.py.",
    rows,
    {
        "closed form": 1e-9,
        "peak from the other end": SAME,
        "share of unsolved peaks": 0.02,
        "solutions that the points enclose": 0.0,
    },
)
