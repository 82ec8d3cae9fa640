"""How the forces of a cycle follow a small disturbance of the motion, instant by instant.

Between the events of a cycle the force of a contact is linear in a disturbance,

    df = gamma du + memory dw

with the place w of its sliders. A slider that comes to rest takes its place from the motion there,
dw = capture du; where a slider slips, memory is zero. Where an event is shifts with the
disturbance, too: as force and motion are continuous, that is of second order. Two tangents that
are coupled remember in slip, too (`Turning`).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.laws.records import Contacts, Motion

if TYPE_CHECKING:
    from tipdamp.hbm.laws.base import ContactLaw

PER_ORDER = 12  # steps for each order of the motion: its tangents have twice as many
STEP = 1e-4  # of tau, in the differences of the tangents of a smooth force


class Turning(NamedTuple):
    """Of the q contacts whose sliders move through every interval, as they are pulled along.

    of : (q,) which contacts
    memory, rate : (2, K, q, nd, nd) N/m, force by the place w, at begin and end, and derivative by
        tau of the whole force by w, less that of gamma times that of the motion
    kept : (K, q, nd, nd), w at the end by w at the begin
    follows : (4, K, q, nd, nd), w at the end by the motion at the begin, its derivative by tau
        there, the motion at the end, and the defect of its derivative there (`stability.kernels`)
    """

    of: np.ndarray
    memory: np.ndarray
    rate: np.ndarray
    kept: np.ndarray
    follows: np.ndarray

    @classmethod
    def none(cls, of: np.ndarray, K: int, nd: int) -> "Turning":
        """All zero."""
        memory, rate = np.zeros((2, 2, K, len(of), nd, nd))
        kept, follows = np.zeros((K, len(of), nd, nd)), np.zeros((4, K, len(of), nd, nd))
        return cls(of, memory, rate, kept, follows)

    def among(self, at: np.ndarray, components: list[int], nd: int) -> "Turning":
        """Of contacts `at` and of some of nd components."""
        found = Turning.none(at[self.of], len(self.kept), nd)
        place = (..., *np.ix_(components, components))
        for into, own in zip(found[1:], self[1:], strict=True):
            into[place] = own
        return found

    def beside(self, other: "Turning") -> "Turning":
        """Of the contacts of both."""
        pairs = zip(self[1:], other[1:], strict=True)
        joined = (np.concatenate(pair, axis=-3) for pair in pairs)
        return Turning(np.concatenate([self.of, other.of]), *joined)


class CycleTangents(NamedTuple):
    """In the K intervals between instants of a cycle, of P contacts with nd components.

    gamma, rate : (2, K, P, nd, nd) N/m, at begin and end of the intervals, and derivative by tau;
        of `turning` contacts of the whole force by the motion, less gamma times its derivative
    memory : (K, P, nd) N/m, of the slider of a component
    captured : (K, P, nd) bool, sliders that come to rest at the begin of an interval
    capture : (K, P, nd, nd), their place by the motion there
    """

    gamma: np.ndarray
    rate: np.ndarray
    memory: np.ndarray
    captured: np.ndarray
    capture: np.ndarray
    turning: Turning

    @classmethod
    def none(cls, K: int, P: int, nd: int) -> "CycleTangents":
        """All zero."""
        gamma, rate = np.zeros((2, 2, K, P, nd, nd))
        memory, captured = np.zeros((K, P, nd)), np.zeros((K, P, nd), dtype=bool)
        turning = Turning.none(np.empty(0, dtype=int), K, nd)
        return cls(gamma, rate, memory, captured, np.zeros((K, P, nd, nd)), turning)

    def put(self, at: np.ndarray, components: list[int], other: "CycleTangents") -> "CycleTangents":
        """With those of some contacts and components, which are filled in."""
        every, k, columns = np.arange(2), np.arange(len(self.memory)), np.array(components)
        self.gamma[np.ix_(every, k, at, columns, columns)] = other.gamma
        self.rate[np.ix_(every, k, at, columns, columns)] = other.rate
        self.memory[np.ix_(k, at, columns)] = other.memory
        self.captured[np.ix_(k, at, columns)] = other.captured
        self.capture[np.ix_(k, at, columns, columns)] = other.capture
        turning = other.turning.among(at, components, self.gamma.shape[-1])
        return self._replace(turning=self.turning.beside(turning))


Smooth = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class Variation(NamedTuple):
    """steps : of a period at least, for what happens between the events
    events : (n,) instants in (0, 2 pi) at which a contact changes its state
    between : of instants (K+1,) from 0 to 2 pi, events among them, the CycleTangents
    smooth : of instants (K,), the tangents of a law without memory (K, P, nd, nd) by the motion in
        N/m and by its velocity in N s/m; None of other laws
    of_velocity : whether the latter are not zero: then `between` tells nothing
    """

    steps: int
    events: np.ndarray
    between: Callable[[np.ndarray], CycleTangents]
    smooth: Smooth | None = None
    of_velocity: bool = False


def of_smooth_force(
    law: "ContactLaw", contacts: Contacts, x: np.ndarray, omega: float
) -> Variation:
    """Of a law without memory, at the motion x (P, nd, nh)."""
    P, nd, nh = x.shape
    H = (nh - 1) // 2

    def tangents(tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = np.einsum("pdh,th->tpd", x, fourier.basis(tau, H)).reshape(-1, nd)
        v = omega * np.einsum("pdh,th->tpd", x, fourier.basis_rate(tau, H)).reshape(-1, nd)
        every = np.tile(np.arange(P), len(tau))
        found = law.select(every).tangents(
            Motion(u, v, 2 * np.pi / omega), np.zeros((len(u), 0)), contacts.select(every)
        )[2]
        shape = len(tau), P, nd, nd
        return found.force_u.reshape(shape), found.force_v.reshape(shape)

    def between(instants: np.ndarray) -> CycleTangents:
        found = CycleTangents.none(len(instants) - 1, P, nd)
        gamma = tangents(instants)[0]
        rate = (tangents(instants + STEP)[0] - tangents(instants - STEP)[0]) / (2 * STEP)
        for into, values in ((found.gamma, gamma), (found.rate, rate)):
            into[0], into[1] = values[:-1], values[1:]
        return found

    of_velocity = bool(tangents(np.linspace(0, 6, 7))[1].any())
    return Variation(PER_ORDER * H, np.empty(0), between, tangents, of_velocity)
