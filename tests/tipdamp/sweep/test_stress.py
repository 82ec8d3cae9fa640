"""Stress of the cases of a sweep, where the study asks for it: of blocks whose contacts stick."""

import csv
import json
from collections import Counter

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.stages.test_stress import LEVEL, STUCK
from tipdamp.cli import main
from tipdamp.sweep import work
from tipdamp.sweep.dataset import NETCDF, TABLE, dataset
from tipdamp.sweep.index import Index
from tipdamp.sweep.run import planned
from tipdamp.sweep.work import product

pytestmark = pytest.mark.slow
LIMITS = "density = 7850\nfatigue_limit = 2e6\ntensile_strength = 1e7"
SWEEP = """
[sweep.over]
damper.pull = [10, 20]
"""


def write(folder, levels=(LEVEL, 2 * LEVEL), sweep=SWEEP, limits=LIMITS):
    """A sweep of the small study with its harmonics 1 and 3, whose pairs all stick."""
    narrow = ("[20000, 40000]", "[20000, 20100]"), ("mu = 0.3", "mu = 3")
    several = (f"levels = [{LEVEL}]", f"levels = {list(levels)}")
    material = ("density = 7850", limits)
    path = corner_study.write(folder, change=[*STUCK, *narrow, several, material])
    path.write_text(path.read_text() + sweep)
    return path


def swept(path):
    return main(["sweep", str(path), "--quiet", "--jobs", "1"])


def folder(path):
    return path.parent / "results" / "corner" / "sweep"


@pytest.fixture
def stages(monkeypatch):
    """Names of the stages that are run."""
    names, real = [], work.run_stage
    monkeypatch.setattr(
        work, "run_stage", lambda name, *a, **k: names.append(name) or real(name, *a, **k)
    )
    return names


def test_stress_follows_level_and_pull(tmp_path, stages):
    """All pairs stick: twice the level is twice the alternating stress, twice the pull twice the
    mean, and Goodman's line says the safety of the node that it names."""
    pytest.importorskip("xarray")
    path = write(tmp_path)
    assert swept(path) == 0
    assert Counter(stages) == {"reduce": 1, "preload": 2, "tune": 2, "respond": 2, "stress": 2}
    found = dataset(folder(path))
    finest = found.isel(curve=found["H"].isel(case=0).values == 3)
    one, two = (finest["alternating_Pa"].isel(curve=k).values for k in (0, 1))
    assert (one > 0).all() and two == pytest.approx(2 * one, rel=1e-6)
    assert finest["mean_Pa"].sel(case=2).values == pytest.approx(
        2 * finest["mean_Pa"].sel(case=1).values, rel=1e-6
    )
    used = finest["alternating_Pa"] / 2e6 + finest["mean_Pa"] / 1e7
    assert (finest["safety"] <= 1 / used * (1 + 1e-9)).all()
    assert np.isin(finest["safety_body"], ["blades", "damper"]).all()
    coarse = found.isel(curve=found["H"].isel(case=0).values == 1)
    assert coarse["alternating_Pa"].isnull().all() and (coarse["safety_body"] == "").all()
    units = {"alternating_Pa": "Pa", "mean_Pa": "Pa", "safety": "1", "safety_body": "1"}
    assert {name: found[name].attrs["units"] for name in units} == units
    assert all("stress" in found[name].attrs["long_name"] for name in ("mean_Pa", "alternating_Pa"))


