"""Meshes without a study: which body is which, where they touch, how the damper lies."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.split import cut
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.ties import first_largest, in_order
from tipdamp.modal.elements.cells import tables
from tipdamp.modal.mesh import GivenMaterial, Mesh, offered
from tipdamp.modal.mesh_checks import parts
from tipdamp.proposal.patches import (
    Patch,
    as_one,
    contact_patches,
    group_of,
    in_one_piece,
    reach_of,
    within_group,
)
from tipdamp.readers.dispatch import read_mesh

# parts of the names that pre-processors and people give to groups, by what they are for
WORDS = {
    "clamp": "clamp|bound|fix|encastre|root|spc|support|ground",
    "load_points": "load|pull|(?<![a-z])cf(?![a-z])|centrifugal",
    "excitation": "excit|(?<![a-z])exc(?![a-z])|shaker|drive",
    "patches": "patch|resp|tip",
}
YOUNG, DENSITY = (1e9, 1e12), (500.0, 25e3)  # Pa, kg/m3: of what blades and dampers are made of
ALONG = 1.0  # degrees: a damper this near to an axis of coordinates lies along it
# degrees: a pull this near to one is meant to act along it, where that is across the damper
INTO = 20.0


@dataclass(frozen=True)
class ProposedSide:
    """A proposed contact side: name, candidate, group of either body or '' where none is that
    patch; matching - whether the nodes of both lie at the same places."""

    name: str
    patch: Patch
    blade: str
    damper: str
    matching: bool


@dataclass(frozen=True)
class Proposal:
    """files, meshes {body: ...} in the unit of the files; together - whether one file holds both
    bodies, cells - the damper's group of cells in it, or ''; length - unit that fits the size;
    reach - within which faces are candidates;
    axis, pull : (3,); groups {purpose: names that fit}; materials {group of cells: what the files
    say that it is made of}."""

    files: dict[str, Path]
    meshes: dict[str, Mesh]
    together: bool
    cells: str
    length: str
    reach: float
    sides: tuple[ProposedSide, ...]
    axis: np.ndarray
    pull: np.ndarray
    groups: dict[str, list[str]]
    materials: dict[str, GivenMaterial]


def propose(paths: list[Path], load_points: str = "") -> Proposal:
    """From one file with all bodies, or one of the blades and one of the damper, in any order.
    load_points - group of the damper that shares the pull, '' to tell it by its name.

    Raises InputError for more files, where no two bodies are found or nothing of them touches, and
    for a group that the damper does not have.
    """
    if len(paths) > 2:
        raise InputError(
            f"{len(paths)} meshes: one file with all bodies is wanted, or one of the blades on "
            "their fixture and one of the damper; join the others to the blades in the "
            "pre-processor"
        )
    read = [read_mesh(path) for path in paths]
    meshes, files, cells = _bodies(paths, read, load_points)
    blades, damper = meshes[BLADES], meshes[DAMPER]
    if load_points:
        _of_nodes(damper, load_points)
    reach = reach_of(damper)
    patches = contact_patches(damper, blades, reach)
    size = float(np.ptp(np.concatenate([m.position for m in read]), axis=0).max())
    length = "mm" if size > 3 else "m"
    if not patches:
        alone = (
            " These are pieces of one file; where all of them are blades, the mesh of the damper "
            "is missing, name it too"
            if len(paths) == 1
            else ""
        )
        raise InputError(
            f"no face of {damper.source} ({len(damper.node)} nodes) lies within {reach:.3g} "
            f"{length} of a face of {blades.source} that faces it: are both in the same unit and "
            f"place?{alone}"
        )
    axis, pull = _directions(patches)
    return Proposal(
        files,
        meshes,
        len(paths) == 1,
        cells,
        length,
        reach,
        _sides(patches, meshes, axis, pull),
        axis,
        pull,
        _groups(blades, damper, load_points),
        _given_materials(read, length),
    )


def _groups(blades: Mesh, damper: Mesh, load_points: str) -> dict[str, list[str]]:
    """{purpose: names of groups that fit, the likeliest first}"""
    found = {
        what: [
            name
            for name in offered((damper if what == "load_points" else blades).groups)
            if re.search(words, name, re.IGNORECASE)
        ]
        for what, words in WORDS.items()
    }
    if load_points:
        found["load_points"] = [load_points]
    # loads of the centrifugal force may be others than the pull
    found["load_points"].sort(key=lambda name: not re.search("load|pull", name, re.IGNORECASE))
    # a tip that is excited is no patch, and any tip is the last choice for one
    found["patches"] = sorted(
        set(found["patches"]) - set(found["excitation"]),
        key=lambda name: (not re.search("patch|resp", name, re.IGNORECASE), name),
    )
    return found


def _of_nodes(mesh: Mesh, load_points: str) -> np.ndarray:
    """Nodes of the group that the command line names."""
    try:
        return mesh.group(load_points, (0, 1, 2))
    except InputError as error:
        raise InputError(f"--load-points: {error}") from None


def _given_materials(read: Sequence[Mesh], length: str) -> dict[str, GivenMaterial]:
    """{group of cells: material}; none where the files do not agree on one or have cells without
    one, or where the values are in other units than the length tells."""
    for mesh in read:
        made = [mesh.cell_groups[group] for group in mesh.materials]
        numbers = np.concatenate(list(mesh.number.values()))
        if not made or not np.isin(numbers, np.concatenate(made)).all():
            return {}
    every = [item for mesh in read for item in mesh.materials.items()]
    given = dict(every)
    in_si = (one.in_si(1.0 if length == "m" else 1e-3) for one in given.values())
    fits = all(
        YOUNG[0] <= E <= YOUNG[1] and DENSITY[0] <= density <= DENSITY[1] and 0 <= nu < 0.5
        for E, nu, density in in_si
    )
    return given if fits and all(given[group] == one for group, one in every) else {}


def _bodies(
    paths: Sequence[Path], read: Sequence[Mesh], load_points: str
) -> tuple[dict[str, Mesh], dict[str, Path], str]:
    """Meshes and files by body, and the damper's group of cells in a common file."""
    if len(read) == 1:
        meshes, cells = _told_apart(read[0], load_points)
        return meshes, dict.fromkeys(meshes, paths[0]), cells
    larger, smaller = in_order([-_volumes(mesh).sum() for mesh in read])
    return (
        {BLADES: read[larger], DAMPER: read[smaller]},
        {BLADES: paths[larger], DAMPER: paths[smaller]},
        "",
    )


