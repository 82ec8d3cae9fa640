"""Stage stress: mean and alternating stress of the whole bodies at the peak of the curves of the
largest H."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tipdamp.bodies.loads import rest_load
from tipdamp.bodies.read import BODY_FILES, BODY_READS
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields.visualization import write_shapes
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.ties import SAME, in_order
from tipdamp.modal.mesh import Mesh
from tipdamp.results.response_results import (
    CurveResult,
    PeakStress,
    RespondResult,
    StressPlace,
    StressResult,
    families,
)
from tipdamp.stages.assembly import READS, Assembly, assembled
from tipdamp.stages.cycles import highest_point, motion_of_bodies
from tipdamp.stages.stage import Stage, recorded
from tipdamp.statics.whole_body import (
    Stressed,
    VibrationStress,
    contact_forces,
    whole_bodies,
)
from tipdamp.study.schema import MaterialSection, OtherMaterial
from tipdamp.study.view import Study

LARGEST = 5  # places of each body that are named
# part of the forces at rest that a free body may take up by its inertia without a word
BALANCED = 1e-3


class BodyAtRest(NamedTuple):
    """A body, its displacement (n, 3) m at rest, and the part of the forces on it that is not
    balanced."""

    stressed: Stressed
    shape: np.ndarray
    unbalanced: float

    @property
    def name(self) -> str:
        """Of the body."""
        return self.stressed.whole.body.name


def stress(study: Study, store: Store, tick: Tick) -> list[str]:
    """Fields of every body, and the places of the largest alternating stress, at the peak of blade
    1."""
    assembly = assembled(study, store, responded=True)
    respond = RespondResult.load(store)
    bodies = _at_rest(study, store, assembly, tick)
    cases = families(respond.responses)[-1]
    found = []
    for k, case in enumerate(cases):
        tick(0.9 + 0.1 * k / len(cases), f"Fe = {case.Fe_N:g} N, H = {case.H}")
        curve = ForcedResponse.load(store.path(case.file))
        point = highest_point(case, curve)
        if point is not None:
            q = motion_of_bodies(assembly, curve, point)
            hz = float(curve.frequency[point])
            model = assembly.model
            each = [_vibration(study, one, q[model.body == one.name], hz) for one in bodies]
            found.append(_at_peak(store, case, hz, each))
    unbalanced = {one.name: one.unbalanced for one in bodies if one.stressed.whole.body.free}
    StressResult(
        curves=tuple(found), unbalanced=unbalanced, warnings=tuple(_unbalanced(unbalanced))
    ).save(store)
    return [file for one in found for file in one.files]


class Vibration(NamedTuple):
    """Of a body: its fields, and the safety (n,) by Goodman at its nodes, NaN where not known."""

    body: BodyAtRest
    fields: VibrationStress
    safety: np.ndarray

    def place(self, node: int) -> StressPlace:
        """What is known at the node of an index."""
        mesh = self.body.stressed.on_mesh.mesh
        fields = self.fields
        return StressPlace(
            body=self.body.name,
            node=mesh.node[node],
            position_m=tuple(mesh.position[node]),
            mean_Pa=fields.mean[node],
            alternating_Pa=fields.alternating[node],
            amplitude_m=fields.amplitude[node],
            safety=self.safety[node],
        )


def _vibration(study: Study, one: BodyAtRest, q: np.ndarray, hz: float) -> Vibration:
    fields = one.stressed.vibration(one.shape, q, 2 * np.pi * hz)
    return Vibration(one, fields, goodman(fields, *limits(study, one.stressed.on_mesh.mesh)))


def _at_peak(store: Store, case: CurveResult, hz: float, each: Sequence[Vibration]) -> PeakStress:
    """The places of the largest stress and the least safety; writes vibration_*.vtu."""
    files = list[str]()
    stem = case.file.rpartition("/")[2].removesuffix(".npz")
    places = list[StressPlace]()
    least = list[StressPlace]()
    for one in each:
        mesh = one.body.stressed.on_mesh.mesh
        fields = one.fields
        safety = one.safety
        known = np.isfinite(safety).any()
        shown = {
            "mean von Mises stress (Pa)": fields.mean,
            "alternating stress (Pa)": fields.alternating,
            "displacement amplitude (m)": fields.amplitude,
        }
        shown |= {"safety by Goodman": safety} if known else {}
        files += write_shapes(store, f"vibration_{stem}_{one.body.name}.vtu", mesh, shown)
        places += map(one.place, _tops(mesh, fields))
        least += [one.place(int(np.nanargmin(safety)))] if known else []
    return PeakStress(
        files=tuple(files),
        Fe_N=case.Fe_N,
        H=case.H,
        hz=hz,
        places=tuple(places),
        least=tuple(least),
    )


def _at_rest(study: Study, store: Store, assembly: Assembly, tick: Tick) -> list[BodyAtRest]:
    """The bodies under their loads and the contact forces of the kept pairs at rest."""
    found = whole_bodies(study, store, tick)
    contact = contact_forces([one.whole.body for one in found], assembly.kept, assembly.rest)
    tick(0.85, "the bodies at rest")
    load = rest_load(study)
    return [
        BodyAtRest(one, *one.whole.at_rest(load.on(body) - contact[body.name]))
        for one in found
        for body in [one.whole.body]
    ]


def limits(study: Study, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """(n,) (n,) Pa: fatigue limit and tensile strength at the nodes of a mesh, the lower ones where
    materials meet; NaN where the material of a node has none."""
    found = np.full((2, len(mesh.node)), np.inf)
    rest = {kind: np.ones(len(cells), dtype=bool) for kind, cells in mesh.cells.items()}
    for other in study.materials.values():
        if other.group in mesh.cell_groups:
            for kind, mine in mesh.members(other.group).items():
                _lower(found, mesh.cells[kind][mine], other)
                rest[kind] &= ~mine
    for kind, mine in rest.items():
        _lower(found, mesh.cells[kind][mine], study.material)
    found[np.isinf(found)] = np.nan
    return found[0], found[1]


def _lower(found: np.ndarray, cells: np.ndarray, material: MaterialSection | OtherMaterial) -> None:
    if material.fatigue_limit is not None:
        nodes = np.unique(cells)
        values = material.fatigue_limit, material.tensile_strength
        found[:, nodes] = np.minimum(found[:, nodes], np.array(values)[:, None])


def goodman(
    fields: VibrationStress, fatigue_limit: np.ndarray, tensile_strength: np.ndarray
) -> np.ndarray:
    """(n,) factor on both stresses at which the nodes reach Goodman's line [Goodman 1899]; the mean
    counts as tension wherever it is. NaN without limits."""
    used = fields.alternating / fatigue_limit + fields.mean / tensile_strength
    return 1 / np.maximum(used, np.finfo(float).tiny)


def _tops(mesh: Mesh, fields: VibrationStress) -> np.ndarray:
    """The nodes of the largest alternating stress, of those that no node of an adjacent cell
    surpasses."""
    value = np.nan_to_num(fields.alternating, nan=-1.0)
    around = np.zeros(len(value))
    for cells in mesh.cells.values():
        np.maximum.at(around, cells, value[cells].max(axis=1, keepdims=True))
    tops = np.flatnonzero((value >= around * (1 - SAME)) & (value > 0))
    return tops[in_order(-value[tops])][:LARGEST]


def _unbalanced(parts: dict[str, float]) -> Iterator[str]:
    for body, part in parts.items():
        if part > BALANCED:
            yield (
                f"the forces on the {body} at rest are balanced to {100 * part:.2g} % of their "
                "size only (they are those of the kept pairs): in its mean stress the inertia of "
                "the body takes up the rest"
            )


def line(store: Store) -> str:
    """The largest alternating stress."""
    found = StressResult.load(store).curves
    tops = [(place, one) for one in found for place in one.places]
    if not tops:
        return "no solved point"
    place, one = max(tops, key=lambda top: top[0].alternating_Pa)
    bounds = {(c.Fe_N, c.H) for c in RespondResult.load(store).responses if c.is_bound}
    least = "at least " * ((one.Fe_N, one.H) in bounds)
    return (
        f"alternating up to {least}{1e-6 * place.alternating_Pa:.4g} MPa, mean "
        f"{1e-6 * place.mean_Pa:.4g} MPa there: node {place.node} of the {place.body} (Fe = "
        f"{one.Fe_N:g} N, H = {one.H})"
    )


STAGE = Stage(
    stress,
    line,
    warnings=recorded(StressResult),
    outputs=("stress.json",),
    may_write=("vibration_*.vtu",),
    needs=("reduce", "tune", "respond"),
    requires=("tune", "respond", "respond.levels", "respond.stress"),
    reads=("respond.stress", "loads", "driver", "preload", *BODY_READS, *READS),
    reads_files=BODY_FILES,
)
