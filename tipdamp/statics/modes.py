"""Modes that a study looks at: free ones of the blades, and those of the assembly where a set of
pairs sticks, tracked by a free one."""

from dataclasses import dataclass

import numpy as np

from tipdamp.bodies import BLADES
from tipdamp.bodies.free_modes import FreeModes, named_modes
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.tuning.roll_springs import RollSpring, spring_rows
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly, StuckModes
from tipdamp.statics.model_inputs import declared_springs, group
from tipdamp.study.view import Study


def free_modes(study: Study, blades: ReducedModel) -> FreeModes:
    """Free modes of the blades by the motion of the two patches along the force."""
    rows = (
        np.mean(
            [
                blades.displacement_row(BLADES, n, study.respond.direction)
                for n in group(blades, study, p)
            ],
            axis=0,
        )
        for p in study.respond.patches
    )
    return named_modes(blades, *rows)


def free_shapes(study: Study, model: ReducedModel) -> dict[str, np.ndarray]:
    """{free mode: (r,) its shape}, the damper at rest."""
    found = {}
    for name, shape in free_modes(study, model.part(BLADES)).follow.items():
        found[name] = np.zeros(model.size)
        found[name][model.body == BLADES] = shape
    return found


@dataclass(frozen=True)
class Stuck:
    """A set of pairs that sticks: pairs - with weight 0 on what is open at rest; open - their
    number; springs - roll springs."""

    pairs: ContactTable
    open: int
    springs: list[RollSpring]
    modes: StuckModes

    @classmethod
    def of(
        cls,
        study: Study,
        assembly: StuckAssembly,
        follow: np.ndarray,
        pairs: ContactTable,
        closed: np.ndarray,
        above_hz: float = 0.0,
    ) -> "Stuck":
        """closed (P,) bool: pairs in contact at rest; follow, above_hz as of
        `StuckAssembly.modes`."""
        stuck = pairs.replace(weight=np.where(closed, pairs.weight, 0.0))
        springs = declared_springs(study, pairs, closed)
        extra = spring_rows(assembly.model, stuck, springs)
        return cls(
            stuck,
            int((pairs.carrying & ~closed).sum()),
            springs,
            assembly.modes(stuck, follow, above_hz=above_hz, extra=extra),
        )
