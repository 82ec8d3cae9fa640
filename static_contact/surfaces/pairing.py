"""Two meshed surfaces become matched node pairs with their contact frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.ties import SAME, first_largest, in_order
from tipdamp.modal.faces import boundary_faces, node_normals
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.normals import smooth_normals
from tipdamp.static_contact.surfaces.pick import faces_of

# degrees; a round side meets a flat one along a line, where both normals agree to the angle that a
# face of it spans
LARGEST_ANGLE = 20.0


@dataclass(frozen=True)
class Side:
    """One contact side of the damper: its name, the node groups of the two meshes that meet there,
    and the names of the two bodies."""

    name: str
    blade: str
    damper: str
    blade_body: str = "blades"
    damper_body: str = "damper"


def pair(
    blade: Mesh,
    damper: Mesh,
    side: Side,
    *,
    axis: ArrayLike,
    pull: ArrayLike,
    tolerance: float,
    shown: Callable[[float], str] = "{:.3g} m".format,
) -> ContactTable:
    """Match the nodes of both groups one to one within `tolerance` m and give each pair its frame.

    kn, kt, mu and gap of the table are still 0: they come from the study or from `stiffness`.

    axis (3,): along the damper; pull (3,): direction of Fc, which orders the rows: row 0 is the one
    farthest against it (the lower edge); shown - how a length in m is written. Raises InputError
    with the number of unmatched nodes and the tolerance that would match them; when normals do not
    oppose each other; when stations and rows do not form a grid.
    """
    b_nodes, d_nodes = blade.group(side.blade), damper.group(side.damper)
    b_index, d_index = blade.index(b_nodes), damper.index(d_nodes)
    match = _match(blade.position[b_index], damper.position[d_index], side, tolerance, shown)
    d_nodes, d_index = d_nodes[match], d_index[match]
    along_axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    both = _normals(blade, side.blade, b_index), _normals(damper, side.damper, d_index)
    frame = contact_frames(_shared_normals(*both, side, b_nodes), along_axis, side)
    position = blade.position[b_index]
    station, row = _grid(position @ along_axis, position @ np.asarray(pull, float), side, tolerance)
    return new_table(
        side,
        (station, row),
        (b_nodes, d_nodes),
        position=position,
        frame=frame,
        gap=np.zeros(len(row)),
    )


def new_table(
    side: Side,
    grid: tuple[np.ndarray, np.ndarray],
    nodes: tuple[np.ndarray, np.ndarray],
    **known: np.ndarray,
) -> ContactTable:
    """Pairs of nodes of blade and damper at stations and rows, in their order, with what is known
    of them; stiffness, friction and preload are 0."""
    (station, row), (blade, damper), P = grid, nodes, len(grid[0])
    return ContactTable(
        side=np.full(P, side.name),
        station=station,
        row=row,
        blade_body=np.full(P, side.blade_body),
        blade_node=blade,
        damper_body=np.full(P, side.damper_body),
        damper_node=damper,
        **dict.fromkeys(("kn", "kt", "mu", "preload"), np.zeros(P)),
        weight=np.ones(P),
        **known,
    ).select(np.lexsort((row, station)))


def _shared_normals(
    on_blade: Sequence[np.ndarray], on_damper: Sequence[np.ndarray], side: Side, number: np.ndarray
) -> np.ndarray:
    """(P, 3); an edge node, which may face two ways, faces as the mean of the side."""
    facing = [
        (mine, theirs, side, node)
        for mine, theirs, node in zip(on_blade, on_damper, number, strict=True)
    ]
    mean = np.mean([_shared_normal(*one) for one in facing], axis=0)
    return np.array([_shared_normal(*one, mean) for one in facing])


def matches(blade: Mesh, damper: Mesh, side: Side, tolerance: float) -> bool:
    """Whether the nodes of the two groups of a side lie at one place each, within `tolerance` m."""
    places = [
        mesh.position[mesh.index(mesh.group(group))]
        for mesh, group in ((blade, side.blade), (damper, side.damper))
    ]
    distance, nearest = cKDTree(places[1]).query(places[0])
    return len(places[0]) == len(places[1]) == len(np.unique(nearest)) and bool(
        (distance <= tolerance).all()
    )


def offsets(pairs: ContactTable, blade: Mesh, damper: Mesh) -> np.ndarray:
    """(P,) m: distance of the two nodes of each pair along the normal; positive where the meshes
    leave a gap, negative where they overlap."""
    apart = (
        blade.position[blade.index(pairs.blade_node)]
        - damper.position[damper.index(pairs.damper_node)]
    )
    return np.einsum("ij,ij->i", apart, pairs.normal)


def join(*tables: ContactTable) -> ContactTable:
    """The tables of all sides as one."""
    return ContactTable(
        **{f.name: np.concatenate([vars(t)[f.name] for t in tables]) for f in fields(ContactTable)}
    )


def _match(
    blade: np.ndarray, damper: np.ndarray, side: Side, tolerance: float, shown: Callable
) -> np.ndarray:
    """For each blade node the index of its damper node."""
    distance, nearest = cKDTree(damper).query(blade)
    back, _ = cKDTree(blade).query(damper)
    unmatched = int((distance > tolerance).sum() + (back > tolerance).sum())
    worst = max(distance.max(), back.max())
    if unmatched or len(np.unique(nearest)) < len(nearest):
        shared = len(nearest) - len(np.unique(nearest))
        advice = "the two surfaces need the same nodes"
        if shared:
            advice = f"{shared} share their nearest partner with another: {advice}"
        elif len(blade) == len(damper):
            advice = f"tolerance = {shown(1.1 * worst)} would match them"
        advice += (
            '; unlike meshes meet as surfaces: [contact] method = "auto" or "surfaces" with '
            "kn_per_area, "
            "kn_total or a model in the place of a stiffness per node"
        )
        raise InputError(
            f"side '{side.name}': {len(blade)} blade nodes in '{side.blade}' and {len(damper)} "
            f"damper nodes in '{side.damper}', {unmatched} without a partner within "
            f"{shown(tolerance)} (largest distance {shown(worst)}); {advice}"
        )
    return nearest


def _normals(mesh: Mesh, group: str, index: np.ndarray) -> list[np.ndarray]:
    """[(m, 3)] outward normals at the nodes `index`: those of the smooth surface of the group's
    faces that hold it, or, where none does, of every boundary face there."""
    blocks = [block for block in faces_of(mesh, group) if len(block)]
    normals = smooth_normals([(block, mesh.position[block]) for block in blocks]) if blocks else []
    own: dict[int, list[np.ndarray]] = {}
    for block, normal in zip(blocks, normals, strict=True):
        unit = normal / np.linalg.norm(normal, axis=2)[:, :, None]
        for node, n in zip(block.ravel().tolist(), unit.reshape(-1, 3), strict=True):
            own.setdefault(node, []).append(n)
    faces = boundary_faces(mesh)
    return [np.array(own[i]) if i in own else node_normals(mesh, i, faces) for i in index.tolist()]


def _shared_normal(
    blade: np.ndarray, damper: np.ndarray, side: Side, number: int, mean: np.ndarray | None = None
) -> np.ndarray:
    """Normal into the blade, from the two faces that oppose each other best (a node may sit on an
    edge); of several that do the one nearest to the mean normal of the side (3,)."""
    if not len(blade) or not len(damper):
        raise InputError(f"side '{side.name}': node {number} is not on the surface of its mesh")
    cosine = blade @ damper.T
    i, j = np.unravel_index(cosine.argmin(), cosine.shape)
    if mean is not None:
        best = np.argwhere(cosine <= cosine[i, j] + SAME)
        i, j = best[first_largest(-blade[best[:, 0]] @ mean)]
    angle = np.degrees(np.arccos(np.clip(-cosine[i, j], -1, 1)))
    if angle > LARGEST_ANGLE:
        raise InputError(
            f"side '{side.name}', blade node {number}: normals of the two faces must oppose each "
            f"other, they are {180 - angle:.0f} degrees apart (180 wanted, {LARGEST_ANGLE:.0f} "
            "allowed off)"
        )
    return -blade[i]


def contact_frames(normals: np.ndarray, axis: np.ndarray, side: Side) -> np.ndarray:
    """(n, 3, 3): rows t1 along the axis (unit vector), t2, n of each normal (n, 3); InputError
    where it is the axis."""
    t1 = axis - normals * (normals @ axis)[:, None]
    length = np.linalg.norm(t1, axis=1)
    if (length < 1e-3).any():
        raise InputError(
            f"side '{side.name}': the damper axis is along a contact normal; state [damper] axis"
        )
    t1 /= length[:, None]
    return np.stack([t1, np.cross(normals, t1), normals], axis=1)


def _grid(
    along: np.ndarray, up: np.ndarray, side: Side, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Station and row of each node. Where stations hold different numbers of nodes, as on the faces
    of 20-node hexahedra, a row is what lies at one height, and the lowest row must be there at
    every station."""
    station = _clusters(along, tolerance)
    rows = np.bincount(station)
    if (rows == rows[0]).all():
        row = np.empty_like(station)
        for s in range(station.max() + 1):
            members = np.flatnonzero(station == s)
            row[members[in_order(up[members])]] = np.arange(len(members))
        return station, row
    row = _clusters(up, tolerance)
    twice = len(np.unique(station * (row.max() + 1) + row)) < len(row)
    if twice or (np.bincount(station[row == 0], minlength=len(rows)) != 1).any():
        odd = int(np.flatnonzero(rows != rows[0])[0])
        raise InputError(
            f"side '{side.name}': station {odd} has {rows[odd]} nodes, station 0 has {rows[0]}, "
            "and they do not lie in rows along the axis; every station needs the lowest row, and "
            "rows apart by more than the tolerance"
        )
    return station, row


def _clusters(values: np.ndarray, tolerance: float) -> np.ndarray:
    order = np.argsort(values)
    step = np.diff(values[order], prepend=values[order[0]]) > tolerance
    label = np.empty(len(values), dtype=np.int64)
    label[order] = np.cumsum(step)
    return label
