"""What is left of a sweep beside its index: the data set, the table, the estimate, and what a full
disk leaves."""

import csv
import errno
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest

from tests.robustness.rows import corner
from tests.tipdamp.rig_study import CHAIN
from tipdamp.checks.machine import COMMON
from tipdamp.checks.sizes import size_of
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.memory import own_bytes
from tipdamp.results.static_results import InspectResult
from tipdamp.stages.run import run_stage
from tipdamp.study.study import load_study
from tipdamp.sweep import work
from tipdamp.sweep.dataset import NETCDF, TABLE, dataset
from tipdamp.sweep.estimate import sweep_estimate
from tipdamp.sweep.expected import reduced_bytes
from tipdamp.sweep.index import Index
from tipdamp.sweep.plan import SweepStep
from tipdamp.sweep.rows import CurveRow
from tipdamp.sweep.run import planned
from tipdamp.sweep.summary import alike, status
from tipdamp.sweep.work import product

SWEEP = """
[sweep.over]
model.pull = [0.06, 0.03]
respond.levels = [[0.005, 0.008], [0.005]]
contact.left.shape = ["cylinder"]
"""
KILO = CHAIN.replace("[model]", '[units]\nforce = "kN"\n[model]').replace(
    "pull = 60", "pull = 0.06"
)


@pytest.fixture
def sweep(matrices_study):
    matrices_study.write_text(KILO + SWEEP)
    return matrices_study


def folder(path):
    return path.parent / "results" / "study" / "sweep"


def swept(path, *options):
    return main(["sweep", str(path), "--quiet", "--jobs", "1", *options])


def test_one_labelled_data_set(sweep):
    """The values of the index by their labels, and again from the file; cases with fewer curves
    are nan there."""
    xarray = pytest.importorskip("xarray")
    assert swept(sweep) == 0
    found = dataset(folder(sweep))
    assert dict(found.sizes) == {"case": 4, "curve": 2, "patch": 2}
    assert found["model.pull"].attrs["units"] == "kN"
    assert found["model.pull"].values.tolist() == [0.06, 0.06, 0.03, 0.03]
    assert found["respond.levels"].values.tolist() == ["[0.005, 0.008]", "[0.005]"] * 2
    assert found["contact.left.shape"].values.tolist() == ["cylinder"] * 4
    assert found["peak_m"].attrs["units"] == "m"
    with Index(folder(sweep)) as index:
        for number, row in index.curves():
            one = found.sel(case=number, patch=row.patch)
            one = one.isel(curve=one["Fe_N"].values.tolist().index(row.Fe_N))
            assert (float(one["peak_m"]), float(one["peak_hz"])) == (row.peak_m, row.peak_hz)
    assert found["peak_m"].isnull().sum() == 2 * 2
    xarray.testing.assert_identical(
        xarray.load_dataset(folder(sweep) / NETCDF)["peak_m"], found["peak_m"]
    )


