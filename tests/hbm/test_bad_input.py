"""Bad input through forced_response and through a study file: one line that names what came and what is allowed.

Nothing heavy may have started: the modes of the stuck system and the continuation are taken away while these run. Then
the input whose right answer is known: no force, no friction, a band that runs down.
"""

import importlib.util
import re
import shutil
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hbm import continuation, linear, residual
from hbm.contact import relative_motion
from hbm.errors import InputError
from hbm.laws import DryFriction2T
from hbm.linear import free_receptance
from hbm.model import ReducedModel
from hbm.response import forced_response
from tests.hbm.small_rig import small_rig
from tipdamp.cli import main

EXAMPLE = Path(__file__).parents[2] / "docs" / "studies" / "matrices_only" / "make_matrices.py"
MODEL, PAIRS, TIP = small_rig(stations=3)


def curve(**changes):
    """forced_response on the small rig with changes: of M, K, C, of columns of the table, or of the call."""
    matrices = {k: changes.pop(k) for k in "MKC" if k in changes}
    columns = {k: changes.pop(k) for k in ("kn", "kt", "mu", "preload", "weight", "gap") if k in changes}
    model = changes.pop("model", MODEL)
    if matrices:
        table = {k: getattr(MODEL, k) for k in ("body", "node", "direction", "position")}
        model = ReducedModel.from_matrices(**({"M": MODEL.M, "K": MODEL.K} | matrices), **table)
    pairs = changes.pop("pairs", PAIRS)
    if columns:
        pairs = replace(pairs, **columns)
    call = dict(law=DryFriction2T(), forcing=8 * TIP, band=(1100, 1500), harmonics=1, damping_ratio=0.02,
                outputs={"tip": TIP})
    return forced_response(model, pairs, **(call | changes))


def with_entry(matrix, i, j, value):
    changed = matrix.copy()
    changed[i, j] = value
    return changed


def changed_pair(column, value):
    values = getattr(PAIRS, column).copy()
    values[1] = value
    return {column: values}


def unheld():
    """The damper on one pair only can move freely whatever sticks."""
    return {"pairs": PAIRS.select(np.arange(len(PAIRS)) == 0)}


