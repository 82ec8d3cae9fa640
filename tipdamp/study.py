"""Study files: one TOML that names the meshes, the contact, the pull and the excitation.

The tables below are the whole language: section, key, kind, unit, default and what it means. Anything else in a file
is refused with the nearest valid name; a value out of range is answered with file, key, value and range.
"""

import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hbm.errors import InputError, nearest

UNITS = {"length": {"m": 1.0, "mm": 1e-3}, "force": {"N": 1.0, "kN": 1e3},
         "stress": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
         "density": {"kg/m3": 1.0, "t/mm3": 1e12, "g/cm3": 1e3}}
REQUIRED = object()


@dataclass(frozen=True)
class Key:
    """kind - how the value is read (see _READ); unit - a name in UNITS or force/length; low, high - allowed range."""

    kind: str
    text: str
    default: object = REQUIRED
    unit: str = ""
    low: float = -np.inf
    high: float = np.inf
    choices: tuple = ()
    open_low: bool = False


STUDY = {
    "title": Key("text", "shown on the report", ""),
    "results": Key("text", "folder of the results, relative to the study file; default: results/<study name>", ""),
}
MATERIAL = {
    "E": Key("number", "Young's modulus", unit="stress", low=0, open_low=True),
    "nu": Key("number", "Poisson's ratio", low=0, high=0.4999),
    "density": Key("number", "density", unit="density", low=0, open_low=True),
    "wave_speed": Key("band", "range of sqrt(E/density) in m/s that passes without a warning of wrong units",
                      (2000.0, 7000.0), low=0, open_low=True),
}
OTHER_MATERIAL = {"group": Key("text", "cells that are made of it: a group of cells of one of the meshes"), **MATERIAL}
BLADES = {
    "mesh": Key("text", "mesh of both blades on their fixture: .msh, .inp, .cdb or .bdf"),
    "clamp": Key("one_or_more", "group of nodes that are fixed, or several groups"),
    "modes": Key("count", "fixed-interface modes kept", 40, low=0, high=2000),
    "modes_below_hz": Key("number", "instead of a number: all fixed-interface modes below this frequency", low=0,
                          open_low=True, default=None),
    "error": Key("number", "instead of a number: as many modes as it takes for the body to add at most this relative "
                 "error to any stuck frequency below 5 kHz", low=1e-9, high=0.1, default=None),
}
DAMPER = {
    "mesh": Key("text", "mesh of the damper: .msh, .inp, .cdb or .bdf"),
    "modes": Key("count", "fixed-interface modes kept", 20, low=0, high=2000),
    "modes_below_hz": Key("number", "instead of a number: all fixed-interface modes below this frequency", low=0,
                          open_low=True, default=None),
    "error": Key("number", "instead of a number: as many modes as it takes for the body to add at most this relative "
                 "error to any stuck frequency below 5 kHz", low=1e-9, high=0.1, default=None),
    "axis": Key("vector", "direction along the damper", (0.0, 1.0, 0.0)),
    "pull": Key("number", "Fc, the total pull on the damper", unit="force", low=0, open_low=True),
    "pull_direction": Key("vector", "direction of the pull", (0.0, 0.0, 1.0)),
    "load_points": Key("text", "group of nodes that carry the pull", "load_points"),
    "shares": Key("numbers", "part of the pull on each load point, in the order of the axis; default: equal", (),
                  low=0, high=1),
    "positions": Key("numbers", "where the pull acts along the axis (0..1 of the damper's length), carried by the two "
                     "mesh nodes beside each on the line through the load points; default: at the load points", (),
                     low=0, high=1),
}
MODEL = {
    "matrices": Key("text", ".npz with M, K, the dof table, groups and the load 'pull', instead of meshes"),
    "axis": Key("vector", "direction along the damper", (0.0, 1.0, 0.0)),
    "pull": Key("number", "Fc, the total pull on the damper", unit="force", low=0, open_low=True),
    "pull_direction": Key("vector", "direction of the pull", (0.0, 0.0, 1.0)),
}
CONTACT = {
    "pairs": Key("text", "CSV of your own pairs of the whole patch, instead of those matched between the meshes", ""),
    "mu": Key("number", "friction coefficient", None, low=0, high=2),
    "tolerance": Key("number", "largest distance of the two nodes of a pair", 1e-6, unit="length", low=0,
                     open_low=True),
    "distance": Key("choice", "of the two nodes of a pair along the normal: 'closed': they count as touching; 'gap': "
                    "it adds to the initial gap", "closed", choices=("closed", "gap")),
    "stiffness": Key("choice", "'given': kn, kt of each side; 'halfspace': from the analytical model", "given",
                     choices=("given", "halfspace")),
    "normal": Key("choice", "statics of the preload: on the 'springs' kn, or 'hard' (the bodies alone are elastic)",
                  "springs", choices=("springs", "hard")),
}
SIDE = {
    "blade": Key("text", "node group of the blades' mesh", ""),
    "damper": Key("text", "node group of the damper's mesh", ""),
    "shape": Key("choice", "form of the damper's side", choices=("cylinder", "flat")),
    "kn": Key("number", "normal stiffness per node", None, unit="force/length", low=0, open_low=True),
    "kt": Key("number", "tangential stiffness per node", None, unit="force/length", low=0, open_low=True),
    "radius": Key("number", "radius of a cylindrical side, needed by stiffness = 'halfspace'", None, unit="length",
                  low=0, open_low=True),
    "width": Key("number", "width of a flat side, needed by stiffness = 'halfspace' and by the roll of an edge line",
                 None, unit="length", low=0, open_low=True),
    "rows": Key("choice", "rows kept in the line model: 'edge' (row 0, the lower edge line) or 'all'", "all",
                choices=("edge", "all")),
    "roll_stiffness": Key("roll", "resistance to roll that the kept edge line lacks: 'from_flat' (sum kn w^2/12), "
                          "a number (N m/rad) or 0", "from_flat"),
    "gap": Key("table", "initial gap g0 along the axis: [[coordinate, gap], ...]", (), unit="length"),
}
ROTATION = {
    "axis": Key("vector", "axis of rotation", (1.0, 0.0, 0.0)),
    "point": Key("triple", "a point on the axis", (0.0, 0.0, 0.0), unit="length"),
    "speed": Key("number", "rad/s at which the blades vibrate: stress stiffening and spin softening (no Coriolis "
                 "forces); 0: at rest", 0.0, low=0),
}
LOAD = {
    "pull": Key("number", "pull on the damper in this case; default: Fc", None, unit="force", low=0),
    "speed": Key("number", "rad/s about the axis of [rotation]: centrifugal load on blades and damper, beside the pull",
                 0.0, low=0),
    "gravity": Key("triple", "acceleration [x, y, z] in m/s2", (0.0, 0.0, 0.0)),
    "forces": Key("group_vectors", "[[body, group, Fx, Fy, Fz], ...]: a total force in equal parts on the nodes of a "
                  "group", (), unit="force"),
    "pressure": Key("group_values", "[[body, group, p], ...]: on the faces of a surface group, positive presses", (),
                    unit="stress"),
    "traction": Key("group_vectors", "[[body, group, tx, ty, tz], ...]: force per area on the faces of a surface group",
                    (), unit="stress"),
}
TUNE = {
    "target_hz": Key("number", "measured stuck frequency that the kept stations must meet", None, low=0,
                     open_low=True),
    "stations": Key("counts", "[front, back]: stations kept at each end, instead of a target", (), low=1, high=9999),
    "follow": Key("choice", "free mode that is tracked", "out_of_phase", choices=("out_of_phase", "in_phase")),
    "preload": Key("choice", "'scaled': the whole map's part on the kept stations carries the whole pull; "
                   "'resolved': the static problem is solved again on them", "scaled", choices=("scaled", "resolved")),
}
RESPOND = {
    "excitation": Key("text", "group (one node) where the force acts", "excitation"),
    "direction": Key("vector", "direction of the excitation and of the response", (1.0, 0.0, 0.0)),
    "patches": Key("texts", "groups of response nodes, blade 1 first", ("patch_1", "patch_2")),
    "levels": Key("numbers", "Fe, amplitudes of the excitation", unit="force", low=0, open_low=True),
    "harmonics": Key("counts", "H, highest order kept; several give several curves", (5,), low=1, high=99),
    "band": Key("band", "first and last frequency in Hz", low=0, open_low=True),
    "damping_ratio": Key("ratios", "zeta of the stuck modes: one value, or one per mode from the lowest (the last one "
                         "holds for all above)", low=0, high=0.9999),
    "both_ways": Key("flag", "follow every curve from the other end too and compare the peaks", True),
}
_POINTS = ("text", "texts", "vector")    # kinds of the keys of [respond] that say where, not how much
FREE = {
    "band": Key("band", "first and last frequency of the response without damper, Hz", (1400.0, 1900.0), low=0,
                open_low=True),
    "damping_ratio": Key("ratios", "zeta of the modes without damper: one value, or one per mode from the lowest",
                         (0.005,), low=0, high=0.9999),
}
SECTIONS = {"material": MATERIAL, "blades": BLADES, "damper": DAMPER, "model": MODEL, "contact": CONTACT,
            "rotation": ROTATION, "tune": TUNE, "free": FREE, "respond": RESPOND}
