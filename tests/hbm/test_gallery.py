"""The six basic examples: each block runs by itself, in eight lines at most, and draws its
picture."""

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la

from tipdamp.hbm.example import cantilever

PAGE = Path(__file__).parents[2] / "docs" / "gallery" / "six_examples.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize("block", BLOCKS, ids=[re.findall(r"(\w+)\.png", b)[0] for b in BLOCKS])
def test_an_example_runs(block, tmp_path, monkeypatch):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    pyplot.close("all")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(compile(block, str(PAGE), "exec"), names)
    curve = names["curve"]
    assert curve.complete and np.nanmax(curve.energy_error) < 1e-5
    assert 0 < curve.amplitude()[:, 0].argmax() < len(curve.frequency) - 1
    assert (tmp_path / re.findall(r"(\w+\.png)", block)[0]).stat().st_size > 1000


def test_there_are_six_of_eight_lines():
    assert len(BLOCKS) == 6
    assert max(len([line for line in block.splitlines() if line]) for block in BLOCKS) <= 8


def test_the_beam_has_its_first_frequency():
    """1.8751^2 sqrt(E I / (rho A L^4)) [Blevins 1979]."""
    M, K = cantilever(0.7, 0.014, 0.014)
    found = np.sqrt(la.eigh(K, M, eigvals_only=True)[0])
    expected = 1.875104**2 * np.sqrt(210e9 * 0.014**2 / 12 / 7850) / 0.7**2
    assert found == pytest.approx(expected, rel=1e-5)
