"""Keys of a study that exclude or require each other; every check raises InputError with the place
in the file."""

from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from tipdamp.hbm.curve.enough_harmonics import SETTINGS as HARMONICS
from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.hbm.io.array_files import check_size
from tipdamp.hbm.validation import check_samples
from tipdamp.study.law import laws_with_sliders
from tipdamp.study.schema import (
    ContactSection,
    LoadCase,
    MaterialSection,
    OtherMaterial,
    Respond,
    SideSection,
    StudySection,
    Tune,
    named_orders,
)
from tipdamp.study.view import Study

if TYPE_CHECKING:
    from tipdamp.hbm.laws import ContactLaw

TRIED = 3  # numbers of harmonics of harmonics = 'auto', as counted
MOST_CURVES, CURVE_SECONDS, CURVE_MB = 1000, 1, 0.05  # of a study; of a curve of a small model
OF_MODELS = ("kind", "scale", "fit_hz")  # keys of [contact] on how a model gives the stiffness
GIVEN = (
    ("kn", "kt"),
    ("kn_per_area", "kt_per_area"),
    ("kn_total", "kt_total"),
    ("reference_kn", "reference_kt"),
)
# of a side, by which model
OF_CURVES = ("levels", "band", "damping_ratio")  # keys of [respond]
NEEDED = {"depth": "plane_depth", "h_rms": "rough_series", "gamma": "rough_series"}


def require_sections(path: Path, raw: dict, sides: dict) -> None:
    """Matrices or meshes, a contact and two sides; before the sections themselves are read."""
    meshed = [name for name in ("material", "blades", "damper") if name in raw]
    if "model" in raw and meshed:
        raise InputError(
            f"{path}: [model] and [{meshed[0]}] exclude each other: matrices or meshes"
        )
    for name in (
        ["model", "contact"] if "model" in raw else ["material", "blades", "damper", "contact"]
    ):
        if name not in raw:
            raise InputError(f"{path}: section [{name}] is missing")
    own_pairs = isinstance(raw["contact"], dict) and raw["contact"].get("pairs")
    if not own_pairs and len(sides) < 2:
        raise InputError(
            f"{path}: {len(sides)} contact sides; a free damper needs two, such as [contact.left] "
            "and [contact.right]"
        )


def check_files(study: Study) -> None:
    """What can be read, where it is there: no pipe, and not too large."""
    for key, file in study.inputs().items():
        # a pipe or a device, which may never end
        if file.exists() and not (file.is_file() or file.is_dir()):
            raise InputError(f"{study.path}: {key} = {shown(file, 400)}: is not a file")
        if file.is_file():
            check_size(file)


def check_study(study: Study) -> None:
    """All that concerns several keys."""
    path, contact = study.path, study.contact
    check_limits(study)
    if not contact.pairs and contact.mu is None:
        raise InputError(
            f"{path}: [contact] mu is missing: {ContactSection.data_sheets()['mu'].text}"
        )
    if "model" in study:
        _check_matrices(study)
    for name in ("blades", "damper"):
        if name in study:
            check_modes(f"{path}: [{name}]", vars(study)[name])
    if "tune" in study:
        check_tune(f"{path}: [tune]", study.tune, study.measured if "measured" in study else ())
    if contact.pairs:
        refuse_beside_pairs(path, contact, study.sides)
    else:
        check_contact(f"{path}: [contact]", contact)
    if contact.fit_hz is not None and not {"tune", "respond"} <= set(vars(study)):
        raise InputError(
            f"{path}: [contact] fit_hz: needs [tune] and [respond], by which the mode is tracked"
        )
    if "respond" in study:
        check_respond(f"{path}: [respond]", study.respond)
        if study.preload.friction and not study.respond.law.file:  # which is not run for that
            check_sliders(f"{path}: [respond]", study.respond, study.respond.law.make())
    if "backbone" in study:
        check_backbone(f"{path}: [backbone]", study)
    for name, side in study.sides.items():
        check_side(f"{path}: [contact.{name}]", side, contact)
    check_loads(study)


