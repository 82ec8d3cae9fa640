"""Inputs of the reduced model from the study: contact line, roll springs, force, outputs,
damping."""

from collections.abc import Iterable, Mapping

import numpy as np

from tipdamp.bodies import BLADES
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.contact.contact_forces import Preload
from tipdamp.static_contact.contact.frictional_preload import FrictionState
from tipdamp.static_contact.tuning.kept_stations import conserve_total
from tipdamp.static_contact.tuning.roll_springs import RollSpring, roll_springs
from tipdamp.study.schema import Respond
from tipdamp.study.view import Study

# keys that `excitation` reads, beside those of the groups
EXCITATION = tuple(
    f"respond.{key}"
    for key in ("share_force", "amplitudes", "phase", "engine_order", "blade_count")
)


def line_of(study: Study, pairs: ContactTable) -> ContactTable:
    """The line model: rows that the study does not keep get weight 0. InputError where points lie
    in no rows."""
    edge = [name for name, side in study.sides.items() if side.rows == "edge"]
    for name in edge:
        mine = pairs.select((pairs.side == name) & pairs.on_surface)
        count = np.bincount(mine.station) if len(mine) else np.ones(1)
        if np.ptp(count) or len(mine) and (np.bincount(mine.station, mine.row == 0) == 0).any():
            raise InputError(
                f"{study.path}: [contact.{name}] rows = 'edge': the damper's faces lie in no rows "
                f"along the axis, its stations hold {count.min()} to {count.max()} contact "
                "points; rows = 'all'"
            )
    detached = np.isin(pairs.side, edge) & (pairs.row > 0)
    line = pairs.replace(weight=np.where(detached, 0.0, pairs.weight))
    return conserve_total(line, pairs) if conserves(study) else line


def ends_kept(study: Study, line: ContactTable) -> tuple[int, int]:
    """(front, back) stations that the study keeps."""
    if study.tune.stations == "all":
        stations = line.stations
        return (stations + 1) // 2, stations // 2
    front, back = study.tune.stations
    return front, back


def conserves(study: Study) -> bool:
    """Whether the pairs that stay take over the stiffness of their whole side."""
    return study.tune.stiffness == "conserved"


def declared_springs(
    study: Study, pairs: ContactTable, closed: np.ndarray | None = None
) -> list[RollSpring]:
    """Roll springs of the flat sides of which one row stands for several; closed (P,) - pairs that
    stick, default: those that carry."""
    springs = []
    stuck = pairs if closed is None else pairs.replace(weight=np.where(closed, pairs.weight, 0.0))
    for name, side in study.sides.items():
        one_row = len(np.unique(pairs.row[(pairs.side == name) & pairs.carrying])) == 1
        if (
            side.shape != "cylinder"
            and side.rows == "edge"
            and one_row
            and side.roll_stiffness != 0
        ):
            given = None if side.roll_stiffness == "from_flat" else side.roll_stiffness
            springs += roll_springs(stuck, name, side.width or 0.0, given)
    return springs


def out_of_reach(study: Study, above: bool, other: str = "") -> str:
    """What can be done where no contact set meets a target: the mode to follow that reaches it,
    where one does; else the stiffness that was given, or that of half-space theory, which is often
    too stiff. above - the target is higher than all sets have."""
    if other:
        return f"; [tune] follow = '{other}' reaches it"
    if study.contact.pairs:
        return "; kn and kt of the table of pairs and the mode ([tune] follow) set the range"
    if all(side.given for side in study.sides.values()):
        return "; kn and kt of the sides and the mode ([tune] follow) set the range"
    if above:
        return (
            "; the tracked mode lies lower whatever sticks, on a softer contact still more so: "
            "check the target, the mode ([tune] follow) and the stiffness"
        )
    return (
        f"; the stiffness is that of [contact] stiffness = '{study.contact.stiffness}': a rough "
        "interface in series ('rough_series'), a declared factor (scale) or a fit to a "
        "measurement (fit_hz) make it softer"
    )


