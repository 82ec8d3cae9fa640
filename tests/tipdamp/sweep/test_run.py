"""Sweeps that run: the same numbers as one study at a time, whatever is killed meanwhile."""

import io
import json
import re
import zipfile

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from tests.tipdamp.rig_study import CHAIN, CHAIN_OF_STAGES
from tipdamp.cli import main
from tipdamp.sweep import run as sweep_run
from tipdamp.sweep.index import Index
from tipdamp.sweep.run import planned
from tipdamp.sweep.work import product

SWEEP = """
[sweep.over]
model.pull = [60, 30]
respond.levels = [5, 8]
"""


def swept(path, *options):
    return main(["sweep", str(path), "--quiet", "--jobs", "1", *options])


def folder(path):
    return path.parent / "results" / "study" / "sweep"


@pytest.fixture
def sweep(matrices_study):
    matrices_study.write_text(CHAIN + SWEEP)
    return matrices_study


@pytest.fixture
def stages(monkeypatch):
    """Names of the stages that are run."""
    from tipdamp.sweep import work

    names, real = [], work.run_stage
    monkeypatch.setattr(
        work, "run_stage", lambda name, *a, **k: names.append(name) or real(name, *a, **k)
    )
    return names


def test_time_left_counts_what_is_made_now(matrices_study, monkeypatch, capsys):
    """Two cases of which only the responses are missing, as after a kill: their preloads, which
    are there, are not taken off what is left."""
    matrices_study.write_text(CHAIN + "\n[sweep.over]\nmodel.pull = [60, 30]\n")
    assert swept(matrices_study) == 0
    for step in planned(matrices_study)[0].steps:
        if step.stage == "respond":
            product(folder(matrices_study), step.key).unlink()
    counted, real = [], sweep_run.Clock.end

    def end(clock, task, made):
        counted.append([int(clock.left.sum()), sorted(made)])
        real(clock, task, made)

    monkeypatch.setattr(sweep_run.Clock, "end", end)
    capsys.readouterr()
    assert main(["sweep", str(matrices_study), "--jobs", "1"]) == 0
    assert [left for left, _ in counted] == [2, 1]
    last = capsys.readouterr().err.splitlines()[-1]
    assert "done  2 of 2 cases  " in last and "left" not in last


def test_numbers_are_those_of_the_study_alone(sweep, stages):
    """Case 4 of the sweep, and the study with its values, to the last bit; nothing is made twice,
    and nothing at all the second time."""
    assert swept(sweep) == 0
    assert sorted(stages) == ["preload"] * 2 + ["reduce"] + ["respond"] * 4 + ["tune"] * 2
    with Index(folder(sweep)) as index:
        rows = [row for number, row in index.curves() if number == 4]
    alone = sweep.with_name("alone.toml")
    alone.write_text(
        CHAIN.replace("pull = 60", "pull = 30").replace("levels = [5]", "levels = [8]")
    )
    with threadpool_limits(1, "blas"):  # more of them sum in another order
        for stage in CHAIN_OF_STAGES:
            main([stage, str(alone), "--quiet"])
    results = sweep.parent / "results" / "alone"
    (curve,) = json.loads((results / "respond.json").read_text())["responses"]
    assert {row.patch: (row.peak_m, row.peak_hz) for row in rows} == {
        patch: (peak["peak_m"], peak["peak_hz"]) for patch, peak in curve["patches"].items()
    }
    assert swept(sweep) == 0
    assert len(stages) == 9


def test_further_cases_take_what_is_there(sweep, stages):
    assert swept(sweep) == 0
    del stages[:]
    sweep.write_text(CHAIN + SWEEP.replace("[5, 8]", "[5, 8, 9]"))
    assert swept(sweep) == 0
    assert stages == ["respond", "respond"]


