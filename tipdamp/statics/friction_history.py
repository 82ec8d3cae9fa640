"""The preload with friction of a study ([preload] friction): its history, and the tangential state
at its end.

The response starts from that state: its origin is the preloaded state, where the friction forces T
act and are balanced by constant loads, and the sliders stand at -T/kt.
"""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tipdamp.bodies import loads
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.csv_table import read_table
from tipdamp.hbm.laws.friction import each_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import FrictionFacts
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact, FrictionState
from tipdamp.static_contact.contact.slide_at_rest import settled
from tipdamp.statics.cases import StaticBodies
from tipdamp.statics.model_inputs import round_sides
from tipdamp.study.view import Study

READS = ("respond.law",)  # of a stage that calls `solve`
COLUMNS = ("pair", "blade_node", "damper_node", "T1_N", "T2_N", "slider1_m", "slider2_m", "slips")


class StartState(NamedTuple):
    """static : (r,) N - constant load that balances the friction forces; sliders : (P, 2) m - their
    positions."""

    static: np.ndarray
    sliders: np.ndarray


def history(study: Study, model: ReducedModel | SparseBodies) -> list[np.ndarray]:
    """(n, r) N: the load cases that the study passes through, and at last the load of the
    response."""
    return [
        *(loads.total(study, case, model) for case in study.preload.history),
        loads.at_rest(study, model),
    ]


def solve(
    study: Study, bodies: StaticBodies, pairs: ContactTable, through: list[np.ndarray]
) -> FrictionState:
    """The state after the loads `through`, within the friction limit of the law of the response.

    Raises InputError where the history ends before it.
    """
    friction = study.respond.law.make().friction if "respond" in study else each_limited
    contact = FrictionalContact(bodies.model, pairs, friction=friction, stuck=bodies.stuck)

    def after_each_load(gaps: np.ndarray) -> list[FrictionState]:
        states = contact.solve(through, steps=study.preload.steps, gap=gaps)
        _check_reached(study, states[-1], len(through))
        return [state for state in states if state.time == int(state.time)]

    return settled(after_each_load, round_sides(study, bodies.model, pairs), len(through))[-1]


def _check_reached(study: Study, end: FrictionState, count: int) -> None:
    """InputError where a history of so many loads ended before the last of them."""
    if end.converged:
        return
    names = [*study.preload.history, loads.rest_name(study)] if count > 1 else ["the load"]
    on_way = names[min(int(np.ceil(end.time)) - 1, len(names) - 1)]
    raise InputError(
        f"[preload] friction: no equilibrium was found on the way to {on_way} "
        f"({100 * (end.time % 1 or 1):.0f} % of it): the damper lifts off, or the load "
        "exceeds what friction can carry; try more [preload] steps"
    )


def facts(state: FrictionState, without_friction: dict[str, float] | None = None) -> FrictionFacts:
    """Figures for the result of a stage; without_friction {side: N} of the frictionless
    equilibrium."""
    return FrictionFacts(
        slipping_pairs=int(state.slips.sum()),
        closed_pairs=int((state.force > 0).sum()),
        largest_T_N=float(np.abs(state.tangential).max()),
        residual=state.residual,
        without_friction_N=without_friction or {},
    )


def save(
    path: Path, pairs: ContactTable, tangential: np.ndarray, slider: np.ndarray, slips: np.ndarray
) -> None:
    """Write T (P, 2) N, slider positions (P, 2) m and whether each pair slips as CSV."""
    with open(path, "w", newline="", encoding="utf-8") as f:
        rows = csv.writer(f)
        rows.writerow(COLUMNS)
        for i in range(len(pairs)):
            rows.writerow(
                [
                    i + 1,
                    pairs.blade_node[i],
                    pairs.damper_node[i],
                    *(repr(float(v)) for v in (*tangential[i], *slider[i])),
                    int(slips[i]),
                ]
            )


def load(path: Path, pairs: ContactTable) -> np.ndarray:
    """(P, 2) N: T1 and T2 of the file, which must belong to the pairs."""
    table = read_table(path, lambda column: int if column in ("pair", "damper_node") else float)
    if table.numbers("damper_node", int) != pairs.damper_node.tolist():
        raise InputError(f"{path} does not belong to the contact table beside it")
    return np.column_stack([table.numbers("T1_N"), table.numbers("T2_N")])


def start(model: ReducedModel, pairs: ContactTable, tangential: np.ndarray) -> StartState:
    """Start of the response for pairs in the state T (P, 2) N."""
    stiffness = (pairs.kt * pairs.weight)[:, None]
    if ((stiffness == 0) & (tangential != 0)).any():
        raise InputError("friction forces act on pairs with kt = 0")
    B = relative_motion(model, pairs)
    force = np.column_stack([tangential, np.zeros(len(pairs))]).ravel()
    return StartState(
        B.T @ force,
        -np.divide(tangential, stiffness, out=np.zeros_like(tangential), where=stiffness > 0),
    )
