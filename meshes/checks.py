"""What a mesh of the rig must satisfy before anything is computed with it. Every failure is one
line."""

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import trapezoid
from scipy.spatial import cKDTree

from tipdamp.meshes.rig import SIDES, STATIONS, Contact, Rig, contact
from tipdamp.meshes.structured import HEX27, SAME_NODE, HexMesh, boundary, faces_of

SAME_VOLUME = 1e-6  # of a body's


class MeshError(ValueError):
    """A mesh that must not be used; the message says what is wrong with it."""


def check(rig: Rig, damper: str, rows: int, blades: HexMesh, solid: HexMesh) -> dict[str, float]:
    """All checks on the pair of meshes `blades` and `solid` (the damper); returns {body: volume in
    m3}."""
    found = contact(rig, damper, rows)
    volumes = {}
    for mesh, expected in (
        (blades, blades_volume(rig, found)),
        (solid, damper_volume(rig, found) - beside_arcs(rig, found, solid)),
    ):
        check_solid(mesh)
        volumes[mesh.name] = volume = cell_volumes(mesh).sum()
        if abs(volume - expected) > SAME_VOLUME * expected:
            raise MeshError(f"{mesh.name}: volume {volume:.6e} m3, expected {expected:.6e}")
    _check_groups(rig, found, blades, solid)
    left, right = (
        blades.nodes[np.unique(blades.surfaces[f"cover_{s}"])][:, 0] for s in ("left", "right")
    )
    gap = right.min() - left.max()
    if not gap > 0:
        raise MeshError(f"blades: the covers overlap in the mid-plane (gap {gap:.3e} m)")
    return volumes


def check_solid(mesh: HexMesh) -> None:
    """No node unused, doubled or not finite; no inverted cell; one closed surface and no crack
    inside."""
    if not np.isfinite(mesh.nodes).all():
        raise MeshError(f"{mesh.name}: a node's position is not a number")
    unused = len(mesh.nodes) - len(np.unique(mesh.cells))
    if unused:
        raise MeshError(f"{mesh.name}: {unused} nodes belong to no cell")
    pairs = cKDTree(mesh.nodes).query_pairs(SAME_NODE)
    if pairs:
        raise MeshError(
            f"{mesh.name}: {len(pairs)} pairs of nodes lie on each other, first {min(pairs)}"
        )
    worst = jacobians(mesh).min(axis=1)
    if not worst.min() > 0:
        raise MeshError(
            f"{mesh.name}: cell {worst.argmin()} is inverted (smallest Jacobian {worst.min():.3e} "
            "m3)"
        )
    _check_surface(mesh)


