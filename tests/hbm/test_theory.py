"""The examples of docs/theory, run as they stand; and the files that the response's pages name are
there."""

import re
import runpy
from pathlib import Path

import pytest

from tipdamp import ForcedResponse

ROOT = Path(__file__).parents[2]
THEORY = ROOT / "docs" / "theory"


@pytest.mark.parametrize(
    "page,examples", [("harmonic_balance", 5), ("time_integration", 1), ("contact_stiffness", 1)]
)
def test_the_examples_run(page, examples):
    text = (THEORY / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) == examples
    names = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


def test_the_first_hour_from_equations():
    """The chain of docs/first_hour.md: its curve is complete, has a fold, and integration stays on
    it."""
    text = (ROOT / "docs" / "first_hour.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text.partition("## From equations")[2], re.DOTALL)
    names = {}
    exec(compile(block, "first_hour.md", "exec"), names)
    curve = names["curve"]
    assert curve.complete and "fold" in {at.kind for at in curve.named_points}
    assert names["compare"](curve, names["driven"].contact_problem, 34.0).difference < 1e-6


def test_the_whole_route_from_python(tmp_path, monkeypatch):
    """docs/python.md, block by block: the energies balance, integration finds the orbit again, the
    file is there."""
    monkeypatch.chdir(tmp_path)
    names = {}
    text = (
        (ROOT / "docs" / "python.md")
        .read_text(encoding="utf-8")
        .partition("## From a finished study")[0]
    )
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "python.md", "exec"), names)
    assert all(
        curve.complete and curve.energy_error.max() < 1e-6 for curve in names["curves"].values()
    )
    assert (
        names["energy"].friction.sum() > 0.1 * names["energy"].input
        and names["energy"].error < 1e-6
    )
    assert names["alone"].amplitude() == pytest.approx(names["curve"].peak("tip")[1], rel=1e-6)
    assert names["found"].stable and names["found"].difference < 1e-2
    assert ForcedResponse.load("curve.npz") == names["curve"]


@pytest.mark.parametrize("page", ["harmonic_balance", "time_integration"])
def test_files_and_links_of_the_page(page):
    text = (THEORY / f"{page}.md").read_text(encoding="utf-8")
    for name in re.findall(r"`([a-z_/]+\.py)`", text):
        assert any((ROOT / "hbm").rglob(name)), name
    for link in re.findall(r"\]\(([^)]+)\)", text):
        assert (THEORY / link).exists(), link


@pytest.mark.slow
def test_pictures_of_modes_and_peaks(tmp_path):
    """The script still draws them, and a page shows each."""
    pytest.importorskip("matplotlib")
    drawn = runpy.run_path(str(THEORY / "modes_and_peaks.py"))
    pages = [
        (THEORY / f"{page}.md").read_text("utf-8") for page in ("nonlinear_modes", "following")
    ]
    for name in drawn["PICTURES"]:
        assert any(f"{name}.png" in page for page in pages)
    drawn["main"](tmp_path, ["backbones", "rig_tornado"])
    for name in ("backbones", "rig_tornado"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


@pytest.mark.slow
def test_pictures_of_trusted_curves(tmp_path):
    """The script still draws those that are not from the rows of the validation page."""
    pytest.importorskip("matplotlib")
    main = runpy.run_path(str(THEORY / "trusted_curves.py"))["main"]
    names = "detached_curve", "stiff_stop"
    main(tmp_path, names)
    for name in names:
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
        assert f"{name}.png" in (THEORY / "trusted_curves.md").read_text(encoding="utf-8")
