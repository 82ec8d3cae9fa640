"""What of a cycle a disturbance feels: the components that act, and the intervals between its
instants."""

from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.stability.intervals import joined
from tipdamp.hbm.stability.kernels import Carried, Poles, Segments
from tipdamp.hbm.stability.slow_poles import system

if TYPE_CHECKING:
    from tipdamp.hbm.laws.variation import CycleTangents, Variation


class DisturbedCycle:
    """A cycle, disturbed: variation, and looked, coarse : instants and the tangents between them.

    acts, opened (P, nd) : components that are disturbed otherwise than the stuck springs, and those
        of them whose contact is open throughout; place (P, nd) : of the others among these, or -1
    """

    def __init__(self, balance: HarmonicBalance, w: float, variation: "Variation") -> None:
        self.balance, self.w, self.variation = balance, w, variation
        self.looked = joined(np.linspace(0, 2 * np.pi, 65), variation.events)
        self.coarse = variation.between(self.looked)
        self.acts = that_act(self.coarse, balance.springs)
        self.opened = self.acts & stays_open(self.coarse)[:, None]
        moved = self.acts & ~self.opened
        self.place = np.where(moved, np.cumsum(moved).reshape(moved.shape) - 1, -1)


def segments_of(
    tangents: "CycleTangents", times: np.ndarray, place: np.ndarray, springs: np.ndarray, w: float
) -> Segments:
    """The intervals between the times, s, of the contacts of which a component has a place."""
    acts = place >= 0
    of = np.flatnonzero(acts.any(axis=1))
    gamma, diagonal = tangents.gamma[:, :, of], np.arange(springs.shape[1])
    gamma[..., diagonal, diagonal] -= springs[of]
    turning, by_time = tangents.turning, np.array([1, 1 / w, 1, 1 / w])
    return Segments(
        place[of],
        np.diff(times),
        gamma,
        w * tangents.rate[:, :, of],
        tangents.memory[:, of] * acts[of],
        tangents.captured[:, of],
        tangents.capture[:, of],
        Carried(
            np.searchsorted(of, turning.of),
            turning.memory,
            w * turning.rate,
            turning.kept,
            by_time[:, None, None, None, None] * turning.follows,
        ),
    )


def that_act(tangents: "CycleTangents", springs: np.ndarray) -> np.ndarray:
    """(P, nd) components that are disturbed otherwise than the stuck springs."""
    gamma, nd = tangents.gamma.copy(), springs.shape[1]
    gamma[..., np.arange(nd), np.arange(nd)] -= springs
    coupled = gamma.any(axis=(0, 1))
    acts = coupled.any(axis=1) | coupled.any(axis=2) | tangents.captured.any(axis=0)
    acts[tangents.turning.of] |= tangents.turning.memory.any(axis=(0, 1, 4))
    return acts


def stays_open(tangents: "CycleTangents") -> np.ndarray:
    """(P,) contacts whose force follows nothing all through the cycle."""
    follows = tangents.gamma.any(axis=(0, 1, 3, 4)) | tangents.rate.any(axis=(0, 1, 3, 4))
    follows |= tangents.memory.any(axis=(0, 2)) | tangents.captured.any(axis=(0, 2))
    follows[tangents.turning.of] = True
    return ~follows


def turns_of(
    tangents: "CycleTangents", moved: np.ndarray, springs: np.ndarray, slow: Poles
) -> np.ndarray:
    """(K,) rad/s at most with which contacts move on what they have beyond the stuck springs, in
    intervals of a cycle; moved (P, nd) : components that act."""
    diagonal = np.arange(springs.shape[1])
    stiffness = np.abs(tangents.gamma[:, :, :, diagonal, diagonal] - springs).max(axis=0)[:, moved]
    light = -np.einsum("cn,nc->c", slow.out @ system(slow), slow.into)  # one over a mass
    return np.sqrt((stiffness * np.abs(light)).max(axis=1, initial=0.0))
