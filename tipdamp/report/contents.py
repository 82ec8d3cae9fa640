"""What the report shows, in its order: a new figure or table is a function of its subject and a
name in this list."""

from tipdamp.report.page import Block, Parts, Section, filled
from tipdamp.report.results import Results
from tipdamp.report.subjects import (
    assumptions,
    backbone,
    bodies,
    damper_motion,
    friction,
    held,
    influence,
    kept,
    key_figures,
    measured,
    modes,
    named_places,
    pairs,
    peaks,
    preload,
    pressure,
    response,
    tuning,
    wear,
)

# (anchor, title, what stands there): each of them yields its blocks, or nothing where the study has
# no data for it
SECTIONS: Parts[Results] = (
    ("figures", "Key figures", (key_figures.key_figures,)),
    ("linear", "Without damper", (modes.free_response,)),
    (
        "preload",
        "Preload",
        (
            preload.stiffness,
            preload.at_rest,
            pressure.scene,
            pressure.line_tables,
            preload.full_model,
            preload.load_cases,
            preload.of_load_cases,
        ),
    ),
    (
        "tuning",
        "Kept contacts",
        (tuning.histories, tuning.equivalent_sets, kept.figure, kept.moments),
    ),
    ("modes", "Mode shapes", (modes.shapes,)),
    (
        "response",
        "Forced response",
        (
            peaks.peaks,
            response.families,
            response.levels,
            response.trend,
            held.table,
            held.figure,
            friction.states,
            influence.figure,
            peaks.stress,
            peaks.safety,
        ),
    ),
    (
        "trust",
        "How far to trust this",
        (peaks.trust, peaks.harmonics, named_places.table),
    ),
    ("backbone", "Nonlinear mode", (backbone.figure, backbone.table)),
    (
        "contacts",
        "Inside the contacts",
        (
            friction.energies,
            friction.friction_work,
            wear.figure,
            damper_motion.figure,
            friction.hysteresis,
        ),
    ),
    ("measured", "Measured and computed", (measured.tables, measured.fitted, measured.figure)),
    ("pairs", "Contact pairs", (pairs.scene,)),
    ("assumptions", "Assumptions", (assumptions.assumptions,)),
    ("reduction", "Reduced and full model", (key_figures.reduction_check,)),
    ("made", "Provenance", (bodies.provenance,)),
)


def contents(results: Results) -> list[Section[Block]]:
    """The sections that have something to show."""
    return filled(SECTIONS, results)