# measured or published values that the report sets beside ours
REFERENCE = ("out_of_phase_hz", "in_phase_hz", "full_line_hz", "tuned_hz", "full_area_hz", "front", "back")


@dataclass(frozen=True)
class Study:
    """A checked study in SI units. `sections` {name: {key: value}}; sides and materials in the order of the file."""

    path: Path
    title: str
    results: Path
    sections: dict
    sides: dict
    reference: dict
    length_unit: float
    materials: dict
    loads: dict = field(default_factory=dict)    # {case: {key: value}}

    @property
    def name(self) -> str:
        return self.path.stem

    def __getitem__(self, section: str) -> dict:
        return self.sections[section]

    def __contains__(self, section: str) -> bool:
        return section in self.sections

    @property
    def driver(self) -> dict:
        """Section that holds axis, pull and pull_direction: [damper] with meshes, [model] with matrices."""
        return self.sections["model"] if "model" in self.sections else self.sections["damper"]

    def part(self, name: str):
        """A section or one of these: what a stage may depend on.

        'points', 'groups' - nodes that [respond] and the contact sides name; 'damper_body', 'model_body' - [damper] and
        [model] without the size of the pull; 'driver' - axis and pull; 'expected' - what [respond] tells of the
        frequencies and the damping; 'wanted_error' - the springs of the contact where [blades] or [damper] asks for an
        error of the stuck frequencies; 'sides', 'loads', 'materials', 'title', 'reference'.
        """
        points = {k: v for k, v in self.sections.get("respond", {}).items() if RESPOND[k].kind in _POINTS}
        groups = [{k: side[k] for k in ("blade", "damper")} for side in self.sides.values()]
        contact = {k: self.sections["contact"][k] for k in ("pairs", "tolerance", "distance", "stiffness")}
        own = {"sides": self.sides, "title": self.title, "reference": self.reference, "points": points,
               "materials": self.materials, "loads": self.loads,
               "expected": {k: self.sections.get("respond", {}).get(k) for k in ("band", "damping_ratio")},
               "groups": [list(self.sides), groups, contact], "driver": self.driver,
               "wanted_error": [self.driver, self.sides, self.sections["contact"]]
               if any(self.sections.get(b, {}).get("error") for b in ("blades", "damper")) else None,
               "damper_body": _without_pull(self.sections.get("damper")),
               "model_body": _without_pull(self.sections.get("model"))}
        return own[name] if name in own else self.sections.get(name)

    def group_name(self, section: str, key: str) -> str:
        """The node group that a key names, such as ('contact.left', 'blade') or ('respond', 'patches[0]')."""
        part, _, name = section.partition(".")
        table = {"contact": self.sides, "material": self.materials}[part][name] if name else self[section]
        key, _, index = key.partition("[")
        return table[key][int(index.rstrip("]"))] if index else table[key]

    def input_files(self) -> list[Path]:
        """Files that the study names: meshes, or matrices and pairs."""
        names = [("model", "matrices"), ("contact", "pairs"), ("blades", "mesh"), ("damper", "mesh")]
        return [self.file(self[s][k]) for s, k in names if s in self and self[s][k]]

    def file(self, relative: str) -> Path:
        """A file named in the study, relative to the study's own folder."""
        return self.path.parent / relative


