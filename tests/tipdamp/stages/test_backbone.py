"""[backbone] in a study: the mode beside its forced peaks, in files, report and summary."""

import csv
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipdamp.rig_study import CHAIN, CHAIN_OF_STAGES, read, write_chain
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.modes.backbone import _ended
from tipdamp.hbm.modes.result import Backbone
from tipdamp.results.response_results import BackboneResult
from tipdamp.stages.backbone import warnings
from tipdamp.study.study import load_study

SLIPS = CHAIN.replace("levels = [5]", "levels = [5, 30]").replace("[1]\nband", "[3]\nband")


def run(study, *verbs):
    return [main([verb, str(study), "--quiet"]) for verb in verbs]


@pytest.fixture(scope="module")
def responded(tmp_path_factory):
    """Folder of the study with forced peaks, up to these."""
    study = write_chain(tmp_path_factory.mktemp("responded"))
    study.write_text(SLIPS)
    assert run(study, *CHAIN_OF_STAGES) == [0] * 4
    return study.parent


@pytest.fixture
def results(responded, tmp_path):
    """(run(section) -> exit code of `backbone`, results folder) of a copy of that study."""
    shutil.copytree(responded, tmp_path, dirs_exist_ok=True)
    study = tmp_path / "study.toml"

    def with_section(section):
        study.write_text(SLIPS + section)
        return run(study, "backbone")[0]

    return with_section, tmp_path / "results" / "study"


def test_the_mode_begins_stuck_and_predicts_the_peaks(results):
    """Where nothing slips its frequency and damping are those of the stuck mode; the force at phase
    resonance is that of the forced peaks."""
    with_section, folder = results
    assert with_section("[backbone]\nnear_hz = 1071\n") == 0
    found = read(folder, "backbone.json")
    mode = Backbone.load(folder / "backbone.npz")
    stuck = read(folder, "tune.json")["stuck_modes_hz"]["tuned"][found["mode"] - 1]
    assert mode.frequency[0] == pytest.approx(stuck, rel=1e-6)
    assert mode.damping_ratio[0] == pytest.approx(0.01, rel=1e-6)
    assert found["complete"] and found["zeta"] > 0.0101
    low, high = found["peaks"]
    assert low["predicted_m"] == pytest.approx(low["peak_m"], rel=0.01)
    assert high["predicted_m"] == pytest.approx(high["peak_m"], rel=0.02)
    with (folder / "backbone.csv").open() as file:
        rows = list(csv.DictReader(file))
    np.testing.assert_array_equal([float(row["frequency_hz"]) for row in rows], mode.frequency)
    assert run(folder.parents[1] / "study.toml", "inspect", "cycles", "report") == [0] * 3
    page = (folder / "report.html").read_text()
    assert "Peaks that the backbone predicts" in page
    assert (folder / "figures" / "backbone.png").is_file()
    summary = read(folder, "summary.json")
    assert summary["backbone"]["mode"] == found["mode"]
    assert summary["backbone"]["peaks"] == found["peaks"]


def test_a_mode_is_named_by_its_number_or_its_frequency(results):
    with_section, folder = results
    assert with_section("[backbone]\n") == 0
    own = read(folder, "backbone.json")
    assert with_section(f"[backbone]\nmode = {own['mode']}\n") == 0
    assert read(folder, "backbone.json") == own
    assert with_section(f"[backbone]\nnear_hz = {own['stuck_hz'] + 3}\nharmonics = 1\n") == 0
    near = read(folder, "backbone.json")
    assert (near["mode"], near["H"], own["H"]) == (own["mode"], 1, 3)


def test_with_a_pair_open_at_rest_the_tracked_mode_is_followed(matrices_study):
    """Closed, it makes the tracked mode 11 % higher, and another the nearest, which the patch does
    not see. Report and results say which frequency is which."""
    folder = matrices_study.parent
    pairs = ContactTable.load(folder / "pairs.csv")
    pairs.replace(gap=1e-4 * (np.arange(6) == 1)).save(folder / "pairs.csv")
    text = CHAIN.replace("stations = [1, 1]", 'stations = "all"').replace("900", "1700")
    matrices_study.write_text(text.replace("1400", "2300") + "[backbone]\n")
    verbs = ("inspect", *CHAIN_OF_STAGES, "backbone", "cycles", "report")
    assert run(matrices_study, *verbs) == [0] * len(verbs)
    folder = folder / "results" / "study"
    tune, found = read(folder, "tune.json"), read(folder, "backbone.json")
    tuned = tune["stuck_hz"]["tuned"]
    assert tune["open_pairs"]["tuned"] == 1
    assert found["rest_hz"] == pytest.approx(tuned, rel=1e-5)
    assert Backbone.load(folder / "backbone.npz").frequency[0] == pytest.approx(tuned, rel=1e-5)
    assert found["stuck_hz"] > 1.1 * tuned
    page = (folder / "report.html").read_text()
    assert f"Nonlinear mode {found['mode']}, stuck at {tuned:.1f} Hz" in page
    assert "in contact at rest, as in the tuning" in page
    assert f"closed and stuck: then it has {found['stuck_hz']:.1f} Hz" in page


