"""The bodies on which a study's static contact is solved: the reduced model, or the unreduced ones
with all their dofs.

Both name their dofs, loads and contact points alike, so that a stage need not know which of them it
works on."""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.assemble import MeshedBody, meshed_bodies
from tipdamp.bodies.loads import rest_load
from tipdamp.bodies.read import BODY_READS
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import ReductionFacts
from tipdamp.static_contact.bodies.compliance import Compliance
from tipdamp.static_contact.bodies.iterative_bodies import bodies_on_springs
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies, SparseCompliance
from tipdamp.static_contact.bodies.stuck_bodies import BodiesOnSprings, stuck_bodies
from tipdamp.statics import whole_body
from tipdamp.study.view import Study, every_key

if TYPE_CHECKING:
    from tipdamp.hbm.hold.spring import HeldMotion
    from tipdamp.static_contact.bodies.rigid_motions import RigidMotionSettings

# of a stage that calls `static_bodies`, with what `reads` says: the meshes
READS_FILES = (BLADES, DAMPER)
_MODES = ("modes", "modes_below_hz", "error", "load_modes")  # of the reduced bodies alone
_READS = (
    *every_key(BLADES, but=_MODES),
    *(key for key in BODY_READS if key != BLADES and key.partition(".")[2] not in _MODES),
)


@dataclass(frozen=True)
class StaticBodies:
    """model - names the dofs, with loads {name: (r,) N}; compliance, stuck - how its bodies are
    factored
    shapes - of whole bodies at rest, displaced by (n, 3) m, each in turn."""

    model: ReducedModel | SparseBodies
    compliance: Callable[..., Compliance]
    stuck: Callable[..., BodiesOnSprings]
    shapes: Callable[[whole_body.Rest], Iterator[tuple[MeshedBody, np.ndarray]]]


def factored_once(bodies: StaticBodies) -> StaticBodies:
    """The same for pairs that differ in stiffness alone: their bodies are factored once for all
    that are alike."""
    made: dict[tuple, tuple[Compliance, np.ndarray]] = {}

    def compliance(
        model: ReducedModel | SparseBodies,
        pairs: ContactTable,
        kn: np.ndarray,
        held: "Sequence[HeldMotion]",
        settings: "RigidMotionSettings",
    ) -> Compliance:
        key = ((kn > 0).tobytes(), *(one.stiffness for one in held))
        if key not in made:
            made.clear()
            new = bodies.compliance(model, pairs, kn, held, settings)
            made[key] = new, new.G.copy()
        found = copy(made[key][0])
        found.G = made[key][1].copy()  # the contact adds its springs in place
        return found

    return replace(bodies, compliance=compliance)


def reads(study: Study) -> tuple[str, ...]:
    """What of the study a stage that calls `static_bodies` reads, beside `preload`."""
    return _READS * ("model" not in study and study.preload.bodies != "reduced")


def static_bodies(study: Study, model: ReducedModel, reduction: ReductionFacts) -> StaticBodies:
    """By [preload] bodies. 'auto' is the reduced model where it is exact in the statics of every
    pair.

    Raises InputError where the study wants what its model cannot give.
    """
    wanted = study.preload.bodies
    if "model" in study and wanted == "full":
        raise InputError(
            "[preload] bodies = 'full': of given matrices there are no other bodies; leave it out"
        )
    if reduction.tractions and wanted == "reduced":
        counts = ", ".join(f"{n} cells on the {body}" for body, n in reduction.tractions.items())
        raise InputError(
            f"[preload] bodies = 'reduced': the reduced model knows tractions alone "
            f"({counts}), not the forces of single pairs; leave it out, or raise [contact] "
            "tractions"
        )
    if wanted == "full" or reduction.tractions:
        return _full(study)
    return StaticBodies(
        model,
        Compliance,
        stuck_bodies,
        partial(
            whole_body.condensed_shapes,
            partial(meshed_bodies, study, rest_load(study).cases),
            model,
        ),
    )


def _full(study: Study) -> StaticBodies:
    meshed = meshed_bodies(study)
    try:
        whole = SparseBodies.of([one.body for one in meshed])
    except InputError as error:
        raise InputError(
            f"{error}; or let the reduced bodies do: [preload] bodies = 'auto', and "
            "[contact] tractions above the number of contact points"
        ) from None
    return StaticBodies(
        whole,
        SparseCompliance,
        bodies_on_springs,
        partial(whole_body.full_shapes, meshed),
    )