def _without_pull(section):
    return {k: v for k, v in section.items() if k != "pull"} if section else None


def load_study(path) -> Study:
    """Read and check a study file; InputError names file, section, key, value and what is allowed."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"study file not found: {path} (looked for it as {path.absolute()})")
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a valid TOML file: {error}") from None
    known = [*STUDY, "units", *SECTIONS, "loads", "reference"]
    for key in raw:
        if key not in known:
            raise InputError(f"{path}: unknown key '{key}'; {nearest(key, known)}")
    factors = _units(path, raw.pop("units", {}))
    top = _section(path, "", {k: raw.pop(k) for k in STUDY if k in raw}, STUDY, factors)
    sides, materials = (_named(raw, section) for section in ("contact", "material"))
    _require(path, raw, sides)
    sections = {name: _section(path, name, raw[name], SECTIONS[name], factors) for name in SECTIONS if name in raw}
    if not _own_pairs(raw) and sections["contact"]["mu"] is None:
        raise InputError(f"{path}: [contact] mu is missing: {CONTACT['mu'].text}")
    if "model" in raw and not _own_pairs(raw):
        raise InputError(f"{path}: [contact] pairs is missing: with [model] the pairs come from a CSV")
    for name in ("blades", "damper"):
        _check_modes(f"{path}: [{name}]", raw.get(name, {}))
    if "tune" in sections:
        _check_tune(f"{path}: [tune]", sections["tune"])
    if _own_pairs(raw):
        _refuse_beside_pairs(path, raw["contact"], sides)
    if "respond" in sections:
        _check_respond(f"{path}: [respond]", sections["respond"])
    sections.setdefault("free", _section(path, "free", {}, FREE, factors))
    sides = {k: _side(path, k, v, factors, sections["contact"]) for k, v in sides.items()}
    materials = {k: _section(path, f"material.{k}", v, OTHER_MATERIAL, factors) for k, v in materials.items()}
    loads = {k: _load(path, k, v, factors, "model" in raw) for k, v in _table_of_cases(path, raw).items()}
    reference = raw.get("reference", {})
    for key, value in reference.items():
        if key not in REFERENCE:
            raise InputError(f"{path}: [reference] unknown key '{key}'; {nearest(key, REFERENCE)}")
        _number(f"{path}: [reference] {key} = {value!r}", value, Key("number", "", low=0))
    results = path.parent / (top["results"] or Path("results") / path.stem)
    return Study(path, top["title"] or path.stem, results, sections, sides, reference, factors["length"],
                 materials, loads)


def _named(raw, section):
    """Tables inside a section, such as [contact.left] or [material.tip], taken out of it."""
    table = raw.get(section)
    return {k: table.pop(k) for k in list(table) if isinstance(table[k], dict)} if isinstance(table, dict) else {}


def _require(path, raw, sides):
    meshed = [name for name in ("material", "blades", "damper") if name in raw]
    if "model" in raw and meshed:
        raise InputError(f"{path}: [model] and [{meshed[0]}] exclude each other: matrices or meshes")
    for name in ["model", "contact"] if "model" in raw else ["material", "blades", "damper", "contact"]:
        if name not in raw:
            raise InputError(f"{path}: section [{name}] is missing")
    if not _own_pairs(raw) and len(sides) < 2:
        raise InputError(f"{path}: {len(sides)} contact sides; a free damper needs two, such as [contact.left] and "
                         "[contact.right]")


def _own_pairs(raw) -> bool:
    """With a table of one's own the pairs are not matched between the meshes: sides only add what it lacks."""
    return isinstance(raw["contact"], dict) and bool(raw["contact"].get("pairs"))


