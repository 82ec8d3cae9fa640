"""A proposal as a commented study file; what cannot be guessed stands in it as "?", which is
refused."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.checks import only_friction
from tipdamp.hbm.errors import shown
from tipdamp.modal.mesh import GivenMaterial
from tipdamp.proposal.propose import Proposal
from tipdamp.proposal.response_text import response_text
from tipdamp.proposal.trial import SOFTEST, SmoothSide, Trial
from tipdamp.proposal.words import (
    ASK,
    command_again,
    group_comment,
    group_names,
    made_of,
    quoted,
    vector,
)
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS

if TYPE_CHECKING:
    from tipdamp.proposal.patches import Patch

UNITS = {"m": ("Pa", "kg/m3"), "mm": ("MPa", "t/mm3")}
STEEL = {"m": ("205e9", "7850"), "mm": ("205e3", "7.85e-9")}


def study_text(
    found: Proposal,
    folder_of: dict[str, str],
    tried: Trial | None = None,
    pull: float | None = None,
) -> str:
    """folder_of {body: the name of its mesh file as the study has it}; tried - what was computed of
    it; pull - N."""
    stress, density = UNITS[found.length]
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
        *_material(found, folder_of),
    ]
    lines += [
        *_blades(found, folder_of[BLADES]),
        *_damper(found, folder_of, tried, pull),
        *_contact(found, tried),
    ]
    return "\n".join([*lines, *response_text(found, tried, pull), ""])


def _material(found: Proposal, folder_of: dict[str, str]) -> list[str]:
    """As the files have it; of all cells that which most of them are made of."""
    (stress, density), E, rho = UNITS[found.length], *STEEL[found.length]
    if not found.materials:
        return [
            "[material]",
            f"E = {ASK}                     # Young's modulus, {stress}; steel {E}",
            f"nu = {ASK}                    # steel 0.3",
            f"density = {ASK}               # {density}; steel {rho}",
            "",
        ]
    cells: dict[GivenMaterial, int] = {}
    for group, one in found.materials.items():
        cells[one] = cells.get(one, 0) + sum(
            len(mesh.cell_groups.get(group, ())) for mesh in found.meshes.values()
        )
    most = max(cells, key=lambda one: cells[one])
    files = " and ".join(dict.fromkeys(folder_of.values()))
    lines = [
        "[material]",
        *_constants(most, f"{shown(most.name)} of {files}; of cells without another"),
    ]
    named = set[str]()
    for group, one in found.materials.items():
        if one == most:
            continue
        name = re.sub(r"[^A-Za-z0-9_-]", "_", group).lower()
        name += f"_{len(named)}" * (name in named)
        named.add(name)
        lines += [f"[material.{name}]", f"group = {quoted(group)}"]
        lines += _constants(one, f"{shown(one.name)} of {files}")
    return lines


def _constants(one: GivenMaterial, source: str) -> list[str]:
    return [
        f"E = {one.E:.8g}                  # {shown(source)}",
        f"nu = {one.nu:.8g}",
        f"density = {one.density:.8g}",
        "",
    ]


def _blades(found: Proposal, file: str) -> list[str]:
    groups = found.groups["clamp"]
    return [
        "[blades]",
        f"mesh = {quoted(file)}",
        f"clamp = {group_names(groups)}"
        + group_comment(found, BLADES, "nodes that are fixed", not groups),
        "",
    ]


def _damper(
    found: Proposal, folder_of: dict[str, str], tried: Trial | None, pull: float | None
) -> list[str]:
    cells = [f"cells = {quoted(found.cells)}"] if found.cells else []
    points, known = found.groups["load_points"], ASK if pull is None else f"{pull:g}"
    if found.together and not cells:
        cells = [
            "# the damper is what is connected to its load points; or name its group of cells: "
            'cells = "..."'
        ]
    return [
        "[damper]",
        f"mesh = {quoted(folder_of[DAMPER])}",
        *cells,
        f"axis = {vector(found.axis)}         # along both contact sides",
        f"pull = {known}                  # N, total pull on the damper",
        f"pull_direction = {vector(found.pull)}         # into both sides",
        *([] if points else _unknown_points(found, folder_of, pull)),
        f"load_points = {group_names(points[:1])}"
        + group_comment(found, DAMPER, "nodes that share the pull", not points),
        *_hold(found, tried),
        "",
    ]


def _unknown_points(found: Proposal, folder_of: dict[str, str], pull: float | None) -> list[str]:
    """How the rest is computed, where the damper has groups among which they may be."""
    if not found.meshes[DAMPER].groups:
        return []
    return [
        "# no group has a name that tells the load points; with one of them band, levels and "
        "nodes are",
        "# computed: move this file away, then",
        f"#   {command_again(folder_of.values(), pull)}",
    ]


def _hold(found: Proposal, tried: Trial | None) -> list[str]:
    """Of the motions that no contact normal faces; before they are computed, the slide along the
    axis where no side faces it."""
    if tried is not None:
        return _unfaced(tried.only_friction)
    if max(abs(side.patch.normal @ found.axis) for side in found.sides) > SETTINGS.facing:
        return []
    axis = np.flatnonzero(found.axis == 1.0)
    return _unfaced(["slide along " + ("xyz"[axis[0]] if len(axis) else _words(found.axis))])


def _words(direction: np.ndarray) -> str:
    return "(" + vector(direction).strip("[]") + ")"


def _unfaced(motions: Sequence[str]) -> list[str]:
    """A slide is held, as a stop does; against a roll there is none."""
    if not motions:
        return []
    held = only_friction.remedy(motions).removeprefix("[damper] ")
    said = f"# {only_friction.said(motions)}"
    if all(motion.startswith("slide") for motion in motions):
        return [
            f"{said}: its mean position is held, as by a",
            "# stop, the vibration stays free; without it a curve may drift or find no first point",
            held,
        ]
    return [
        f"{said}; where a curve drifts or finds no first",
        "# point, hold its mean position, as a stop does (the vibration stays free): take the "
        "mark off",
        f"# {held}",
    ]


def _contact(found: Proposal, tried: Trial | None) -> list[str]:
    lines = [
        "[contact]",
        f"mu = {ASK}                    # friction coefficient; 0.6 in [Zucca 2016]",
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
            f'shape = "{"flat" if patch.flat else "cylinder"}"              # faces within '
            f"{patch.spread:.2g} "
            "degrees of their mean normal",
            _size(found, patch),
            *(_stiffness(tried.sides[side.name], found) if tried else []),
            "",
        ]
    return lines


def _stiffness(side: SmoothSide, found: Proposal) -> list[str]:
    """Of smooth half-spaces, and down to what machined faces are, in the units of the study."""
    length = found.length
    per, what, unit = (
        (side.area, "_per_area", f"N/{length}3")
        if side.area
        else (side.pairs, " of each node", f"N/{length}")
    )
    factor = 1.0
    if length != "m":
        factor = 1e-9 if side.area else 1e-3
    kn, kt = factor * side.kn / per, factor * side.kt / per
    return [
        f"# half-spaces of {made_of(found)}: kn{what} = {kn:.2g}, kt{what} = {kt:.2g} {unit}; "
        "machined faces",
        f"# were as soft as {SOFTEST * kn:.2g} and {SOFTEST * kt:.2g}: where nothing is measured, "
        "run both ends",
    ]


def _size(found: Proposal, patch: "Patch") -> str:
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


def _faces(found: Proposal, body: str, keys: np.ndarray, group: str) -> str:
    """The group, or the faces by geometry: a box around all of their nodes, which on the larger
    body lie beyond the contact."""
    if group:
        return quoted(group)
    mesh = found.meshes[body]
    place = mesh.position[mesh.index(np.setdiff1d(keys, [-1]))]
    low, high = place.min(axis=0) - found.reach, place.max(axis=0) + found.reach
    return f"{{ within = {found.reach:.3g}, box = [{vector(low)}, {vector(high)}] }}"
