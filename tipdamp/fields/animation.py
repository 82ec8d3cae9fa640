"""One period of the bodies at a peak, as a series of .vtu with its .pvd for ParaView: surfaces that
move, and the contacts with what they do in colour."""

from collections.abc import Mapping, Sequence
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from tipdamp.engine.store import Store
from tipdamp.fields.surface import OuterSurface
from tipdamp.fields.visualization import write_cells
from tipdamp.hbm import fourier
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.curve.cycles import ContactCycles

FRAMES = 24
BODY, STICK, SLIP, GAP = -1, 0, 1, 2  # values of 'state'
MOVES = 1e-9  # of its way in the period: how far a slider must move between two instants to slip


def keep_motion(
    store: Store,
    stem: str,
    surfaces: Mapping[str, OuterSurface],
    motion: Mapping[str, np.ndarray],
    contact: tuple[ContactTable, ContactCycles],
) -> list[str]:
    """motion_STEM.pvd and its frames; the names of what was written, none without surfaces or
    meshio.

    motion - {body: (r, H+1) m}, Fourier coefficients of the reduced dofs of each body; contact -
    the pairs that carry, which move with the last body, and their period"""
    pairs, cycle = contact
    state = states(cycle.force, cycle.sliders, cycle.components)
    near = nearest(list(surfaces.values())[-1], pairs.position)
    files: list[str] = []
    for k in range(FRAMES):
        share = k / FRAMES
        moved = [one.displacement(_at(motion[body], share)) for body, one in surfaces.items()]
        now = state[round(share * len(state)) % len(state)]
        data = {
            "displacement (m)": np.concatenate([*moved, moved[-1][near]]),
            "state": np.concatenate([np.full(sum(map(len, moved)), BODY), now]),
        }
        files += _frame(store, f"motion_{stem}_{k:02d}.vtu", surfaces, pairs.position, data)
    if not files:
        return []
    with store.writing(f"motion_{stem}.pvd") as path:
        path.write_text(_series(files, cycle.time[-1]), encoding="utf-8")
    return [f"motion_{stem}.pvd", *files]


def states(force: np.ndarray, sliders: np.ndarray, components: Sequence[str]) -> np.ndarray:
    """(n, P) STICK, SLIP or GAP from each instant of a period to the next, of contacts with these
    force (n+1, P, nd) and sliders (n+1, P, s)."""
    found = np.full(force.shape[:2], STICK)[:-1]
    if sliders.shape[2]:
        way = np.linalg.norm(np.diff(sliders, axis=0), axis=2)
        found[way > MOVES * np.maximum(way.sum(axis=0), np.finfo(float).tiny)] = SLIP
    if "n" in components:
        found[force[:-1, :, components.index("n")] <= 0] = GAP
    return found


def _at(X: np.ndarray, share: float) -> np.ndarray:
    tau = np.array([2 * np.pi * share])
    return (fourier.basis(tau, X.shape[1] - 1) @ fourier.to_real(X).T)[0]


def nearest(surface: OuterSurface, places: np.ndarray) -> np.ndarray:
    """(P,) index of the node of a surface that is closest to each place (P, 3)."""
    return np.array([np.linalg.norm(surface.position - one, axis=1).argmin() for one in places])


def _frame(
    store: Store, name: str, surfaces: Mapping[str, OuterSurface], places: np.ndarray, data: dict
) -> Any:
    start = np.cumsum([0, *(len(one.node) for one in surfaces.values())])
    triangles = [one.triangles + k for one, k in zip(surfaces.values(), start, strict=False)]
    points = np.concatenate([*(one.position for one in surfaces.values()), places])
    contacts = np.arange(start[-1], len(points))[:, None]
    cells = [("triangle", np.concatenate(triangles)), ("vertex", contacts)]
    return write_cells(store, name, points, cells, data)


def _series(files: Sequence[str], period: float) -> str:
    frames = "\n".join(
        f'  <DataSet timestep="{period * k / len(files):.9g}" part="0" file={quoteattr(file)}/>'
        for k, file in enumerate(files)
    )
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n <Collection>\n'
        f"{frames}\n </Collection>\n</VTKFile>\n"
    )
