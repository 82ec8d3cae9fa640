"""What can slip or lift off under a force, before a curve is followed: Newton's system grows with
it.

Taken are the contact forces at the response with every contact stuck. What slips takes energy out,
so that a curve is lower at its resonances: hardly ever do more contacts move on it than counted.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.laws.records import ContactForces


@dataclass(frozen=True)
class ActivitySettings:
    """Where the stuck response is looked at."""

    grid: int = 41  # frequencies of the band, beside its resonances


class Activity(NamedTuple):
    """Numbers of contacts, and of components of their motion, on which forces that are not those of
    springs act."""

    contacts: int
    components: int


SETTINGS = ActivitySettings()


def activity(
    problem: ContactProblem, force: np.ndarray, band: tuple[float, float], start: str | np.ndarray
) -> Activity:
    """What acts anywhere in a band (Hz) under force (r,) N of harmonic 1 and the problem's static
    load; start : of the sliders. Where one resonance is near another, what acts at either may act
    at once."""
    P = len(problem.contacts)
    nd = len(problem.law.components)
    acts = np.zeros((P, nd), dtype=bool)
    for forces in _stuck(problem, force, band, start):
        acts |= forces.active
    return Activity(int(acts.any(axis=1).sum()), int(acts.sum()))


def opening(
    problem: ContactProblem, force: np.ndarray, band: tuple[float, float], start: str | np.ndarray
) -> int:
    """Number of the contacts that are closed at rest and lift off in a part of a cycle; of what
    `activity` counts."""
    opens = np.zeros(len(problem.contacts), dtype=bool)
    for forces in _stuck(problem, force, band, start):
        opens |= forces.shares[:, 2] > 0
    return int((opens & (problem.contacts.preload > 0)).sum())


def _stuck(
    problem: ContactProblem, force: np.ndarray, band: tuple[float, float], start: str | np.ndarray
) -> Iterator[ContactForces]:
    """Contact forces at the stuck response, of a grid of the band and its resonances."""
    balance = HarmonicBalance(problem, {1: force}, 1, start)
    P = len(problem.contacts)
    modes = balance
    if problem.reducible:  # those up to the end of the band are enough
        modes = balance.covering(np.r_[2 * np.pi * max(band), np.zeros(P)])
    own = modes.receptance.frequencies
    for hz in (
        *np.linspace(min(band), max(band), SETTINGS.grid),
        *own[(own > min(band)) & (own < max(band))],
    ):
        w = 2 * np.pi * hz
        factors = modes.receptance.factors(w * np.arange(2))[0]
        u = fourier.to_real(modes.shapes @ (factors * modes.force_at(1.0))).reshape(
            P, balance.nd, balance.nh
        )
        yield balance.contact_forces(u, w)
