"""The reduced model against the unreduced one: stuck frequencies of both, and the bound that the
reduction gives."""

import numpy as np

from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.read import read_meshes
from tipdamp.engine.progress import Tick
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.truncation import Truncation
from tipdamp.results.static_results import FullModelCheck
from tipdamp.static_contact.full.stuck_modes import StuckSet, full_stuck_sets
from tipdamp.static_contact.tuning.reduction_error import stuck_error_bound
from tipdamp.static_contact.tuning.roll_springs import spring_rows
from tipdamp.study.view import Study


def full_model_check(
    study: Study,
    model: ReducedModel,
    truncation: Truncation | None,
    sets: dict[str, StuckSet],
    tick: Tick,
) -> dict[str, FullModelCheck]:
    """{set: figures} of the stuck frequencies of the reduced model against those of the full one:
    as many modes of the full model as there are reduced ones. truncation - None where it bounds no
    frequency."""
    bodies = assemble_bodies(study, read_meshes(study), lambda *_: None)
    tick(0.8, f"full model, {sum(body.dofs for body in bodies)} dofs")
    found = {}
    for (name, one), full in zip(
        sets.items(), full_stuck_sets(bodies, list(sets.values())), strict=True
    ):
        bound = (
            ()
            if truncation is None
            else stuck_error_bound(
                model,
                truncation,
                one.pairs,
                one.hz,
                extra=spring_rows(model, one.pairs, one.springs),
            )
        )
        found[name] = FullModelCheck(
            reduced_hz=tuple(one.hz),
            full_hz=tuple(full),
            error_bound=tuple(bound),
            largest_error=float(np.abs(one.hz / full - 1).max(initial=0.0)),
        )
    return found
