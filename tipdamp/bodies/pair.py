"""The contact pairs of a study: matched between the meshes, or a table of the user's own, which is
checked."""

from dataclasses import replace

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.surfaces import SurfaceContact, length_text, named_side, surface_points
from tipdamp.bodies.table_checks import check_on_surface
from tipdamp.hbm.contact import GROUND, ContactTable, check_distinct, check_pairs_once
from tipdamp.hbm.errors import InputError
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.pairing import join, matches, offsets, pair
from tipdamp.static_contact.surfaces.pick import faces_of
from tipdamp.static_contact.surfaces.settings import DEFAULT
from tipdamp.study.view import Study


def matched(study: Study, meshes: dict[str, Mesh]) -> SurfaceContact:
    """All pairs of all sides with their frames: nodes matched between the meshes, points of unlike
    surfaces, or the user's own table; and the points of the surfaces on either mesh, none where
    there are no surfaces."""
    if study.contact.pairs:
        pairs = own_pairs(study)
        check_positions(study, meshes, pairs)
        check_on_surface(study, meshes, pairs)
        return SurfaceContact(pairs, {})
    _check_not_swapped(study, meshes)
    met = surface_points(study, meshes)
    found = (
        {name: met.pairs.select(met.pairs.side == name) for name in met.pairs.sides} if met else {}
    )
    for name in study.sides:
        if name in found:
            continue
        pairs = pair(
            meshes[BLADES],
            meshes[DAMPER],
            named_side(study, name),
            axis=study.driver.axis,
            pull=study.driver.pull_direction,
            tolerance=study.contact.tolerance,
            shown=length_text(study.length_unit),
        )
        if study.contact.distance == "gap":
            pairs = pairs.replace(gap=offsets(pairs, meshes[BLADES], meshes[DAMPER]))
        found[name] = pairs
    pairs = join(*(found[name] for name in study.sides))
    check_pairs_once(f"{study.path}: [contact]", pairs)
    _check_apart(study, meshes, pairs)
    return SurfaceContact(pairs, met.points if met else {})


def _check_apart(study: Study, meshes: dict[str, Mesh], pairs: ContactTable) -> None:
    """InputError where most pairs of a side of nodes lie within a side that meets as surfaces, and
    face its way."""
    for surface in dict.fromkeys(pairs.side[pairs.on_surface].tolist()):
        own, normals = named_side(study, surface), pairs.normal[pairs.side == surface]
        inside = [
            np.unique(np.concatenate([f.ravel() for f in faces_of(meshes[body], group)]))
            for body, group in ((BLADES, own.blade), (DAMPER, own.damper))
        ]
        for name in dict.fromkeys(pairs.side[~pairs.on_surface].tolist()):
            mine = pairs.select(pairs.side == name)
            there = np.isin(meshes[BLADES].index(mine.blade_node), inside[0]) & np.isin(
                meshes[DAMPER].index(mine.damper_node), inside[1]
            )
            there &= (mine.normal @ normals.T).max(axis=1) > np.cos(np.radians(DEFAULT.opposed))
            if there.sum() > len(mine) / 2:
                raise InputError(
                    f"{study.path}: [contact.{name}]: {there.sum()} of its {len(mine)} pairs of "
                    f"nodes lie within the surfaces of side '{surface}': their contact would "
                    "count twice; leave one of the two sides out, or take the faces off it"
                )


def _check_not_swapped(study: Study, meshes: dict[str, Mesh]) -> None:
    """InputError where the damper groups of two sides stand in each other's place."""
    tolerance = study.contact.tolerance
    for name in study.sides:
        own = named_side(study, name)
        if matches(meshes[BLADES], meshes[DAMPER], own, tolerance):
            continue
        for other in study.sides:
            theirs = named_side(study, other)
            if other != name and matches(
                meshes[BLADES], meshes[DAMPER], replace(own, damper=theirs.damper), tolerance
            ):
                raise InputError(
                    f"{study.path}: [contact.{name}]: the nodes of blade group '{own.blade}' lie "
                    f"on those of damper group '{theirs.damper}', which [contact.{other}] names: "
                    "the groups are swapped; exchange the damper groups of the two sides"
                )


def side_nodes(
    study: Study, meshes: dict[str, Mesh], pairs: ContactTable
) -> dict[str, list[np.ndarray]]:
    """{"blades", "damper": node numbers of each side of the pairs}: of pairs of nodes, and of the
    faces that meet as surfaces. None of the ground."""
    found: dict[str, list[np.ndarray]] = {BLADES: [], DAMPER: []}
    for side in pairs.sides:
        mine = pairs.select(pairs.side == side)
        if mine.on_surface.all():
            named = named_side(study, side)
            found[BLADES].append(meshes[BLADES].group(named.blade))
            found[DAMPER].append(meshes[DAMPER].group(named.damper))
        else:
            found[BLADES].append(mine.blade_node[mine.blade_body != GROUND])
            found[DAMPER].append(mine.damper_node[mine.damper_body != GROUND])
    return found


