"""How stages are run: skipped, refused, taken up again, and one run at a time in a results
folder."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import edit, files
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.stages.run import STAGES, results_folder, run_stage
from tipdamp.study.study import load_study

HOLD = """
import sys
from pathlib import Path
from tipdamp.engine.store import Store
with Store(Path(sys.argv[1])).lock():
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_run_names_the_first(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    store = Store(tmp_path / "results" / "corner")
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(store.folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    )
    assert holder.stdout.readline() == "held\n"
    assert main(["reduce", str(path), "--quiet"]) == 4
    said = capsys.readouterr().err
    assert f"in use by process {holder.pid} on host" in said and said.count("\n") == 1
    holder.communicate()
    assert main(["reduce", str(path), "--quiet"]) == 0


def test_the_lock_is_released_after_a_failure(tmp_path):
    store = Store(tmp_path)
    with pytest.raises(ValueError, match="failed"), store.lock():
        raise ValueError("failed")
    with store.lock(), pytest.raises(BlockingIOError, match="in use by process"), store.lock():
        pass


def test_stages_declare_what_they_write(rig_results):
    """Only declared files are removed when a stage no longer writes them."""
    written = [(stage, o) for name, stage in STAGES.items() for o in rig_results.outputs(name)]
    assert "responses/Fe_1N_H1.npz" in [o for _, o in written]
    assert [o for stage, o in written if not stage.writes(o)] == []


def test_nothing_is_computed_twice(copy, capsys):
    before = files(copy / "results")
    assert main(["tune", str(copy / "rig.toml"), "--quiet"]) == 0
    assert "up to date" in capsys.readouterr().out
    assert files(copy / "results") == before


@pytest.mark.slow
def test_change_runs_dependent_stages_only(copy):
    path = edit(copy, "stations = [5, 4]", "stations = [4, 4]")
    study = load_study(path)
    store = results_folder(study, None)
    assert run_stage("reduce", study, store, quiet=True) == "skipped"
    assert run_stage("preload", study, store, quiet=True) == "skipped"
    assert run_stage("tune", study, store, quiet=True) == "done"
    assert store.read_json("tune.json")["tuned_pairs"] == {"front": 4, "back": 4}


def test_changes_that_keep_the_reduced_model(copy, capsys):
    for old, new in (
        ("mu = 0.6", "mu = 0.3"),
        ("pull = 113", "pull = 60"),
        ("kn = 3.32e6", "kn = 3e6"),
    ):
        path = edit(copy, old, new)
        assert main(["reduce", path, "--quiet"]) == 0
        assert "up to date" in capsys.readouterr().out
    assert main(["preload", path, "--quiet"]) == 0
    table = ContactTable.load(copy / "results" / "rig" / "preload.csv")
    assert set(table.mu) == {0.3} and table.kn[0] == 3e6
    # 60 / (2 sin 45)
    assert table.preload[table.side == "left"].sum() == pytest.approx(60 / 2**0.5, rel=1e-6)


def test_a_file_that_a_mesh_includes_is_looked_at(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    (tmp_path / "blades.inp").rename(tmp_path / "part.inc")
    (tmp_path / "blades.inp").write_text("*Include, input=part.inc\n")
    told = []
    for change in ("", "", "** another word\n"):
        with (tmp_path / "part.inc").open("a") as file:
            file.write(change)
        assert main(["reduce", str(path), "--quiet"]) == 0
        told.append(capsys.readouterr().out.splitlines()[0])
    assert ["up to date" in line for line in told] == [False, True, False]


def test_levels_band_and_damping_leave_inspect_alone(copy, capsys):
    """What they do not fit is judged each time, beside what inspect found."""
    edit(copy, "levels = [1, 20]", "levels = [2]")
    edit(copy, "damping_ratio = 0.022", "damping_ratio = 0.3")
    path = edit(copy, "band = [2300, 3300]", "band = [1e6, 2e6]")
    assert main(["inspect", path, "--quiet"]) == 0
    out = capsys.readouterr().out
    assert "inspect  up to date" in out
    assert (
        "first natural frequency between" in out and "damping_ratio = 0.3: is it in percent" in out
    )


def test_a_stage_says_what_it_needs(copy, capsys):
    shutil.rmtree(copy / "results")
    assert main(["respond", str(copy / "rig.toml")]) == 2
    line = capsys.readouterr().err
    assert (
        "'respond' needs the stages 'reduce', 'preload' and 'tune', which have not been run; "
        "run: tipdamp run " in (line)
    )
    assert line.count("\n") == 1 and not (copy / "results").exists()


def test_a_stage_whose_needs_are_out_of_date(copy, capsys):
    path = edit(copy, "pull = 113", "pull = 60")
    assert main(["tune", path]) == 2
    assert "'tune' needs the stage 'preload', which is out of date" in capsys.readouterr().err


def test_an_edited_result_is_not_overwritten(copy, capsys):
    table = copy / "results" / "rig" / "preload.csv"
    table.write_text(table.read_text().replace("left", "Left"))
    text = table.read_text()
    assert main(["tune", str(copy / "rig.toml")]) == 2
    assert "preload.csv was changed after the stage 'preload' wrote it" in capsys.readouterr().err
    assert table.read_text() == text


def test_an_interrupted_stage_is_run_again(variant, tmp_path, monkeypatch):
    """Interrupted after it had written a file: the same command goes on."""
    from tipdamp.stages import run as stages

    folder = variant("tune")
    job = stages.STAGES["preload"].work

    def interrupted(study, store, tick):
        with store.writing("preload.csv") as path:
            path.write_text("half")
        raise KeyboardInterrupt

    object.__setattr__(stages.STAGES["preload"], "work", interrupted)
    assert main(["preload", str(tmp_path / "rig.toml"), "--quiet", "--force"]) == 130
    object.__setattr__(stages.STAGES["preload"], "work", job)
    assert main(["preload", str(tmp_path / "rig.toml"), "--quiet"]) == 0
    # 31 stations: one row left, two rows right
    assert len(ContactTable.load(folder / "preload.csv")) == 93