def _told_apart(mesh: Mesh, load_points: str) -> tuple[dict[str, Mesh], str]:
    """The bodies of one mesh, and the damper's group of cells, '' where none is that."""
    count, label = parts(mesh)
    if count < 2:
        raise InputError(
            f"{mesh.source}: all its cells are connected: blades and damper cannot be told apart; "
            'separate their nodes, or write a study with cells = "..." in [damper]'
        )
    chosen = _piece_of_damper(mesh, label, load_points)
    mine = {kind: label[cells[:, 0]] == chosen for kind, cells in mesh.cells.items()}
    others = {kind: ~m for kind, m in mine.items()}
    own = np.sort(np.concatenate([mesh.number[kind][m] for kind, m in mine.items()]))
    named = (
        name
        for name, found in sorted(mesh.cell_groups.items())
        if np.array_equal(np.sort(found), own)
    )
    meshes = {BLADES: cut(mesh, others, mesh.source), DAMPER: cut(mesh, mine, mesh.source)}
    return meshes, next(named, "")


def _piece_of_damper(mesh: Mesh, label: np.ndarray, load_points: str) -> int:
    """Label of the piece with a group that sounds like a load, or of the smallest."""
    if load_points:
        loaded = [_of_nodes(mesh, load_points)]
    else:
        words = WORDS["load_points"]
        loaded = [
            nodes for name, nodes in mesh.groups.items() if re.search(words, name, re.IGNORECASE)
        ]
    pulled = {int(i) for nodes in loaded for i in label[mesh.index(nodes)]}
    return pulled.pop() if len(pulled) == 1 else first_largest(-_volumes(mesh))


