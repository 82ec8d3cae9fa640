"""Can these numbers be a turbine blade and its damper in the units that the study states? Warnings, never errors.

What is found in the meshes alone is kept by `inspect`; what compares them with bands, damping and stiffness of the
study is said anew each time (`expectations`), so that changing those leaves `inspect` up to date.
"""

import numpy as np

from hbm.errors import InputError
from modal.mesh import Mesh
from modal.mesh_checks import parts

# largest size (m) and mass (kg) of what is sold as blades and as dampers, and a margin
SIZE = {"blades": (5e-3, 5.0), "damper": (1e-3, 1.0)}
MASS = {"blades": (1e-3, 1e3), "damper": (1e-5, 10.0)}
LARGE_DAMPING = 0.2


def mesh_warnings(study, name: str, mesh: Mesh, mass: float | None = None) -> list[str]:
    """What looks wrong with the mesh of a body: what its reader says, pieces, and units, with the factor of 1000.

    mass : kg, None where it is not known yet
    """
    found = [f"{name}: {w}" for w in mesh.warnings]
    pieces, label = parts(mesh)
    if pieces > 1:
        sizes = sorted(np.bincount(label).tolist(), reverse=True)
        found.append(f"{name}: the mesh consists of {pieces} pieces that share no node (of "
                     f"{', '.join(map(str, sizes[:5]))}{', ...' if pieces > 5 else ''} nodes)")
    found += _wave_speed(study) if name == "blades" else []
    return found + _size(study, name, mesh) + ([] if mass is None else _mass(name, mass))


def expectations(study, inspected: dict) -> list[str]:
    """What of the study does not fit the content of inspect.json."""
    return [*_frequency(study, inspected), *_stiffness(study, inspected), *damping_warnings(study)]


def _wave_speed(study):
    for name, m in {"": study["material"], **study.materials}.items():
        speed = np.sqrt(m["E"] / m["density"])
        low, high = m["wave_speed"]
        if not low <= speed <= high:
            yield (f"[material{'.' if name else ''}{name}] sqrt(E/density) = {speed:.4g} m/s, metals have {low:g} to "
                   f"{high:g} (see wave_speed): a factor of 1000 in E = {m['E']:.4g} Pa or density = "
                   f"{m['density']:.4g} kg/m3? See [units]")


def _size(study, name, mesh):
    size = np.ptp(mesh.position, axis=0).max()
    low, high = SIZE[name]
    if low <= size <= high:
        return []
    unit, other = ("m", "mm") if study.length_unit == 1 else ("mm", "m")
    return [f"{name}: the mesh is {size:.4g} m in size, {low:g} to {high:g} m is usual: it was read in {unit}; a "
            f"factor of 1000 ([units] length = \"{other}\")?"]


def _mass(name, mass):
    low, high = MASS[name]
    if low <= mass <= high:
        return []
    return [f"{name}: its mass is {mass:.3g} kg, {low:g} to {high:g} kg is usual: a factor of 1000 in the length is "
            "1e9 in the mass, in the density 1000"]


def first_frequency(study, mesh) -> tuple[float, float]:
    """Hz: the first frequency of a solid of size L and thickness h lies between those of a slender cantilever and of
    its lengthwise waves: 0.16 c h/L^2 (a third of it, for two blades on a soft fixture) and c/2L."""
    m = study["material"]
    speed, size = np.sqrt(m["E"] / m["density"]), np.ptp(mesh.position, axis=0).max()
    edge = min(np.linalg.norm(mesh.position[c[:, 1]] - mesh.position[c[:, 0]], axis=1).min()
               for c in mesh.cells.values())
    return 0.05 * speed * edge / size**2, speed / (2 * size)


def _frequency(study, inspected):
    low, high = inspected["bodies"]["blades"].get("first_hz", (0.0, np.inf))
    band = study["respond"]["band"] if "respond" in study else (low, high)
    if low <= band[1] and band[0] <= high:
        return []
    return [f"blades: a body of this size and material has its first natural frequency between {low:.3g} and "
            f"{high:.3g} Hz, the band of the study is {band[0]:g} to {band[1]:g} Hz: a factor of 1000 in the length is "
            "one in frequency too"]


def _stiffness(study, inspected):
    """Given kn beyond what two smooth half-spaces of the side's size and materials have: real contacts are softer."""
    from static_contact.stiffness.contact_side import ContactSide, side_stiffness
    from static_contact.stiffness.elastic_constants import MaterialPair

    for name, moduli in inspected.get("side_moduli", {}).items():
        side, facts = study.sides[name], inspected["pair_checks"][name]
        width = side["width"] or facts["across_m"]
        if side["kn"] is None or not facts["force_per_pull"] or not facts["length_m"] or not (
                side["radius"] if side["shape"] == "cylinder" else width):
            continue
        try:
            one = ContactSide(side["shape"], facts["length_m"], MaterialPair(*moduli),
                              radius=None if side["shape"] == "flat" else side["radius"],
                              width=None if side["shape"] == "cylinder" else width)
            bound = side_stiffness(one, facts["force_per_pull"] * study.driver["pull"]).normal
        except InputError:       # a radius that is missing, or far too small for the load
            continue
        total = side["kn"] * facts["pairs"]
        if total > bound:
            yield (f"[contact.{name}] kn = {side['kn']:.4g} N/m on {facts['pairs']} nodes is {total:.3g} N/m for the "
                   f"side, {total / bound:.2g} times that of two smooth half-spaces of its size and material "
                   f"({bound:.3g} N/m), and real contacts are softer: is kn per node, and in the units of [units]?")


def distance_warnings(study, pairs, meshes):
    """Pairs whose nodes lie apart along the normal by more than a tenth of the distance of neighbouring nodes."""
    from scipy.spatial import cKDTree

    from static_contact.pairing import offsets

    apart = offsets(pairs, meshes["blades"], meshes["damper"])
    for name in pairs.sides:
        mine = np.flatnonzero(pairs.side == name)
        size = np.median(cKDTree(pairs.position[mine]).query(pairs.position[mine], 2)[0][:, 1])
        far = mine[np.abs(apart[mine]) > 0.1 * size]
        if len(far):
            i = far[np.abs(apart[far]).argmax()]
            how = ("they count as touching (shifted onto each other)" if study["contact"]["distance"] == "closed"
                   else "it counts as initial gap")
            yield (f"side '{name}': {len(far)} pairs {'overlap' if apart[i] < 0 else 'gape'}, most at blade node "
                   f"{pairs.blade_node[i]} ({np.round(pairs.position[i], 5).tolist()} m): {apart[i]:.3g} m, "
                   f"{abs(apart[i]) / size:.2g} of the distance of neighbouring nodes; {how}: [contact] distance")


def damping_warnings(study):
    for section in ("respond", "free"):
        large = max(study[section]["damping_ratio"], default=0) if section in study else 0
        if large >= LARGE_DAMPING:
            yield f"[{section}] damping_ratio = {large:g}: is it in percent? A ratio, 0.02 for 2 %, is meant"
