"""The tracked stuck frequency of one assembly for hundreds of sets of pairs."""

from collections.abc import Callable

import numpy as np
import scipy.linalg as sl

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.tuning.followed_mode import SETTINGS, Assembled, FollowedMode, Shifted
from tipdamp.static_contact.tuning.roll_springs import spring_directions
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly, stuck_springs


class StuckSearch:
    """pairs - the table of which sets are taken; closed (P,) bool - those that stick where they are
    kept
    follow (r,) - mass-normalised shape of the tracked mode; springs(pairs) -> RollSpring records,
    or None conserve(table) - gives the kept pairs the stiffness of all, or None
    """

    def __init__(
        self,
        assembly: StuckAssembly,
        pairs: ContactTable,
        closed: np.ndarray,
        follow: np.ndarray,
        springs: Callable | None = None,
        conserve: Callable | None = None,
    ) -> None:
        self.pairs, self.closed, self._springs, self._conserve = pairs, closed, springs, conserve
        if not closed.any():
            raise InputError("no contact pair is closed at rest: nothing sticks")
        model = assembly.model
        B, stuck = assembly.motion(model, pairs), self._stuck(pairs)
        own = springs(stuck) if springs else []
        self._place = {(s.low, s.high): i for i, s in enumerate(own)}
        ways = spring_directions(B, own)
        rows = np.vstack([B[np.repeat(closed, 3)], ways])
        lam, y = sl.eigh(assembly.K)
        phi = sl.solve_triangular(assembly.L.T, y, lower=False)
        self._mode = FollowedMode(lam, phi, rows, model.M @ follow)
        extra = np.sqrt([s.k for s in own])[:, None] * ways if own else None
        whole = assembly.modes(stuck, follow, extra=extra)
        self._shifts: dict[int, Shifted | Assembled] = {}
        self._shifted = self._about((2 * np.pi * whole.tracked_hz) ** 2)

    def find(self, weight: np.ndarray) -> tuple[float, float]:
        """(Hz, MAC) of the tracked mode with the weights (P,)."""
        kept = self._stuck(self.table(weight))
        if not kept.carrying.any():
            raise InputError("no contact pairs are left: a free damper needs some on both sides")
        k = np.zeros(len(self._mode.V))
        k[: 3 * int(self.closed.sum())] = stuck_springs(kept)[self.closed].ravel()
        for s in self._springs(kept) if self._springs else ():
            if (s.low, s.high) in self._place:
                k[3 * int(self.closed.sum()) + self._place[s.low, s.high]] = s.k
        lam, mac = self._shifted.find(k)
        self._shifted = self._about(lam)  # for the next set, which will not lie far off
        return float(np.sqrt(max(lam, 0.0)) / (2 * np.pi)), mac

    def table(self, weight: np.ndarray) -> ContactTable:
        """The pairs with these weights (P,), and the stiffness that belongs to them."""
        kept = self.pairs.replace(weight=weight)
        return self._conserve(kept) if self._conserve else kept

    def _about(self, lam: float) -> Assembled | Shifted:
        place = round(np.log(max(lam, 1.0)) / SETTINGS.apart)
        if place not in self._shifts:
            self._shifts[place] = self._mode.near(np.exp(place * SETTINGS.apart))
        return self._shifts[place]

    def _stuck(self, pairs: ContactTable) -> ContactTable:
        return pairs.replace(weight=np.where(self.closed, pairs.weight, 0.0))