@pytest.mark.slow
def test_a_level_more_computes_its_curves_alone(matrices_study, tmp_path, monkeypatch):
    """Curves of an earlier sweep are taken over where they are the same, also when another
    damping came between them, and damaged ones are made anew; the numbers are those of a sweep
    from nothing."""
    from tipdamp.engine.curves import Curves

    made, real = [], Curves._make_curve
    monkeypatch.setattr(
        Curves, "_make_curve", lambda self, case, *a: made.append(case.Fe_N) or real(self, case, *a)
    )

    def levels(text, zeta=0.01, out=tmp_path / "r"):
        del made[:]
        over = f"[sweep.over]\nmodel.pull = [60, 30]\nrespond.damping_ratio = [{zeta}]\n"
        matrices_study.write_text(CHAIN.replace("levels = [5]", f"levels = {text}") + over)
        assert swept(matrices_study, "--out", str(out)) == 0
        return sorted(made)

    def cut():
        for key in planned(matrices_study)[0].last:
            product(tmp_path / "r" / "sweep", key).write_bytes(b"cut")

    assert levels("[5, 8]") == [5, 5, 8, 8]
    assert levels("[5, 8]", zeta=0.02) == [5, 5, 8, 8]
    assert levels("[5, 8, 9]") == [9, 9]
    assert levels("[9, 4]") == [4, 4]  # the others are not kept with it
    cut()
    assert levels("[4]") == [4, 4]
    assert levels("[4, 5, 9]", zeta=0.02) == [4, 4, 9, 9]
    taken = finished(tmp_path / "r", matrices_study)
    assert levels("[4, 5, 9]", zeta=0.02, out=tmp_path / "anew") == [4, 4, 5, 5, 9, 9]
    assert taken == finished(tmp_path / "anew", matrices_study)


def finished(results, study):
    """The table, and the files of the responses of all cases but for their seconds."""
    found = [(results / "sweep" / "sweep.csv").read_bytes()]
    for key in planned(study)[0].last:
        with zipfile.ZipFile(product(results / "sweep", key)) as packed:
            assert packed.testzip() is None
            curves = [name for name in packed.namelist() if not name.startswith(".stages")]
            for name in curves:
                content = packed.read(name)
                if name.endswith(".npz"):
                    with np.load(io.BytesIO(content)) as z:
                        content = {k: z[k].tobytes() for k in z.files if k != "seconds"}
                elif name == "respond.json":
                    content = re.sub(rb'"seconds": [^,\n]*', b"", content)
                found.append((name, content))
    return found


def test_the_status_tells_what_each_process_does(sweep, monkeypatch):
    """By the folder that all share: processes of a cluster report nothing."""
    from tipdamp.sweep import work

    seen, real = [], work.run_stage

    def run_stage(name, *given, **options):
        seen.append((name, work.at_work(folder(sweep))))
        return real(name, *given, **options)

    monkeypatch.setattr(work, "run_stage", run_stage)
    assert swept(sweep) == 0
    cases = {text for name, (text,) in seen if name == "respond"}
    assert cases == {
        f"respond of model.pull = {pull}, respond.levels = {level}"
        for pull in (60, 30)
        for level in (5, 8)
    }
    assert all(text.startswith(f"{name} of ") for name, (text,) in seen)
    assert not work.at_work(folder(sweep))


def test_failures_are_listed_and_tried_again(sweep, stages, capsys, monkeypatch):
    """What fails once is told with its reason and the cases that need it, the others are made."""
    from tipdamp.hbm.errors import InputError
    from tipdamp.sweep import work

    real = work.run_stage

    def failing(name, study, *a, **k):
        if name == "tune" and study.driver.pull == 30:
            raise InputError("this one is out of reach")
        return real(name, study, *a, **k)

    monkeypatch.setattr(work, "run_stage", failing)
    assert swept(sweep) == 3
    told = capsys.readouterr().out
    assert "2 of 4 cases done, 2 failed, 0 to do" in told
    assert "failed: this one is out of reach in the stage 'tune'" in told
    assert "case 3: model.pull = 30, respond.levels = 5" in told
    monkeypatch.setattr(work, "run_stage", real)
    del stages[:]
    assert swept(sweep) == 3  # not tried again unasked
    assert swept(sweep, "--retry") == 0
    assert "4 of 4 cases done" in capsys.readouterr().out


def test_progress_tells_what_failed(sweep, capsys, monkeypatch):
    """Cases that failed are through, and not done; also those that failed in an earlier run."""
    from tipdamp.sweep import work

    def failing(name, study, *a, **k):
        if name == "tune" and study.driver.pull == 30:
            raise RuntimeError("gave up")
        return real(name, study, *a, **k)

    real = work.run_stage
    monkeypatch.setattr(work, "run_stage", failing)
    for _ in range(2):
        assert main(["sweep", str(sweep), "--jobs", "1"]) == 3
        last = capsys.readouterr().err.splitlines()[-1]
        assert "done  2 of 4 cases, 2 failed" in last


