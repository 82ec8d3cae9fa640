"""What vibrates: the kept pairs between the bodies on their roll springs, from what the stages
before have left."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple
from warnings import warn

import numpy as np

from tipdamp.bodies.interface import kept_shapes, shapes_of
from tipdamp.bodies.loads import damper_hold
from tipdamp.engine.curves import Curves
from tipdamp.engine.store import Store
from tipdamp.hbm.balance.open_damping import OpenModes, open_modes
from tipdamp.hbm.balance.problem import doubted_problem
from tipdamp.hbm.balance.receptance import linear_response, linear_response_with_peaks
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.hold import spring
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.interface import InterfaceReduction
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.tuning.roll_springs import with_springs
from tipdamp.statics import friction_history
from tipdamp.statics.model_inputs import (
    declared_springs,
    excitation,
    outputs,
    peak_groups,
    ratio,
)
from tipdamp.study.checks import check_sliders
from tipdamp.study.schema import Respond
from tipdamp.study.view import Study, every_key

# of `assembled`
READS = (
    *every_key("respond", but=("animate", "compare", "stress")),
    "sides",
    "preload.friction",
    "driver.hold",
    "model.hold",
)
# of the linear response: laws with fewer have another one where nothing slips
ALL_SPRINGS = ("t1", "t2", "n")
POINTS = 801  # of the linear stuck response
DAMPED = 1500  # dofs up to which the damping of open contacts is looked at, in seconds


@dataclass(frozen=True)
class Assembly:
    """What vibrates: the model with its roll springs, the kept pairs, their forces at rest (P, 3) N
    along t1, t2, n, the curves of the study, and the shapes that the response is in, None for all
    dofs."""

    model: ReducedModel
    kept: ContactTable
    rest: np.ndarray
    curves: Curves
    interface: InterfaceReduction | None

    @property
    def vibrating(self) -> ReducedModel:
        """The model on the dofs that the response is in, with the springs on what is held."""
        return (
            self.model
            if self.interface is None
            else on_springs(self.interface.model, self.interface.held)
        )

    @cached_property
    def open_modes(self) -> OpenModes | None:
        """Those that leave open what is open at rest."""
        return open_modes(self.curves.problem, DAMPED)

    def linear(self, settings: Respond, hz: np.ndarray, level: float) -> np.ndarray:
        """(n, outputs) m: response with all kept pairs stuck that are in contact at rest."""
        return linear_response(*self._stuck(settings, hz, level))

    def drawn(self, settings: Respond) -> tuple[np.ndarray, np.ndarray]:
        """(Hz (n,), (n, outputs) m per newton): `linear` over the band, with its peaks."""
        hz = np.linspace(*settings.band, POINTS)
        return linear_response_with_peaks(*self._stuck(settings, hz, 1.0))

    def _stuck(
        self, settings: Respond, hz: np.ndarray, level: float
    ) -> tuple[
        ReducedModel,
        ContactTable,
        np.ndarray,
        np.ndarray,
        float | np.ndarray,
        dict[str, np.ndarray],
    ]:
        closed = self.kept.select(self.kept.preload > 0)
        force = level * self.curves.force
        zeta = ratio(settings.damping_ratio)
        if self.open_modes is not None and len(self.open_modes.own) == self.vibrating.size:
            zeta = self.open_modes.own
        return self.vibrating, closed, force, hz, zeta, self.curves.rows


class FrictionAtRest(NamedTuple):
    """Friction at rest of the kept pairs: tangential (P, 2) N; static (r,) N - constant load that
    balances it; sliders (P, n) m - their positions. The last two None without friction."""

    tangential: np.ndarray
    static: np.ndarray | None = None
    sliders: np.ndarray | None = None


def assembled(study: Study, store: Store, responded: bool = False) -> Assembly:
    """What the stages before have left, put together for the forced response; responded - the
    shapes that it is in are there."""
    model = ReducedModel.load(store.path("model.npz"))
    table = ContactTable.load(store.path("kept.csv"))
    model = with_springs(model, table, declared_springs(study, table, table.preload > 0))
    kept = table.select(table.carrying)
    law = study.respond.law.make()
    force = excitation(study, model)
    rest = _friction_at_rest(study, store, model, table, law)
    rows = outputs(study, model)
    held = damper_hold(study).on(model, kept)
    if responded:
        shapes = kept_shapes(store, held)
    else:
        largest = max(study.respond.levels) * force
        loads = [largest] if rest.static is None else [largest, rest.static]
        shapes = shapes_of(study, model, kept, loads, held)
    small = model
    there = held
    static = rest.static
    if shapes is not None:
        small, there = shapes.model, shapes.held
        force = force @ shapes.basis
        rows = {name: r @ shapes.basis for name, r in rows.items()}
        static = None if static is None else static @ shapes.basis
    problem, _, doubts = doubted_problem(
        small, kept, law, ("preloaded", static, ratio(study.respond.damping_ratio), ())
    )
    for doubt in doubts:  # those of the table itself: where it was read
        warn(doubt, stacklevel=2)
    curves = Curves(
        replace(problem, held=there),
        force,
        rows,
        rest.sliders,
        store,
        study.respond.samples,
        peak_groups(study, rows),
        study.respond.stability,
        study.respond.derivatives,
    )
    forces = np.column_stack([rest.tangential, np.maximum(kept.preload, 0.0)])
    return Assembly(on_springs(model, held), kept, forces, curves, shapes)


def _friction_at_rest(
    study: Study, store: Store, model: ReducedModel, table: ContactTable, law: ContactLaw
) -> FrictionAtRest:
    kept = table.select(table.carrying)
    if not study.preload.friction:
        return FrictionAtRest(np.zeros((len(kept), 2)))
    check_sliders("[respond]", study.respond, law)
    tangential = friction_history.load(store.path("kept_friction.csv"), table)[table.carrying]
    # a tangent that the law does not know carries no friction
    tangential[:, law.sliders :] = 0.0
    static, sliders = friction_history.start(model, kept, tangential)
    return FrictionAtRest(tangential, static, sliders[:, : law.sliders])


def on_springs(model: ReducedModel, held: Sequence[HeldMotion]) -> ReducedModel:
    """The model with the springs on what is held."""
    return model.with_stiffness(spring.with_springs(model.K, [one for one in held if not one.mean]))