def _check_matrices(study: Study) -> None:
    """What needs meshes has no meaning with given matrices."""
    path, contact = study.path, study.contact
    if not contact.pairs:
        raise InputError(
            f"{path}: [contact] pairs is missing: with [model] the pairs come from a CSV"
        )
    if "reduction" in contact.model_fields_set:
        raise InputError(
            f"{path}: [contact] reduction is of meshes, and the study gives matrices ([model]): "
            "leave it out"
        )
    for name in ("preload", "respond"):
        if name in study and vars(study)[name].stress:
            raise InputError(
                f"{path}: [{name}] stress needs meshes, and the study gives matrices ([model]): "
                "leave it out"
            )


def check_limits(study: Study) -> None:
    """Both limits of a material, or none."""
    if "material" not in study:
        return
    every: dict[str, MaterialSection | OtherMaterial] = {"material": study.material}
    every |= {f"material.{name}": one for name, one in study.materials.items()}
    for name, one in every.items():
        if (one.fatigue_limit is None) != (one.tensile_strength is None):
            absent = "fatigue_limit" if one.fatigue_limit is None else "tensile_strength"
            raise InputError(
                f"{study.path}: [{name}] {absent} is missing: safety by Goodman needs both limits"
            )


def check_contact(where: str, contact: ContactSection) -> None:
    """Keys of a stiffness model have no meaning without one."""
    for key in OF_MODELS:
        if key in contact.model_fields_set and contact.stiffness == "given":
            raise InputError(f'{where} {key}: leave it out, stiffness = "given" uses no model')
    if contact.fit_hz is not None and "scale" in contact.model_fields_set:
        raise InputError(
            f"{where} scale and fit_hz exclude each other: the factor is declared or fitted"
        )
    if contact.stiffness == "rough_series" and contact.kind == "secant":
        raise InputError(
            f'{where} kind = "secant": rough surfaces have no defined onset of contact, stiffness '
            '= "rough_series" has a tangent only'
        )


def check_side(where: str, side: SideSection, contact: ContactSection) -> None:
    """Nodes, shape and stiffness of one side: given, or what its model needs."""
    matched, stated = not contact.pairs, dict(side)
    if matched and contact.method == "surfaces" and side.per_node:
        raise InputError(
            f"{where} kn and kt are per node, which means nothing on surfaces ([contact] method): "
            "give kn_per_area and kt_per_area, or kn_total and kt_total"
        )
    if matched:
        _check_given_stiffness(where, side, contact.stiffness)
    needs = {key: matched for key in ("blade", "damper")}
    theory = matched and not side.given
    edge = side.shape != "cylinder" and side.rows == "edge" and side.roll_stiffness == "from_flat"
    needs |= {
        "width": side.shape != "cylinder" and (theory or edge),
        "radius": side.shape != "flat" and theory,
        **{key: theory and contact.stiffness == its for key, its in NEEDED.items()},
    }
    for key, needed in needs.items():
        if needed and not stated[key]:
            raise InputError(f"{where} {key} is missing: {SideSection.data_sheets()[key].text}")
    if side.depth and len(side.depth) != 2:
        raise InputError(f"{where} depth = {list(side.depth)}: must be two numbers [blade, damper]")
    for key, its in NEEDED.items():
        if theory and stated[key] and contact.stiffness != its:
            raise InputError(
                f'{where} {key}: leave it out, it belongs to [contact] stiffness = "{its}"'
            )


def _check_given_stiffness(where: str, side: SideSection, model: str) -> None:
    stated = dict(side)
    ways = [way for way in GIVEN[:-1] if any(stated[key] is not None for key in way)]
    if model == "given" and not any(None not in (stated[kn], stated[kt]) for kn, kt in GIVEN[:-1]):
        raise InputError(
            f'{where} kn and kt are missing; give them, or set [contact] stiffness = "halfspace"'
        )
    if len(ways) > 1:
        raise InputError(
            f"{where} {ways[0][0]} and {ways[1][0]} exclude each other: per node, per area or in "
            "total"
        )
    for kn, kt in GIVEN:
        if (stated[kn] is None) != (stated[kt] is None):
            absent, other = (kn, kt) if stated[kn] is None else (kt, kn)
            why = "are compared" if kn.startswith("reference") else "replace the model"
            raise InputError(
                f"{where} {absent} is missing: {other} is given; only both together {why}"
            )


