"""A wedge damper under blade platforms that slides along its axis at 3 N: the curves stop, and have
no peak; held along its axis they are complete."""

import re
import shutil
from pathlib import Path

import pytest

from tests.conftest import changed
from tests.tipdamp.backwards import followed_back
from tests.tipdamp.rig_study import CHAIN_OF_STAGES
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.stages.report import said
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
FOLDER = Path(__file__).parents[1] / "reference" / "platform-wedge"


def run(folder, *changes, verbs=("run",)):
    """(exit code of the last verb, results) of the study at 3 N."""
    for name in ("coarse_blades.msh", "coarse_damper.msh"):
        shutil.copy(FOLDER / name, folder)
    text = (FOLDER / "coarse.toml").read_text(encoding="utf-8")
    (folder / "coarse.toml").write_text(
        changed(text, ("levels = [0.1, 1, 3]", "levels = [3]"), *changes), encoding="utf-8"
    )
    codes = [main([verb, str(folder / "coarse.toml"), "--quiet"]) for verb in verbs]
    return codes[-1], Store(folder / "results" / "coarse")


def test_held_along_its_axis(tmp_path):
    """Both ways are complete: 1042.6 um/N at 823.6 Hz, what a stop along the axis would have to
    take, and with 102 pairs that slip and lift whether the peak is stable: with one harmonic it is
    not."""
    code, store = run(tmp_path, ("pull = 60", 'pull = 60\nhold = "y"'))
    up = store.read_json("summary.json")["responses"][0]
    assert code == 0 and up["complete"] and up["alike_backwards"] and up["held_change"] < 1e-4
    assert up["peak_m"] / 3 == pytest.approx(1042.6e-6, rel=1e-3)
    assert up["peak_hz"] == pytest.approx(823.6, rel=1e-3)
    assert up["unstable"]
    study = load_study(tmp_path / "coarse.toml")
    [(down, peak, held)] = followed_back(study, store, [up])
    assert down.complete and peak.peak_m == pytest.approx(up["peak_m"], rel=1e-6)
    force, back = (forces["damper: slide along y"] for forces in (up["held"], held))
    assert (
        back.mean == pytest.approx(force["mean"], rel=1e-4)
        and abs(force["mean"]) > 0.01
        and force["unit"] == "N"
    )
    assert (store.folder / "figures" / "held.png").is_file()


def test_curve_that_stops_has_no_peak(tmp_path, capsys):
    """309 and 491 um/N are where they stop; the peak, with a soft spring along the axis, is 1042.6
    um/N at 823.6 Hz."""
    code, store = run(tmp_path, verbs=("inspect", *CHAIN_OF_STAGES))
    printed, found = capsys.readouterr(), store.read_json("respond.json")
    assert code == 3
    up, down = found["responses"][0], found["responses"][0]["back"]
    for one, bound in ((up, 308.8e-6), (down, 491e-6)):
        assert (
            one["peak_hz"] is None and one["peak_m"] is None and "rigid-body drift" in one["ended"]
        )
        assert "slides along (0.00, 1.00, 0.00)" in one["ended"]
        assert "hold = { motion = 'y', mean = true } in [damper]" in one["ended"]
        assert one["at_least_m"] / 3 == pytest.approx(bound, rel=1e-3)
    assert "2 curves incomplete, 2 without a peak" in printed.out
    assert "no peak, at least 926.5 um at 809.4 Hz; stopped at 809.394 Hz: " in printed.out
    assert any(
        re.search("followed from the other end is incomplete.*: no peak, at least 1473 um", w)
        for w in said(load_study(tmp_path / "coarse.toml"), store)["respond"]
    )
