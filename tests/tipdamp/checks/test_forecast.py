"""The forecast: order of magnitude of measured runs, growth with what makes a study large, and
advice."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.checks.test_sizes import SIDE
from tests.tipdamp.rig_study import read
from tipdamp.checks import law_cost
from tipdamp.checks.forecast import Cost, advice, estimate, forecast
from tipdamp.checks.machine import COMMON, Machine, measured
from tipdamp.checks.sizes import Size, size_of
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.results.static_results import InspectResult
from tipdamp.study.own_law import code_allowed
from tipdamp.study.study import load_study

DAHL = Path(__file__).parents[3] / "docs" / "studies" / "own_law" / "dahl.py"
# the wedge under platforms, 51 pairs a side: 4 s for reduce were measured; and the same with 518
# pairs
SMALL = Size({"blades": (9513, 360, 40), "damper": (2604, 306, 20)}, 102, (1,) * 6)
LARGE = Size({"blades": (43000, 1605, 40), "damper": (12000, 1605, 20)}, 518, (1,) * 6)


def test_many_pairs_are_warned_of():
    """518 pairs: hours of forced response should all of them slip, and what helps; a small study is
    passed."""
    costs = forecast(LARGE, COMMON)
    said = list(advice(LARGE, costs))
    assert any(
        "respond is estimated to take" in one and "coarsen the meshes" in one for one in said
    )
    assert costs["respond"].at_most > 3600 > 60 > forecast(SMALL, COMMON)["reduce"].seconds
    assert 0.5 < forecast(SMALL, COMMON)["reduce"].seconds < 40
    assert list(advice(SMALL, forecast(SMALL, COMMON))) == []


def test_stress_costs_by_its_levels():
    """The rig of 70 mm took 25 s of one core for the stress at four levels, most of it for the
    range at each node; a study that does not ask for it has no such stage."""
    rig = Size({"blades": (42501, 531, 40), "damper": (11997, 60, 20)}, 102, (3,) * 4, stressed=4)
    cost = forecast(rig, COMMON)["stress"]
    assert 25 / 3 < cost.seconds < 3 * 25
    assert cost.bytes == forecast(replace(rig, stressed=1), COMMON)["stress"].bytes > 1e8
    assert "stress" not in forecast(replace(rig, stressed=0), COMMON)


def test_a_reduced_interface_costs_less():
    """64 pairs that are followed instead of 518: half of the time as long as these are the ones
    that slip, and the advice does not name it again. All pairs can slip as before: the bound is the
    same."""
    few, all_of_them = (
        forecast(size, COMMON)["respond"]
        for size in (Size(**{**vars(LARGE), "followed": 64}), LARGE)
    )
    assert few.seconds < 0.6 * all_of_them.seconds and few.bytes < all_of_them.bytes
    assert few.at_most == all_of_them.at_most and few.bytes_at_most == all_of_them.bytes_at_most
    followed = Size(**{**vars(LARGE), "followed": 64})
    assert any('interface = "reduced"' in one for one in advice(LARGE, forecast(LARGE, COMMON)))
    assert not any(
        'interface = "reduced"' in one for one in advice(followed, forecast(followed, COMMON))
    )


def test_every_kept_pair_may_slip_in_every_worker(monkeypatch):
    """1092 kept of 2220 points, 64 followed, H = 3, two curves side by side: 8.2 and 7.8 GB were
    measured where two of three components became active, 0.1 GB were said."""
    size = Size(
        {"blades": (70000, 600, 40), "damper": (70000, 600, 20)},
        2220,
        (3,) * 4,
        followed=64,
        kept=1092 / 2220,
        jobs=2,
    )
    cost = forecast(size, COMMON)["respond"]
    assert 16.0e9 < cost.bytes_at_most * (2083 / 3276) ** 2 < 20e9 and cost.bytes < 1e9
    one = forecast(Size(**{**vars(size), "jobs": 1}), COMMON)["respond"]
    assert cost.bytes_at_most / one.bytes_at_most == pytest.approx(2, rel=0.02)
    assert re.search(r"GB \(should all pairs slip: .* h .*, 4\d\.\d GB\)", cost.text)
    monkeypatch.setattr("tipdamp.checks.forecast.available_bytes", lambda: 24e9)
    [said] = [text for text in advice(size, {"respond": cost}) if "may need" in text]
    assert re.search(
        r"respond may need 4\d.* should all kept pairs slip, 24.0 GB .*, or --jobs below 2", said
    )


@pytest.mark.parametrize(
    "unlike, contact, told",
    [
        (
            False,
            "",
            r"518 pairs make 3210 masters and contact shapes: \[contact\] reduction = "
            r".contact_points. and "
            "tractions = 200 makes them",
        ),
        (
            True,
            "",
            r"518 pairs make 3210 masters and contact shapes: \[contact\] tractions = 200 makes "
            r"them",
        ),
        (True, "tractions = 150", r"lower \[contact\] tractions, 150 cells a body now"),
    ],
)
def test_what_makes_many_pairs_fewer(tmp_path, unlike, contact, told):
    """Six dofs for each pair of nodes become cells by way of contact points; those of surfaces are
    such already."""
    study = load_study(corner_study.write(tmp_path, change=[("mu = 0.3", f"mu = 0.3\n{contact}")]))
    own = {"pairs": 259, "stations": 1, "rows": 1, "area_m2": 1.0 if unlike else None}
    side = {**SIDE, **own}
    found = InspectResult(
        bodies={"blades": {"free_dofs": 43000}, "damper": {"free_dofs": 12000}},
        pairs={"one": 259, "two": 259},
        columns={"blades": 1605, "damper": 1605},
        pair_checks={"one": side, "two": side},
        tractions={"blades": 150, "damper": 150} if contact else {},
    )
    size = size_of(study, found)
    assert re.search(told, size.fewer) and size.unreduced == bool(contact)


def test_many_stations_are_many_sets():
    """151 stations of 9 points: half of their square is tried, one factor of the modes each; by
    area it is a dozen."""
    size = Size(
        {"blades": (68000, 636, 40), "damper": (225000, 609, 20)},
        2700,
        (),
        unreduced=True,
        sets=151**2 // 2,
    )
    costs = forecast(size, COMMON)
    less = forecast(Size(**{**vars(size), "sets": 0}), COMMON)["tune"].seconds
    assert costs["tune"].seconds - less == pytest.approx(
        151**2 // 2 * 2 / 3 * 1305**3 / COMMON.flops
    )
    assert any("tune" in one and 'by = "area" tries' in one for one in advice(size, costs))


def test_a_preload_on_all_dofs_costs_factors():
    """Of 2700 pairs: a reduced model with shapes of each would be larger by far, and the pairs are
    a dense matrix."""
    points = Size({"blades": (68000, 8100, 40), "damper": (225000, 8100, 20)}, 2700, ())
    cells = Size(
        {"blades": (68000, 636, 40), "damper": (225000, 609, 20)}, 2700, (), unreduced=True
    )
    one, other = (forecast(size, COMMON) for size in (points, cells))
    assert (
        other["reduce"].seconds < one["reduce"].seconds / 20
        and other["reduce"].bytes < one["reduce"].bytes / 5
    )
    few = Size(**{**vars(cells), "pairs": 500})
    assert 20 < forecast(few, COMMON)["preload"].seconds < other["preload"].seconds
    assert other["preload"].bytes - forecast(few, COMMON)["preload"].bytes == 24 * (
        2700**2 - 500**2
    )


def test_memory_is_warned_of():
    need = {"reduce": Cost(1.0, 1e16)}
    assert "reduce is estimated to need 10000000.0 GB" in next(advice(LARGE, need))


@pytest.mark.parametrize(
    "more, stage, factor",
    [
        ({"pairs": 1036}, "respond", 7.8),
        ({"curves": (3,) * 6}, "respond", 3.5),
        ({"curves": (1,) * 12}, "respond", 1.9),
        ({"bodies": {"blades": (86000, 1605, 40), "damper": (24000, 1605, 20)}}, "reduce", 1.9),
    ],
)
def test_more_costs_more(more, stage, factor):
    """Solutions by factors grow with the cube of 2 (2 H + 1) a slipping pair, by iterations with
    the cube of the pairs alone and with H; multipliers know no H."""
    size = replace(LARGE, stability="none")
    one, other = (forecast(each, COMMON)[stage] for each in (size, replace(size, **more)))
    assert (
        max(other.at_most, other.seconds) > factor * max(one.at_most, one.seconds)
        and other.bytes >= one.bytes
    )


def test_what_acts_is_counted_where_it_is_known():
    """50 and 400 of 518 pairs at two levels, in place of four in five at both."""
    size = replace(LARGE, curves=(3, 3))
    known = [forecast(replace(size, acting=n), COMMON)["respond"] for n in ((50, 400), (50, 50))]
    assert known[0].seconds > 20 * known[1].seconds
    assert known[0].at_most == known[1].at_most == forecast(size, COMMON)["respond"].at_most
    assert known[1].seconds < known[0].seconds < forecast(size, COMMON)["respond"].seconds


def test_a_slower_machine_takes_longer():
    slow = Machine(COMMON.factor * 10, COMMON.solve * 10, COMMON.flops / 10)
    for stage, cost in forecast(LARGE, slow).items():
        assert cost.seconds > 5 * forecast(LARGE, COMMON)[stage].seconds


def test_the_yardstick_is_a_machine():
    found = measured()
    assert found.factor > 0 and found.solve > 0 and found.flops > 1e7 and found.dofs == 3 * 15**3


def test_inspect_says_it(tmp_path, capsys):
    """A line of all stages; the sizes are in inspect.json: 9 + 9 pairs, 18 nodes on the blades and
    15 on the damper, since the cube's two faces share an edge."""
    study = corner_study.write(tmp_path)
    assert main(["inspect", str(study), "--quiet"]) == 0
    out = capsys.readouterr().out
    assert (
        "estimate: reduce about " in out
        and "; respond about " in out
        and "is estimated to" not in out
    )
    columns = read(tmp_path / "results" / "corner", "inspect.json")["columns"]
    assert columns == {"blades": 54, "damper": 45}
    size, costs = estimate(
        load_study(study), InspectResult.load(Store(tmp_path / "results" / "corner"))
    )
    assert (
        size.pairs == 18
        and size.curves == (3, 15)
        and size.outputs == 18
        and set(costs) == {"reduce", "preload", "tune", "respond"}
    )
    assert np.isfinite([cost.seconds for cost in costs.values()]).all() and size.reduced == 99 + 8


