"""The factor on the contact stiffness with which the stuck assembly has a measured frequency."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tipdamp.bodies import BLADES, loads
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.stages.reduce import free_modes
from tipdamp.static_contact.stiffness.nodal_weights import calibrate_scale
from tipdamp.static_contact.tuning.kept_stations import keep_ends
from tipdamp.static_contact.tuning.redistribution import carried
from tipdamp.static_contact.tuning.roll_springs import spring_rows
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly
from tipdamp.statics import model_inputs as inputs
from tipdamp.statics.cases import StaticBodies, factored_once, solve_at_rest, static_contact
from tipdamp.study.view import Study

READS = ("tune.follow", "tune.stations", "tune.stiffness", "respond.direction", "respond.patches")


@dataclass(frozen=True)
class FitSettings:
    """Of the search for the factor."""

    least: float = 1e-3  # far below what any contact is softer by
    most: float = 1e2  # far above smooth bodies
    met_hz: float = 0.1  # a fit that ends farther off met a place where pairs open or close


SETTINGS = FitSettings()


def fit_factor(
    study: Study, model: ReducedModel, bodies: StaticBodies, scaled: Callable[[float], ContactTable]
) -> tuple[float, list[str]]:
    """The factor with which the line model, stuck at every station or at those of [tune] stations,
    has the frequency [contact] fit_hz; and a warning where none meets it. scaled(factor) -> the
    pairs with that stiffness.

    The preload is solved again for every factor, without friction: pairs that are open at rest do
    not stick. Raises InputError where no factor reaches the frequency.
    """
    assembly, goal, bodies = (
        StuckAssembly(model),
        study.contact.fit_hz or 0.0,
        factored_once(bodies),
    )
    follow = np.zeros(model.size)
    follow[model.body == BLADES] = free_modes(study, model.part(BLADES)).follow[study.tune.follow]

    def frequency(factor: float) -> float:
        pairs = scaled(factor)
        contact = static_contact(study, bodies, pairs)
        found = solve_at_rest(study, contact, loads.at_rest(study, bodies.model), constrain=True)
        whole = inputs.preload_map(found, pairs)
        line = inputs.line_of(study, whole)
        if study.tune.stations:
            line = keep_ends(line, *inputs.ends_kept(study, line), conserve=inputs.conserves(study))
        closed = carried(whole, line) > 0
        springs = spring_rows(model, line, inputs.declared_springs(study, line, closed))
        stuck = line.replace(weight=np.where(closed, line.weight, 0.0))
        return assembly.modes(stuck, follow, extra=springs).tracked_hz

    factor = calibrate_scale(frequency, goal, SETTINGS.least, SETTINGS.most)
    met = frequency(factor)
    return factor, [] if abs(met - goal) < SETTINGS.met_hz else [
        f"[contact] fit_hz = {goal:g}: no factor meets it, since pairs open or close or modes "
        f"cross near {factor:.4g}, which gives {met:.1f} Hz"
    ]