def own_pairs(study: Study) -> ContactTable:
    """The user's own table, read and never written to."""
    pairs = ContactTable.load(study.file(study.contact.pairs))
    where = f"{study.path}: [contact] pairs"
    if not np.isfinite(pairs.position).all():
        i = int((~np.isfinite(pairs.position)).any(axis=1).argmax())
        raise InputError(
            f"{where}, pair {i + 1}: x, y, z = {pairs.position[i].tolist()}, must be finite"
        )
    unknown = sorted(set(study.sides) - set(pairs.sides))
    if unknown:
        raise InputError(
            f"{study.path}: [contact.{unknown[0]}]: the pairs have sides {', '.join(pairs.sides)}"
        )
    for column, bodies, body in (
        ("blade_body", pairs.blade_body, BLADES),
        ("damper_body", pairs.damper_body, DAMPER),
    ):
        odd = sorted(set(bodies.tolist()) - {body, GROUND})
        if odd:
            raise InputError(
                f"{where}: {column} '{odd[0]}' must be '{body}', or '{GROUND}' for a fixed "
                "counterpart"
            )
    alone = (pairs.blade_body == GROUND) & (pairs.damper_body == GROUND)
    if alone.any():
        raise InputError(
            f"{where}, pair {int(alone.argmax()) + 1}: blade_body and damper_body are both "
            f"'{GROUND}'; one must be '{BLADES}' or '{DAMPER}'"
        )
    check_distinct(where, pairs)
    _check_springs(where, pairs)
    for name in pairs.sides:
        _check_stations(
            f"{where}, side '{name}'", pairs.select(pairs.side == name), np.array(study.driver.axis)
        )
    return pairs


def _check_springs(where: str, pairs: ContactTable) -> None:
    for column, k, bad, more in (
        (
            "kn",
            pairs.kn,
            ~np.isfinite(pairs.kn) | (pairs.kn <= 0),
            ' and above 0; hard contact in the statics is [contact] normal = "hard", a pair that '
            "does not carry has "
            "weight 0",
        ),
        ("kt", pairs.kt, ~np.isfinite(pairs.kt), ""),
    ):
        if bad.any():
            i = int(bad.argmax())
            raise InputError(f"{where}, pair {i + 1}: {column} = {k[i]:g} must be finite{more}")


def _check_stations(where: str, pairs: ContactTable, axis: np.ndarray) -> None:
    """Stations count from 0 along the axis without a gap, as detaching counts them."""
    numbers = np.unique(pairs.station)
    if numbers.tolist() != list(range(len(numbers))):
        raise InputError(
            f"{where}: stations must count from 0 without a gap, found {numbers[0]}..{numbers[-1]} "
            f"({len(numbers)} different ones)"
        )
    along = pairs.position @ axis
    place = np.array([along[pairs.station == s].mean() for s in numbers])
    if (np.diff(place) <= 0).any():
        raise InputError(
            f"{where}: station {int(np.diff(place).argmin()) + 1} does not lie further along the "
            "axis than the one before it"
        )


def places_on(meshes: dict[str, Mesh], pairs: ContactTable) -> dict[str, np.ndarray]:
    """{"blades", "damper": (P, 3) m} of the two nodes of each pair; of the ground the place in the
    table, of contact points that on the damper and, beyond the gap, on the blade."""
    found = {}
    for name, bodies, numbers in (
        (BLADES, pairs.blade_body, pairs.blade_node),
        (DAMPER, pairs.damper_body, pairs.damper_node),
    ):
        found[name], there = pairs.position.copy(), (bodies != GROUND) & ~pairs.on_surface
        found[name][there] = meshes[name].position[meshes[name].index(numbers[there])]
    beyond = pairs.on_surface[:, None] * pairs.gap[:, None] * pairs.normal
    return {**found, BLADES: found[BLADES] + beyond}


def check_positions(study: Study, meshes: dict[str, Mesh], pairs: ContactTable) -> None:
    """A user-supplied pair table must belong to these meshes: nodes exist and lie where the table
    says, or as far away along the normal as its gap."""
    for name, numbers in ((BLADES, pairs.blade_node), (DAMPER, pairs.damper_node)):
        apart = places_on(meshes, pairs)[name] - pairs.position
        across = apart - _along(apart, pairs.normal)[:, None] * pairs.normal
        along = np.abs(_along(apart, pairs.normal))
        off = np.hypot(np.linalg.norm(across, axis=1), np.maximum(along - np.abs(pairs.gap), 0.0))
        if off.max() > study.contact.tolerance:
            i, shown = int(off.argmax()), length_text(study.length_unit)
            raise InputError(
                f"{study.path}: [contact] pairs, row {i + 1}: node {numbers[i]} of the {name} lies "
                f"{shown(off[i])} from where the table has it, more than [contact] tolerance"
            )


def _along(apart: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return np.einsum("pd,pd->p", apart, normal)
