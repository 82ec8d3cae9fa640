"""What is written for other codes comes back as the same model: matrices, dof table, loads and
groups."""

import numpy as np
import pytest
import scipy.io

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.matrices_out import write_model
from tipdamp.hbm.model import ReducedModel


@pytest.fixture
def model():
    """Two bodies with a node 7 each, a mode, a clamped direction, names with spaces and commas."""
    rng = np.random.default_rng(3)
    A = rng.standard_normal((7, 7))
    position = np.vstack(
        [np.repeat(rng.standard_normal((2, 3)), 3, axis=0), np.full((1, 3), np.nan)]
    )
    return ReducedModel.from_matrices(
        A @ A.T / 3 + np.eye(7),
        1e6 * (A + A.T),
        0.1 * A @ A.T,
        body=["left, one"] * 3 + ["pin"] * 4,
        node=[7, 7, 7, 7, 7, 7, 1],
        direction=["x", "y", "z"] * 2 + ["mode"],
        position=position,
        groups={"left, one/tip": [7], "pin/end line": [7]},
        loads={"pull": rng.standard_normal(7), "own weight": A[0]},
    )


@pytest.mark.parametrize("kind", ["npz", "npz alone", "mat", "mat alone", "mtx"])
def test_comes_back_the_same(model, tmp_path, kind):
    """An .npz or .mat holds the dof table, the groups and the loads: alone it is the whole
    model."""
    kind, _, alone = kind.partition(" ")
    written = write_model(model, tmp_path / "out", kind)
    assert all(path.is_file() for path in written)
    if alone:
        again = ReducedModel.from_files(*3 * written[:1])
    elif kind == "npz":
        again = ReducedModel.load(written[0])
    else:
        matrix = [
            tmp_path / "out" / ("model.mat" if kind == "mat" else f"{name}.mtx") for name in "MKC"
        ]
        again = ReducedModel.from_files(*matrix, dofs=tmp_path / "out" / "dofs.csv")
    for name in ("M", "K", "C", "position"):
        assert np.allclose(
            getattr(again, name), getattr(model, name), rtol=1e-15, atol=0, equal_nan=True
        )
    for name in ("body", "node", "direction"):
        assert np.array_equal(getattr(again, name), getattr(model, name))
    for name in ("groups", "loads"):
        one, two = getattr(again, name), getattr(model, name)
        assert set(one) == set(two) and all(np.array_equal(one[k], two[k]) for k in one)


def test_unknown_kind(model, tmp_path):
    with pytest.raises(InputError, match="export to 'mtz' is unknown.*mtx"):
        write_model(model, tmp_path, "mtz")


@pytest.mark.parametrize("kind", ["mat", "mtx"])
@pytest.mark.parametrize("name", ["", "a ", " a"])
def test_names_that_a_dof_table_would_not_keep_are_refused(tmp_path, kind, name):
    made = [
        ("body", {"body": name}),
        ("load", {"loads": {name: np.ones(1)}}),
    ]
    for of, named in made:
        model = ReducedModel.from_matrices([[1.0]], [[1e6]], **named)
        with pytest.raises(InputError, match=f"export to '{kind}': {of} '{name}' is empty or has"):
            write_model(model, tmp_path, kind)
        assert ReducedModel.load(*write_model(model, tmp_path, "npz")).body[0] == model.body[0]


def test_mat_of_another_program_with_an_empty_name(model, tmp_path):
    """MATLAB has no characters in an empty cell: reading it ended in a traceback."""
    path = write_model(model, tmp_path, "mat")[0]
    content = scipy.io.loadmat(path)
    content["load_names"][0, 0] = np.array([], dtype="<U1")
    scipy.io.savemat(path, {k: v for k, v in content.items() if not k.startswith("__")})
    again = ReducedModel.from_files(M=path, K=path)
    assert np.array_equal(again.loads[""], model.loads["pull"])