def _volumes(mesh: Mesh) -> np.ndarray:
    """Volume of each connected piece."""
    count, label = parts(mesh)
    found = np.zeros(count)
    for kind, cells in mesh.cells.items():
        _, gradient, weight = tables(kind)
        jacobian = np.einsum("qin,cnj->cqij", gradient, mesh.position[cells], optimize=True)
        np.add.at(found, label[cells[:, 0]], np.linalg.det(jacobian) @ weight)
    return found


def _directions(patches: Sequence[Patch]) -> tuple[np.ndarray, np.ndarray]:
    """Axis of the damper, across the normals of its two largest sides; pull, into both."""
    first = patches[0].normal
    other = patches[
        first_largest([np.linalg.norm(np.cross(first, p.normal)) for p in patches])
    ].normal
    along, into = np.cross(first, other), first + other
    if np.linalg.norm(along) < 1e-3:  # parallel sides: along the longest edge of the patch
        along = np.eye(3)[first_largest(np.ptp(patches[0].box, axis=0))]
    axis = _snapped(along / np.linalg.norm(along), ALONG)
    axis = axis if axis[first_largest(np.abs(axis))] > 0 else -axis
    into = into - axis * (into @ axis)
    if np.linalg.norm(into) < 1e-3:
        return axis, np.array([0.0, 0.0, 1.0])
    into /= np.linalg.norm(into)
    pull = _snapped(into, INTO)
    return axis, pull if abs(pull @ axis) < 1e-6 else np.round(into, 6)


def _snapped(direction: np.ndarray, degrees: float) -> np.ndarray:
    i = first_largest(np.abs(direction))
    near = np.degrees(np.arccos(min(abs(direction[i]), 1.0))) < degrees
    return np.sign(direction[i]) * np.eye(3)[i] if near else np.round(direction, 6)


def _sides(
    patches: Sequence[Patch], meshes: dict[str, Mesh], axis: np.ndarray, pull: np.ndarray
) -> tuple[ProposedSide, ...]:
    """Named by where they lie across axis and pull: left and right for two of them."""
    across = np.cross(axis, pull)
    order = sorted(
        _grouped(patches, meshes), key=lambda one: float(one[0].box.mean(axis=0) @ across)
    )
    names = (
        ["left", "right"] if len(order) == 2 else [f"side_{i}" for i in range(1, len(order) + 1)]
    )
    return tuple(
        ProposedSide(name, patch, blade, damper, _match(meshes, patch))
        for name, (patch, blade, damper) in zip(names, order, strict=True)
    )


def _grouped(patches: Sequence[Patch], meshes: dict[str, Mesh]) -> list[tuple[Patch, str, str]]:
    """[(patch, blade group, damper group)]. Lands that a group of the damper joins are one side
    where they meet one flank of the blades; elsewhere no group, or their contact would count on
    each of them."""
    named: dict[tuple[str, str], list[Patch]] = {}
    for patch in patches:
        blade = group_of(meshes[BLADES], patch.blades)
        damper = group_of(meshes[DAMPER], patch.damper)
        patch = within_group(meshes[DAMPER], patch, damper) if damper else patch
        named.setdefault((blade, damper), []).append(patch)
    found = []
    for (blade, damper), same in named.items():
        if len(same) == 1 or not damper:
            found += [(patch, blade, damper) for patch in same]
        elif blade and in_one_piece(meshes[BLADES], blade):
            found.append((as_one(meshes[DAMPER], same), blade, damper))
        else:
            found += [(patch, blade, "") for patch in same]
    return found


def _match(meshes: dict[str, Mesh], patch: Patch) -> bool:
    """Whether every corner of the damper's faces lies on one of the blades'."""
    ends = [
        meshes[body].position[meshes[body].index(np.setdiff1d(keys, [-1]))]
        for body, keys in ((BLADES, patch.blades), (DAMPER, patch.damper))
    ]
    limit = 1e-6 * float(np.ptp(patch.box, axis=0).max())
    return bool((cKDTree(ends[0]).query(ends[1])[0] <= limit).all())
