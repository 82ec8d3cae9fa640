"""Measured curves in a study: from files to their agreement with the computed ones."""

import csv
import shutil

import numpy as np
import pytest

from tests.tipdamp.rig_study import CHAIN, read, write_chain
from tipdamp.cli import main
from tipdamp.hbm.result import ForcedResponse
from tipdamp.measured.frf import load_band
from tipdamp.results import STAGES

SECTION = """
[measured.run]
files = ["run_1.csv", "run_2.csv", "run_3.csv"]
columns = ["frequency_hz", "real", "imaginary"]
quantity = "receptance"
unit = "um/N"
level = 5
"""
FACTORS = (0.98, 1.0, 1.02)


def run(study, *verbs):
    return [main([verb, str(study), "--quiet"]) for verb in verbs]


@pytest.fixture(scope="module")
def responded(tmp_path_factory):
    """Folder of the study with three made repeats of its own computed curve, 2 % apart."""
    study = write_chain(tmp_path_factory.mktemp("responded"))
    assert run(study, "inspect", "reduce", "preload", "tune", "respond") == [0] * 5
    folder = study.parent
    curve = ForcedResponse.load(folder / "results/study/responses/Fe_5N_H1.npz")
    hz = np.linspace(1000, 1300, 601)
    x = (
        1e6
        / 5
        * np.array(
            [
                np.interp(hz, curve.frequency, part)
                for part in (curve.harmonics[:, 0, 1].real, curve.harmonics[:, 0, 1].imag)
            ]
        )
    )
    for k, factor in enumerate(FACTORS, 1):
        np.savetxt(folder / f"run_{k}.csv", np.column_stack([hz, *(factor * x)]), delimiter=",")
    study.write_text(CHAIN + SECTION)
    return folder


@pytest.fixture
def study(responded, tmp_path):
    """Path of a copy of that study."""
    shutil.copytree(responded, tmp_path, dirs_exist_ok=True)
    return tmp_path / "study.toml"


def test_a_measured_curve_beside_its_own_computation(study):
    assert run(study, "measured", "cycles", "agreement", "report") == [0] * 4
    folder = study.parent / "results" / "study"
    facts, (one,) = (
        read(folder, "measured.json")["curves"]["run"],
        read(folder, "agreement.json")["curves"],
    )
    hz, mean, low, high = load_band(folder / "measured" / "run.csv")
    assert (facts["repeats"], facts["points"], facts["level_N"], len(hz)) == (3, 601, 5.0, 601)
    assert facts["peak_m_per_N_deviation"] == pytest.approx(0.02 * facts["peak_m_per_N"], rel=1e-9)
    # the scatter of 5 % is the wider one
    np.testing.assert_allclose(high - low, 2 * 0.05 * mean, rtol=1e-9)
    peak = read(folder, "respond.json")["responses"][0]
    assert one["share_inside"] == 1.0
    assert facts["peak_hz"] == pytest.approx(peak["peak_hz"], abs=0.3)
    assert abs(one["peak"]) < 3e-3 and abs(one["frequency"]) < 3e-4
    assert one["half_power"]["zeta"] == pytest.approx(facts["half_power"]["zeta"], rel=0.02)
    page = (folder / "report.html").read_text()
    assert "Measured and computed" in page and "Computed beside measured curves" in page


def test_only_what_depends_on_the_measurement_runs_again(study, capsys):
    assert main(["run", str(study), "--quiet"]) == 0
    path = study.parent / "run_2.csv"
    np.savetxt(path, np.loadtxt(path, delimiter=",") * [1, 1.1, 1.1], delimiter=",")
    capsys.readouterr()
    assert main(["run", str(study), "--quiet"]) == 0
    out = capsys.readouterr().out
    idle = ("up to date", "nothing to do")
    ran = {
        name
        for name in STAGES
        if not any(
            line.split()[:1] == [name] and line[len(name) :].strip().startswith(idle)
            for line in out.splitlines()
        )
    }
    assert ran == {"measured", "agreement", "report"}


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("level = 5", "level = 7", "'run' has no computed curve at its level of 7 N"),
        (
            "level = 5",
            'level = 5\nresponse = "patch_9"',
            "response = 'patch_9': no output of that name",
        ),
        ('"run_3.csv"', '"absent.csv"', "measured curve not found"),
        ('quantity = "receptance"', 'quantity = "receptence"', "did you mean 'receptance'"),
        ("[measured.run]", "[measured.pull]", "not 'pull'"),
    ],
)
def test_what_does_not_fit(study, capsys, old, new, why):
    text = study.read_text()
    assert old in text
    study.write_text(text.replace(old, new))
    run(study, "measured", "cycles", "agreement")
    if "no computed curve" in why:  # the report then shows the measurement alone
        assert run(study, "report") == [0]
    captured = capsys.readouterr()
    assert why in captured.out + captured.err


