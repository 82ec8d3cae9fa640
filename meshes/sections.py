"""Cross-sections (x, z) of the rig's two bodies as ruled blocks of 9-node quadrilaterals."""

import numpy as np

from tipdamp.meshes.rig import Cells, Contact, Rig
from tipdamp.meshes.structured import join, ruled, subdivide


def blades_section(
    rig: Rig, found: Contact, cells: Cells, rows: int
) -> tuple[np.ndarray, np.ndarray]:
    """Fixture, two blades and their covers in one piece -> points (n, 2), quadrilaterals (m, 3,
    3)."""
    blocks = _fixture(rig, cells)
    for side in ("left", "right"):
        blocks += _blade(rig, found, side, cells, rows)
    return join(blocks)


def _fixture(rig: Rig, cells: Cells) -> list[np.ndarray]:
    inner = (rig.pitch - rig.root_thickness) / 2
    outer = (rig.pitch + rig.root_thickness) / 2
    half = np.array([inner, rig.free_span / 2, outer, outer + rig.fixture_overhang])
    counts = [cells.thickness, cells.thickness, cells.overhang]
    x = subdivide(np.concatenate([-half[::-1], half]), counts[::-1] + [cells.span] + counts)
    top = np.column_stack([x, np.zeros_like(x)])
    return [ruled(top, top - [0.0, rig.fixture_height], cells.fixture)]


def _blade(rig: Rig, found: Contact, side: str, cells: Cells, rows: int) -> list[np.ndarray]:
    """Blade in two halves, parted by a line from the clamp edge's x at the root to the middle at
    the tip; its cover."""
    sign = -1.0 if side == "left" else 1.0
    bottom = rig.height - rig.cover_height
    cover_z = _cover_heights(rig, found, side, cells, rows)
    z = np.concatenate(
        [
            subdivide([0.0, bottom - rig.patch_height, bottom], [cells.height, cells.patch])[:-1],
            cover_z,
        ]
    )
    thickness = rig.thickness(z)
    at_root = (rig.free_span - rig.pitch + rig.root_thickness) / (2 * rig.root_thickness)
    part = at_root + (0.5 - at_root) * np.minimum(z / bottom, 1.0)
    inner = np.column_stack([sign * (rig.pitch - thickness) / 2, z])
    outer = np.column_stack([sign * (rig.pitch + thickness) / 2, z])
    middle = inner + (outer - inner) * part[:, None]
    face = np.column_stack([found.face_x(side, cover_z), cover_z])
    return [
        ruled(inner, middle, cells.thickness),
        ruled(middle, outer, cells.thickness),
        ruled(inner[-len(cover_z) :], face, cells.cover),
    ]


def _cover_heights(rig: Rig, found: Contact, side: str, cells: Cells, rows: int) -> np.ndarray:
    bottom, n = rig.height - rig.cover_height, cells.face
    if found.shape[side] == "flat":
        low, high = found.rows[side][[0, -1], 1]
        return subdivide([bottom, low, high, rig.height], [n, flat_cells(cells, rows), n])
    return subdivide([bottom, found.rows[side][0, 1], found.turn[side], rig.height], [2 * n, n, n])


def flat_cells(cells: Cells, rows: int) -> int:
    """Cells across a flat: at least those asked for, and a whole number between neighbouring rows
    of pairs."""
    return (rows - 1) * -(-cells.flat // (rows - 1))


def damper_section(
    rig: Rig, found: Contact, cells: Cells, rows: int
) -> tuple[np.ndarray, np.ndarray]:
    """The damper: a core of straight lines through the axis, and a ring around it."""
    beta = np.radians(rig.contact_angle)
    half = np.arcsin(rig.flat_width / (2 * rig.damper_radius))
    low = beta - half
    top = _over_the_top(rig, found, cells, rows, (low, beta + half))
    under = _arc(rig, np.linspace(-low, -np.pi + low, len(top)))
    right = _arc(rig, np.linspace(-low, low, 2 * cells.gap + 1))
    # of the core; keeps the angles at the corners below 150 degrees
    corner = _arc(rig, np.array([low]))[0] * [0.667, 0.4]
    x, z = np.linspace(corner[0], -corner[0], len(top)), np.full(len(top), corner[1])
    core_top, core_under = np.column_stack([x, z]), np.column_stack([x, -z])
    core_right = np.column_stack(
        [np.full(len(right), corner[0]), np.linspace(-corner[1], corner[1], len(right))]
    )
    blocks = [
        ruled(core_under, core_top, cells.gap),
        ruled(core_top, top, cells.ring),
        ruled(core_under, under, cells.ring),
        ruled(core_right, right, cells.ring),
        ruled(core_right * [-1, 1], right * [-1, 1], cells.ring),
    ]
    return join([found.centre + block for block in blocks])


def _over_the_top(
    rig: Rig, found: Contact, cells: Cells, rows: int, ends: tuple[float, float]
) -> np.ndarray:
    """The damper's surface from the lower end of its right side over the top to that of its left,
    around the axis; ends - angles of the lower and the upper end of the right side."""
    low, high = ends
    counts = {"flat": flat_cells(cells, rows), "round": 2 * -(-cells.flat // 2)}
    right, left = counts[found.shape["right"]], counts[found.shape["left"]]
    over = subdivide([low, high, np.pi - high, np.pi - low], [right, cells.gap, left])
    top = _arc(rig, over)
    for side, inside in (("right", over <= high), ("left", over >= np.pi - high)):
        if found.shape[side] == "flat":
            first, last = top[inside][[0, -1]]
            top[inside] = first + (last - first) * np.linspace(0, 1, inside.sum())[:, None]
    return top


def _arc(rig: Rig, angles: np.ndarray) -> np.ndarray:
    """Places on the damper's circle, around its axis."""
    return rig.damper_radius * np.column_stack([np.cos(angles), np.sin(angles)])
