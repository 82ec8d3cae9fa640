"""The language of study files as data sheets: section, key, kind, unit, default, range and what it means."""

from dataclasses import dataclass

import numpy as np

UNITS = {"length": {"m": 1.0, "mm": 1e-3}, "force": {"N": 1.0, "kN": 1e3},
         "stress": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
         "density": {"kg/m3": 1.0, "t/mm3": 1e12, "g/cm3": 1e3}}
REQUIRED = object()


@dataclass(frozen=True)
class Key:
    """kind - how the value is read (READ in values.py); unit - a name in UNITS or force/length; low, high - range."""

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
HOW_MANY = {  # fixed-interface modes of a body, other than by `modes`
    "modes_below_hz": Key("number", "instead of a number: all fixed-interface modes below this frequency", low=0,
                          open_low=True, default=None),
    "error": Key("number", "instead of a number: as many modes as it takes for the body to add at most this relative "
                 "error to any stuck frequency below 5 kHz", low=1e-9, high=0.1, default=None),
    "load_modes": Key("flag", "keep beside the modes the static shape of each load (pull, [loads.NAME]) that acts off "
                      "the contact, so that the displacement of the whole body under it is exact", False),
}
BLADES = {
    "mesh": Key("text", "mesh of both blades on their fixture: .msh, .inp, .cdb or .bdf"),
    "clamp": Key("one_or_more", "group of nodes that are fixed, or several groups"),
    "modes": Key("count", "fixed-interface modes kept", 40, low=0, high=2000),
    **HOW_MANY,
}
DAMPER = {
    "mesh": Key("text", "mesh of the damper: .msh, .inp, .cdb or .bdf"),
    "modes": Key("count", "fixed-interface modes kept", 20, low=0, high=2000),
    **HOW_MANY,
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
    "mu": Key("number", "friction coefficient; above 2 with a warning", None, low=0),
    "tolerance": Key("number", "largest distance of the two nodes of a pair", 1e-6, unit="length", low=0,
                     open_low=True),
    "distance": Key("choice", "of the two nodes of a pair along the normal: 'closed': they count as touching; 'gap': "
                    "it adds to the initial gap", "closed", choices=("closed", "gap")),
    "stiffness": Key("choice", "of sides without kn and kt of their own: 'halfspace': smooth bodies in three "
                     "dimensions; 'plane_depth': plane strain with depth; 'rough_series': halfspace in series with a "
                     "rough interface; 'given': none, every side has its kn and kt. Given kn and kt win over every "
                     "model", "given", choices=("given", "halfspace", "plane_depth", "rough_series")),
    "kind": Key("choice", "of the stiffness from a model: 'tangent' at the side's force under the pull, or 'secant' "
                "from zero force", "tangent", choices=("tangent", "secant")),
    "scale": Key("number", "factor on all stiffness from a model, such as one found by calibration; given kn and kt "
                 "are taken as they are", 1.0, low=0, open_low=True),
    "shares": Key("choice", "nodes of a side share the stiffness from a model: 'equal', or by 'tributary' area, which "
                  "gives end nodes half (needs every row at every station)", "equal", choices=("equal", "tributary")),
    "normal": Key("choice", "statics of the preload: on the 'springs' kn, or 'hard' (the bodies alone are elastic)",
                  "springs", choices=("springs", "hard")),
}
SIDE = {
    "blade": Key("text", "node group of the blades' mesh", ""),
    "damper": Key("text", "node group of the damper's mesh", ""),
    "shape": Key("choice", "form of the damper's side",
                 choices=("cylinder", "flat", "rounded")),
    "kn": Key("number", "normal stiffness per node; with kt it wins over [contact] stiffness", None,
              unit="force/length", low=0, open_low=True),
    "kt": Key("number", "tangential stiffness per node", None, unit="force/length", low=0, open_low=True),
    "radius": Key("number", "radius of a cylindrical side, or of the edges of a rounded one; a stiffness from a model "
                  "needs it", None, unit="length", low=0, open_low=True),
    "width": Key("number", "width of a flat side, or of the flat part of a rounded one; a stiffness from a model and "
                 "the roll of an edge line need it", None, unit="length", low=0, open_low=True),
    "depth": Key("numbers", "[blade, damper]: depths below the contact against which stiffness = 'plane_depth' counts "
                 "the displacement", (), unit="length", low=0, open_low=True),
    "h_rms": Key("number", "rms height of both surfaces combined, needed by stiffness = 'rough_series'", None,
                 unit="length", low=0, open_low=True),
    "gamma": Key("number", "of K_rough = N / (gamma h_rms), about 0.5, by the roughness spectrum; needed by stiffness "
                 "= 'rough_series'", None, low=0, open_low=True),
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
PRELOAD = {
    "friction": Key("flag", "the preload with Coulomb friction (mu and kt of the pairs): it then depends on how the "
                    "load was reached, and the response starts from the friction forces at the end", False),
    "history": Key("texts", "load cases ([loads.NAME]) that are passed in this order before the pull (or `case`); "
                   "default: straight from no load to it", ()),
    "case": Key("text", "load case ([loads.NAME]) whose preload is that of the stages tune and respond, instead of the "
                "pull alone: a damper pressed by rotation, say", ""),
    "steps": Key("count", "increments from each load of the history to the next", 20, low=1, high=10000),
    "stress": Key("flag", "write displacement and von Mises stress of blades and damper at rest, stress_*.vtu; both "
                  "are assembled and factorised for it", False),
}
TUNE = {
    "target_hz": Key("number", "measured stuck frequency that the kept stations must meet", None, low=0,
                     open_low=True),
    "stations": Key("stations", "[front, back]: stations kept at each end, or 'all', instead of a target", (), low=0,
                    high=9999),
    "stiffness": Key("choice", "'kept': a node keeps its share of the full patch; 'conserved': the nodes that stay "
                     "take over the stiffness of their whole side", "kept", choices=("kept", "conserved")),
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
POINTS = ("text", "texts", "vector")    # kinds of the keys of [respond] that say where, not how much
FREE = {
    "band": Key("band", "first and last frequency of the response without damper, Hz; default: around the blades' own "
                "out-of-phase and in-phase modes", None, low=0, open_low=True),
    "damping_ratio": Key("ratios", "zeta of the modes without damper: one value, or one per mode from the lowest",
                         (0.005,), low=0, high=0.9999),
}
SECTIONS = {"material": MATERIAL, "blades": BLADES, "damper": DAMPER, "model": MODEL, "contact": CONTACT,
            "rotation": ROTATION, "preload": PRELOAD, "tune": TUNE, "free": FREE, "respond": RESPOND}
# measured or published values that the report sets beside ours
REFERENCE = ("out_of_phase_hz", "in_phase_hz", "full_line_hz", "tuned_hz", "full_area_hz", "front", "back")
