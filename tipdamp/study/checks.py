"""Values of a study file that exclude or need each other: every check raises InputError with the place in the file."""

from hbm.errors import InputError, nearest
from tipdamp.stiffness import is_given
from tipdamp.study.schema import SIDE

OF_MODELS = ("kind", "scale", "shares")       # keys of [contact] on how a model gives the stiffness
NEEDED = {"depth": "plane_depth", "h_rms": "rough_series", "gamma": "rough_series"}     # of a side, by which model


def check_contact(where, contact):
    """What says how a model gives the stiffness has no meaning without a model."""
    for key in OF_MODELS:
        if key in contact and contact.get("stiffness", "given") == "given":
            raise InputError(f"{where} {key}: leave it out, stiffness = \"given\" has no model that it could be of")
    if contact.get("stiffness") == "rough_series" and contact.get("kind") == "secant":
        raise InputError(f"{where} kind = \"secant\": rough surfaces approach without a first touch, stiffness = "
                         "\"rough_series\" has a tangent only")


def check_side(where, side, contact):
    """Nodes, shape and stiffness of one side: given, or what its model needs."""
    model, matched = contact["stiffness"], not contact["pairs"]
    if matched and (side["kn"] is None or side["kt"] is None):
        if model == "given":
            raise InputError(f"{where} kn and kt are missing; give them, or set [contact] stiffness = \"halfspace\"")
        for key, other in (("kn", "kt"), ("kt", "kn")):
            if side[key] is None and side[other] is not None:
                raise InputError(f"{where} {key} is missing: {other} is given, and only both win over the model")
    for key in ("blade", "damper"):
        if matched and not side[key]:
            raise InputError(f"{where} {key} is missing: {SIDE[key].text}")
    theory = matched and not is_given(side)
    edge = side["shape"] != "cylinder" and side["rows"] == "edge" and side["roll_stiffness"] is None
    needs = {"width": side["shape"] != "cylinder" and (theory or edge), "radius": side["shape"] != "flat" and theory,
             **{key: theory and model == its for key, its in NEEDED.items()}}
    for key, needed in needs.items():
        if needed and not side[key]:
            raise InputError(f"{where} {key} is missing: {SIDE[key].text}")
    if side["depth"] and len(side["depth"]) != 2:
        raise InputError(f"{where} depth = {list(side['depth'])}: must be two numbers [blade, damper]")
    for key, its in NEEDED.items():
        if theory and side[key] and model != its:
            raise InputError(f"{where} {key}: leave it out, it belongs to [contact] stiffness = \"{its}\"")


def refuse_beside_pairs(path, contact, sides):
    """What the table of pairs says is said there alone."""
    own = ("blade", "damper", "kn", "kt", "gap", *NEEDED)
    for where, given, keys in [("[contact]", contact, ("mu", *OF_MODELS, "stiffness")),
                               *((f"[contact.{name}]", side, own) for name, side in sides.items())]:
        for key in keys:
            if key in given:
                raise InputError(f"{path}: {where} {key}: leave it out, the table [contact] pairs = "
                                 f"'{contact['pairs']}' says it for every pair")


def check_respond(where, respond):
    for key in ("levels", "harmonics", "patches"):
        names = [f"{v:g}" if isinstance(v, float) else str(v) for v in respond[key]]
        double = [n for n in names if names.count(n) > 1]
        if double:
            raise InputError(f"{where} {key}: {double[0]} stands there twice")
    if len(respond["patches"]) != 2:
        raise InputError(f"{where} patches = {list(respond['patches'])}: two groups are needed, one on each blade")


def check_history(where, preload, cases):
    if preload["history"] and not preload["friction"]:
        raise InputError(f"{where} history: without friction the preload does not depend on it; set friction = true")
    for key, names in (("history", preload["history"]), ("case", [preload["case"]] if preload["case"] else [])):
        for name in names:
            if name not in cases:
                raise InputError(f"{where} {key}: no load case [loads.{name}]; {nearest(name, cases)}")


def check_modes(where, body):
    given = [k for k in ("modes", "modes_below_hz", "error") if k in body]
    if len(given) > 1:
        raise InputError(f"{where} {given[0]} and {given[1]} exclude each other: one of them says how many modes")


def check_tune(where, tune):
    if (tune["target_hz"] is None) == (not tune["stations"]):
        raise InputError(f"{where} needs either target_hz or stations = [front, back]")
    if tune["stations"] and tune["stations"] != "all" and (len(tune["stations"]) != 2 or not any(tune["stations"])):
        raise InputError(f"{where} stations = {list(tune['stations'])}: must be two numbers [front, back], not both 0, "
                         "or 'all'")