def _refuse_beside_pairs(path, contact, sides):
    """What the table of pairs says is said there alone."""
    own = ("blade", "damper", "kn", "kt", "gap")
    for where, given, keys in [("[contact]", contact, ("mu", "stiffness")),
                               *((f"[contact.{name}]", side, own) for name, side in sides.items())]:
        for key in keys:
            if key in given:
                raise InputError(f"{path}: {where} {key}: leave it out, the table [contact] pairs = "
                                 f"'{contact['pairs']}' says it for every pair")


def _check_respond(where, respond):
    for key in ("levels", "harmonics", "patches"):
        names = [f"{v:g}" if isinstance(v, float) else str(v) for v in respond[key]]
        double = [n for n in names if names.count(n) > 1]
        if double:
            raise InputError(f"{where} {key}: {double[0]} stands there twice")
    if len(respond["patches"]) != 2:
        raise InputError(f"{where} patches = {list(respond['patches'])}: two groups are needed, one on each blade")


def _check_modes(where, body):
    given = [k for k in ("modes", "modes_below_hz", "error") if k in body]
    if len(given) > 1:
        raise InputError(f"{where} {given[0]} and {given[1]} exclude each other: one of them says how many modes")


def _check_tune(where, tune):
    if (tune["target_hz"] is None) == (not tune["stations"]):
        raise InputError(f"{where} needs either target_hz or stations = [front, back]")
    if tune["stations"] and len(tune["stations"]) != 2:
        raise InputError(f"{where} stations = {list(tune['stations'])}: must be two numbers [front, back]")


