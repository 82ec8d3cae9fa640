"""`tipdamp export`: the reduced model of a study for other codes, and back in."""

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.measured.read import read_measured
from tipdamp.study.schema import Measured


def test_reduced_model_exported_and_read_back(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    assert main(["export", str(path)]) == 2
    assert f"run: tipdamp reduce {path}" in capsys.readouterr().err
    assert main(["reduce", str(path), "--quiet"]) == 0
    results = tmp_path / "results" / "corner"
    model = ReducedModel.load(results / "model.npz")
    assert "pull" in model.loads and model.groups
    for arguments, names in (
        ([], ("M.mtx", "K.mtx")),
        (["--format", "mat"], ("model.mat", "model.mat")),
    ):
        assert main(["export", str(path), *arguments]) == 0
        out = results / "export"
        again = ReducedModel.from_files(*(out / name for name in names), dofs=out / "dofs.csv")
        assert again.K == pytest.approx(model.K, rel=1e-14) and again.M == pytest.approx(
            model.M, rel=1e-14
        )
        assert np.array_equal(again.loads["pull"], model.loads["pull"]) and set(
            again.groups
        ) == set(model.groups)
        assert (
            again.body.tolist() == model.body.tolist()
            and again.node.tolist() == model.node.tolist()
        )
    assert main(["export", str(path), "--format", "xls"]) == 2
    assert "export to 'xls' is unknown" in capsys.readouterr().err


@pytest.mark.slow
def test_responses_for_modal_analysis(tmp_path, capsys):
    """A measured curve of another study reads them, with the amplitude per newton of the curve."""
    path = corner_study.write(
        tmp_path,
        change=[
            ("levels = [1]", "levels = [0.02]\nharmonics = [1]"),
            ("[20000, 40000]", "[20000, 20100]"),
            ("[respond]", "[tune]\nstations = 'all'\n[respond]"),
        ],
    )
    assert main(["export", str(path), "--format", "unv"]) == 2
    assert f"run: tipdamp respond {path}" in capsys.readouterr().err
    for stage in ("reduce", "preload", "tune", "respond"):
        assert main([stage, str(path), "--quiet"]) == 0
    assert main(["export", str(path), "--format", "unv"]) == 0
    results = tmp_path / "results" / "corner"
    (file,) = results.glob("responses/*_H1.npz")
    curve = ForcedResponse.load(file)
    settings = Measured.model_validate({"files": "x", "level": 0.02, "records": [2]})
    ((frf,), _) = read_measured([results / "export" / "responses.unv"], settings)
    assert frf.hz == pytest.approx(curve.frequency, rel=1e-5)
    assert frf.amplitude == pytest.approx(curve.amplitude("harmonic")[:, 1] / 0.02, rel=1e-6)
