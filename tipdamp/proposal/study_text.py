"""A proposal as a commented study file; what cannot be guessed stands in it as "?", which is
refused."""

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.proposal.propose import Proposal
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS

ASK = '"?"'
UNITS = {"m": ("Pa", "kg/m3"), "mm": ("MPa", "t/mm3")}
STEEL = {"m": ("205e9", "7850"), "mm": ("205e3", "7.85e-9")}


def study_text(found: Proposal, folder_of: dict[str, str]) -> str:
    """folder_of {body: the name of its mesh file as the study has it}."""
    (stress, density), E, rho = UNITS[found.length], *STEEL[found.length]
    lines = [
        '# Proposed by tipdamp inspect from the meshes alone. Fill in what is "?", check the '
        "rest, then run",
        "#   tipdamp inspect, and tipdamp run. All keys: tipdamp keys",
        "",
        "[units]",
        f'length = "{found.length}"             # by the size of the meshes',
        'force = "N"',
        f'stress = "{stress}"',
        f'density = "{density}"',
        "",
        "[material]",
        f"E = {ASK}                     # Young's modulus, {stress}; steel {E}",
        f"nu = {ASK}                    # steel 0.3",
        f"density = {ASK}               # {density}; steel {rho}",
        "",
    ]
    lines += [
        *_blades(found, folder_of[BLADES]),
        *_damper(found, folder_of[DAMPER]),
        *_contact(found),
    ]
    return "\n".join([*lines, *_response(found), ""])


def _blades(found, file):
    groups = found.groups["clamp"]
    return [
        "[blades]",
        f'mesh = "{file}"',
        f"clamp = {_names(groups)}" + _of(found, BLADES, "nodes that are fixed", not groups),
        "",
    ]


def _damper(found, file):
    cells = [f'cells = "{found.cells}"'] if found.cells else []
    if found.together and not cells:
        cells = [
            "# the damper is what is connected to its load points; or name its group of cells: "
            'cells = "..."'
        ]
    return [
        "[damper]",
        f'mesh = "{file}"',
        *cells,
        f"axis = {_vector(found.axis)}         # along both contact sides",
        f"pull = {ASK}                  # N, total pull on the damper",
        f"pull_direction = {_vector(found.pull)}         # into both sides",
        "load_points = "
        + _names(found.groups["load_points"][:1])
        + _of(found, DAMPER, "nodes that share the pull", not found.groups["load_points"]),
        *_hold(found),
        "",
    ]


def _hold(found):
    """Along the axis, where no side faces it."""
    if max(abs(side.patch.normal @ found.axis) for side in found.sides) > SETTINGS.facing:
        return []
    axis = np.flatnonzero(found.axis == 1.0)
    motion = f'"{"xyz"[axis[0]]}"' if len(axis) else _vector(found.axis)
    return [
        "# nothing but friction holds the damper along its axis; where a curve drifts or finds "
        "no first",
        "# point, hold its mean position, as a stop does (the vibration stays free): take the "
        "mark off",
        f"# hold = {{ motion = {motion}, mean = true }}",
    ]


def _contact(found):
    lines = [
        "[contact]",
        f"mu = {ASK}                    # friction coefficient",
        "# smooth half-spaces, an upper bound: machined faces are softer, down to a thirteenth "
        "[Zucca 2016];",
        '# surer: "rough_series", kn_per_area and kt_per_area of each side, a measured target_hz',
        'stiffness = "halfspace"',
        "",
    ]
    for side in found.sides:
        patch = side.patch
        match = "match" if side.matching else "do not match: contact of surfaces"
        lines += [
            f"# {len(patch.damper)} faces of the damper, {patch.area:.4g} {found.length}2, meet "
            f"{len(patch.blades)} of the blades; the nodes {match}",
            f"[contact.{side.name}]",
            f"blade = {_faces(found, BLADES, side.patch.blades, side.blade)}",
            f"damper = {_faces(found, DAMPER, side.patch.damper, side.damper)}",
            f'shape = "{"flat" if patch.flat else "cylinder"}"              # normals within '
            f"{patch.spread:.2g} "
            "degrees of their mean",
            _size(found, patch),
            "",
        ]
    return lines


def _size(found, patch):
    """Width of a flat side, radius of a round one, from its area and what its normals turn by."""
    mesh = found.meshes[DAMPER]
    nodes = mesh.position[mesh.index(np.setdiff1d(patch.damper, [-1]))]
    width = patch.area / float(np.ptp(nodes @ found.axis))
    if patch.flat:
        return f"width = {width:.4g}               # area over length"
    if np.isinf(patch.radius):
        return (
            f"radius = {width / np.radians(2 * patch.spread):.4g}              # area over length "
            "and turn of normals"
        )
    return f"radius = {abs(patch.radius):.4g}              # by how the normals turn"


def _faces(found, body: str, keys: np.ndarray, group: str) -> str:
    """The group, or the faces by geometry: a box around all of their nodes, which on the larger
    body lie beyond the contact."""
    if group:
        return f'"{group}"'
    mesh = found.meshes[body]
    place = mesh.position[mesh.index(np.setdiff1d(keys, [-1]))]
    low, high = place.min(axis=0) - found.reach, place.max(axis=0) + found.reach
    return f"{{ within = {found.reach:.3g}, box = [{_vector(low)}, {_vector(high)}] }}"


def _response(found):
    excitation, patches = found.groups["excitation"], found.groups["patches"]
    lines = [
        "[tune]",
        *_all_kept(found),
        "",
        "[respond]",
        f"excitation = {_names(excitation[:1])}"
        + _of(found, BLADES, "the node that is excited", not excitation),
        f"direction = {_vector(np.cross(found.axis, found.pull))}     # of force and response: "
        "across both",
        f"patches = {_names(patches[:2])}"
        + _of(found, BLADES, "two groups of response nodes, blade 1 first", not patches),
        "# by the pull: a hundredth of it (all stuck), a tenth, a quarter (near the best damping), "
        "a half",
        "# [Zucca 2016, figure 3]",
        'levels = "?"                # N, amplitudes of the excitation, such as [1, 5]',
        "# from below the lowest free mode, which `tipdamp reduce` prints, to above the stuck one, "
        "which",
        "# `tipdamp tune` prints: 0.9 and 1.15 times that",
        'band = "?"                  # Hz, such as [700, 900]',
        "damping_ratio = 0.005",
        'harmonics = "auto"          # as many as the tolerance needs, at every level',
        "tolerance = 1e-3            # of the vibration, error by the harmonics left out",
    ]
    return [
        "# for the forced response complete these and take the marks off",
        *(f"# {line}" if line else "#" for line in lines),
    ]


def _all_kept(found):
    """Stations, where nodes match on every side; points of unlike meshes lie in none."""
    if all(side.matching for side in found.sides):
        return ['stations = "all"            # or target_hz, a measured stuck frequency']
    return [
        'by = "area"',
        "kept_share = 1              # of the closed area; or target_hz, a measured stuck "
        "frequency",
    ]


def _of(found, body, meaning, wanted):
    names = ", ".join(sorted(found.meshes[body].groups)) or "none in the file"
    return f"     # {meaning}" + (f"; groups: {names}" if wanted else "")


def _names(groups):
    return (
        ASK
        if not groups
        else _name(groups[0])
        if len(groups) == 1
        else f"[{', '.join(map(_name, groups))}]"
    )


def _name(group):
    return '"' + group.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _vector(values):
    return "[" + ", ".join(f"{v:.6g}" for v in np.asarray(values) + 0.0) + "]"
