"""Rotating cantilever: published flapping frequencies, and lagging ones from them."""

import numpy as np

from tests.modal.test_stiffening import FLAP, beam_body, flap_and_lag
from tests.validation import Subject, row


def rows():
    made = beam_body()
    for eta in (1, 4, 12):
        lagging = np.sqrt(np.array(FLAP[eta]) ** 2 - eta**2)
        flap, lag = flap_and_lag(made, eta)
        for k in (0, 1):
            yield row(f"flapping at speed {eta}, mode {k + 1}", flap[k], FLAP[eta][k], "published")
            yield row(f"lagging at speed {eta}, mode {k + 1}", lag[k], lagging[k], "published")


SUBJECT = Subject(
    "Rotating cantilever",
    "omega sqrt(m L^4 / EI). Source: Wright et al. 1982.",
    rows,
    {"published": 1e-3},
)
