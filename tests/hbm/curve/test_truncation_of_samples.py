"""The estimate of the error holds that of the samples of a law by its step alone."""

from typing import ClassVar

import numpy as np
import pytest

from tipdamp import ContactLaw, Problem

PLACES = (790.0, 805.0, 830.0)  # Hz: below, at and above the peak
ROW = {"tip": 0}


class TwoSliders(ContactLaw):
    """Two sliders side by side, of half the stiffness and of a quarter and three of the limit."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    def stuck_stiffness(self, contacts):
        return contacts.kt[:, None]

    def step(self, motion, state, contacts):
        k, limit = contacts.kt[:, None] / 2, (contacts.mu * contacts.preload)[:, None]
        trial, most = k * (motion.u - state), limit * [0.25, 0.75]
        force = np.where(trial.real > most, most, np.where(trial.real < -most, -most, trial))
        return force.sum(axis=1, keepdims=True), motion.u - force / k


def blade():
    plain = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.002).force(0, 12.0)
    return plain.add(TwoSliders(), 0, kt=5e5, mu=0.5, preload=60.0)


@pytest.mark.slow
@pytest.mark.parametrize("samples", [64, 128])
def test_the_error_of_the_samples_is_estimated(samples):
    """Against 16 times as many samples, and harmonics enough that these are all."""
    curve = blade().follow_band((780, 840), outputs=ROW, harmonics=9, samples=samples, at=PLACES)
    for hz in PLACES:
        i = int(np.abs(curve.frequency - hz).argmin())
        exact = blade().solve_at(hz, outputs=ROW, harmonics=9, samples=16 * samples)
        error = np.linalg.norm(curve.harmonics[i, 0, 1:] - exact.harmonics[0, 1:])
        error /= np.linalg.norm(exact.harmonics[0, 1:])
        assert 0.5 * error < curve.relative_truncation[i] < 3 * error + 1e-4