def group(model: ReducedModel, study: Study, name: str) -> np.ndarray:
    """Nodes of a group of the blades that the study names."""
    key = f"{BLADES}/{name}"
    if key not in model.groups:
        names = [k.split("/", 1)[1] for k in model.groups if k.startswith(f"{BLADES}/")]
        raise InputError(f"{study.path}: the blades have no group '{name}'; {nearest(name, names)}")
    return model.groups[key]


def excitation(study: Study, model: ReducedModel) -> np.ndarray:
    """(r,) force for Fe = 1 N on all groups of the excitation; complex where they differ in phase,
    real otherwise.

    Raises InputError where a group has several nodes that are not told to share its force.
    """
    settings = study.respond
    force = np.zeros(model.size, dtype=complex)
    nodes_of = {name: group(model, study, name) for name in settings.excitation}
    check_shared(study, {name: len(nodes) for name, nodes in nodes_of.items()})
    for name, factor in zip(settings.excitation, force_factors(settings), strict=True):
        nodes = nodes_of[name]
        force += factor * np.mean(
            [model.displacement_row(BLADES, n, settings.direction) for n in nodes], axis=0
        )
    return force if force.imag.any() else force.real


def check_shared(study: Study, counts: Mapping[str, int]) -> None:
    """InputError where a group of the excitation has several nodes that are not told to share its
    force. counts {group: nodes}"""
    if "respond" not in study or study.respond.share_force:
        return
    for name in study.respond.excitation:
        if counts.get(name, 1) > 1:
            raise InputError(
                f"{study.path}: [respond] excitation: group '{name}' has {counts[name]} nodes; set "
                "share_force = true to share its force equally, or name a group of one node"
            )


def force_factors(settings: Respond) -> np.ndarray:
    """(groups,) complex amplitude of each group for Fe = 1; a positive phase leads."""
    if settings.engine_order is not None and settings.blade_count is not None:
        degrees: tuple[float, ...] = (360.0 * settings.engine_order / settings.blade_count,)
    elif isinstance(settings.phase, str):
        degrees = (180.0 * (settings.phase == "out_of_phase"),) * (len(settings.excitation) - 1)
    else:
        degrees = settings.phase
    turns = np.array([0.0, *degrees]) / 360.0 % 1.0
    exact = {0.0: 1, 0.25: 1j, 0.5: -1, 0.75: -1j}  # no rounding of what is real or imaginary
    phases = np.array([exact.get(turn, np.exp(2j * np.pi * turn)) for turn in map(float, turns)])
    return phases * (settings.amplitudes or 1.0)


def outputs(study: Study, model: ReducedModel) -> dict[str, np.ndarray]:
    """{"patch:node": (r,) row} displacement along the direction of the force."""
    return {
        f"{patch}:{n}": model.displacement_row(BLADES, n, study.respond.direction)
        for patch in study.respond.patches
        for n in group(model, study, patch)
    }


def in_patch(names: Iterable[str], patch: str) -> np.ndarray:
    """(m,) bool: names of `outputs` that belong to the patch."""
    return np.array([name.rpartition(":")[0] == patch for name in names], dtype=bool)


def peak_groups(study: Study, names: Iterable[str]) -> tuple[tuple[str, ...], ...]:
    """Outputs whose largest and smallest peak are shown: those of each patch, and each node that a
    measured curve names."""
    nodes = {one.response for one in study.measured.values()} if study.shows("measured") else set()
    patches = (
        tuple(n for n, mine in zip(names, in_patch(names, patch), strict=True) if mine)
        for patch in study.respond.patches
    )
    return *patches, *((name,) for name in names if name in nodes)


def ratio(values: tuple[float, ...]) -> float | np.ndarray:
    """One damping ratio for all modes, or one per mode."""
    return values[0] if len(values) == 1 else np.array(values)


def preload_map(result: Preload | FrictionState, pairs: ContactTable) -> ContactTable:
    """The table with its own springs again: hard pairs that are open stand open by -preload / kn as
    well."""
    return pairs.replace(
        preload=np.where(
            result.force > 0,
            result.force,
            np.where(
                np.isinf(result.pairs.kn),
                -pairs.kn * pairs.weight * result.opening,
                result.pairs.preload,
            ),
        )
    )