def _units(path, given):
    factors = {}
    for key in given:
        if key not in UNITS:
            raise InputError(f"{path}: [units] unknown key '{key}'; {nearest(key, UNITS)}")
    for key, allowed in UNITS.items():
        name = given.get(key, next(iter(allowed)))
        if name not in allowed:
            raise InputError(f"{path}: [units] {key} = {name!r}: {nearest(name, allowed)}")
        factors[key] = allowed[name]
    factors["force/length"] = factors["force"] / factors["length"]
    factors[""] = 1.0
    return factors


def _side(path, name, given, factors, contact):
    side = _section(path, f"contact.{name}", given, SIDE, factors)
    where = f"{path}: [contact.{name}]"
    matched = not contact["pairs"]
    if matched and contact["stiffness"] == "given" and (side["kn"] is None or side["kt"] is None):
        raise InputError(f"{where} kn and kt are missing; give them, or set [contact] stiffness = \"halfspace\"")
    for key in ("blade", "damper"):
        if matched and not side[key]:
            raise InputError(f"{where} {key} is missing: {SIDE[key].text}")
    needs = {"flat": "width", "cylinder": "radius"}[side["shape"]]
    edge = side["shape"] == "flat" and side["rows"] == "edge"
    if side[needs] is None and (contact["stiffness"] == "halfspace" or (edge and side["roll_stiffness"] is None)):
        raise InputError(f"{where} {needs} is missing")
    return side


def _table_of_cases(path, raw):
    cases = raw.get("loads", {})
    if not isinstance(cases, dict) or not all(isinstance(v, dict) for v in cases.values()):
        raise InputError(f"{path}: [loads] must hold load cases such as [loads.takeoff]")
    for name in cases:
        if name == "pull" or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
            raise InputError(f"{path}: [loads.{name}]: a case is named by letters, digits, - and _, and not 'pull'")
    return cases


def _load(path, name, given, factors, matrices):
    case = _section(path, f"loads.{name}", given, LOAD, factors)
    extra = [key for key in given if key != "pull"]
    if matrices and extra:
        raise InputError(f"{path}: [loads.{name}] {extra[0]}: with [model] the case is the load '{name}' of its "
                         "matrices; only pull may be stated")
    return case


def _section(path, name, given, keys, factors):
    where = f"{path}: [{name}]" if name else f"{path}:"
    if not isinstance(given, dict):
        raise InputError(f"{where} must be a section, got {given!r}")
    for key in given:
        if key not in keys:
            raise InputError(f"{where} unknown key '{key}'; {nearest(key, keys)}")
    out = {}
    for key, spec in keys.items():
        if key not in given:
            if spec.default is REQUIRED:
                raise InputError(f"{where} {key} is missing: {spec.text}")
            out[key] = None if spec.kind == "roll" and spec.default == "from_flat" else spec.default
        else:
            out[key] = _value(f"{where} {key} = {given[key]!r}", given[key], spec, factors[spec.unit])
    return out


