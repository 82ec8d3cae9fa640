"""What the forces of contacts do with a disturbance between the instants of a cycle, from its
pieces: `tipdamp.hbm.laws.variation.CycleTangents`."""

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.uncoupled.breaks import (
    BACKWARD,
    BEGIN,
    BY_N,
    BY_U,
    END,
    FORWARD,
    INSTANT,
    STICK,
    Sliders,
)


@njit(cache=True)
def fill(
    law: Sliders,
    moving: np.ndarray,
    pieces: np.ndarray,
    counts: np.ndarray,
    instants: np.ndarray,
    gamma: np.ndarray,
    memory: np.ndarray,
    captured: np.ndarray,
    capture: np.ndarray,
) -> None:
    """Fill in the tangents of the contacts `moving`; law : breaks.Sliders, pieces and counts : of
    `events.find_pieces`, the others as in CycleTangents."""
    for p in moving:
        if law.normal:
            opened = pieces[p, law.count, : counts[p, law.count]]
            _opened(law.count, p, opened, instants, gamma)
        for d in range(law.count):
            if counts[p, d]:
                own = pieces[p, d, : counts[p, d]]
                _slid(law, p, d, own, instants, gamma, memory)
                _caught(law, p, d, own, instants, captured, capture)


@njit(cache=True)
def _opened(n: int, p: int, opened: np.ndarray, instants: np.ndarray, gamma: np.ndarray) -> None:
    """Nothing on the normal n where the contact is open."""
    began = ended = 0
    for k in range(len(instants) - 1):
        middle = 0.5 * (instants[k] + instants[k + 1])
        while began < len(opened) and opened[began, BEGIN] < middle:
            began += 1
        while ended < len(opened) and opened[ended, END] < middle:
            ended += 1
        if began > ended:
            gamma[:, k, p, n, n] = 0.0


@njit(cache=True)
def _slid(
    law: Sliders,
    p: int,
    d: int,
    pieces: np.ndarray,
    instants: np.ndarray,
    gamma: np.ndarray,
    memory: np.ndarray,
) -> None:
    """A tangent follows the motion where it sticks, and the normal where it slips."""
    kt, slope, at = law.kt[p], law.mu[p] * law.kn[p], 0
    for k in range(len(instants) - 1):
        middle = 0.5 * (instants[k] + instants[k + 1])
        while at < len(pieces) - 1 and pieces[at, END] < middle:
            at += 1
        state = pieces[at, 0]
        sticks = state == STICK
        gamma[:, k, p, d, d] = kt if sticks else 0.0
        memory[k, p, d] = -kt if sticks else 0.0
        if law.normal:
            away = 0.0
            if state == FORWARD:
                away = slope
            elif state == BACKWARD:
                away = -slope
            gamma[:, k, p, d, law.count] = away


@njit(cache=True)
def _caught(
    law: Sliders,
    p: int,
    d: int,
    pieces: np.ndarray,
    instants: np.ndarray,
    captured: np.ndarray,
    capture: np.ndarray,
) -> None:
    """Where a slider comes to rest within the cycle it takes its place from the motion there."""
    last = len(instants) - 1
    for piece in pieces:
        begin = piece[BEGIN]
        if piece[0] != STICK or begin <= 0 or piece[INSTANT] != begin:
            continue
        k = min(np.searchsorted(instants, begin), last)
        if k > 0 and begin - instants[k - 1] <= instants[k] - begin:
            k -= 1
        if k == last:
            continue
        captured[k, p, d] = True
        capture[k, p, d, d] = piece[BY_U]
        if law.normal:
            capture[k, p, d, law.count] = piece[BY_N] * law.kn[p]