REFUSED = {
    "H negative": ({"harmonics": -1}, r"harmonics = -1: must be a whole number between 0 and 200"),
    "H not whole": ({"harmonics": 2.5}, r"harmonics = 2\.5: must be a whole number between 0 and 200"),
    "H a text": ({"harmonics": "5"}, r"harmonics = '5': must be a whole number"),
    "H true": ({"harmonics": True}, r"harmonics = True: must be a whole number"),
    "H absurd": ({"harmonics": 100000}, r"harmonics = 100000: must be a whole number between 0 and 200"),
    "H below the forcing": ({"harmonics": 0}, r"harmonic 1: harmonics = 0 keeps orders 0\.\.0"),
    "NaN in K": (lambda: {"K": with_entry(MODEL.K, 3, 5, np.nan)}, r"K\[3, 5\] is nan: every entry must be finite"),
    "NaN in M": (lambda: {"M": with_entry(MODEL.M, 2, 2, np.nan)}, r"M\[2, 2\] is nan: every entry must be finite"),
    "infinite C": (lambda: {"C": with_entry(0 * MODEL.M, 2, 2, np.inf)}, r"C\[2, 2\] is inf"),
    "K unsymmetric": (lambda: {"K": with_entry(MODEL.K, 0, 1, 1e6)}, r"K is not symmetric: .*allowed 1e-10"),
    "M unsymmetric": (lambda: {"M": with_entry(MODEL.M, 0, 1, 1e-3)}, r"M is not symmetric: .*allowed 1e-10"),
    "K not square": (lambda: {"K": MODEL.K[:, :-1]}, r"K must be a square matrix, got shape"),
    "M of another size": (lambda: {"M": MODEL.M[:-1, :-1]}, r"M is \(\d+, \d+\).*all must have the same size"),
    "M indefinite": (lambda: {"M": with_entry(MODEL.M, 4, 4, -1.0)}, r"M has -1 on its diagonal at dof 4"),
    "C drives": (lambda: {"C": -1e-3 * MODEL.K}, r"C feeds energy in"),
    "kn negative": (lambda: changed_pair("kn", -1.0), r"pair 2: kn = -1, must be finite and between 0"),
    "kt negative": (lambda: changed_pair("kt", -2.0), r"pair 2: kt = -2, must be finite and between 0"),
    "mu negative": (lambda: changed_pair("mu", -0.1), r"pair 2: mu = -0\.1, must be finite and between 0"),
    "mu not a number": (lambda: changed_pair("mu", np.nan), r"pair 2: mu = nan"),
    "kn infinite": (lambda: changed_pair("kn", np.inf), r"pair 2: kn = inf, must be finite and not negative"),
    "preload infinite": (lambda: changed_pair("preload", np.inf), r"pair 2: preload = inf, must be finite"),
    "weight above 1": (lambda: changed_pair("weight", 1.5), r"pair 2: weight = 1\.5, .* between 0 and 1"),
    "no pairs": (lambda: {"pairs": PAIRS.select(np.zeros(len(PAIRS), bool))}, r"no (contact )?pair"),
    "no pair carries": (lambda: {"weight": 0 * PAIRS.weight}, r"no pair carries: every weight is 0"),
    "a free body": (unheld, r"held by nothing even when every pair sticks: body 'damper' (slides|rotates)"),
    "band empty": ({"band": (1300, 1300)}, r"band = \(1300, 1300\) Hz: both must be positive, and different"),
    "band from zero": ({"band": (0, 100)}, r"band = \(0, 100\) Hz: both must be positive"),
    "band negative": ({"band": (-5, 100)}, r"band = \(-5, 100\) Hz: both must be positive"),
    "band not finite": ({"band": (100, np.inf)}, r"band = \(100, inf\) Hz"),
    "band of three": ({"band": (1, 2, 3)}, r"band = \(1, 2, 3\): must be two frequencies"),
    "forcing of another size": (lambda: {"forcing": TIP[:-1]}, r"forcing of harmonic 1: must be finite with shape"),
    "forcing not a number": (lambda: {"forcing": np.nan * TIP}, r"forcing of harmonic 1: must be finite"),
    "forcing of order 0": (lambda: {"forcing": {0: TIP}}, r"harmonic 0: harmonics count from 1"),
    "no outputs": ({"outputs": {}}, r"outputs: at least one"),
    "output of another size": ({"outputs": {"tip": [1.0]}}, r"output 'tip': must be a finite row of length"),
    "damping negative": ({"damping_ratio": -0.01}, r"damping_ratio = -0\.01: .*0 <= ratio < 1"),
    "damping over-critical": ({"damping_ratio": 1.5}, r"damping_ratio = 1\.5: .*0 <= ratio < 1"),
    "no damping": ({"damping_ratio": None}, r"damping: neither C nor damping_ratio given"),
    "origin misspelt": ({"origin": "prelaoded"}, r"origin = 'prelaoded': must be 'preloaded' or 'unloaded'"),
    "start misspelt": ({"start": "zero"}, r"start = 'zero': must be 'zero_force', 'zero_slider' or"),
    "samples negative": ({"samples": -8}, r"samples = -8: must be a whole number"),
    "samples too few": ({"samples": 4, "harmonics": 5}, r"samples = 4: .*at least"),
    "at not a number": ({"at": ["x"]}, r"at = "),
}


@pytest.mark.parametrize("row", REFUSED)
def test_refused_by_forced_response(row, monkeypatch):
    changes, message = REFUSED[row]

    def heavy(*_, **__):
        raise AssertionError("something heavy has started")
    monkeypatch.setattr(continuation, "solve_at", heavy)
    monkeypatch.setattr(continuation, "follow", heavy)
    if row not in ("a free body", "damping negative", "damping over-critical", "no damping"):
        monkeypatch.setattr(residual, "stuck_receptance", heavy)
    else:
        monkeypatch.setattr(linear.la, "eigh", eigh_of_one(linear.la.eigh))
    with warnings.catch_warnings(), pytest.raises(InputError, match=message) as caught:
        warnings.simplefilter("error")
        curve(**(changes() if callable(changes) else changes))
    assert "\n" not in str(caught.value)