def test_no_overlap_with_the_band(study, capsys):
    for k in (1, 2, 3):
        path = study.parent / f"run_{k}.csv"
        table = np.loadtxt(path, delimiter=",")
        np.savetxt(path, table + [1000, 0, 0], delimiter=",")
    assert run(study, "measured") == [2]
    assert "no overlap: measured 2000..2300 Hz, computed 900..1400 Hz" in capsys.readouterr().err


def fitted(study, section, expected=0):
    """fit.json of the study with other damping than its measured curve, and a section [fit]."""
    other = CHAIN.replace("damping_ratio = 0.01", "damping_ratio = 0.02")
    study.write_text(other + SECTION + section)
    assert run(study, "tune", "respond", "measured", "fit") == [0, 0, 0, expected]
    return read(study.parent / "results" / "study", "fit.json") if not expected else None


def test_damping_of_a_measured_curve_comes_back(study):
    """0.01 made it; from 0.02, with the contacts in the model. The report has it beside
    half-power."""
    found = fitted(study, "[fit]\nband = [1050, 1250]\nscatter = false\n")
    (one,), (curve,) = found["values"], found["curves"]
    assert one["start"] == 0.02
    assert one["value"] == pytest.approx(0.01, rel=0.01)
    assert one["low"] < one["value"] < one["high"]  # links of the made curve are straight
    assert curve["misfit"] < 0.01 and curve["half_power"]["zeta"] == pytest.approx(0.01, rel=0.1)
    assert run(study, "cycles", "agreement", "report") == [0] * 3
    page = (study.parent / "results" / "study" / "report.html").read_text()
    assert "Fitted to the measured curves" in page and "half-power over fit" in page
    folder = study.parent / "results" / "study"
    hz, mean, *_ = load_band(folder / "measured" / "run.csv")
    assert curve["m_per_N"] == pytest.approx(np.interp(curve["hz"], hz, mean), rel=0.1)
    with (folder / "figures" / "measured.csv").open() as file:
        drawn = [row for row in csv.DictReader(file) if row["name"] == "fitted"]
    assert [float(row["y"]) for row in drawn] == pytest.approx(1e6 * np.array(curve["m_per_N"]))


def test_a_measured_curve_has_factors_of_its_own(study):
    """They take up what the straight links of the made curve cut off its peak."""
    one, *own = fitted(study, "[fit]\nband = [1050, 1250]\n")["values"]
    assert one["value"] == pytest.approx(0.01, rel=0.02)
    assert {each["name"]: each["value"] for each in own} == {
        "factor on amplitude of run": pytest.approx(1.0, abs=0.02),
        "factor on frequency of run": pytest.approx(1.0, abs=1e-3),
    }


def test_what_a_fit_cannot_do_is_said(study, capsys):
    """Nothing slips at 5 N: mu is not told, and named."""
    fitted(study, "[fit]\nmu = true\n", expected=2)
    assert "fit_damping: mu does not change the measured curves" in capsys.readouterr().err
    fitted(study, "[fit]\nband = [2000, 3000]\n", expected=2)
    assert "no point lies in the band 2000 to 3000 Hz" in capsys.readouterr().err
    fitted(study, "[fit]\ncurves = 'rum'\n", expected=2)
    assert "[fit] curves: no [measured.rum]; did you mean 'run'" in capsys.readouterr().err
