"""Rows of the validation pages for H1: stuck frequencies of the lumped two-blade rig, and its tuning."""

from static_contact.detachment import StuckAssembly, detach_until
from tests.static_contact.test_h1_lumped_rig import H1, P, lumped_rig, out_of_phase, pairs_of, rows, stations
from tests.validation import Section, relative


def frequency_rows():
    """Elastic modes of every set of kept pairs; how many rigid ones each has; the target that can be met."""
    model = lumped_rig()
    for case in H1["results"]:
        found = StuckAssembly(model, rows).modes(pairs_of(stations(case["set"])), out_of_phase(model))
        for k, (ours, told) in enumerate(zip(found.hz, case["f"], strict=False), start=1):
            if told > 1:
                yield f"{case['set']}, mode {k}, Hz", "", float(ours), told, relative(ours, told), "table"
        rigid = int((found.hz[:8] < 1).sum())
        told = case["rigid_modes"]
        yield f"{case['set']}, rigid modes", "", rigid, told, float(abs(rigid - told)), "number of rigid modes"
    target = H1["tuning_targets"]["2300.0"]["f"]
    ours = detach_until(StuckAssembly(model, rows), pairs_of(range(P["n"])), 2300.0, out_of_phase(model)).chosen.hz
    yield "tuned to 2300 Hz", "", float(ours), target, relative(ours, target), "table"


SECTIONS = (
    Section("h", "H: stuck frequencies of a lumped rig", "Hz, for lists of carrying pairs, and the tuning to a target. "
            "Source: tests/reference/statics/H1.", frequency_rows, {"table": 1e-6, "number of rigid modes": 0.0}),)
