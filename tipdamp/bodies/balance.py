"""The damper in balance: the force on it, the rigid motions that the study holds, and what its
sides carry beside them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.bodies import DAMPER
from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold import spring
from tipdamp.hbm.hold.rigid_motion import parse_motion
from tipdamp.hbm.hold.spring import HeldMotion, Hold
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS as RIGID
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies
from tipdamp.static_contact.contact.equilibrium import beside, side_forces, side_normals
from tipdamp.study.hold import HoldChoice


@dataclass(frozen=True)
class DamperHold:
    """The rigid motions of the damper that a study holds, and the section that says so: [damper],
    or [model] in its place."""

    section: str
    motions: Sequence[HoldChoice]

    @property
    def ways(self) -> np.ndarray:
        """(m, 6) coefficients of the motions."""
        return np.array([parse_motion(one.motion)[2] for one in self.motions]).reshape(-1, 6)

    def directions(self, pairs: ContactTable) -> np.ndarray:
        """(m, 3) directions along which it holds the damper and no pair's normal does."""
        ways = self.ways[:, :3]
        faced = np.abs(ways @ pairs.normal.T).max(axis=1, initial=0.0)
        return ways[ways.any(axis=1) & (faced <= RIGID.facing)]

    def on(self, model: ReducedModel | SparseBodies, pairs: ContactTable) -> tuple[HeldMotion, ...]:
        """The motions on the dofs of a model with these pairs."""
        held = [Hold(one.motion, one.stiffness, one.mean, DAMPER) for one in self.motions]
        try:
            return spring.held_motions(model, pairs, held)
        except InputError as error:
            raise InputError(f"[{self.section}] {error}") from None


@dataclass(frozen=True)
class Balance:
    """force : (3,) N - on the damper; hold - what takes a part of it beside the contacts."""

    force: np.ndarray
    hold: DamperHold

    def of_sides(
        self, pairs: ContactTable, normals: Mapping[str, np.ndarray] = MappingProxyType({})
    ) -> dict[str, float]:
        """{side: N} that balance the force without friction, none of sides that share theirs;
        normals {side: (3,)} - in the place of those of the pairs. InputError where they cannot."""
        found = side_normals(pairs) | dict(normals)
        return side_forces(found, self.force, held=self.hold.directions(pairs))

    def equilibrium(self, pairs: ContactTable) -> dict[str, float]:
        """The same of every side: the sum of its pairs where that does not follow."""
        return {**side_sums(pairs), **self.of_sides(pairs)}

    def error(self, pairs: ContactTable, tangential: ArrayLike = 0.0) -> float:
        """|force - sum (N n + T t)| / |force| with T (P, 2) N, beside the directions along which
        the damper is held."""
        mine = pairs.damper_body != GROUND
        T, pairs = np.broadcast_to(tangential, (len(pairs), 2))[mine], pairs.select(mine)
        total = np.maximum(pairs.preload, 0) @ pairs.normal + np.einsum(
            "pd,pdx->x", T, pairs.frame[:, :2]
        )
        left = beside(self.hold.directions(pairs), self.force - total)
        return float(np.linalg.norm(left) / np.linalg.norm(self.force))

    def by_friction(self, pairs: ContactTable) -> tuple[float, float]:
        """N: what normal forces leave of the force, beside the directions along which the damper is
        held; and at most how much of it friction holds, mu N on every pair along its tangent
        plane."""
        pairs = pairs.select(pairs.damper_body != GROUND)
        normal = np.maximum(pairs.preload, 0)
        left = beside(self.hold.directions(pairs), self.force - normal @ pairs.normal)
        size = float(np.linalg.norm(left))
        if not size:
            return 0.0, 0.0
        tangent = np.linalg.norm(pairs.frame[:, :2] @ (left / size), axis=1)
        return size, float(pairs.mu * normal @ tangent)


def side_sums(pairs: ContactTable) -> dict[str, float]:
    """{side: N} of the closed pairs."""
    return {s: float(np.maximum(pairs.preload, 0)[pairs.side == s].sum()) for s in pairs.sides}
