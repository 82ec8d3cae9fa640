"""A wedge damper under blade platforms that slides along its axis at 3 N: the curves stop, and have no peak."""

import shutil
from pathlib import Path

import pytest

from tests.conftest import changed
from tipdamp.cli import main
from tipdamp.store import Store

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
FOLDER = Path(__file__).parents[1] / "reference" / "platform-wedge"


def test_curve_that_stops_has_no_peak(tmp_path, capsys):
    """309 and 491 um/N are where they stop; the peak, with a soft spring along the axis, is 1042.6 um/N at 823.6 Hz."""
    for name in ("coarse_blades.msh", "coarse_damper.msh"):
        shutil.copy(FOLDER / name, tmp_path)
    text = (FOLDER / "coarse.toml").read_text(encoding="utf-8")
    (tmp_path / "coarse.toml").write_text(changed(text, ("levels = [0.1, 1, 3]", "levels = [3]")), encoding="utf-8")
    assert main(["run", str(tmp_path / "coarse.toml"), "--quiet"]) == 1
    printed = capsys.readouterr()
    summary = Store(tmp_path / "results" / "coarse").read_json("summary.json")
    up, down = summary["responses"][0], summary["responses"][0]["back"]
    for one, bound in ((up, 308.8e-6), (down, 491e-6)):
        assert one["peak_hz"] is None and one["peak_m"] is None and "rigid-body drift" in one["ended"]
        assert one["at_least_m"] / 3 == pytest.approx(bound, rel=1e-3)
    assert "2 curves incomplete, 2 without a peak" in printed.out
    assert "no peak, at least 926.5 um at 809.4 Hz; stopped at 809.394 Hz: " in printed.out
    assert any("followed from the other end is incomplete: no peak, at least 1473 um" in w for w in summary["warnings"])