def test_contact_of_studies_from_matrices_is_swept(matrices_study, stages):
    """mu, kn and kt of the study stand in the place of those of the table of pairs; the reduced
    matrices are shared. Stuck as it is, twice the stiffness raises the stuck frequency, and mu does
    not change it."""
    matrices_study.write_text(
        CHAIN
        + "[sweep.over]\ncontact.mu = [0.3, 0.6]\ncontact.left.kt = [1e6, 2e6]\n"
        + "contact.left.kn = [1e6]\n"
    )
    assert swept(matrices_study) == 0
    assert stages.count("reduce") == 1
    with Index(folder(matrices_study)) as index:
        stuck = {number: row.stuck_hz for number, row in index.curves()}
    assert stuck[1] == stuck[3] < stuck[2] == stuck[4]


def test_a_case_goes_on_at_the_step_where_it_ended(matrices_study, stages, monkeypatch):
    """Steps of a case alone are kept as well, when the case ends before its last."""
    from tipdamp.sweep import work

    matrices_study.write_text(CHAIN + "[sweep.over]\nmodel.pull = [60, 30]\n")
    counted = work.run_stage

    def failing(name, *a, **k):
        if name == "respond":
            raise RuntimeError("gave up")
        return counted(name, *a, **k)

    monkeypatch.setattr(work, "run_stage", failing)
    assert swept(matrices_study) == 3
    assert stages == ["reduce", "preload", "tune", "preload", "tune"]
    del stages[:]
    monkeypatch.setattr(work, "run_stage", counted)
    assert swept(matrices_study, "--retry") == 0
    assert stages == ["respond", "respond"]


def test_an_index_that_is_lost_or_damaged_is_made_anew(sweep, stages, capsys):
    assert swept(sweep) == 0
    file = folder(sweep) / "index.sqlite"
    before = Index(folder(sweep)).curves()
    file.unlink()
    assert swept(sweep) == 0
    assert Index(folder(sweep)).curves() == before
    assert len(stages) == 9
    file.write_bytes(b"no data base at all" * 100)
    assert swept(sweep) == 2
    assert "index.sqlite is damaged" in capsys.readouterr().err


def test_a_damaged_step_is_made_again(sweep, stages):
    assert swept(sweep) == 0
    file = folder(sweep) / "index.sqlite"
    before = Index(folder(sweep)).curves()
    file.unlink()
    key = before[0][1].key
    sweep_run.product(folder(sweep), key).write_bytes(b"cut")
    assert swept(sweep) == 0
    assert stages.count("respond") == 5
    assert sorted(map(str, Index(folder(sweep)).curves())) == sorted(map(str, before))


def test_a_damaged_step_that_others_need_is_named(sweep, capsys):
    assert swept(sweep) == 0
    with Index(folder(sweep)) as index:
        (reduced,) = [
            k for k, s in index.base.execute("select key, stage from steps") if s == "reduce"
        ]
    sweep_run.product(folder(sweep), reduced).write_bytes(b"cut")
    sweep.write_text(CHAIN + SWEEP.replace("[5, 8]", "[9]"))
    assert swept(sweep) == 3
    told = capsys.readouterr().out
    assert f"{reduced}.zip is damaged" in told
    sweep_run.product(folder(sweep), reduced).unlink()
    assert swept(sweep, "--retry") == 0


def test_two_sweeps_on_one_store(sweep, capsys):
    from tipdamp.engine.store import Store

    with Store(folder(sweep)).lock():
        assert swept(sweep) == 4
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "is in use by process" in error


def test_no_folder_for_each_case(sweep):
    """Products are files, in at most 256 folders."""
    assert swept(sweep) == 0
    made = list((folder(sweep) / "made").rglob("*.zip"))
    assert len(made) == 9
    assert list((folder(sweep) / "working").iterdir()) == []
    assert all(zipfile.ZipFile(one).testzip() is None for one in made)


def test_status_of_nothing(sweep, capsys):
    assert main(["sweep", str(sweep), "--status"]) == 2
    assert "no sweep has run here yet" in capsys.readouterr().err
