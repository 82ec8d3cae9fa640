"""`tipdamp export`: the reduced model of a study for other codes, and back in."""

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.hbm.model import ReducedModel


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