def _check_surface(mesh: HexMesh) -> None:
    if faces_of(mesh.cells)[1].max() > 2:
        raise MeshError(f"{mesh.name}: a face belongs to more than two cells")
    outside = boundary(mesh.cells)
    edges = np.sort(outside[:, [[0, 1], [1, 2], [2, 3], [3, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    if (count != 2).any():
        raise MeshError(
            f"{mesh.name}: the boundary is not closed at {np.count_nonzero(count != 2)} edges"
        )
    euler = len(np.unique(outside[:, :4])) - len(edges) + len(outside)
    # a sphere; cells that meet without sharing their face leave a second surface inside
    if euler != 2:
        raise MeshError(
            f"{mesh.name}: not conforming, its boundary has Euler characteristic {euler} instead "
            "of 2"
        )


def _shape_gradients(points: np.ndarray) -> np.ndarray:
    """Gradients (p, 27, 3) of the 27 shape functions at points (p, 3) of [-1, 1]^3."""
    # (3, p, 3)
    value = np.stack([points * (points - 1) / 2, 1 - points**2, points * (points + 1) / 2])
    slope = np.stack([points - 0.5, -2 * points, points + 0.5])
    parts = []
    for axis in range(3):
        factors = [(slope if axis == k else value)[HEX27[:, k], :, k] for k in range(3)]
        parts.append((factors[0] * factors[1] * factors[2]).T)
    return np.stack(parts, axis=-1)


def jacobians(mesh: HexMesh, points: np.ndarray | None = None) -> np.ndarray:
    """Jacobian determinants (m, p), m3; by default at the 27 nodes of each cell, corners
    included."""
    points = HEX27 - 1.0 if points is None else points
    gradients = np.einsum(
        "pia,mib->mpab", _shape_gradients(points), mesh.nodes[mesh.cells], optimize=True
    )
    return np.linalg.det(gradients)


def cell_volumes(mesh: HexMesh) -> np.ndarray:
    """Volume of each cell (m,), m3, by 3 x 3 x 3 Gauss points."""
    x, w = np.polynomial.legendre.leggauss(3)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), -1).reshape(-1, 3)
    return jacobians(mesh, points) @ np.einsum("i,j,k->ijk", w, w, w).ravel()


def damper_volume(rig: Rig, found: Contact) -> float:
    """Closed form: circle less one circular segment for each flat."""
    half = np.arcsin(rig.flat_width / (2 * rig.damper_radius))
    segment = rig.damper_radius**2 * half - rig.flat_distance * rig.flat_width / 2
    flats = sum(found.shape[s] == "flat" for s in SIDES)
    return (np.pi * rig.damper_radius**2 - flats * segment) * rig.length


def beside_arcs(rig: Rig, found: Contact, solid: HexMesh) -> float:
    """m3 between the damper's cylinder and its quadratic cells: each follows its arc by a parabola
    through both ends and the middle, coarse ones to some thousandths of the volume."""
    place = solid.nodes[boundary(solid.cells)]
    arm = place[..., [0, 2]] - found.centre
    round_ones = (np.abs(np.hypot(*arm.T) - rig.damper_radius) < SAME_NODE).all(axis=0)
    length = np.ptp(place[round_ones][..., 1], axis=1)
    corner = arm[round_ones][:, :4]
    chord = np.linalg.norm(np.ptp(corner, axis=1), axis=1)
    half = np.arcsin(chord / (2 * rig.damper_radius))
    segment = half - np.sin(half) * np.cos(half)
    parabola = 4 / 3 * np.sin(half) * (1 - np.cos(half))
    return float(rig.damper_radius**2 * (segment - parabola) @ length)


def blades_volume(rig: Rig, found: Contact) -> float:
    """Closed form: fixture block, the cubic thickness integrated, and the covers between blade and
    face."""
    q = Polynomial([0.0, 1.0 / rig.height])
    thickness = rig.root_thickness + (rig.tip_thickness - rig.root_thickness) * q
    thickness = thickness * (1 + 4 * (rig.mid_thickness_factor - 1) * q * (1 - q))
    area = (rig.pitch + rig.root_thickness + 2 * rig.fixture_overhang) * rig.fixture_height
    area += 2 * thickness.integ()(rig.height)
    bottom = rig.height - rig.cover_height
    for side in SIDES:
        z = np.array([bottom, found.turn[side], rig.height])
        to_blade = ((rig.pitch - thickness) / 2).integ()
        area += to_blade(rig.height) - to_blade(bottom)
        area -= trapezoid(np.abs(found.face_x(side, z)), z)
    return area * rig.length


def _check_groups(rig: Rig, found: Contact, blades: HexMesh, solid: HexMesh) -> None:
    for mesh in (blades, solid):
        _check_counts(found, mesh)
    for side in SIDES:
        a, b = (m.nodes[m.node_sets[f"contact_{side}"]] for m in (blades, solid))
        if (distance := np.linalg.norm(a - b, axis=1).max()) > SAME_NODE:
            raise MeshError(f"contact_{side}: the pairs are up to {distance:.2e} m apart")
    for name in ("patch_1", "patch_2"):
        p = blades.nodes[blades.node_sets[name][:4]]  # corners in turn
        area = np.linalg.norm(np.cross(p[2] - p[0], p[3] - p[1])) / 2
        if abs(area - rig.patch_area) > 0.01 * rig.patch_area:
            raise MeshError(f"blades/{name}: area {area:.3e} m2, expected {rig.patch_area:.3e}")


def _check_counts(found: Contact, mesh: HexMesh) -> None:
    expected = {"excitation": 1, "patch_1": 5, "patch_2": 5, "load_points": 4}
    expected |= {f"contact_{s}": STATIONS * len(found.rows[s]) for s in SIDES}
    for name, nodes in mesh.node_sets.items():
        if len(nodes) != expected[name] or len(np.unique(nodes)) != len(nodes):
            raise MeshError(
                f"{mesh.name}/{name}: {len(np.unique(nodes))} nodes, expected {expected[name]}"
            )
    for name, faces in mesh.surfaces.items():
        if not len(faces):
            raise MeshError(f"{mesh.name}/{name}: no faces")
