"""Intervals of a period between which the tangents of contacts are taken: their instants, and
periods whose second half is the first one again."""

import numpy as np

from tipdamp.hbm.stability.kernels import Carried, Segments

MOST_PARTS = 32  # of an interval between events


def joined(even: np.ndarray, events: np.ndarray) -> np.ndarray:
    """Instants of both, each once; an event takes the place of an even one beside it."""
    events = np.unique(events[(events > 1e-12) & (events < 2 * np.pi - 1e-12)])
    events = events[np.r_[True, np.diff(events) > 1e-12]] if len(events) else events
    inner = even[1:-1]
    far = np.abs(inner[:, None] - events[None]).min(axis=1, initial=np.inf) > 1e-3 * even[1]
    return np.sort(np.concatenate([even[[0, -1]], inner[far], events]))


def divided_between_events(
    instants: np.ndarray, steps: int, looked: np.ndarray, turns: np.ndarray
) -> np.ndarray:
    """The instants, with more of them in intervals that twice as many steps leave as they are:
    there no steps tell whether a motion is resolved. turns (K,) : intervals that it needs by a
    rad of the cycle, in those between the instants `looked`."""
    step, middle = np.pi / steps, 0.5 * (instants[1:] + instants[:-1])
    alone = np.ceil(instants[:-1] / step + 1e-9) >= instants[1:] / step - 1e-9
    needed = turns[np.clip(np.searchsorted(looked, middle) - 1, 0, len(turns) - 1)]
    parts = np.where(alone, np.ceil(needed * np.diff(instants)), 1).clip(1, MOST_PARTS).astype(int)
    if (parts == 1).all():
        return instants
    pieces = zip(instants[:-1], instants[1:], parts, strict=True)
    return np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in pieces] + [instants[-1:]]
    )


def first_half(segments: Segments, alike: float) -> Segments | None:
    """The first half of a period whose second half is the same, as that of a motion that goes
    its way back; else None. alike : relative difference of tangents that are the same"""
    K = len(segments.length)
    if K % 2 or segments.captured[0].any():
        return None
    first, second = (_some_of(segments, part) for part in (slice(K // 2), slice(K // 2, K)))
    arrays = ((*half[1:-1], *half.turning[1:]) for half in (first, second))
    for one, other in zip(*arrays, strict=True):
        largest = np.abs(one).max(initial=0)
        if not (np.abs(one * 1.0 - other) <= alike * largest).all():
            return None
    return first


def _some_of(segments: Segments, part: slice) -> Segments:
    """Some of the intervals."""
    of, memory, rate, kept, follows = segments.turning
    turning = Carried(of, memory[:, part], rate[:, part], kept[part], follows[:, part])
    place, length, gamma, by_time, held, captured, capture = segments[:-1]
    return Segments(
        place,
        length[part],
        gamma[:, part],
        by_time[:, part],
        held[part],
        captured[part],
        capture[part],
        turning,
    )
