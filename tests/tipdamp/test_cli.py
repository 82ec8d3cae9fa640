"""The command line on the small rig: stages, skipping, order, bad input with exit code 2, and the matrices-only way."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hbm.balance.receptance import linear_response
from hbm.contact import ContactTable
from hbm.model import ReducedModel
from hbm.result import ForcedResponse
from tests.conftest import STUDY
from tipdamp.cli import main
from tipdamp.stages import model_inputs as terms
from tipdamp.stages.run import run_stage
from tipdamp.study.study import load_study

ROOT = Path(__file__).parents[2]


@pytest.fixture
def copy(rig, rig_results, tmp_path):
    """A copy of the study, its meshes and its results."""
    folder = tmp_path / "copy"
    shutil.copytree(rig, folder)
    return folder


def edit(folder, old, new):
    path = folder / "rig.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return str(path)


SAID_BY_THE_TABLE = ('blade = "contact_left"\n', 'damper = "contact_left"\n', 'blade = "contact_right"\n',
                     'damper = "contact_right"\n', "mu = 0.6\n", "kn = 3.32e6\n", "kt = 3.02e6\n", "kn = 1.03e6\n",
                     "kt = 0.94e6\n")


def own_pairs(folder):
    """The study with the pairs of mine.csv, and without what the table says."""
    for line in SAID_BY_THE_TABLE:
        edit(folder, line, "")
    return edit(folder, "[contact]", '[contact]\npairs = "mine.csv"')


def files(folder):
    """Times of all files but the name of who holds the lock."""
    return {p: p.stat().st_mtime_ns for p in Path(folder).rglob("*") if p.is_file() and p.name != ".holder"}


def test_nothing_is_computed_twice(copy, capsys):
    before = files(copy / "results")
    assert main(["tune", str(copy / "rig.toml"), "--quiet"]) == 0
    assert "up to date" in capsys.readouterr().out
    assert files(copy / "results") == before


@pytest.mark.slow
def test_change_runs_dependent_stages_only(copy):
    path = edit(copy, "stations = [5, 4]", "stations = [4, 4]")
    study = load_study(path)
    from tipdamp.stages.run import results_folder
    store = results_folder(study, None)
    assert run_stage("reduce", study, store, quiet=True) == "skipped"
    assert run_stage("preload", study, store, quiet=True) == "skipped"
    assert run_stage("tune", study, store, quiet=True) == "done"
    assert store.read_json("tune.json")["tuned_pairs"] == {"front": 4, "back": 4}


def test_changes_that_keep_the_reduced_model(copy, capsys):
    for old, new in (("mu = 0.6", "mu = 0.3"), ("pull = 113", "pull = 60"), ("kn = 3.32e6", "kn = 3e6")):
        path = edit(copy, old, new)
        assert main(["reduce", path, "--quiet"]) == 0
        assert "up to date" in capsys.readouterr().out
    assert main(["preload", path, "--quiet"]) == 0
    table = ContactTable.load(copy / "results" / "rig" / "preload.csv")
    assert set(table.mu) == {0.3} and table.kn[0] == 3e6
    assert table.preload[table.side == "left"].sum() == pytest.approx(60 / 2**0.5, rel=1e-6)  # 60 / (2 sin 45)


def test_levels_band_and_damping_leave_inspect_alone(copy, capsys):
    """What they do not fit is judged each time, beside what inspect found."""
    edit(copy, "levels = [1, 20]", "levels = [2]")
    edit(copy, "damping_ratio = 0.022", "damping_ratio = 0.3")
    path = edit(copy, "band = [2300, 3300]", "band = [1e6, 2e6]")
    assert main(["inspect", path, "--quiet"]) == 0
    out = capsys.readouterr().out
    assert "inspect  up to date" in out
    assert "first natural frequency between" in out and "damping_ratio = 0.3: is it in percent" in out


def test_a_stage_says_what_it_needs(copy, capsys):
    shutil.rmtree(copy / "results")
    assert main(["respond", str(copy / "rig.toml")]) == 2
    line = capsys.readouterr().err
    assert "'respond' needs the stage 'reduce', which has not been run; run: tipdamp reduce" in line
    assert line.count("\n") == 1 and not (copy / "results").exists()


def test_a_stage_whose_needs_are_out_of_date(copy, capsys):
    path = edit(copy, "pull = 113", "pull = 60")
    assert main(["tune", path]) == 2
    assert "'tune' needs the stage 'preload', which is out of date" in capsys.readouterr().err


@pytest.mark.parametrize("verb, old, new, message", [
    ("inspect", "asymmetric_blades.msh", "none.msh", "[blades] mesh = 'none.msh': no such file"),
    ("reduce", 'clamp = "clamp"', 'clamp = "clmp"', "[blades] clamp[0]: asymmetric_blades.msh: no group 'clmp'; did "
                                                    "you mean 'clamp'"),
    ("reduce", 'blade = "contact_right"', 'blade = "contact_left"', "62 damper nodes in 'contact_right'"),
    ("reduce", "asymmetric_blades.msh", "asymmetric_damper.msh", "no group 'clamp'"),
    ("reduce", "[respond]", '[respond]\nexcitation = "tip"', "[respond] excitation: asymmetric_blades.msh: no group"),
    ("run", "band = [2300, 3300]", "band = [3300, 2300]", "the band is empty"),
])
def test_bad_input_exits_with_one_line(copy, capsys, verb, old, new, message):
    path = edit(copy, old, new)
    before = files(copy / "results")
    assert main([verb, path, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert files(copy / "results") == before  # nothing overwritten


def test_a_body_that_nothing_holds(copy, capsys):
    """The clamp group is a single node: it exists, but three rotations stay free."""
    path = edit(copy, 'clamp = "clamp"', 'clamp = "excitation"')
    path = edit(copy, "[respond]", '[respond]\nexcitation = "patch_1"')
    assert main(["inspect", path, "--quiet"]) == 2
    assert "body 'blades': it is not held fast, 3 rigid motions are free" in capsys.readouterr().err


@pytest.mark.slow
def test_zero_contact_pairs(copy, capsys):
    """A table of one's own in which every pair is detached."""
    pairs = ContactTable.load(copy / "results" / "rig" / "preload.csv")
    pairs.replace(weight=np.zeros(len(pairs))).save(copy / "mine.csv")
    path = own_pairs(copy)
    assert main(["reduce", path, "--quiet"]) == 0
    assert main(["preload", path, "--quiet"]) == 2
    assert "no contact pairs" in capsys.readouterr().err


