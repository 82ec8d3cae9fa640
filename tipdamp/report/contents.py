"""What the report shows, in its order: a new figure or table is a file of its own and a name in
this list."""

from collections.abc import Callable, Iterator

from tipdamp.report.figures import (
    contact_pairs,
    contact_states,
    detachment,
    free_response,
    friction_work,
    held,
    hysteresis,
    kept_area,
    kept_preload,
    measured,
    mode_shapes,
    peak_trend,
    preload_map,
    pressure,
    response_family,
    response_levels,
)
from tipdamp.report.page import Block, Section
from tipdamp.report.results import Results
from tipdamp.report.tables import (
    agreement,
    assumptions,
    contact_stiffness,
    energies,
    full_preload,
    harmonics,
    kept_moment,
    kept_sets,
    key_figures,
    line_contact,
    load_cases,
    peaks,
    provenance,
    reduction_check,
    stress,
    trust,
)
from tipdamp.report.tables import held as held_table

# (anchor, title, what stands there): each of them yields its blocks, or nothing where the study has
# no data for it
SECTIONS: tuple[tuple[str, str, tuple[Callable[[Results], Iterator[Block]], ...]], ...] = (
    ("figures", "Key figures", (key_figures.tables,)),
    ("linear", "Without damper", (free_response.figures,)),
    (
        "preload",
        "Preload",
        (
            contact_stiffness.tables,
            preload_map.figures,
            pressure.figures,
            line_contact.tables,
            full_preload.tables,
            load_cases.tables,
            preload_map.load_case_figures,
        ),
    ),
    (
        "tuning",
        "Kept contacts",
        (
            detachment.figures,
            kept_area.figures,
            kept_sets.tables,
            kept_preload.figures,
            kept_moment.tables,
        ),
    ),
    ("modes", "Mode shapes", (mode_shapes.figures,)),
    (
        "response",
        "Forced response",
        (
            peaks.tables,
            trust.tables,
            harmonics.tables,
            response_family.figures,
            response_levels.figures,
            peak_trend.figures,
            held_table.tables,
            held.figures,
            contact_states.figures,
            stress.tables,
        ),
    ),
    (
        "contacts",
        "Inside the contacts",
        (energies.tables, friction_work.figures, hysteresis.figures),
    ),
    ("measured", "Measured and computed", (agreement.tables, measured.figures)),
    ("pairs", "Contact pairs", (contact_pairs.figures,)),
    ("assumptions", "Assumptions", (assumptions.tables,)),
    ("reduction", "Reduced and full model", (reduction_check.tables,)),
    ("made", "Provenance", (provenance.tables,)),
)


def contents(results: Results) -> list[Section[Block]]:
    """The sections that have something to show."""
    found = [
        Section(name, title, [block for part in parts for block in part(results)])
        for name, title, parts in SECTIONS
    ]
    return [section for section in found if section.blocks]
