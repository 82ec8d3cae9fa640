"""The reduced model of a study: Craig-Bampton models of blades and damper side by side, loads
condensed onto them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tipdamp.bodies import BLADES, CHECK_BELOW_HZ, DAMPER, loads
from tipdamp.bodies.assemble import (
    assemble_bodies,
    master_nodes,
    shape_counts,
    tractions_on,
    with_points,
)
from tipdamp.bodies.pair import matched
from tipdamp.bodies.pieces import check_pieces
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.stiffness import side_materials, with_values
from tipdamp.engine.progress import Tick
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body
from tipdamp.modal.contact_shapes import holding_nodes
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.reduction import Reduction as BodyReduction
from tipdamp.modal.truncation import Truncation, join
from tipdamp.results.static_results import ReductionFacts
from tipdamp.static_contact.tuning.reduction_error import enough_modes, own_error
from tipdamp.study.schema import Blades, Damper
from tipdamp.study.view import Study

FIRST_CUT_HZ = 4 * CHECK_BELOW_HZ  # modes up to here at first, where an error is asked for
LAST_CUT_HZ = 1e6


@dataclass(frozen=True)
class ReducedBodies:
    """model - both bodies side by side; pairs - the whole patch; parts - (blades, damper)
    reductions; truncation - what they left out, None where it is not known; materials {side: E, nu,
    E, nu} where a model makes the stiffness pull_positions - m."""

    model: ReducedModel
    pairs: ContactTable
    meshes: dict[str, Mesh]
    parts: tuple[BodyReduction, BodyReduction]
    truncation: Truncation | None
    materials: dict
    pull_positions: list[float]

    @property
    def size(self) -> ReductionFacts:
        """Numbers of dofs and modes."""
        return ReductionFacts(
            dofs=sum(p.body.dofs for p in self.parts),
            masters=sum(len(p.boundary) for p in self.parts),
            modes={p.body.name: len(p.mode_omega) for p in self.parts},
            load_modes={p.body.name: p.load_modes for p in self.parts},
            contact_shapes={p.body.name: p.contact_shapes for p in self.parts},
            tractions={
                p.body.name: p.tractions.shape[1]
                for p in self.parts
                if p.contact_shapes and p.tractions is not None
            },
        )

    @property
    def highest_hz(self) -> dict[str, float]:
        """{body: highest fixed-interface frequency kept}"""
        return {p.body.name: p.mode_omega.max(initial=0) / (2 * np.pi) for p in self.parts}


def wants_error(study: Study) -> bool:
    """Whether a body's modes are chosen by the error of the stuck frequencies."""
    return "model" not in study and bool(study.blades.error or study.damper.error)


def reduced_model(study: Study, tick: Tick) -> ReducedBodies:
    """Meshes to the reduced model; load cases and pairs are checked before anything is
    assembled."""
    meshes = read_meshes(study)
    loads.check(study, meshes)
    pairs, points = matched(study, meshes)
    masters = master_nodes(study, meshes, pairs)
    bodies = assemble_bodies(study, meshes, tick, shape_counts(study, pairs, masters), points)
    bodies = loads.with_loads(study, bodies, meshes)
    check_pieces(meshes, bodies, pairs)
    masters |= {body.name: holding_nodes(body) for body in bodies if not len(masters[body.name])}
    bodies = [with_points(body, pairs, masters[body.name]) for body in bodies]
    side_moduli = side_materials(study, meshes, pairs)
    springs = with_values(study, pairs, side_moduli) if wants_error(study) else pairs
    parts = reduce_bodies(study, bodies, masters, springs, tick)
    for part in parts:
        for case, force in part.body.loads.items():
            part.model.loads[case] = part.condense_dofs(force)
    blades, damper = parts
    left_out = [part.truncation for part in parts if part.truncation is not None]
    return ReducedBodies(
        assemble(blades.model, damper.model),
        pairs,
        meshes,
        (blades, damper),
        join(*left_out) if len(left_out) == len(parts) else None,
        side_moduli,
        loads.unit_pull(study, damper.body, meshes[DAMPER]).along_axis,
    )


def reduce_bodies(
    study: Study, bodies: list[Body], masters: dict, pairs: ContactTable, tick: Tick
) -> list[BodyReduction]:
    """Reductions with the modes that the study asks for: a number, all below a frequency, or enough
    for an error; and the static shapes of the bodies' loads where it asks for them."""
    settings: dict[str, Blades | Damper] = {BLADES: study.blades, DAMPER: study.damper}

    def reduced(body: Body, cut_hz: float | None) -> BodyReduction:
        given, cells = settings[body.name], tractions_on(study, body, pairs)
        below = cut_hz or given.modes_below_hz
        return craig_bampton(
            body,
            masters[body.name],
            None if below else given.modes,
            below_hz=below,
            loads=list(body.loads.values()) if given.load_modes else (),
            tractions=cells,
            # of tractions it bounds no frequency, but counts modes
            bound=cells is None or wants_error(study),
        )

    targets = [settings[body.name].error for body in bodies]
    parts = []
    for body, target, share in zip(bodies, targets, (0.15, 0.75), strict=True):
        tick(share, f"reducing the {body.name}, {body.dofs} dofs")
        parts.append(reduced(body, FIRST_CUT_HZ if target else None))
    for i, target in enumerate(targets):
        cut = FIRST_CUT_HZ
        while target and _error(parts, i, pairs) > target and cut < LAST_CUT_HZ:
            cut *= 2
            tick(0.85, f"{bodies[i].name}: modes up to {cut:g} Hz")
            parts[i] = reduced(bodies[i], cut)
    counts = enough_modes(parts, targets, pairs, CHECK_BELOW_HZ)
    return [
        part.fewer(n) if part.truncation else part for part, n in zip(parts, counts, strict=True)
    ]


def _error(parts: Sequence[BodyReduction], i: int, pairs: ContactTable) -> float:
    """Of the stuck frequencies, by all modes of one of the bodies."""
    return own_error(parts, i, len(parts[i].mode_omega), pairs, CHECK_BELOW_HZ)