@pytest.mark.slow
def test_own_table_of_pairs(copy):
    """Half the stiffness on all pairs, from a CSV: the same sum of preloads, lower stuck frequencies."""
    store_before = json.loads((copy / "results" / "rig" / "tune.json").read_text())["stuck_hz"]
    pairs = ContactTable.load(copy / "results" / "rig" / "preload.csv")
    pairs.replace(kn=pairs.kn / 2, kt=pairs.kt / 2).save(copy / "mine.csv")
    text = (copy / "mine.csv").read_bytes()
    path = own_pairs(copy)
    for verb in ("reduce", "preload", "tune"):
        assert main([verb, path, "--quiet"]) == 0
    assert (copy / "mine.csv").read_bytes() == text
    after = json.loads((copy / "results" / "rig" / "tune.json").read_text())["stuck_hz"]
    assert all(after[k] < store_before[k] for k in after)


def test_an_edited_result_is_not_overwritten(copy, capsys):
    table = copy / "results" / "rig" / "preload.csv"
    table.write_text(table.read_text().replace("left", "Left"))
    text = table.read_text()
    assert main(["tune", str(copy / "rig.toml")]) == 2
    assert "preload.csv was changed after the stage 'preload' wrote it" in capsys.readouterr().err
    assert table.read_text() == text


def test_stuck_curve_is_the_linear_one(rig_results):
    """At 1 N no pair slips: harmonic balance equals the linear stuck response with the same damping."""
    response = rig_results.read_json("respond.json")
    gentle = next(r for r in response["responses"] if r["Fe_N"] == 1)
    assert gentle["slipping_pairs"] == [] and gentle["complete"] and gentle["failed_points"] == 0
    assert response["stuck_difference"][gentle["file"]] < 1e-6


def test_stuck_curve_by_a_second_route(rig_results, rig):
    """Direct solution of the complex dynamic stiffness with hysteretic-free modal damping, at three frequencies."""
    study = load_study(rig / "rig.toml")
    model, table = ReducedModel.load(rig_results.path("model.npz")), ContactTable.load(rig_results.path("kept.csv"))
    from scipy.linalg import eigh

    from static_contact.detachment import stuck_rows
    from static_contact.roll_springs import with_springs

    model = with_springs(model, table, terms.declared_springs(study, table))
    rows = stuck_rows(model, table)
    K = model.K + rows.T @ rows
    lam, phi = eigh(K, model.M)
    C = model.M @ phi @ np.diag(2 * 0.022 * np.sqrt(lam)) @ phi.T @ model.M
    force, out = terms.excitation(study, model), terms.outputs(study, model)
    hz = np.array([2400.0, 2781.0, 3200.0])
    direct = [np.array(list(out.values())) @ np.linalg.solve(K + 1j * w * C - w**2 * model.M, force)
              for w in 2 * np.pi * hz]
    ours = linear_response(model, table.select(table.carrying), force, hz, 0.022, out)
    assert np.abs(ours - direct).max() < 1e-8 * np.abs(direct).max()


