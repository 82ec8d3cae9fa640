"""The preload with friction of a study ([preload] friction): its history, and the tangential state
at its end.

The response starts from that state: its origin is the preloaded state, where the friction forces T
act and are balanced by constant loads, and the sliders stand at -T/kt.
"""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.csv_table import read_table
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import FrictionFacts
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact, FrictionState
from tipdamp.static_contact.contact.slide_at_rest import settled
from tipdamp.statics.at_rest import ContactAtRest, Friction

READS = ("respond.law",)  # of a stage that calls `solve`
COLUMNS = ("pair", "blade_node", "damper_node", "T1_N", "T2_N", "slider1_m", "slider2_m", "slips")


class StartState(NamedTuple):
    """static : (r,) N - constant load that balances the friction forces; sliders : (P, 2) m - their
    positions."""

    static: np.ndarray
    sliders: np.ndarray


def solve(
    contact: ContactAtRest, friction: Friction, through: Sequence[tuple[str, np.ndarray]]
) -> FrictionState:
    """The state after the loads (name, (r,) N), one after the other.

    Raises InputError where the history ends before the last.
    """
    names, loads = zip(*through, strict=True)
    bodies = contact.damper.bodies
    pairs = contact.frictionless.pairs
    slipping = FrictionalContact(bodies.model, pairs, friction=friction.limit, stuck=bodies.stuck)

    def after_each_load(gaps: np.ndarray) -> list[FrictionState]:
        states = slipping.solve(loads, steps=friction.steps, gap=gaps)
        _check_reached(states[-1], names)
        return [state for state in states if state.time == int(state.time)]

    return settled(after_each_load, contact.rounds, len(loads))[-1]


def _check_reached(end: FrictionState, names: Sequence[str]) -> None:
    """InputError where a history of loads of these names ended before the last of them."""
    if end.converged:
        return
    on_way = names[min(int(np.ceil(end.time)) - 1, len(names) - 1)]
    raise InputError(
        f"[preload] friction: no equilibrium was found on the way to {on_way} "
        f"({100 * (end.time % 1 or 1):.0f} % of it): the damper lifts off, or the load "
        "exceeds what friction can carry; try more [preload] steps"
    )


def figures(
    state: FrictionState, without_friction: dict[str, float] | None = None
) -> FrictionFacts:
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
