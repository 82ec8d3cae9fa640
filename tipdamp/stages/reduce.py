"""Stage reduce: the reduced model and the contact pairs of the whole patch; modes and response
without damper."""

from typing import Any

import numpy as np

from tipdamp.bodies import BLADES
from tipdamp.bodies.free_modes import band, band_warnings, lowest_modes
from tipdamp.bodies.matrices import given_model, size_of
from tipdamp.bodies.read import BODY_FILES, BODY_READS
from tipdamp.bodies.reduce import reduced_model, wants_error
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields.visualization import keep_bodies
from tipdamp.hbm.balance.receptance import linear_response_with_peaks
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import FreeResponse, ReduceResult
from tipdamp.stages.stage import Stage, recorded
from tipdamp.statics.model_inputs import EXCITATION, excitation, in_patch, outputs, ratio
from tipdamp.statics.modes import free_modes
from tipdamp.statics.whole_body import KEPT, keep_modes
from tipdamp.study.view import Study


def reduce(study: Study, store: Store, tick: Tick) -> list[str]:
    """Meshes to a reduced model and the contact pairs of the whole patch; free modes and linear
    response."""
    files: list[str] = []
    if "model" in study:
        model, pairs = given_model(study)
        found: dict[str, Any] = {"reduction": size_of(model)}
    else:
        reduced = reduced_model(study, tick)
        model, pairs = reduced.model, reduced.pairs
        pictures = keep_bodies(store, reduced.meshes, reduced.parts, model)
        files = [*pictures]
        if reduced.truncation is not None:
            with store.writing("truncation.npz") as path:
                reduced.truncation.save(path)
            files.append("truncation.npz")
        if "respond" in study and study.respond.stress:
            files += keep_modes(store, reduced.parts)
        found = {
            "reduction": reduced.size,
            "highest_fixed_interface_hz": reduced.highest_hz,
            "pictures": pictures,
            "side_materials": reduced.materials,
            "pull_positions_m": reduced.pull_positions,
        }
    with store.writing("model.npz") as path:
        model.save(path)
    with store.writing("pairs.csv") as path:
        pairs.save(path)
    rows = {s: int(pairs.row[pairs.side == s].max()) + 1 for s in pairs.sides}
    ReduceResult(rows=rows, **found, **_free(study, model.part(BLADES))).save(store)
    return files


def _free(study: Study, blades: ReducedModel) -> dict[str, Any]:
    """Modes and response without damper, by shape where the study says where to look."""
    if "respond" not in study:
        return {"free_modes_hz": lowest_modes(blades)[0][:10]}
    free = free_modes(study, blades)
    limits = band(study.free.band, free)
    return {
        "free_hz": free.named,
        "free_modes_hz": free.hz,
        "free_response": free_response(study, blades, limits),
        "warnings": [*free.warnings, *band_warnings(limits, free)],
    }


def free_response(study: Study, blades: ReducedModel, limits: tuple[float, float]) -> FreeResponse:
    """Linear response without damper, per newton: largest over each patch.          [Zucca 2016,
    figure 2]"""
    rows = outputs(study, blades)
    force = excitation(study, blades)
    hz, x = linear_response_with_peaks(
        blades, None, force, np.linspace(*limits, 801), ratio(study.free.damping_ratio), rows
    )
    return FreeResponse(
        hz=tuple(hz),
        m_per_N={p: np.abs(x[:, in_patch(rows, p)]).max(axis=1) for p in study.respond.patches},
    )


def line(store: Store) -> str:
    """Size of the model and its free frequencies."""
    found = ReduceResult.load(store)
    modes = ", ".join(f"{name.replace('_', ' ')} {hz:.1f} Hz" for name, hz in found.free_hz.items())
    shapes = sum(found.reduction.contact_shapes.values())
    cells = sum(found.reduction.tractions.values())
    of = f" of tractions on {cells} cells" * bool(cells)
    kept = f"{found.reduction.masters} masters + " + f"{shapes} contact shapes{of} + " * bool(
        shapes
    )
    return (
        f"{found.reduction.dofs} dofs to {kept}{sum(found.reduction.modes.values())} modes; free: "
        + (modes or f"{found.free_modes_hz[0]:.1f} Hz{_unnamed(found)}")
    )


def _unnamed(found: ReduceResult) -> str:
    """Without patches nothing tells modes by their shape."""
    if found.free_response is not None:
        return ""
    return " (which are in and out of phase is told where [respond] names patches and direction)"


def _for_error(study: Study) -> tuple[str, ...]:
    """The contact springs, where a body's modes are chosen by the error of the stuck
    frequencies."""
    return ("driver", "sides", "contact") if wants_error(study) else ()


STAGE = Stage(
    reduce,
    line,
    warnings=recorded(ReduceResult),
    outputs=("model.npz", "pairs.csv", "reduce.json"),
    may_write=("truncation.npz", KEPT, "surface.npz", "free_modes.npz", "free_modes.vtu"),
    reads=("free", "loads", "respond.stress", *EXCITATION, *BODY_READS),
    reads_more=_for_error,
    reads_files=BODY_FILES,
)
