"""Stuck frequencies of a lumped two-blade rig for every set of kept pairs, and the tuning to a
target."""

from tests.static_contact.tuning.test_station_detachment import (
    H1,
    P,
    lumped_rig,
    motion,
    out_of_phase,
    pairs_of,
    stations,
)
from tests.validation import Subject, row
from tipdamp.static_contact.tuning.station_detachment import detach_until
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly


def rows():
    model = lumped_rig()
    for case in H1["results"]:
        found = StuckAssembly(model, motion).modes(
            pairs_of(stations(case["set"])), out_of_phase(model)
        )
        for k, (ours, told) in enumerate(zip(found.hz, case["f"], strict=False), start=1):
            if told > 1:
                yield row(f"{case['set']}, mode {k}, Hz", ours, told, "table")
        yield row(
            f"{case['set']}, rigid modes",
            int((found.hz[:8] < 1).sum()),
            case["rigid_modes"],
            "rigid modes",
            1,
        )
    target = H1["tuning_targets"]["2300.0"]["f"]
    found = detach_until(
        StuckAssembly(model, motion), pairs_of(range(P["n"])), 2300.0, out_of_phase(model)
    )
    even = min(
        (s for s in found.history if s.front - s.back in (0, 1)), key=lambda s: abs(s.hz - 2300.0)
    )
    yield row("even ends tuned to 2300 Hz", even.hz, target, "table")


SUBJECT = Subject(
    "Stuck frequencies of a lumped rig",
    "Hz, for lists of carrying pairs, and the tuning to a target. "
    "Source: tests/reference/statics/H1.",
    rows,
    {"table": 1e-6, "rigid modes": 0.0},
)