def test_a_law_by_file_takes_its_time(tmp_path):
    """A law is evaluated as the run will do it: 52 s were measured for two curves of 9 pairs. What
    helps is said with its page; twice the samples, twice the time."""
    shutil.copy(DAHL.with_name("creeping_contact.py"), tmp_path)
    law = 'law = { name = "creeping_contact.py:CreepingContact", elastic = 0.1 }'
    path = corner_study.write(tmp_path, change=[("[respond]", f"[respond]\n{law}")])
    with code_allowed():
        settings = load_study(path).respond
        found = law_cost.cycles(settings, 60, (5,))
        finer = law_cost.cycles(settings.model_copy(update={"samples": 512}), 60, (5,))
    assert 1.4 < finer[5] / found[5] < 2.8
    model = {"blades": (30, 0, 30), "damper": (15, 0, 15)}
    size = Size(model, 60, (5,), cycles=found)
    cost = forecast(size, COMMON)["respond"]
    assert 60 < cost.seconds < 1200
    [said] = [one for one in advice(size, {"respond": cost}) if "numba" in one]
    page = re.search(r"docs/\S+\.py", said)
    assert page and (DAHL.parents[3] / page[0]).is_file()
    assert list(advice(replace(size, cycles={}), {"respond": Cost(100.0, 0.0)})) == []


@pytest.mark.parametrize("more", ["", "\nsamples = 512"])
def test_instants_of_a_law_whose_file_may_not_run(tmp_path, more):
    """Their number alone is known."""
    assert size_of(*inspected(tmp_path, "")).cycles == {}
    cycles = size_of(*inspected(tmp_path, f"\nlaw = 'dahl.py:Dahl'{more}")).cycles
    usual = size_of(*inspected(tmp_path, "\nlaw = 'dahl.py:Dahl'")).cycles
    assert cycles.keys() == usual.keys() != set()
    assert all(cycles[H] == (2 if more else 1) * usual[H] > 0 for H in cycles)


def inspected(folder, more):
    shutil.copy(DAHL, folder)
    path = corner_study.write(folder, change=[("[respond]", f"[respond]{more}")])
    return load_study(path), InspectResult(bodies={}, pairs={"one": 9}, columns={})
