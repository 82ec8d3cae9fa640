"""A round damper that slides along its flanks until it rests: the gaps of the position reached.

A pair keeps its partner and its normal. The normals of a round side turn across it, so that a slide
s along the flank closes the points ahead, where they face it, and opens those behind: contact would
leave the line along which a cylinder touches a flank wherever it has slid to. The gaps g0 go along,

    g = g0 + s dg0/dx,        x across the side, along t2

s is that of the damper's axis past the flank, since a roll closes nothing. It follows from the
solution, so gaps and solution are found in turn. A turn of the flank is in the motion of its points
and moves the line of contact, as it should.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from tipdamp.hbm.contact import GROUND, ContactTable, Moves, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.contact.equilibrium import side_normals, touch


@dataclass(frozen=True)
class SlideSettings:
    """Of the search for the position at rest."""

    near: float = 1e-9  # of the relative motion, which solutions have to some 1e-11
    most: int = 40  # solutions; an error is about s/R of the one before: 30 for a slide of R/2


SETTINGS = SlideSettings()


class AtRest(Protocol):
    """A static solution."""

    @property
    def displacement(self) -> np.ndarray:
        """(r,) m"""


State = TypeVar("State", bound=AtRest)


@dataclass(frozen=True)
class SlideAtRest:
    """How far the damper has slid along one flank, and where it presses on it.

    slide, spacing, radius : m - along t2 where it carries; of neighbouring rows; of the damper
    normal : (3,) - where damper and flank are nearest to each other at rest
    off : rad - from that normal to the sum of the normal forces
    """

    slide: float
    spacing: float
    radius: float
    normal: np.ndarray
    off: float


class RoundSides:
    """The round sides among those of the names: contact points of surfaces, whose normals are the
    damper's, with gaps that open to both sides of a line. Pairs of nodes have the normals of the
    blade, along which a slide closes what it should."""

    def __init__(self, model: Moves, pairs: ContactTable, names: Iterable[str] = ()) -> None:
        self.pairs = pairs
        self.slope, self.radius = np.zeros(len(pairs)), np.zeros(len(pairs))
        self.names = [name for name in names if self._is_round(pairs.side == name)]
        if self.names:
            nobody = np.full(len(pairs), GROUND)
            self._on_damper = np.flatnonzero(pairs.damper_body != GROUND)
            self._apart = relative_motion(model, pairs)
            self._damper = relative_motion(model, pairs.replace(blade_body=nobody))

    def _is_round(self, mine: np.ndarray) -> bool:
        """Whether the side is round; if so radius and slope of the gaps along t2 are kept."""
        mine = mine & self.pairs.on_surface & (self.pairs.damper_body != GROUND)
        side = self.pairs.select(mine)
        found = touch(side) if len(side) > 1 else None
        if found is None:
            return False
        radius = float(np.polyfit(found.turned, side.position @ found.way, 1)[0])
        along_t2 = np.sign(side.frame[:, 1].sum(axis=0) @ found.way)
        self.radius[mine] = radius
        self.slope[mine] = along_t2 * 2 * found.curved * (found.turned - found.least) / radius
        return True

    def slide(self, displacement: np.ndarray) -> np.ndarray:
        """(P,) m along t2: of the damper's axis past the flank, 0 on sides that are not round."""
        if not self.names:
            return np.zeros(len(self.pairs))
        apart = (self._apart @ displacement).reshape(-1, 3)[:, 1]
        return np.where(self.radius != 0, apart + self.radius * self._roll(displacement), 0.0)

    def reach(self, displacement: np.ndarray) -> float:
        """m, the largest relative motion."""
        return float(np.abs(self._apart @ displacement).max()) if self.names else 0.0

    def gap(self, displacement: np.ndarray) -> np.ndarray:
        """(P,) m at the position reached."""
        return self.pairs.gap + self.slope * self.slide(displacement)

    def slides(self, displacement: np.ndarray, force: np.ndarray) -> dict[str, SlideAtRest]:
        """Of each round side that carries; force (P,) N of the pairs."""
        if not self.names:
            return {}
        slide = self.slide(displacement)
        closing = (self._apart @ displacement).reshape(-1, 3)[:, 2]
        nearest = side_normals(self.pairs.replace(gap=self.gap(displacement) - closing))
        found = {}
        for name in self.names:
            mine = self.pairs.side == name
            side, load = self.pairs.select(mine), np.maximum(force[mine], 0.0)
            if not load.any():
                continue
            pressed = load @ side.normal
            rows, across = len(np.unique(side.row)), side.position @ side.frame[:, 1].mean(axis=0)
            found[name] = SlideAtRest(
                slide=float(load @ slide[mine] / load.sum()),
                spacing=float(np.ptp(across)) / max(rows - 1, 1),
                radius=abs(float(self.radius[mine][0])),
                normal=nearest[name],
                off=float(np.arctan2(*_sine_and_cosine(pressed, nearest[name]))),
            )
        return found

    def _roll(self, displacement: np.ndarray) -> np.ndarray:
        """(P,) rad about t1, of the rigid motion that is nearest to that of the damper's pairs."""
        mine = self._on_damper
        motion = (self._damper @ displacement).reshape(-1, 3)[mine]
        arm = self.pairs.position[mine] - self.pairs.position[mine].mean(axis=0)
        turning = np.cross(np.eye(3)[:, None], arm).transpose(1, 2, 0)
        rigid = np.concatenate([np.broadcast_to(np.eye(3), turning.shape), turning], axis=2)
        rows = (self.pairs.frame[mine] @ rigid).reshape(-1, 6)
        turn = np.linalg.lstsq(rows, motion.ravel(), rcond=None)[0][3:]
        return self.pairs.frame[:, 0] @ turn


def settled(
    solve: Callable[[np.ndarray], Sequence[State]],
    sides: RoundSides,
    loads: int = 1,
    settings: SlideSettings = SETTINGS,
) -> Sequence[State]:
    """The states that solve(gaps) finds under so many loads in turn, with the gaps of the positions
    that they reach; gaps (loads + 1, P) m, of the start and of each load. Raises InputError where
    gaps and solutions do not settle."""
    start = sides.pairs.gap
    gaps = np.tile(start, (loads + 1, 1))
    for _ in range(settings.most):
        found = solve(gaps)
        reached = np.vstack([start, *(sides.gap(one.displacement) for one in found)])
        enough = settings.near * max(sides.reach(one.displacement) for one in found)
        if np.abs(reached - gaps).max() <= enough:
            return found
        gaps = reached
    far = max(float(np.abs(sides.slide(one.displacement)).max()) for one in found)
    raise InputError(
        f"no position at rest was found on the sides {', '.join(sides.names)}: the damper slides "
        f"by {1e3 * far:.3g} mm beside a radius of {1e3 * abs(sides.radius).max():.3g} mm, which "
        "is no small motion; check the load, and the stiffness of bodies and contacts"
    )


def _sine_and_cosine(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    return float(np.linalg.norm(np.cross(one, other))), float(one @ other)
