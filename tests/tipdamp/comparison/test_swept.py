"""Which cases of a sweep stand at places of a comparison, and which are its scatter: of the studies
of three dampers."""

from pathlib import Path

import pytest

from tests.tipdamp.stages.test_stress import LEVEL
from tests.tipdamp.sweep import test_stress
from tipdamp.comparison import stress
from tipdamp.comparison.record import compared
from tipdamp.comparison.swept import scatter_of, swept_cases
from tipdamp.engine.store import Store
from tipdamp.study.study import load_study, read_toml
from tipdamp.sweep.cases import cases_of

FOLDER = Path(__file__).parents[3] / "docs" / "studies" / "three_dampers"


@pytest.mark.parametrize("damper", ["asymmetric", "cylindrical", "wedge"])
def test_both_phases_have_the_values_of_the_study(damper):
    path = FOLDER / f"{damper}.toml"
    content, cases = read_toml(path), cases_of(load_study(path))
    scatter = [scatter_of(content, case) for case in cases]
    assert len(cases) == 14 and scatter.count("") == 2
    assert scatter.count("contact.mu = 0.5") == scatter.count("tune.stations = [4, 4]") == 2
    bands = [case["respond.band"] for case, text in zip(cases, scatter, strict=True) if not text]
    assert bands[0][0] > bands[1][1]  # out of phase, in phase


def test_single_values_and_lists_of_one_are_alike():
    content = {"respond": {"damping_ratio": [0.02], "levels": 5.0}}
    assert scatter_of(content, {"respond.damping_ratio": 0.02, "respond.levels": 7.0}) == ""
    said = scatter_of(content, {"respond.damping_ratio": 0.03, "damper.pull": 9.0})
    assert said == "respond.damping_ratio = 0.03"


@pytest.mark.slow
def test_stress_of_a_sweep_stands_beside_the_pull(tmp_path):
    """Twice the pull on pairs that stick: the same alternating stress, twice the mean; of a case
    that does not ask for it none."""
    over = "[sweep.over]\ndamper.pull = [10, 20]\nrespond.stress = [true, false]\n"
    path = test_stress.write(tmp_path, (LEVEL,), over)
    assert test_stress.swept(path) == 0
    cases = swept_cases(load_study(path), Store(tmp_path / "results" / "corner"))
    (table,) = stress.table(compared(cases.computed()))
    one, two = table.records
    assert (one["Fc (N)"], two["Fc (N)"]) == ("10.00", "20.00")
    assert one["alternating (MPa)"] == two["alternating (MPa)"]
    means = [float(row["mean there (MPa)"]) for row in table.records]
    assert means[1] == pytest.approx(2 * means[0], rel=1e-3)
    safety = [float(row["safety"].removeprefix("at most ")) for row in table.records]
    assert safety[1] == pytest.approx(safety[0] / 2, rel=0.1)  # by the mean, nearly alone