@pytest.mark.parametrize(
    "section, said",
    [
        ("mode = 0", "[backbone] mode = 0: must lie between"),
        ("mode = 1\nnear_hz = 9", "mode and near_hz exclude each other"),
        ("amplitudes = [1e-6]", "[backbone] amplitudes: must be two or more"),
        ("amplitudes = [1e-5, 1e-6]", "ascending"),
        ("response = 'patch_3'", "[backbone] response = 'patch_3': did you mean"),
    ],
)
def test_bad_input_is_told_at_the_entrance(matrices_study, section, said):
    matrices_study.write_text(f"{SLIPS}[backbone]\n{section}\n")
    with pytest.raises(InputError, match=re.escape(said)):
        load_study(matrices_study)


def test_what_is_not_there_is_one_line(results, capsys):
    """A mode beyond the last, and amplitudes at which all slips: no motion exists."""
    with_section, _ = results
    for section, said in (
        ("mode = 99", "[backbone] mode = 99: there are 27 with every kept pair stuck"),
        ("amplitudes = [1.0, 2.0]", "[backbone] amplitudes begin at 1 m: no free motion"),
    ):
        capsys.readouterr()
        assert with_section(f"[backbone]\n{section}\n") == 2
        error = capsys.readouterr().err.strip().splitlines()
        assert len(error) == 1 and said in error[0], error


def test_a_report_without_the_backbone_that_failed(results):
    """Asked for where there is none: an error of its own verb alone; an older one is not shown."""
    with_section, folder = results
    study = folder.parents[1] / "study.toml"
    assert with_section("[backbone]\nharmonics = 1\n") == 0
    assert with_section("[backbone]\namplitudes = [1.0, 2.0]\n") == 2
    assert run(study, "inspect", "cycles", "report") == [0] * 3
    page = (folder / "report.html").read_text()
    assert "Nonlinear mode" not in page and "backbone" not in read(folder, "summary.json")
    assert any("'backbone' was not run" in one for one in read(folder, "summary.json")["warnings"])


def test_default_amplitudes_begin_where_the_motion_exists(results, monkeypatch):
    """Lower than a tenth of the smallest peak, which may be that of another mode."""
    with_section, folder = results
    monkeypatch.setattr("tipdamp.stages.backbone.AROUND", (1e5, 1e6))
    monkeypatch.setattr("tipdamp.stages.backbone.LOWER", (1.0, 1e-6))
    assert with_section("[backbone]\nharmonics = 1\n") == 0
    found = read(folder, "backbone.json")
    assert found["points"] and found["first_m"] == pytest.approx(1e-6 * found["no_motion_m"])
    said = warnings(None, Store(folder))
    assert "begins at" in said[0] and "no free motion was found at" in said[0]


def test_a_backbone_that_is_not_found_is_a_warning(results, monkeypatch):
    with_section, folder = results
    monkeypatch.setattr("tipdamp.stages.backbone.AROUND", (1e5, 1e6))
    monkeypatch.setattr("tipdamp.stages.backbone.LOWER", (1.0,))
    assert with_section("[backbone]\nharmonics = 1\n") == 0
    assert not (folder / "backbone.npz").exists()
    assert run(folder.parents[1] / "study.toml", "inspect", "cycles", "report") == [0] * 3
    summary = read(folder, "summary.json")
    assert summary["backbone"]["points"] == 0
    assert any("was not found: no free motion" in one for one in summary["warnings"])


@pytest.mark.parametrize(
    "complete, ended, said",
    [
        (True, "reached the last amplitude", []),
        (
            False,
            "reached the last amplitude; 2e-06 m could not be solved",
            ["the backbone of mode 1 reached the last amplitude; 2e-06 m could not be solved"],
        ),
        (
            False,
            "stopped at 1.2e-06 m",
            ["the backbone of mode 1 reaches 1.2e-06 m of 3e-06 m: stopped at 1.2e-06 m"],
        ),
    ],
)
def test_the_warning_says_where_it_stopped_or_what_is_missing(tmp_path, complete, ended, said):
    """Of a backbone with a gap that goes on behind it: not that it reaches its last amplitude of
    its last amplitude."""
    store = Store(tmp_path)
    BackboneResult(
        mode=1,
        stuck_hz=100.0,
        stuck_zeta=0.01,
        response="patch_1",
        output="patch_1: node 1",
        H=3,
        first_m=1e-7,
        last_m=3e-6,
        reached_m=3e-6 if ended.startswith("reached") else 1.2e-6,
        low_hz=90.0,
        high_hz=100.0,
        zeta=0.02,
        zeta_at_m=1e-6,
        points=20,
        complete=complete,
        ended=ended,
        peaks=(),
    ).save(store)
    assert warnings(None, store) == said


def test_points_that_failed_are_named():
    """The branch goes on behind them and reaches its end."""
    points = [SimpleNamespace(converged=one != 2, parameter=1e-6 * one) for one in (1, 2, 3)]
    branch = SimpleNamespace(complete=True, points=points)
    assert _ended(branch, None, 1.0, [2.5e-6]) == (
        "reached the last amplitude; 2e-06 m could not be solved; 2.5e-06 m could not be solved"
    )


def test_needs_forced_peaks(matrices_study, capsys):
    matrices_study.write_text(CHAIN.partition("[respond]")[0] + "[backbone]\n")
    assert run(matrices_study, "backbone") == [2]
    assert "[backbone] stands beside forced peaks" in capsys.readouterr().err
