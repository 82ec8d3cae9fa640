"""Curves of a study followed from the other end of its band."""

from tipdamp.hbm.response import follow_band
from tipdamp.stages.assembly import assembled
from tipdamp.stages.curve_facts import held_forces, peak_of
from tipdamp.statics.model_inputs import in_patch


def followed_back(study, store, responses):
    """(curve, Peak on the first patch, forces on what is held) of each of these entries of
    respond.json; without what the way of the curve does not hang on."""
    curves, band = assembled(study, store, responded=True).curves, study.respond.band
    for response in responses:
        curve = follow_band(
            curves.problem,
            response["Fe_N"] * curves.force,
            band[::-1],
            harmonics=response["H"],
            outputs=curves.rows,
            start=curves.start,
            samples=curves.samples,
            peaks=curves.peaks,
            truncation=False,
        )
        first = in_patch(curve.output_names, study.respond.patches[0])
        yield curve, peak_of(curve, first), held_forces(curve, curves.problem.held, first)