def eigh_of_one(eigh):
    """The check for free motions needs one eigenvalue; all of them would be the heavy thing."""
    def only(*a, **k):
        assert "subset_by_index" in k, "something heavy has started"
        return eigh(*a, **k)
    return only


STUDY = """
[model]
matrices = "model.npz"
axis = [1, 0, 0]
pull = 60
[contact]
pairs = "pairs.csv"
[contact.left]
shape = "cylinder"
[contact.right]
shape = "cylinder"
[tune]
stations = [1, 1]
[respond]
direction = [0, 1, 0]
levels = [5]
harmonics = [1]
band = [900, 1400]
damping_ratio = 0.01
"""


@pytest.fixture
def study(tmp_path):
    """Path of a valid study from matrices, without finite elements."""
    spec = importlib.util.spec_from_file_location("make_matrices", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    M, K = example.matrices()
    body, node = zip(*[(b, n) for b, nodes in example.NODES.items() for n in nodes], strict=True)
    pull = np.zeros(27)
    pull[[20, 26]] = 0.5                                  # z of the two ends of the damper
    ReducedModel.from_matrices(M, K, body=np.repeat(body, 3), node=np.repeat(node, 3), direction=["x", "y", "z"] * 9,
                               position=np.repeat(example.positions(), 3, axis=0), loads={"pull": pull},
                               groups={"blades/excitation": [2], "blades/patch_1": [2], "blades/patch_2": [12]},
                               ).save(tmp_path / "model.npz")
    example.contact_table().save(tmp_path / "pairs.csv")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


def text(old, new):
    def change(study):
        assert old in STUDY
        study.write_text(STUDY.replace(old, new))
    return change


def cell(column, value):
    """A cell of the contact table, in the third line of the file."""
    def change(study):
        path = study.parent / "pairs.csv"
        lines = path.read_text().splitlines()
        fields = lines[2].split(",")
        fields[lines[0].split(",").index(column)] = value
        lines[2] = ",".join(fields)
        path.write_text("\n".join(lines))
    return change


def no_rows(study):
    path = study.parent / "pairs.csv"
    path.write_text(path.read_text().splitlines()[0] + "\n")


def array(name, change):
    def changed(study):
        path = study.parent / "model.npz"
        with np.load(path) as z:
            arrays = {k: z[k] for k in z.files}
        arrays[name] = change(arrays[name])
        np.savez(path, **arrays)
    return changed


REFUSED_STUDIES = {
    "H negative": (text("harmonics = [1]", "harmonics = [-1]"), r"harmonics.*-1.*1.*99"),
    "H zero": (text("harmonics = [1]", "harmonics = [0]"), r"harmonics.*0.*1.*99"),
    "H not whole": (text("harmonics = [1]", "harmonics = [2.5]"), r"harmonics.*2\.5.*whole"),
    "H absurd": (text("harmonics = [1]", "harmonics = [5000]"), r"harmonics.*5000.*99"),
    "NaN in K": (array("K", lambda K: with_entry(K, 3, 5, np.nan)), r"K\[3, 5\] is nan"),
    "K unsymmetric": (array("K", lambda K: with_entry(K, 0, 1, 1e6)), r"K is not symmetric.*1e-10"),
    "M of another size": (array("M", lambda M: M[:-1, :-1]), r"M is \(26, 26\), K is \(27, 27\)"),
    "kn negative": (cell("kn", "-1"), r"pair 2: kn = -1"),
    "kt negative": (cell("kt", "-1"), r"pair 2: kt = -1"),
    "mu negative": (cell("mu", "-0.5"), r"pair 2: mu = -0\.5"),
    "mu a text": (cell("mu", "much"), r"line 3: mu = 'much' is not a number"),
    "no pairs": (no_rows, r"holds no contact pairs"),
    "band empty": (text("[900, 1400]", "[900, 900]"), r"band.*empty"),
    "band reversed": (text("[900, 1400]", "[1400, 900]"), r"band.*the first must be below the last"),
    "band negative": (text("[900, 1400]", "[-900, 1400]"), r"band.*-900"),
    "damping negative": (text("damping_ratio = 0.01", "damping_ratio = -0.01"), r"damping_ratio.*-0\.01"),
    "level not a number": (text("levels = [5]", "levels = ['much']"), r"levels.*much"),
    "key misspelt": (text("harmonics", "harmonic"), r"harmonic'.*harmonics"),
}


@pytest.mark.parametrize("row", REFUSED_STUDIES)
def test_refused_in_a_study(row, study, capsys, monkeypatch):
    """Exit code 2, one line on the error stream, before any stage is solved."""
    change, message = REFUSED_STUDIES[row]
    change(study)

    def heavy(*_, **__):
        raise AssertionError("something heavy has started")
    monkeypatch.setattr(residual, "stuck_receptance", heavy)
    assert main(["run", str(study), "--quiet"]) == 2
    error = capsys.readouterr().err.strip()
    assert re.search(message, error), error
    assert "Traceback" not in error and len(error.splitlines()) == 1
    shutil.rmtree(study.parent / "results", ignore_errors=True)


def test_the_study_that_the_changes_start_from_is_good(study):
    assert main(["run", str(study), "--quiet"]) == 0


# ---- input with a known answer ------------------------------------------------------------------------------------

def test_no_force_is_the_static_state():
    """Nothing moves from the preloaded state; from the unloaded one, what the load exceeds the preload by moves it."""
    found = curve(forcing=0 * TIP)
    assert found.complete and found.ended == "no force: the static state" and len(found.frequency) == 2
    assert np.abs(found.harmonics).max() == 0 and np.abs(found.dissipated).max() == 0
    assert np.isfinite(found.peak("tip")).all()
    gap = -PAIRS.preload / PAIRS.kn                        # pressed by as much: closed at q = 0
    B = relative_motion(MODEL, PAIRS).toarray()
    k = np.stack([PAIRS.kt, PAIRS.kt, PAIRS.kn], axis=1).ravel()
    push = B.T @ np.stack([0 * gap, 0 * gap, PAIRS.preload], axis=1).ravel()
    loaded = curve(forcing=0 * TIP, origin="unloaded", static=push + 1e-2 * TIP, gap=gap, start="zero_slider")
    expected = TIP @ np.linalg.solve(MODEL.K + (B.T * k) @ B, 1e-2 * TIP)
    assert loaded.complete and loaded.harmonics[0, 0, 0].real == pytest.approx(expected, rel=1e-9)
    assert np.abs(loaded.harmonics[..., 1:]).max() == 0


def test_no_friction_is_the_linear_system():
    """mu = 0 while every pair stays closed: normal springs alone, to 1e-10; modes of damping as in the stuck system."""
    found = curve(mu=0 * PAIRS.mu, forcing=1e-3 * TIP, harmonics=3)
    assert found.complete and np.nanmax(found.share_open) == 0
    B = relative_motion(MODEL, PAIRS).toarray()
    tangent = np.kron(np.diag(PAIRS.kt), np.diag([1.0, 1, 0])) + np.kron(np.diag(PAIRS.kn), np.diag([0, 0, 1.0]))
    stuck = MODEL.K + B.T @ tangent @ B
    normal = MODEL.K + (B.T * np.kron(PAIRS.kn, [0, 0, 1.0])) @ B
    receptance = free_receptance(MODEL.M, stuck, 0.02)               # its modes carry the damping
    C = np.linalg.inv(receptance.shapes).T @ np.diag(0.04 * np.sqrt(receptance.stiffness)) @ np.linalg.inv(
        receptance.shapes)
    for f, X in zip(found.frequency[::7], found.harmonics[::7, 0, 1], strict=True):
        w = 2 * np.pi * f
        expected = TIP @ np.linalg.solve(normal - w**2 * MODEL.M + 1j * w * C, 1e-3 * TIP)
        assert abs(X - expected) < 1e-10 * np.abs(found.harmonics[:, 0, 1]).max()


def test_a_band_from_high_to_low_is_run_downwards():
    up, down = curve(), curve(band=(1500, 1100))
    assert down.complete and down.frequency[0] == pytest.approx(1500) and down.frequency[-1] == pytest.approx(1100)
    assert down.peak("tip")[1] == pytest.approx(up.peak("tip")[1], rel=1e-8)