def refuse_beside_pairs(path: Path, contact: ContactSection, sides: dict[str, SideSection]) -> None:
    """What the table of pairs gives is given there alone, but for mu, kn and kt, which replace its
    own."""
    own = ("blade", "damper", *(key for way in GIVEN[1:] for key in way), "gap", *NEEDED)
    of_all = (*OF_MODELS, "shares", "stiffness")
    given: list[tuple[str, StudySection, tuple[str, ...]]] = [("[contact]", contact, of_all)]
    given += [(f"[contact.{name}]", side, own) for name, side in sides.items()]
    for where, section, keys in given:
        for key in keys:
            if key in section.model_fields_set:
                raise InputError(
                    f"{path}: {where} {key}: leave it out, the table [contact] pairs = "
                    f"'{contact.pairs}' gives it for every pair"
                )


def check_respond(where: str, respond: Respond) -> None:
    """No curve or patch twice; one patch on each blade; all that curves need, or none of it."""
    absent = [key for key in OF_CURVES if key not in respond.model_fields_set]
    if absent and len(absent) < len(OF_CURVES):
        text = Respond.data_sheets()[absent[0]].text
        raise InputError(f"{where} {absent[0]} is missing: {text}")
    orders = named_orders(respond.harmonics)
    listed: dict[str, tuple] = {"levels": respond.levels, "harmonics": orders}
    listed |= {"patches": respond.patches, "excitation": respond.excitation}
    for key, values in listed.items():
        names = [f"{v:g}" if isinstance(v, float) else str(v) for v in values]
        double = [n for n, times in Counter(names).items() if times > 1]
        if double:
            raise InputError(f"{where} {key}: {shown(double[0])} is given twice")
    try:
        check_samples(respond.samples, max(orders, default=HARMONICS.most))
    except InputError as error:
        raise InputError(f"{where} {error}") from None
    of_each = len(orders) or TRIED
    curves = len(respond.levels) * of_each * (1 + respond.both_ways)
    if curves > MOST_CURVES:
        raise InputError(
            f"{where} levels and harmonics make {curves} curves, at most {MOST_CURVES} are "
            f"computed in one study; at {CURVE_SECONDS} s and {CURVE_MB} MB each, as of a small "
            f"model, they would take {curves * CURVE_SECONDS / 3600:.0f} h and "
            f"{curves * CURVE_MB / 1000:.0f} GB"
        )
    check_excitation(where, respond)
    if len(respond.patches) != 2:
        raise InputError(
            f"{where} patches = {list(respond.patches)}: two groups are needed, one on each blade"
        )


def check_excitation(where: str, respond: Respond) -> None:
    """One amplitude for each group; one phase for each further group, as a word, angles or an
    engine order."""
    groups = len(respond.excitation)
    phase = respond.phase
    given = respond.model_fields_set
    if respond.amplitudes and len(respond.amplitudes) != groups:
        raise InputError(
            f"{where} amplitudes = {list(respond.amplitudes)}: {groups} needed, one for each "
            "group of excitation"
        )
    if respond.amplitudes and not any(respond.amplitudes):
        raise InputError(f"{where} amplitudes = {list(respond.amplitudes)}: must not all be 0")
    if ("engine_order" in given) != ("blade_count" in given):
        raise InputError(
            f"{where} engine_order and blade_count go together: their ratio is the phase"
        )
    if "engine_order" in given and "phase" in given:
        raise InputError(f"{where} phase and engine_order exclude each other: state one of them")
    if groups == 1 and given & {"phase", "engine_order"}:
        raise InputError(
            f"{where} phase and engine_order need two groups of excitation, one on each blade"
        )
    if groups > 2 and (phase == "out_of_phase" or "engine_order" in given):
        raise InputError(f"{where} phase: of {groups} groups, give {groups - 1} angles in degrees")
    if not isinstance(phase, str) and len(phase) != groups - 1:
        raise InputError(
            f"{where} phase = {list(phase)}: {groups - 1} angles needed, one for each further group"
        )


def check_sliders(where: str, respond: Respond, law: "ContactLaw") -> None:
    """The response can start from friction forces only where its law has sliders."""
    if not law.sliders:
        raise InputError(
            f"{where} law = '{respond.law}': has no sliders, and with [preload] friction = true "
            "the response starts from friction forces; laws with sliders: "
            f"{', '.join(laws_with_sliders())}"
        )


