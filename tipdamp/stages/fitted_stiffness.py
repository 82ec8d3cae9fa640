"""The factor on the contact stiffness with which the stuck assembly has a measured frequency."""

from collections.abc import Callable
from dataclasses import dataclass

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.stiffness.nodal_weights import calibrate_scale
from tipdamp.static_contact.tuning.kept_stations import keep_ends
from tipdamp.static_contact.tuning.redistribution import carried
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly
from tipdamp.statics import model_inputs as inputs
from tipdamp.statics.at_rest import ContactAtRest, DamperAtRest
from tipdamp.statics.modes import Stuck, free_shapes
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
    study: Study, model: ReducedModel, damper: DamperAtRest, scaled: Callable[[float], ContactTable]
) -> tuple[float, list[str]]:
    """The factor with which the line model, stuck at every station or at those of [tune] stations,
    has the frequency [contact] fit_hz; and a warning where none meets it. scaled(factor) -> the
    pairs with that stiffness.

    The preload is solved again for every factor, without friction: pairs that are open at rest do
    not stick. Raises InputError where no factor reaches the frequency.
    """
    assembly = StuckAssembly(model)
    goal = study.contact.fit_hz or 0.0
    follow = free_shapes(study, model)[study.tune.follow]
    damper = damper.factored_once()

    def frequency(factor: float) -> float:
        pairs = scaled(factor)
        found = ContactAtRest(damper, pairs).solve(damper.loads.at_rest, constrain=True)
        whole = inputs.preload_map(found, pairs)
        line = inputs.line_of(study, whole)
        if study.tune.stations:
            line = keep_ends(line, *inputs.ends_kept(study, line), conserve=inputs.conserves(study))
        return Stuck.of(study, assembly, follow, line, carried(whole, line) > 0).modes.tracked_hz

    factor = calibrate_scale(frequency, goal, SETTINGS.least, SETTINGS.most)
    met = frequency(factor)
    return factor, [] if abs(met - goal) < SETTINGS.met_hz else [
        f"[contact] fit_hz = {goal:g}: no factor meets it, since pairs open or close or modes "
        f"cross near {factor:.4g}, which gives {met:.1f} Hz"
    ]