def _value(where, value, spec, factor):
    return _READ[spec.kind](where, value, spec, factor)


def _text(where, value, spec, _):
    if not isinstance(value, str) or not value:
        raise InputError(f"{where}: must be a text in quotes")
    if spec.choices and value not in spec.choices:
        raise InputError(f"{where}: {nearest(value, spec.choices)}")
    return value


def _flag(where, value, *_):
    if not isinstance(value, bool):
        raise InputError(f"{where}: must be true or false")
    return value


def _roll(where, value, *_):
    """'from_flat' becomes None: the value is worked out from the flat."""
    return None if value == "from_flat" else _number(f"{where} (or 'from_flat')", value, Key("number", "", low=0))


def _each(read, alone):
    """A list of values; a single value stands for a list of one where `alone` allows it."""
    def many(where, value, spec, factor):
        items = [value] if alone and not isinstance(value, list) else value
        if not isinstance(items, list) or not items:
            raise InputError(f"{where}: must be a list that is not empty")
        return tuple(read(where, v, spec, factor) for v in items)
    return many


def _number(where, value, spec):
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where}: must be a number")
    low_ok = value > spec.low if spec.open_low else value >= spec.low
    if not (np.isfinite(value) and low_ok and value <= spec.high):
        bound = f"{'above' if spec.open_low else 'at least'} {spec.low:g}" if np.isfinite(spec.low) else "finite"
        upper = f" and at most {spec.high:g}" if np.isfinite(spec.high) else ""
        raise InputError(f"{where}: must be {bound}{upper}")
    return float(value)


def _count(where, value, spec, _=1.0):
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{where}: must be a whole number from {spec.low:g} to {spec.high:g}")
    if not spec.low <= value <= spec.high:
        raise InputError(f"{where}: must lie between {spec.low:g} and {spec.high:g}")
    return value


def _vector(where, value, *_):
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: must be three numbers")
    vector = np.array([_number(where, v, Key("number", "")) for v in value])
    size = np.linalg.norm(vector)
    if size == 0:
        raise InputError(f"{where}: must not be zero")
    return tuple((vector / size).tolist())


def _triple(where, value, _, factor):
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: must be three numbers")
    return tuple(factor * _number(where, v, Key("number", "")) for v in value)


def _on_groups(numbers):
    """Rows [body, group, one number or three]."""
    last = "value" if numbers == 1 else "x, y, z"

    def rows(where, value, _, factor):
        if not isinstance(value, list) or not all(isinstance(r, list) and len(r) == 2 + numbers for r in value):
            raise InputError(f"{where}: must be a list of [body, group, {last}]")
        texts, number = Key("text", ""), Key("number", "")
        return tuple((*(_text(where, t, texts, 1.0) for t in r[:2]), *(factor * _number(where, v, number)
                                                                     for v in r[2:])) for r in value)
    return rows


def _band(where, value, spec, _=1.0):
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"{where}: must be two numbers [first, last]")
    a, b = (_number(where, v, spec) for v in value)
    if a >= b:
        raise InputError(f"{where}: the band is empty: the first must be below the last")
    return a, b


def _profile(where, value, _, factor):
    try:
        table = np.array(value, dtype=float)
    except (TypeError, ValueError):
        table = np.empty(0)
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2 or not np.isfinite(table).all():
        raise InputError(f"{where}: must be at least two rows [coordinate, gap]")
    if (np.diff(table[:, 0]) <= 0).any():
        raise InputError(f"{where}: the coordinates must ascend")
    return tuple(map(tuple, (table * factor).tolist()))


def _scaled(where, value, spec, factor):
    return factor * _number(where, value, spec)


_READ = {"text": _text, "choice": _text, "flag": _flag, "roll": _roll, "number": _scaled, "count": _count,
         "texts": _each(_text, False), "one_or_more": _each(_text, True),
         "numbers": _each(_scaled, False), "ratios": _each(_scaled, True),
         "counts": _each(_count, True), "vector": _vector, "triple": _triple,
         "group_values": _on_groups(1), "group_vectors": _on_groups(3), "band": _band, "table": _profile}