def test_columns_are_what_the_stage_finds_of_the_study_alone(tmp_path):
    """Case 2, and the study with its pull: the largest of the places, the least of the safeties."""
    path = write(tmp_path, levels=(LEVEL,))
    assert swept(path) == 0
    with (folder(path) / TABLE).open() as file:
        rows = [row for row in csv.DictReader(file) if (row["case"], row["H"]) == ("2", "3")]
    alone = path.with_name("alone.toml")
    alone.write_text(path.read_text().replace("pull = 10", "pull = 20"))
    for stage in ("reduce", "preload", "tune", "respond", "stress"):
        assert main([stage, str(alone), "--quiet"]) == 0
    (curve,) = json.loads((tmp_path / "results" / "alone" / "stress.json").read_text())["curves"]
    top = max(curve["places"], key=lambda place: place["alternating_Pa"])
    least = min(curve["least"], key=lambda place: place["safety"])
    for row in rows:
        assert float(row["alternating_Pa"]) == pytest.approx(top["alternating_Pa"], rel=1e-9)
        assert float(row["mean_Pa"]) == pytest.approx(top["mean_Pa"], rel=1e-9)
        assert float(row["safety"]) == pytest.approx(least["safety"], rel=1e-9)
        assert (row["alternating_body"], row["safety_body"]) == (top["body"], least["body"])
    assert len(rows) == 2  # patches


def test_safety_is_that_by_the_limits_of_the_case(tmp_path):
    """Twice both limits, twice the safety of the same stress; without limits there is none."""
    xarray = pytest.importorskip("xarray")
    (tmp_path / "limits.csv").write_text(
        "damper.pull,material.fatigue_limit,material.tensile_strength\n"
        "10,2e6,1e7\n10,4e6,2e7\n10,,\n"
    )
    path = write(tmp_path, (LEVEL,), '[sweep]\ncases = "limits.csv"\n', "density = 7850")
    assert swept(path) == 0
    found = xarray.load_dataset(folder(path) / NETCDF)
    finest = found.isel(curve=int(np.flatnonzero(found["H"].values[0] == 3)[0]))
    assert np.ptp(finest["alternating_Pa"].values) == pytest.approx(0.0, abs=1e-9)
    once, twice, without = finest["safety"].values
    assert twice == pytest.approx(2 * once, rel=1e-9) and np.isnan(without)
    assert finest["safety_body"].values[2] == ""


def test_a_sweep_goes_on_at_the_stress(tmp_path, stages, monkeypatch, capsys):
    """What was lost or failed of it is made again alone, a level more takes the curves that are
    there; until then its case is not done."""
    path = write(tmp_path, (LEVEL,))
    counted = work.run_stage

    def failing(name, study, *a, **k):
        if name == "stress" and study.driver.pull == 20:
            raise RuntimeError("gave up")
        return counted(name, study, *a, **k)

    monkeypatch.setattr(work, "run_stage", failing)
    assert swept(path) == 3
    told = capsys.readouterr().out
    assert "1 of 2 cases done, 1 failed" in told and "gave up in the stage 'stress'" in told
    with Index(folder(path)) as index:  # the curves of the case that failed are known
        assert {number for number, _ in index.curves()} == {1, 2}
        assert {number for number, _ in index.stresses()} == {1}
    monkeypatch.setattr(work, "run_stage", counted)
    del stages[:]
    product(folder(path), planned(path)[0].last[0]).unlink()
    assert main(["sweep", str(path), "--dry-run", "--quiet"]) == 0
    assert "1 of them there" not in (said := capsys.readouterr().out)
    assert "to make: 2 stress" in said
    assert main(["sweep", str(path), "--quiet", "--jobs", "1", "--retry"]) == 0
    assert stages == ["stress", "stress"]
    assert "2 of 2 cases done" in capsys.readouterr().out
    path.write_text(path.read_text().replace(f"[{LEVEL}]", f"[{LEVEL}, {3 * LEVEL}]"))
    made, real = [], work._unpack_curves
    monkeypatch.setattr(work, "_unpack_curves", lambda *a: made.append(a) or real(*a))
    assert swept(path) == 0
    assert stages[2:] == ["respond", "stress"] * 2 and len(made) == 2


def test_an_index_that_is_lost_has_the_stress_again(tmp_path, stages):
    path = write(tmp_path, (LEVEL,))
    assert swept(path) == 0
    with Index(folder(path)) as index:
        before = index.stresses()
    (folder(path) / "index.sqlite").unlink()
    del stages[:]
    assert swept(path) == 0
    with Index(folder(path)) as index:
        assert index.stresses() == before and len(before) == 2
    assert stages == []
