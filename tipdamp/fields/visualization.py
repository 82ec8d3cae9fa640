"""What the stages keep to be looked at: surfaces, mode shapes and preload, for the report and as
.vtu for ParaView.

The .vtu files are written by meshio and left out where it is missing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from tipdamp.engine.store import Store
from tipdamp.fields import surface
from tipdamp.fields.line_contact import LineContact, shown_patches
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.reduction import Reduction
from tipdamp.static_contact.tuning.stuck_assembly import StuckModes

# straight cells through the corners: every viewer draws them, and the shapes are at the user's own
# nodes
_CORNERS = {"tetra": 4, "wedge": 6, "hexahedron": 8}
SHOWN = 6  # lowest modes of each kind
ELASTIC = 1e-3  # of the first elastic frequency: below, a mode is a rigid motion


@dataclass(frozen=True)
class Shapes:
    """Modes on the reduced dofs. kind, label : (m,) str; hz : (m,); q : (r, m), 0 on bodies that do
    not take part."""

    kind: np.ndarray
    label: np.ndarray
    hz: np.ndarray
    q: np.ndarray

    def save(self, path: Path) -> None:
        """As .npz."""
        save_npz(path, kind=self.kind, label=self.label, hz=self.hz, q=self.q)

    @classmethod
    def load(cls, path: Path) -> "Shapes":
        """From .npz."""
        with open_npz(path) as z:
            return cls(z["kind"], z["label"], z["hz"], z["q"])


# ---- kept by the stages --------------------------------------------------------------------------


def keep_bodies(
    store: Store, meshes: Mapping[str, Mesh], reductions: Sequence[Reduction], model: ReducedModel
) -> list[str]:
    """surface.npz, free_modes.npz and free_modes.vtu of the bodies by themselves; the names of what
    was written."""
    with store.writing("surface.npz") as path:
        surface.save([surface.skin(meshes[r.body.name], r.body.name, r) for r in reductions], path)
    kinds, q = [], []
    hz: list[float] = []
    for reduction in reductions:
        name = reduction.body.name
        found, shapes = free_shapes(reduction.model)
        kinds += [f"{name} by themselves" if name.endswith("s") else f"{name} by itself"] * len(
            found
        )
        hz += map(float, found)
        whole = np.zeros((model.size, len(found)))
        whole[model.body == name] = shapes
        q.append(whole)
    labels = [f"{value:.1f} Hz" for value in hz]
    with store.writing("free_modes.npz") as path:
        Shapes(np.array(kinds), np.array(labels), np.array(hz), np.hstack(q)).save(path)
    return ["surface.npz", "free_modes.npz", *_free_vtu(store, meshes, reductions[0])]


def _free_vtu(store: Store, meshes: Mapping[str, Mesh], reduction: Reduction) -> list[str]:
    """free_modes.vtu: the lowest modes of the blades without damper, on their mesh."""
    hz, q = free_shapes(reduction.model)
    shapes = {f"mode {i + 1}, {hz[i]:.1f} Hz": reduction.recover(q[:, i]) for i in range(len(hz))}
    return write_shapes(store, "free_modes.vtu", meshes[reduction.body.name], shapes)


def free_shapes(model: ReducedModel) -> tuple[np.ndarray, np.ndarray]:
    """Hz (m,) and shapes (r, m) of the lowest modes of a model, without its rigid motions."""
    lam, q = eigh(model.K, model.M, subset_by_index=(0, min(SHOWN + 6, model.size) - 1))
    hz = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    elastic = np.flatnonzero(hz > ELASTIC * hz[-1])[:SHOWN]
    return hz[elastic], q[:, elastic]


def keep_stuck(store: Store, model: ReducedModel, stuck: Mapping[str, StuckModes]) -> list[str]:
    """stuck_modes.npz of {words for the set: StuckModes}, and .vtu where the surfaces are known:
    the lowest modes of each set and the tracked one."""
    kind = []
    label = []
    hz = []
    q = []
    for words, modes in stuck.items():
        for i in sorted({*range(min(SHOWN, len(modes.hz))), modes.tracked}):
            kind.append(words)
            label.append(
                f"{modes.hz[i]:.1f} Hz" + (", the tracked mode" if i == modes.tracked else "")
            )
            hz.append(modes.hz[i])
            q.append(modes.shapes[:, i])
    shapes = Shapes(np.array(kind), np.array(label), np.array(hz), np.column_stack(q))
    with store.writing("stuck_modes.npz") as path:
        shapes.save(path)
    return ["stuck_modes.npz", *_stuck_vtu(store, model, shapes)]


def _stuck_vtu(store: Store, model: ReducedModel, shapes: Shapes) -> list[str]:
    """stuck_modes.vtu: the surfaces of all bodies with a vector for each mode."""
    if not store.path("surface.npz").is_file():
        return []
    parts = list(surface.load(store.path("surface.npz")).values())
    start = np.cumsum([0, *(len(s.node) for s in parts)])
    cells = [
        ("triangle", np.concatenate([s.triangles + k for s, k in zip(parts, start, strict=False)]))
    ]
    data = {
        "node": np.concatenate([s.node for s in parts]),
        "body": np.repeat(np.arange(len(parts)), [len(s.node) for s in parts]),
    }
    for kind, label, q in zip(shapes.kind, shapes.label, shapes.q.T, strict=True):
        data[f"{kind}, {label}"] = np.concatenate(
            [s.displacement(q[model.body == s.body]) for s in parts]
        )
    return write_cells(
        store, "stuck_modes.vtu", np.concatenate([s.position for s in parts]), cells, data
    )


def keep_preload(
    store: Store,
    tables: Mapping[str, ContactTable],
    hard: bool,
    lines: Sequence[LineContact] = (),
) -> list[str]:
    """preload.vtu: the contact between the pairs with preload and pressure of each {load case:
    ContactTable}; hard - the preload is that of pairs without springs; lines - sides that are in
    contact along a line, whose stations have force per length."""
    first = next(iter(tables.values()))
    sides = shown_patches(first, hard, lines)
    cells = [("triangle" if p.is_area else "line", p.rows[p.cells]) for p in sides]
    number = np.array([first.sides.index(s) for s in first.side])
    data = {
        "side": number,
        "station": first.station,
        "row": first.row,
        "blade node": first.blade_node,
        "damper node": first.damper_node,
        "n": first.normal,
    }
    for case, table in tables.items():
        data[f"preload (N), {case}"] = table.preload
        for unit in dict.fromkeys(p.unit for p in sides):
            what = "pressure" if unit == "N/mm²" else "force per length"
            values = np.zeros(len(table))
            for p in sides:
                if p.unit == unit:
                    values[p.rows] = p.load(table.preload)
            data[f"{what} ({unit.replace('²', '2')}), {case}"] = values
    return write_cells(store, "preload.vtu", first.position, cells, data) if cells else []


# ---- .vtu ----------------------------------------------------------------------------------------


def write_shapes(
    store: Store, name: str, mesh: Mesh, shapes: Mapping[str, np.ndarray]
) -> list[str]:
    """The cells of a mesh and, at its nodes, the numbers of the user and vectors {name: (n, 3)};
    the name of the file, or nothing where meshio is not installed."""
    blocks = [(kind.rstrip("0123456789"), cells) for kind, cells in mesh.cells.items()]
    straight = [(kind, cells[:, : _CORNERS[kind]]) for kind, cells in blocks]
    used = np.unique(np.concatenate([cells.ravel() for _, cells in straight]))
    return write_cells(
        store,
        name,
        mesh.position[used],
        [(kind, np.searchsorted(used, cells)) for kind, cells in straight],
        {"node": mesh.node[used], **{what: shape[used] for what, shape in shapes.items()}},
    )


def write_cells(
    store: Store,
    name: str,
    position: np.ndarray,
    cells: Sequence[tuple[str, np.ndarray]],
    data: Mapping[str, np.ndarray],
) -> list[str]:
    """A .vtu of cells [(type, (c, k) rows of the points)] at points (n, 3) with their data; the
    name of the file, or nothing where meshio is not installed."""
    if find_spec("meshio") is None:
        return []
    import meshio

    with store.writing(name) as path:
        meshio.write(path, meshio.Mesh(position, cells, point_data=data), file_format="vtu")
    return [name]
