"""Curves of a study followed from the other end of its band."""

from tipdamp.engine.curves import CurveCase
from tipdamp.hbm.curve.journal import Journal
from tipdamp.stages.curve_facts import held_forces, peak_of
from tipdamp.stages.respond import assembled
from tipdamp.statics.model_inputs import in_patch


def followed_back(study, store, responses):
    """(curve, Peak on the first patch, forces on what is held) of each of these entries of
    respond.json."""
    curves, band = assembled(study, store, responded=True).curves, study.respond.band
    for response in responses:
        case = CurveCase(response["Fe_N"], response["H"], band[::-1])
        curve = curves._followed(case, lambda *_: None, Journal([].append))
        first = in_patch(curve.output_names, study.respond.patches[0])
        yield curve, peak_of(curve, first), held_forces(curve, curves.problem.held, first)
