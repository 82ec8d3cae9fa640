"""The damper at rest: what a study says of its static contact, and the contact of some pairs in
it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tipdamp.bodies.loads import Loads, on_model
from tipdamp.bodies.pieces import check_loaded
from tipdamp.bodies.stiffness import radii
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.laws.friction import FrictionLimit, each_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import ReductionFacts
from tipdamp.static_contact.contact.contact_forces import Preload
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.contact.slide_at_rest import RoundSides, settled
from tipdamp.statics.cases import StaticBodies, factored_once, static_bodies
from tipdamp.study.view import Study


@dataclass(frozen=True)
class Friction:
    """limit - what the law of the response holds; steps - from each load to the next."""

    limit: FrictionLimit
    steps: int


@dataclass(frozen=True)
class DamperAtRest:
    """What is the same whatever pairs touch: bodies, and the loads on their dofs
    axis (3,) - of the damper; radius - {side: m} of the cylinders, None where it is not stated
    hard - whether contact has no springs; friction - None without."""

    bodies: StaticBodies
    loads: Loads
    axis: np.ndarray
    radius: Mapping[str, float | None]
    hard: bool
    friction: Friction | None

    def factored_once(self) -> "DamperAtRest":
        """The same for pairs that differ in stiffness alone."""
        return replace(self, bodies=factored_once(self.bodies))


def damper_at_rest(study: Study, model: ReducedModel, reduction: ReductionFacts) -> DamperAtRest:
    """Of a study, of which there is the reduced model. InputError where the load leaves out a piece
    of the damper."""
    bodies = static_bodies(study, model, reduction)
    damper = DamperAtRest(
        bodies,
        on_model(study, bodies.model),
        np.array(study.driver.axis),
        radii(study),
        study.contact.normal == "hard",
        friction_of(study) if study.preload.friction else None,
    )
    check_loaded(damper.bodies.model, damper.loads)
    return damper


def friction_of(study: Study) -> Friction:
    """Of the law of the response; without one each tangent has its limit."""
    limit = study.respond.law.make().friction if "respond" in study else each_limited
    return Friction(limit, study.preload.steps)


@dataclass(frozen=True)
class ContactAtRest:
    """The static contact of some pairs, set up where it is asked for and once."""

    damper: DamperAtRest
    pairs: ContactTable

    @cached_property
    def frictionless(self) -> StaticContact:
        """On the springs kn, or with hard contact where the study says so."""
        bodies = self.damper.bodies
        pairs = self.pairs
        return StaticContact(
            bodies.model,
            pairs.replace(kn=np.full(len(pairs), np.inf)) if self.damper.hard else pairs,
            held=self.damper.loads.balance.hold.on(bodies.model, pairs),
            compliance=bodies.compliance,
        )

    @cached_property
    def rounds(self) -> RoundSides:
        """The sides that are cylinders, where a slide at rest takes the gaps along."""
        return RoundSides(self.damper.bodies.model, self.pairs, self.damper.radius)

    def solve(self, load: np.ndarray, *, constrain: bool = False) -> Preload:
        """`StaticContact.solve` with the gaps of the position that the damper reaches under the
        load."""
        found = settled(
            lambda gaps: [self.frictionless.solve(load, gap=gaps[-1], constrain=constrain)],
            self.rounds,
        )
        return found[-1]