def test_friction_damps_and_both_ways_agree(rig_results):
    for r in rig_results.read_json("respond.json")["responses"]:
        assert r["complete"] and r["failed_points"] == 0 and r["back"]["failed_points"] == 0
        assert r["back"]["peak_m"] == pytest.approx(r["peak_m"], rel=1e-6)
        curve = ForcedResponse.load(rig_results.path(r["file"]))
        shares = curve.share_stick + curve.share_slip + curve.share_open
        assert np.allclose(shares[curve.converged], 1.0, atol=1e-9)
    strong = rig_results.read_json("respond.json")["responses"][-1]
    assert strong["Fe_N"] == 20 and len(strong["slipping_pairs"]) > 0


@pytest.mark.slow
def test_matrices_only_way_without_finite_elements(rig, rig_results, tmp_path):
    """From model.npz and pairs.csv alone, where dolfinx, petsc4py, slepc4py, gmsh and mpi4py cannot be imported."""
    shutil.copy(rig_results.path("model.npz"), tmp_path)
    shutil.copy(rig_results.path("preload.csv"), tmp_path / "pairs.csv")
    head, rest = STUDY.split("[contact]")
    text = '[model]\nmatrices = "model.npz"\npull = 113\n[contact]\npairs = "pairs.csv"' + rest
    for line in SAID_BY_THE_TABLE:
        assert line in text
        text = text.replace(line, "")
    (tmp_path / "rig.toml").write_text(text)
    program = ("import sys\n"
               "for name in ('dolfinx', 'petsc4py', 'slepc4py', 'gmsh', 'mpi4py'): sys.modules[name] = None\n"
               "from tipdamp.cli import main\n"
               "for verb in ('inspect', 'reduce', 'preload', 'tune', 'respond'):\n"
               "    code = main([verb, 'rig.toml', '--quiet'])\n"
               "    assert code == 0, (verb, code)\n")
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True,
                          env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}, timeout=300)
    assert done.returncode == 0, done.stderr
    ours = json.loads((tmp_path / "results" / "rig" / "respond.json").read_text())["responses"]
    for one, two in zip(ours, rig_results.read_json("respond.json")["responses"], strict=True):
        assert one["peak_hz"] == pytest.approx(two["peak_hz"], rel=1e-9)
        assert one["peak_m"] == pytest.approx(two["peak_m"], rel=1e-7)


@pytest.mark.slow
def test_a_study_of_the_preload_alone(copy, capsys):
    """Without [tune] and [respond] the run ends with the preload map and its report."""
    path = copy / "rig.toml"
    path.write_text(path.read_text().split("[tune]")[0])
    assert main(["run", str(path), "--quiet", "--out", str(copy / "alone")]) == 0
    out = capsys.readouterr().out
    assert "nothing to do: the study has no [tune], [respond]" in out
    summary = json.loads((copy / "alone" / "summary.json").read_text())
    assert summary["preload"]["left"]["sum_N"] == pytest.approx(79.903, abs=1e-3)  # 113 / (2 sin 45)
    assert "Preload" in (copy / "alone" / "report.html").read_text()


def test_free_modes_can_be_looked_at(rig_results):
    """The file for ParaView: mode 1 out of phase, mode 2 in phase at the tips, on the user's node numbers."""
    meshio = pytest.importorskip("meshio")
    picture = meshio.read(rig_results.path("free_modes.vtu"))
    names = [n for n in picture.point_data if n.startswith("mode")]
    free = rig_results.read_json("reduce.json")["free_hz"]
    assert names[0] == f"mode 1, {free['out_of_phase']:.1f} Hz" and len(names) == 6
    tips = [np.flatnonzero((picture.points[:, 2] > 0.073) & (side * picture.points[:, 0] > 0)) for side in (-1, 1)]
    for name, sign in zip(names[:2], (-1, 1), strict=True):
        left, right = (picture.point_data[name][t, 0].mean() for t in tips)
        assert np.sign(left * right) == sign and 0.9 < abs(left / right) < 1.1
