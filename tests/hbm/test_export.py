"""What is exported comes back as it was."""

import numpy as np
import pytest
import scipy.io

from hbm.errors import InputError
from hbm.export import export
from hbm.files import model_from_files
from hbm.model import ReducedModel

from .small_rig import small_rig


@pytest.fixture(scope="module")
def model():
    """The small rig with a modal dof at the end, damping and a load."""
    plain, _, force = small_rig(stations=3)
    r = plain.size + 1
    M, K = np.eye(r), np.eye(r) * 7e5
    M[:-1, :-1], K[:-1, :-1] = plain.M, plain.K
    M[0, -1] = M[-1, 0] = 1 / 3000
    add = lambda column, value: np.append(column, [value], axis=0)  # noqa: E731
    return ReducedModel.from_matrices(
        M, K, M / 3 + 1e-6 * K, body=add(plain.body, "damper"), node=add(plain.node, 1),
        direction=add(plain.direction, "mode"), position=add(plain.position, [np.nan] * 3),
        loads={"pull": np.append(force, 0.1)})


def same(one, two):
    for name in ("M", "K", "C", "position"):
        assert np.array_equal(getattr(one, name), getattr(two, name), equal_nan=True), name
    for name in ("body", "node", "direction"):
        assert getattr(one, name).tolist() == getattr(two, name).tolist(), name


def test_npz(model, tmp_path):
    npz, dofs = export(model, tmp_path / "model.npz")
    back = ReducedModel.load(npz)
    same(back, model)
    assert np.array_equal(back.loads["pull"], model.loads["pull"])
    same(model_from_files(npz, npz, npz, dofs), model)


def test_matlab(model, tmp_path):
    mat, dofs = export(model, tmp_path / "model.mat")
    same(model_from_files(mat, mat, mat, dofs), model)
    assert np.array_equal(scipy.io.loadmat(mat)["load_pull"].ravel(), model.loads["pull"])


def test_matrix_market(model, tmp_path):
    M, K, C, dofs = export(model, tmp_path / "model.mtx")
    assert [p.name for p in (M, K, C, dofs)] == ["model_M.mtx", "model_K.mtx", "model_C.mtx", "model_dofs.csv"]
    same(model_from_files(M, K, C, dofs), model)


def test_unknown_format(model, tmp_path):
    with pytest.raises(InputError, match=r"format of .*model.mad is unknown; did you mean '.mat'"):
        export(model, tmp_path / "model.mad")
