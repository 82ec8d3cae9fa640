"""The reduced model against the unreduced one: stuck frequencies of both, and the bound that the
reduction gives."""

from dataclasses import fields

import numpy as np

from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.read import read_meshes
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import fingerprint
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.truncation import Truncation
from tipdamp.results.static_results import FullModelCheck
from tipdamp.static_contact.full.stuck_modes import StuckSet, full_stuck_sets
from tipdamp.static_contact.tuning.reduction_error import stuck_error_bound
from tipdamp.static_contact.tuning.roll_springs import spring_rows
from tipdamp.study.view import Study

Check = dict[str, FullModelCheck]
# columns in which tables of the same stuck pairs may differ
NOT_OF_STUCK = ("preload", "mu", "gap")
LATEST = 4  # checks that a process keeps
_latest: dict[str, Check] = {}


def full_model_check(
    study: Study,
    model: ReducedModel,
    reduced: str,
    truncation: Truncation | None,
    sets: dict[str, StuckSet],
    tick: Tick,
) -> Check:
    """{set: figures} of the stuck frequencies of the reduced model against those of the full one:
    as many modes of the full model as there are reduced ones. truncation - None where it bounds no
    frequency.

    reduced - key of the reduction, which the full model follows from too. The same sets of the same
    bodies are checked once in a process: in a sweep over the pull or friction they often are.
    """
    stuck = [part for name, one in sets.items() for part in (name, *_stuck(one))]
    mark = fingerprint(reduced, truncation is None, *stuck)
    if mark not in _latest:
        found = _check(study, model, truncation, sets, tick)
        while len(_latest) >= LATEST:
            del _latest[next(iter(_latest))]  # the oldest
        _latest[mark] = found
    return _latest[mark]


def _stuck(one: StuckSet) -> list:
    """All that its stuck modes depend on."""
    columns = [f.name for f in fields(ContactTable) if f.name not in NOT_OF_STUCK]
    springs = [[spring.k, spring.low, spring.high, spring.distance] for spring in one.springs]
    return [*(vars(one.pairs)[name] for name in columns), springs, one.hz]


def _check(
    study: Study,
    model: ReducedModel,
    truncation: Truncation | None,
    sets: dict[str, StuckSet],
    tick: Tick,
) -> Check:
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