def check_backbone(where: str, study: Study) -> None:
    """Curves that it stands beside, one way to name the mode, a range of amplitudes."""
    asked = study.backbone
    if "respond" not in study or not study.respond.levels:
        raise InputError(
            f"{where} stands beside forced peaks: give [respond] levels, or leave the section out"
        )
    if asked.mode is not None and asked.near_hz is not None:
        raise InputError(f"{where} mode and near_hz exclude each other: state one of them")
    a = asked.amplitudes
    if len(a) == 1 or any(one >= other for one, other in pairwise(a)):
        raise InputError(f"{where} amplitudes: must be two or more, [first, last], ascending")
    patches = study.respond.patches
    if asked.response and asked.response not in patches:
        raise InputError(
            f"{where} response = '{shown(asked.response)}': {nearest(asked.response, patches)}"
        )


def check_loads(study: Study) -> None:
    """Cases that [preload] names exist; with matrices a case has only its pull."""
    preload = study.preload
    for name, case in study.loads.items():
        extra = [
            key for key in LoadCase.model_fields if key != "pull" and key in case.model_fields_set
        ]
        if "model" in study and extra:
            raise InputError(
                f"{study.path}: [loads.{name}] {extra[0]}: with [model] the case is the load "
                f"'{name}' of its matrices; only pull may be stated"
            )
    where = f"{study.path}: [preload]"
    if preload.history and not preload.friction:
        raise InputError(
            f"{where} history: without friction the preload does not depend on it; set friction = "
            "true"
        )
    for key, names in (
        ("history", preload.history),
        ("case", [preload.case] if preload.case else []),
    ):
        for name in names:
            if name not in study.loads:
                raise InputError(
                    f"{where} {key}: no load case [loads.{name}]; "
                    f"{nearest(name, list(study.loads))}"
                )


def check_modes(where: str, body: StudySection) -> None:
    """One way alone says how many modes are kept."""
    given = [k for k in ("modes", "modes_below_hz", "error") if k in body.model_fields_set]
    if len(given) > 1:
        raise InputError(
            f"{where} {given[0]} and {given[1]} exclude each other: one of them says how many modes"
        )


def check_tune(where: str, tune: Tune, measured: Iterable[str] = ()) -> None:
    """A target, the stations or a table; keys of a target have no meaning without one."""
    stations = tune.stations
    target = tune.target_hz is not None or bool(tune.target_from)
    if tune.by == "station":
        _refuse(where, tune, ("cell_size", "kept_share"), "by = 'area' or 'cell'")
        if tune.order == "from_edge":
            raise InputError(
                f"{where} order = 'from_edge' is of by = 'area' or 'cell'; for stations "
                "'from_middle' or 'least_loaded'"
            )
    else:
        _refuse(where, tune, ("stations", "kept"), "by = 'station'")
    if tune.by == "area" and "graded" in tune.model_fields_set:
        raise InputError(f"{where} graded: leave it out, by = 'area' meets the target exactly")
    if not tune.kept and target == bool(stations or tune.kept_share):
        raise InputError(
            f'{where} needs either target_hz, or stations = [front, back], or a table kept = "..."'
            if tune.by == "station"
            else f"{where} needs either target_hz or kept_share"
        )
    if tune.target_hz is not None and tune.target_from:
        raise InputError(
            f"{where} target_hz and target_from exclude each other: a number or a measured curve"
        )
    if tune.target_from and tune.target_from not in measured:
        raise InputError(
            f"{where} target_from = '{tune.target_from}': there is no "
            f"[measured.{tune.target_from}]; {nearest(tune.target_from, list(measured))}"
        )
    if not target:
        _refuse(
            where,
            tune,
            ("scatter_hz", "graded", *(("order",) if tune.by == "station" else ())),
            "target_hz",
        )
    if tune.preload == "table" and not tune.kept:
        raise InputError(
            f"{where} preload = 'table': needs a table kept = \"...\"; without one 'scaled' or "
            "'resolved'"
        )
    if stations and stations != "all" and (len(stations) != 2 or not any(stations)):
        raise InputError(
            f"{where} stations = {list(stations)}: must be two numbers [front, back], not both 0, "
            "or 'all'"
        )


def _refuse(where: str, section: Tune, keys: tuple[str, ...], of: str) -> None:
    for key in keys:
        if key in section.model_fields_set:
            raise InputError(f"{where} {key}: leave it out, it belongs to {of}")