def test_the_page_reads_it(sweep, monkeypatch):
    """docs/sweeps.md, with the pull of a model in the place of a damper's."""
    pytest.importorskip("xarray")
    sweep.write_text(KILO + SWEEP.replace("[[0.005, 0.008], [0.005]]", "[0.005, 0.008]"))
    assert swept(sweep) == 0
    monkeypatch.chdir(sweep.parent)
    page = (Path(__file__).parents[3] / "docs" / "sweeps.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(compile(block.replace("damper.pull", "model.pull"), "sweeps.md", "exec"), names)
    assert names["peak"].dims == ("case", "curve")
    assert dict(names["table"].sizes) == {
        "model.pull": 2,
        "respond.levels": 2,
        "curve": 1,
        "patch": 2,
    }
    levels = names["table"].peak_m.sel({"model.pull": 0.06, "patch": "patch_1"})
    assert levels.shape == (1, 2) and (levels > 0).all()


def test_a_table_of_all_curves(sweep):
    assert swept(sweep) == 0
    with (folder(sweep) / TABLE).open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == (2 + 1) * 2 * 2
    assert rows[0]["model.pull [kN]"] == "0.06"
    assert [row["Fe_N"] for row in rows[:6]] == ["5.0", "5.0", "8.0", "8.0", "5.0", "5.0"]
    with Index(folder(sweep)) as index:
        curves = [row for _, row in index.curves()]
    assert [float(row["peak_m"]) for row in rows] == [row.peak_m for row in curves]
    hz = [row["peak_hz"] for row in rows]
    assert list(map(float, hz)) == pytest.approx([row.peak_hz for row in curves], rel=1e-11)
    assert max(map(len, hz)) <= 13  # 999.9999999999999 is 1000.0


def test_a_failed_case_is_in_both(sweep, monkeypatch):
    pytest.importorskip("xarray")

    def failing(name, study, *a, **k):
        if name == "tune" and study.driver.pull == 30:
            raise RuntimeError("gave up")
        return real(name, study, *a, **k)

    real = work.run_stage
    monkeypatch.setattr(work, "run_stage", failing)
    assert swept(sweep) == 3
    found = dataset(folder(sweep))
    assert found["state"].values.tolist() == ["done"] * 2 + ["failed"] * 2
    assert "gave up" in str(found["reason"].values[3])
    assert bool(found["peak_m"].sel(case=3).isnull().all())
    with (folder(sweep) / TABLE).open() as file:
        last = list(csv.DictReader(file))[-1]
    assert (last["case"], last["state"], last["peak_m"]) == ("4", "failed", "")


def test_the_estimate_alone(sweep, capsys):
    """Counts are exact, and nothing of the sweep is made; afterwards there is nothing to make."""
    assert swept(sweep, "--dry-run") == 0
    told = capsys.readouterr().out
    assert "4 cases, 0 of them there; to make: 1 reduce, 2 preload, 2 tune, 4 respond" in told
    assert not (folder(sweep) / "made").exists()
    assert swept(sweep) == 0
    capsys.readouterr()
    assert swept(sweep, "--dry-run") == 0
    assert capsys.readouterr().out == "estimate    4 cases, nothing to make\n"


def test_that_a_comparison_needs_the_case_of_the_study_is_told_first(sweep, capsys):
    """With the values to add, before anything is computed; not where the sweep has it."""
    own = "respond.damping_ratio = "
    text = sweep.read_text()
    for ratios, said in (("[0.011, 0.012]", True), ("[0.01, 0.012]", False)):
        sweep.write_text(f"{text}\n{own}{ratios}\n")
        assert swept(sweep, "--dry-run") == 0
        told = capsys.readouterr().out
        assert ("compare     will refuse this sweep as it is: no case has the" in told) == said
        assert (f"add one with {own}0.01\n" in told) == said


def test_what_cannot_be_looked_at_has_no_estimate(sweep, capsys):
    """No figures of nothing, but why; once every stage was made, time and disk are those of its
    steps."""
    model = sweep.with_name("model.npz")
    matrix = model.read_bytes()
    model.write_bytes(b"damaged")
    assert swept(sweep, "--dry-run") == 0
    told = capsys.readouterr().out
    assert "to make: 1 reduce, 2 preload, 2 tune, 4 respond; " in told
    assert "; time, disk and memory are not known: " in told and f"{model}: is not an .npz" in told
    assert "about" not in told and " free" not in told
    model.write_bytes(matrix)
    assert swept(sweep) == 0
    model.write_bytes(b"damaged")
    capsys.readouterr()
    assert swept(sweep, "--dry-run") == 0
    told = capsys.readouterr().out
    assert "to make: 1 reduce, 2 preload, 2 tune, 4 respond; about" in told
    assert "free, memory is not known: " in told and f"{model}: is not an .npz" in told


def test_too_little_room_is_told_first(sweep, capsys, monkeypatch):
    monkeypatch.setattr("tipdamp.sweep.estimate.available_bytes", lambda: 1e3)
    assert swept(sweep, "--dry-run") == 0
    assert "warning: 1 cases side by side need about" in capsys.readouterr().out


def test_the_processes_are_in_the_memory(sweep, monkeypatch):
    """Beside what the stages need, each process holds the program; so does the one that waits."""
    monkeypatch.setattr("tipdamp.sweep.estimate.own_bytes", lambda: 3e8)
    store = Store(sweep.parent / "results" / "study")
    found = [sweep_estimate(*planned(sweep), sweep, store, jobs).memory for jobs in (1, 2)]
    stages = found[0] - 3e8
    assert stages > 0
    assert found[1] == pytest.approx(2 * stages + 3 * 3e8, rel=1e-12)


@pytest.mark.parametrize("harmonics", [[[1], [1], [25]], [[25], [1], [1]]])
def test_the_memory_is_that_of_the_largest_case(sweep, harmonics):
    """Small cases beside a large one need what the large one needs alone, not a mean of them."""
    store = Store(sweep.parent / "results" / "study")

    def memory(orders):
        sweep.write_text(KILO + f"\n[sweep.over]\nrespond.harmonics = {orders}\n")
        own = own_bytes()
        return sweep_estimate(*planned(sweep), sweep, store, 1).memory - own

    assert memory(harmonics) == pytest.approx(memory([[25]]), abs=2e6)
    assert memory([[25]]) > memory([[1]]) + 1e7


def test_the_program_is_some_hundred_megabytes():
    """What a fresh process with the finite elements and the equations holds."""
    assert 5e7 < own_bytes() < 2e10


def test_a_folder_that_cannot_be_written_ends_the_dry_run(sweep, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert swept(sweep, "--dry-run", "--out", str(tmp_path / "file" / "out")) == 4
    assert str(tmp_path / "file") in capsys.readouterr().err


def test_a_refused_study_is_no_sweep(sweep, capsys):
    """Its status is not that of a sweep without cases."""
    sweep.write_text(KILO + "[sweep.over]\nmodel.pull = [0.06, -1]\n")
    assert swept(sweep) == 2
    capsys.readouterr()
    assert swept(sweep, "--status") == 2
    there = f"{sweep} --out {sweep.parent / 'other'}"
    assert f"run: tipdamp sweep {sweep}\n" in capsys.readouterr().err
    assert swept(sweep, "--status", "--out", str(sweep.parent / "other")) == 2
    assert f"no sweep has run here yet; run: tipdamp sweep {there}\n" in capsys.readouterr().err


def test_nothing_runs_after_a_kill(sweep):
    """A time left is told while somebody works there alone."""
    assert swept(sweep, "--dry-run") == 0
    process = folder(sweep) / "working" / "tmp1"
    process.mkdir(parents=True)
    (process / "runs").write_text("reduce of model.pull = 60")
    (process.parent / "tmp2").mkdir()  # of one that only begins
    with Index(folder(sweep), write=True) as index:
        index.begin([{"model.pull": 60}, {"model.pull": 30}], ["a", "b"])
        index.say(left=None)
        with Store(folder(sweep)).lock():
            assert "2 to do; runs: reduce of model.pull = 60" in status(folder(sweep))[0]
        index.say(left=100.0, told=time.time())
    with Store(folder(sweep)).lock():
        assert "2 to do; about 1 min 40 s left" in status(folder(sweep))[0]
    text = status(folder(sweep), "tipdamp sweep study.toml --out here")[0]
    assert "left" not in text
    assert "2 to do; nothing runs, to go on: tipdamp sweep study.toml --out here" in text


def test_a_full_disk_ends_the_sweep_in_one_line(sweep, capsys, monkeypatch):
    """It is no failure of the cases: with room again the rest is made."""
    real, packed = work._pack, []

    def full(folder, step, store):
        if len(packed) == 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        packed.append(step)
        real(folder, step, store)

    monkeypatch.setattr(work, "_pack", full)
    assert swept(sweep) == 4
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{folder(sweep)}: No space left on device" in error
    monkeypatch.setattr(work, "_pack", real)
    assert swept(sweep) == 0
    with Index(folder(sweep)) as index:
        assert index.counts() == {"done": 4}


def test_the_summary_counts_cases_and_says_why(tmp_path):
    """Of five cases two are done, one of them with a curve that stopped, and two failed alike."""
    steps = [SweepStep("respond", key, ()) for key in "abcde"]
    row = CurveRow("a", "patch_1", 5.0, 3, *5 * [None], True, False, 0, 4, 1844.0, "whole")
    with Index(tmp_path, write=True) as index:
        index.begin([{"model.pull": i} for i in range(5)], list("abcde"))
        index.done([(steps[0], 1.0, 10), (steps[1], 1.0, 10)], [row])
        assert status(tmp_path)[1]
        stopped = replace(row, key="b", complete=False, ended="the damper slides freely")
        index.done([(steps[1], 1.0, 10)], [stopped, replace(stopped, patch="patch_2")])
        index.failed([("c", "respond"), ("d", "respond")], "gave up")
        text, whole = status(tmp_path)
    assert not whole
    assert text.splitlines()[:5] == [
        "sweep       2 of 5 cases done, 2 failed, 1 to do; nothing runs, to go on: tipdamp sweep "
        "STUDY.toml",
        "1 curve is incomplete: the damper slides freely",
        "failed: gave up",
        "    case 3: model.pull = 2",
        "    case 4: model.pull = 3",
    ]


def test_warnings_of_the_cases_are_told(tmp_path):
    """Each once, whatever its numbers; of a step that cases share for all of them, of cases that
    are not finished not yet."""
    steps = {key: SweepStep("respond", key, ("r",)) for key in "abc"}
    row = CurveRow("a", "patch_1", 5.0, 3, *5 * [None], True, False, 0, 4, 1844.0, "whole")
    with Index(tmp_path, write=True) as index:
        chains = {key: ("r", key) for key in steps}
        index.begin([{"model.pull": i} for i in range(3)], list(steps), chains)
        index.done([(SweepStep("reduce", "r", ()), 1.0, 10)], [], [("r", "error 1 %")])
        for key, percent in (("a", "3"), ("b", "2.5e+01")):
            said = [(key, f"peak at {percent} %")]
            index.done([(steps[key], 1.0, 10)], [replace(row, key=key)], said)
        assert index.warnings() == {
            1: ["error 1 %", "peak at 3 %"],
            2: ["error 1 %", "peak at 2.5e+01 %"],
        }
        index.done([(steps["b"], 1.0, 10)], [replace(row, key="b")])  # made again, without it
        assert index.warnings()[2] == ["error 1 %"]
        text, whole = status(tmp_path)
    assert whole  # a warning is no failure
    assert text.splitlines()[1:] == [
        "warning: error 1 % (case 1 and 1 more)",
        "warning: peak at 3 % (case 1)",
    ]


def test_the_worst_of_cases_that_are_alike_is_quoted():
    """By the errors that it tells; the first where it tells none."""
    said = {
        4: ["at Fe = 20 N (6.2e-02): more", "MAC of 0.42"],
        5: ["at Fe = 20 N (1.7e-01): more", "MAC of 0.43"],
        6: ["at Fe = 20 N (8.1e-02): more"],
    }
    assert alike(said) == [
        ("at Fe = 20 N (1.7e-01): more", [5, 4, 6]),
        ("MAC of 0.42", [4, 5]),
    ]


def test_warnings_stand_in_the_data_set_and_the_table(sweep, monkeypatch, capsys):
    """As the stage of a study alone says them; cases that share the step have them too."""
    xarray = pytest.importorskip("xarray")
    tune = replace(work.STAGES["tune"], warnings=lambda study, _: [f"pull {study.driver.pull:g}"])
    monkeypatch.setitem(work.STAGES, "tune", tune)
    assert swept(sweep) == 0
    told = "warning: pull 60 (case 1 and 3 more)"
    assert told in capsys.readouterr().out
    assert main(["sweep", str(sweep), "--status"]) == 0
    assert told in capsys.readouterr().out
    found = xarray.load_dataset(folder(sweep) / NETCDF)
    assert ["pull 60" in text for text in found["warnings"].values] == [True, True, False, False]
    assert ["pull 30" in text for text in found["warnings"].values] == [False, False, True, True]
    with (folder(sweep) / TABLE).open() as file:
        assert "pull 60" in next(csv.DictReader(file))["warnings"]


def test_lists_of_any_length_are_alike():
    """Of levels, say: one sentence for all cases, that with the largest error."""
    at = "of the peak is above 0.001 at Fe = {}: set harmonics"
    said = {1: [at.format("4 N (1.3e-02), 12 N (4.9e-02)")], 2: [at.format("12 N (1.6e-02)")]}
    assert alike(said) == [(said[1][0], [1, 2])]


def test_a_long_reason_is_told_whole(tmp_path):
    step = SweepStep("respond", "a", ())
    ended = "reached the end; " + "points open for 32 % of the cycle; " * 20 + "and then it folds"
    row = CurveRow("a", "patch_1", 5.0, 3, *5 * [None], False, False, 0, 4, 1844.0, ended)
    with Index(tmp_path, write=True) as index:
        index.begin([{"model.pull": 1}], ["a"])
        index.done([(step, 1.0, 10)], [row])
        assert status(tmp_path)[0].splitlines()[1].endswith("and then it folds")


def test_curves_that_stop_for_one_reason_are_one_line(tmp_path):
    """Wherever each of them stops."""
    steps = [SweepStep("respond", key, ()) for key in "abc"]
    row = CurveRow("a", "patch_1", 5.0, 3, *5 * [None], False, False, 0, 4, 1844.0, "")
    with Index(tmp_path, write=True) as index:
        index.begin([{"model.pull": i} for i in range(3)], list("abc"))
        for step, hz in zip(steps, (1500.0, 1474.88, 2870.29), strict=True):
            ended = f"stopped at {hz:g} Hz: the damper rolls"
            index.done([(step, 1.0, 10)], [replace(row, key=step.key, ended=ended)])
        text, _ = status(tmp_path)
    assert text.splitlines()[1:] == [
        "3 curves are incomplete: stopped at 1474.88 to 2870.29 Hz: the damper rolls"
    ]


def test_an_index_without_room(tmp_path):
    """What SQLite says of a full disk is an error of the machine."""
    with Index(tmp_path, write=True) as index:
        index.base.execute("pragma max_page_count = 12")
        with pytest.raises(OSError, match="no space left on device"):
            index.begin([{"model.pull": "x" * 100}] * 1000, ["key"] * 1000)
        assert index.counts() == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    "before",
    ["drop table warnings", "drop table curves", "alter table curves drop column stuck_hz"],
)
def test_an_index_of_another_version_is_one_line(tmp_path, before):
    """Whatever it lacks: no words of the data base alone."""
    with Index(tmp_path, write=True) as index:
        index.begin([{"model.pull": 60}], ["key"])
        index.base.execute(before)
        index.base.commit()
    with pytest.raises(InputError, match="by another version of tipdamp.*remove it"):
        with Index(tmp_path) as index:
            index.curves()
            index.warnings()


def test_the_disk_of_reduced_bodies_is_estimated(tmp_path):
    """To a factor of three beside what `reduce` leaves of the corner's meshes."""
    study = load_study(corner(tmp_path))
    store = Store(tmp_path / "alone")
    run_stage("inspect", study, store, quiet=True)
    estimated = reduced_bytes(size_of(study, InspectResult.load(store)))
    run_stage("reduce", study, store, quiet=True)
    left = sum(store.path(file).stat().st_size for file in store.outputs("reduce"))
    assert left / 3 < estimated < 3 * left


def test_the_disk_of_a_sweep_is_estimated(sweep):
    """To a factor of two beside what the finished steps take: levels count as often as cases have
    them, whatever the study itself has."""
    text = sweep.read_text().replace("harmonics = [1]", "harmonics = [1, 7]")
    sweep.write_text(text.replace("levels = [5]", "levels = [1, 2, 3, 4, 5, 6, 7]"))
    whole, content = planned(sweep)
    store = Store(sweep.parent / "results" / "study")
    estimated = sweep_estimate(whole, content, sweep, store, 1).disk
    assert swept(sweep) == 0
    left = sum(product(folder(sweep), step.key).stat().st_size for step in whole.steps)
    assert left / 2 < estimated < 2 * left


def test_the_time_of_a_sweep_is_estimated(matrices_study, monkeypatch):
    """To a factor of two: 40 cases over pull and level took 98 s of CPU time, half of it the last
    one, on a machine of this speed; two jobs need half as long."""
    over = """
[sweep.over]
model.pull = [80, 60, 45, 30, 22]
respond.levels = { start = 2, stop = 40, count = 8, spacing = "log" }
"""
    matrices_study.write_text(CHAIN.replace("harmonics = [1]", "harmonics = [3]") + over)
    machine = replace(COMMON, flops=1.8e10, evaluation=1.7e-3)
    monkeypatch.setattr("tipdamp.sweep.expected.measured", lambda: machine)
    store = Store(matrices_study.parent / "results" / "study")
    found = [
        sweep_estimate(*planned(matrices_study), matrices_study, store, jobs).seconds
        for jobs in (1, 2)
    ]
    assert 98 / 2 < found[0] < 2 * 98
    assert found[1] == pytest.approx(found[0] / 2, rel=1e-12)
