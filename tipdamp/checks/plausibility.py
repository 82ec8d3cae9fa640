"""Are these numbers plausible for turbine blades and their damper in the units of the study?
Warnings, never errors.

What concerns the meshes and friction is stored by `inspect`; what compares them with bands, damping
and stiffness of the study is judged anew each time (`expectations`), so that changing those leaves
`inspect` up to date.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.loads import pull_vector
from tipdamp.bodies.pieces import merging
from tipdamp.bodies.stiffness import contact_side
from tipdamp.bodies.surfaces import damper_areas, length_text, named_side
from tipdamp.checks.pairs import spacing
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.contact_doubts import LIMITS
from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.cell_shape import sliver_warning
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import parts
from tipdamp.results.static_results import InspectResult, SideCheck
from tipdamp.static_contact.stiffness.side_stiffness import side_stiffness
from tipdamp.static_contact.surfaces.pairing import offsets
from tipdamp.study.schema import MaterialSection, OtherMaterial, SideSection
from tipdamp.study.view import Study

# largest size (m) and mass (kg) of what is sold as blades and as dampers, and a margin
SIZE = {"blades": (5e-3, 5.0), "damper": (1e-3, 1.0)}
MASS = {"blades": (1e-3, 1e3), "damper": (1e-5, 10.0)}
LARGE_DAMPING = 0.2
# of two smooth half-spaces: rough contacts are stiffer; N/mm taken for N/m is a factor of 1e-3
SOFT = 2e-3
IN_UNITS = "and in the units of [units] (1 N/mm is 1e3 N/m, 1 N/mm3 is 1e9 N/m3)?"
ALIKE = 1e-3  # of each constant of a material: people round them
COVERED = 0.95  # of a side of the damper: less of it opposite to the blade is said
# percent by which a bar with one and two layers of linear cells is too stiff in bending; quadratic
# ones: 3 and 2 [tests/modal/test_bending.py]
LOCKING = {"tetra": (284, 84), "hexahedron": (56, 16), "wedge": (55, 16)}


def mesh_warnings(study: Study, name: str, mesh: Mesh, mass: float | None = None) -> list[str]:
    """What looks wrong with the mesh of a body: what its reader says, pieces, and units, with the
    factor of 1000.

    mass : kg, None where it is not known yet
    """
    found = [f"{name}: {w}" for w in mesh.warnings]
    found += _loose_pieces(study, name, mesh)
    found += _locking(name, mesh)
    found += _slivers(study, name, mesh)
    found += _wave_speed(study) if name == "blades" else []
    return found + _size(study, name, mesh) + ([] if mass is None else _mass(name, mass))


def unlike_materials(study: Study, mesh: Mesh) -> Iterator[str]:
    """Of each group of cells the material of the file, in its own units, where the study has
    another for these cells: it is not taken over."""
    stated = {one.group: one for one in study.materials.values()}
    for group, given in mesh.materials.items():
        if group not in mesh.cell_groups:  # of the other body of the file
            continue
        own = stated.get(group, study.material)
        alike = np.isclose(
            [own.E, own.nu, own.density],
            given.in_si(study.length_unit),
            rtol=ALIKE,
            atol=0.0,
        )
        if not alike.all():
            yield (
                f"material {shown(given.name)} of '{shown(group)}' (E = {given.E:g}, nu = "
                f"{given.nu:g}, density = {given.density:g} in the units of the file)"
            )


def expectations(study: Study, inspected: InspectResult) -> list[str]:
    """What of the study does not fit what `inspect` found."""
    return [*_frequency(study, inspected), *_stiffness(study, inspected), *damping_warnings(study)]


def friction_warnings(study: Study) -> Iterator[str]:
    """A friction coefficient above that of any dry metals."""
    mu = study.contact.mu
    if mu is not None and mu > LIMITS.mu:  # None: a table of pairs says it
        yield f"[contact] mu = {mu:g} is above {LIMITS.mu:g}: is it mu, or in percent?"


def _locking(name: str, mesh: Mesh) -> Iterator[str]:
    total = sum(map(len, mesh.cells.values()))
    for kind, percent in LOCKING.items():
        if kind in mesh.cells:
            yield (
                f"{name}: {len(mesh.cells[kind])} of {total} cells are linear ({kind}) and lock "
                f"in bending: with one layer through the thickness a bar is {percent[0]} % too "
                f"stiff, with two {percent[1]} %, of quadratic ones 3 and 2 %; use quadratic "
                "cells"
            )


def _slivers(study: Study, name: str, mesh: Mesh) -> list[str]:
    unit = study.length_unit
    said = sliver_warning(mesh, unit, "m" if unit == 1 else "mm")
    return [f"{name}: {said}"] if said else []


def _loose_pieces(study: Study, name: str, mesh: Mesh) -> Iterator[str]:
    """Pieces without contact: two blades that stand apart, each with a side of the damper, are
    none; and a damper of several."""
    pieces, label = parts(mesh)
    clamped = _labels(mesh, label, study.blades.clamp if name == BLADES else ())
    sides = [] if study.contact.pairs else [named_side(study, one) for one in study.sides]
    met = _labels(mesh, label, [side.blade if name == BLADES else side.damper for side in sides])
    apart = set(range(pieces)) - met
    loose = apart - clamped
    idle, how = (
        (loose, "neither clamped nor in contact")
        if loose or study.contact.pairs
        else (apart, "clamped and in no contact")
    )
    if pieces > 1 and (idle or name == DAMPER):
        sizes = sorted(np.bincount(label).tolist(), reverse=True)
        said = "each floats by itself"
        if idle:
            said = f"{len(idle)} of them {'is' if len(idle) == 1 else 'are'} {how}"
        yield (
            f"{name}: the mesh consists of {pieces} pieces that share no node (of "
            f"{', '.join(map(str, sizes[:5]))}{', ...' if pieces > 5 else ''} nodes); {said}"
        )
        # two blades may touch each other
        if (loose or name == DAMPER) and (merged := merging(mesh)):
            yield f"{name}: {merged}"


def _labels(mesh: Mesh, label: np.ndarray, groups: Sequence[str]) -> set[int]:
    """Pieces that groups of the mesh have nodes of."""
    return {
        int(i)
        for group in groups
        if group in mesh.groups
        for i in label[mesh.index(mesh.groups[group])]
    }


def _wave_speed(study: Study) -> Iterator[str]:
    stated: dict[str, MaterialSection | OtherMaterial] = {"": study.material, **study.materials}
    for name, m in stated.items():
        speed = np.sqrt(m.E / m.density)
        low, high = m.wave_speed
        if not low <= speed <= high:
            yield (
                f"[material{'.' if name else ''}{name}] sqrt(E/density) = {speed:.4g} m/s, metals "
                f"have {low:g} to {high:g} (see wave_speed): a factor of 1000 or more in E = "
                f"{m.E:.4g} Pa or density = {m.density:.4g} kg/m3? See [units]"
            )


def _size(study: Study, name: str, mesh: Mesh) -> list[str]:
    size = np.ptp(mesh.position, axis=0).max()
    low, high = SIZE[name]
    if low <= size <= high:
        return []
    unit, other = ("m", "mm") if study.length_unit == 1 else ("mm", "m")
    return [
        f"{name}: the mesh is {size:.4g} m in size, {low:g} to {high:g} m is usual: it was read in "
        f"{unit}; a "
        f'factor of 1000 ([units] length = "{other}")?'
    ]


def _mass(name: str, mass: float) -> list[str]:
    low, high = MASS[name]
    if low <= mass <= high:
        return []
    return [
        f"{name}: its mass is {mass:.3g} kg, {low:g} to {high:g} kg is usual: a factor of 1000 in "
        "the length is 1e9 in the mass, in the density 1000"
    ]


def first_frequency(study: Study, mesh: Mesh) -> tuple[float, float]:
    """Hz: the first frequency of a solid of size L and thickness h lies between those of a slender
    cantilever and of longitudinal waves: 0.16 c h/L^2 (a third of it, for two blades on a soft
    fixture) and c/2L."""
    m = study.material
    speed, size = np.sqrt(m.E / m.density), np.ptp(mesh.position, axis=0).max()
    edge = min(
        np.linalg.norm(mesh.position[c[:, 1]] - mesh.position[c[:, 0]], axis=1).min()
        for c in mesh.cells.values()
    )
    return 0.05 * speed * edge / size**2, speed / (2 * size)


def _frequency(study: Study, inspected: InspectResult) -> Iterator[str]:
    bounds = inspected.bodies[BLADES].first_hz
    if bounds is None or "respond" not in study:
        return
    (low, high), band = bounds, study.respond.band
    if any(band) and (band[1] < low or high < band[0]):
        yield (
            "blades: a body of this size and material has its first natural frequency between "
            f"{low:.3g} and {high:.3g} Hz, the band of the study is {band[0]:g} to {band[1]:g} "
            "Hz: a factor of 1000 in the length is one in frequency too"
        )


def _stiffness(study: Study, inspected: InspectResult) -> Iterator[str]:
    """Given kn beyond what two smooth half-spaces of the side's size and materials have, real
    contacts are softer; or hundreds of times below it."""
    pull = float(np.linalg.norm(pull_vector(study)))
    for name, moduli in inspected.side_moduli.items():
        found = inspected.pair_checks[name]
        side = study.sides.get(name) or SideSection(shape="flat")  # of an own table
        if side.shape == "cylinder" and not side.radius:  # none is larger than the damper
            side = side.model_copy(
                update={"radius": np.ptp(inspected.bodies[DAMPER].box_m, axis=0).max() / 2}
            )
        sized = side.radius if side.shape == "cylinder" else side.width or found.across_m
        # a flat's does not depend on it
        share = found.force_per_pull or (1.0 if side.shape == "flat" else 0.0)
        total, said, asked = _given_total(side, found)
        if not total or not share or not found.length_m or not sized:
            continue
        try:
            one = contact_side(side, found.length_m, moduli, found.across_m)
            bound = side_stiffness(one, share * pull).normal
        except InputError:  # a radius that is missing, or far too small for the load
            continue
        if total < SOFT * bound:
            force = (found.force_per_pull or 0.0) * pull
            closes = (
                f": {force:.3g} N close it by {1e3 * force / total:.2g} mm and those by "
                f"{1e3 * force / bound:.2g} mm"
                if force
                else ""
            )
            yield (
                f"[contact.{name}] {said} for the side, 1/{bound / total:.3g} of that of two "
                f"smooth half-spaces of its size and material ({bound:.3g} N/m){closes}; rough "
                f"contacts have a tenth to a hundredth: is {asked}"
            )
        if total > bound:
            yield (
                f"[contact.{name}] {said} for the side, {total / bound:.2g} times that of two "
                f"smooth half-spaces of its size and material ({bound:.3g} N/m), real contacts "
                f"are softer: is {asked}"
            )


def _given_total(side: SideSection, found: SideCheck) -> tuple[float, str, str]:
    """N/m of the whole side, 0 where a model gives it, how it is stated, and what may be meant."""
    if not side.given:
        total = found.kn_N_per_m or 0.0
        return total, f"kn of the table is {total:.3g} N/m", "kn that of each pair, and in N/m?"
    if side.kn is not None:
        total = side.kn * found.pairs
        return (
            total,
            f"kn = {side.kn:.4g} N/m on {found.pairs} nodes is {total:.3g} N/m",
            f"kn per node, {IN_UNITS}",
        )
    if side.kn_total is not None:
        return (
            side.kn_total,
            f"kn_total = {side.kn_total:.4g} N/m",
            f"kn_total that of the side, {IN_UNITS}",
        )
    area = found.area_m2 or found.length_m * (side.width or found.across_m)
    assert side.kn_per_area is not None, "a side without a given stiffness"
    total = side.kn_per_area * area
    return (
        total,
        (f"kn_per_area = {side.kn_per_area:.4g} N/m3 on {1e6 * area:.4g} mm2 is {total:.3g} N/m"),
        f"kn_per_area per area, {IN_UNITS}",
    )


def distance_warnings(study: Study, pairs: ContactTable, meshes: dict[str, Mesh]) -> Iterator[str]:
    """Pairs whose nodes lie apart along the normal by more than a tenth of the distance of
    neighbouring nodes."""
    yield from gap_warnings(study, pairs.select(pairs.on_surface))
    yield from _cover_warnings(study, pairs, damper_areas(study, meshes))
    shown = length_text(study.length_unit)
    pairs = pairs.select(~pairs.on_surface)
    yield from _left_alone(study, pairs, meshes)
    apart = offsets(pairs, meshes[BLADES], meshes[DAMPER])
    for name in pairs.sides:
        mine = np.flatnonzero(pairs.side == name)
        size = spacing(pairs.position[mine])
        far = mine[np.abs(apart[mine]) > 0.1 * size]
        if len(far):
            i = far[np.abs(apart[far]).argmax()]
            how = (
                "they count as touching (shifted onto each other)"
                if study.contact.distance != "gap"
                else "it counts as initial gap"
            )
            yield (
                f"side '{name}': {len(far)} pairs {'overlap' if apart[i] < 0 else 'are apart'}, "
                f"most at blade node {pairs.blade_node[i]} "
                f"({', '.join(map(shown, pairs.position[i]))}): {shown(apart[i])}, "
                f"{abs(apart[i]) / size:.2g} of the distance of neighbouring nodes; {how}: "
                "[contact] distance"
            )


def _left_alone(study: Study, pairs: ContactTable, meshes: dict[str, Mesh]) -> Iterator[str]:
    """Nodes of a face that lie where another one has the partner already, as those of unmerged
    nodes do."""
    for name in pairs.sides:
        mine, side = pairs.select(pairs.side == name), named_side(study, name)
        for body, group, paired in (
            (BLADES, side.blade, mine.blade_node),
            (DAMPER, side.damper, mine.damper_node),
        ):
            alone = np.setdiff1d(nodes := meshes[body].group(group), paired)
            if len(alone):
                yield (
                    f"side '{name}': {len(alone)} of {len(nodes)} nodes of '{group}' of the "
                    f"{body} have no partner and no contact (first: node {alone[0]}): the node on "
                    "the other side belongs to another one at the same place; merge coincident "
                    "nodes where that is one body"
                )


def gap_warnings(study: Study, points: ContactTable) -> Iterator[str]:
    """Surfaces that lie apart; beside its line of contact a round side does anyway."""
    for name in points.sides:
        mine = np.flatnonzero(points.side == name)
        far = mine[points.gap[mine] > 0.1 * np.sqrt(points.area[mine])]
        # on a round side only those that can touch do, see node_stiffness
        shared = study.sides[name].shape == "flat"
        if len(far) == len(mine) or len(far) and shared:
            i = far[points.gap[far].argmax()]
            shown = length_text(study.length_unit)
            yield (
                f"side '{name}': {len(far)} of {len(mine)} contact points have gaps of more than "
                f"a tenth of their size, up to {shown(points.gap[i])} at point "
                f"{points.damper_node[i]}; they carry nothing until they close"
                + ", and take their share of a stiffness of the whole side (kn_total, a model): "
                "kn_per_area is that of each point" * shared
            )


def _cover_warnings(study: Study, pairs: ContactTable, areas: dict[str, float]) -> Iterator[str]:
    """Sides of which a part lies opposite to no blade face; areas {side: m2} of the damper's
    faces."""
    for name, whole in areas.items():
        met, side = float(pairs.area[pairs.side == name].sum()), named_side(study, name)
        if met < COVERED * whole:
            yield (
                f"side '{name}': of the damper's faces '{side.damper}' {1e6 * met:.4g} of "
                f"{1e6 * whole:.4g} mm2 ({met / whole:.0%}) lie opposite to blade faces of "
                f"'{side.blade}', the rest carries nothing; where it should, see whether the "
                "meshes are in place and all blade faces are named"
            )


def damping_warnings(study: Study) -> Iterator[str]:
    """Damping ratios that look like percent."""
    sections = {"respond": study.respond.damping_ratio} if "respond" in study else {}
    for section, ratios in {**sections, "free": study.free.damping_ratio}.items():
        large = max(ratios, default=0.0)
        if large >= LARGE_DAMPING:
            yield (
                f"[{section}] damping_ratio = {large:g}: is it in percent? expected a ratio (2 % "
                "is 0.02)"
            )
