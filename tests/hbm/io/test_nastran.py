"""Matrices of Nastran: OUTPUT4, punched DMIG and, with pyNastran, OUTPUT2; sources of the files in
tests/reference/hbm/README.md."""

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tipdamp.hbm.balance.receptance import natural_frequencies
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.matrices_in import read_matrix
from tipdamp.hbm.io.op4 import read_op4, write_op4
from tipdamp.hbm.io.punch import read_punch, write_punch
from tipdamp.hbm.matrices_out import write_model
from tipdamp.hbm.model import ReducedModel

FILES = Path(__file__).parents[2] / "reference" / "hbm" / "nastran"
KINDS = ["t_dn", "t_s1", "t_s2", "b_dn", "b_s1", "b_s2"]  # text, binary; dense, strings, BIGMAT
doubles = arrays.arrays(
    float,
    arrays.array_shapes(min_dims=2, max_dims=2, max_side=6),
    elements=st.just(0.0) | st.floats(-1e30, 1e30, allow_subnormal=False),
)


@pytest.mark.parametrize("kind", KINDS)
def test_one_set_of_matrices_in_six_layouts(kind):
    """EYE10 is an identity by name, EYE5CD a complex multiple of one, LOW counts its columns."""
    found, dense = read_op4(FILES / f"mat_{kind}.op4"), read_op4(FILES / "mat_t_dn.op4")
    assert set(found) == set(dense)
    for name, matrix in dense.items():
        assert (found[name] != matrix).nnz == 0, name
    assert (found["EYE10"] != sp.eye(10)).nnz == 0
    assert np.array_equal(found["EYE5CD"].toarray(), (-1 + 1j) * np.eye(5))
    assert found["NULL"].shape == (3, 3) and found["NULL"].nnz == 0
    assert all(set(found["LOW"][:, [j]].data) <= {j + 1.0} for j in range(7))


@settings(max_examples=60, deadline=None)
@given(doubles)
def test_op4_keeps_every_bit(tmp_path_factory, matrix):
    path = tmp_path_factory.mktemp("op4") / "a.op4"
    write_op4(path, {"KAA": matrix, "MAA": sp.csc_matrix(matrix.T)})
    found = read_op4(path)
    assert np.array_equal(found["KAA"].toarray(), matrix)
    assert np.array_equal(found["MAA"].toarray(), matrix.T)


@settings(max_examples=40, deadline=None)
@given(doubles, st.sets(st.tuples(st.integers(1, 99999999), st.integers(0, 6)), min_size=6))
@example(np.array([[-1.0], [1.0000000049e-241]]), {(1, i) for i in range(6)})
def test_punch_keeps_ten_digits_and_names(tmp_path_factory, half, names):
    """Rows that are empty are not in the file: all others come back by their names."""
    path = tmp_path_factory.mktemp("pch") / "a.pch"
    A = half @ half.T if np.abs(half).max() < 1e10 else np.sign(half @ half.T)
    labels = sorted(names)[: len(A)]
    write_punch(path, {"KAAX": A}, labels)
    found, rows = read_punch(path)
    held = [k for k in range(len(A)) if A[k].any()]
    assert list(rows) == [labels[k] for k in held]
    again = found["KAAX"].toarray()
    assert np.allclose(again, A[np.ix_(held, held)], rtol=1e-9, atol=0)


def test_punch_of_another_program_is_a_model():
    """K has the frequencies of the eigenproblem; the damper of 15 dofs stands at its own nodes."""
    model = ReducedModel.from_files(*3 * [FILES / "dmig.pch"])
    assert model.size == 15 and set(model.direction) == {"x"}
    assert model.K[0, 0] == 155.6 and model.K[0, 1] == -155.6 == model.K[1, 0]
    assert np.all(np.diag(model.M) > 0) and np.any(model.C)
    squares = np.linalg.eigvals(np.linalg.solve(model.M, model.K)).real
    assert np.allclose(
        natural_frequencies(model)[2:5], np.sqrt(np.sort(squares))[2:5] / (2 * np.pi), rtol=1e-6
    )


def test_names_of_nastran_are_found(tmp_path):
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    write_op4(tmp_path / "se.op4", {"KAA": K, "MAA": np.eye(2), "PA": np.ones((2, 1))})
    assert np.array_equal(read_matrix(tmp_path / "se.op4", "K")[0], K)
    assert np.array_equal(read_matrix(tmp_path / "se.op4", "M")[0], np.eye(2))
    with pytest.raises(InputError, match="holds no 'C'.*KAA"):
        read_matrix(tmp_path / "se.op4", "C")


@pytest.mark.parametrize("kind", ["op4", "pch"])
def test_model_goes_to_nastran_and_back(tmp_path, kind):
    rng = np.random.default_rng(1)
    A = rng.normal(size=(5, 5))
    model = ReducedModel.from_matrices(
        A @ A.T + np.eye(5),
        1e6 * (A.T @ A + np.eye(5)),
        body="disc",
        node=[7, 7, 2, 2, 100],
        direction=["x", "ry", "y", "x", "mode"],
        loads={"pull": np.arange(5.0)},
        groups={"disc/tip": [7]},
    )
    path, dofs = write_model(model, tmp_path, kind)
    again = ReducedModel.from_files(path, path, dofs=dofs)
    order = np.arange(5) if kind == "op4" else np.array([3, 2, 0, 1, 4])
    digits = 0 if kind == "op4" else 1e-9
    for name in "MK":
        expected = getattr(model, name)[np.ix_(order, order)]
        assert np.allclose(getattr(again, name), expected, rtol=digits, atol=0)
    assert np.array_equal(again.loads["pull"], model.loads["pull"][order])
    assert again.direction.tolist() == model.direction[order].tolist()
    assert again.groups["disc/tip"].tolist() == [7]


def test_nodes_of_one_number_are_no_punch(tmp_path):
    two = {"body": ["a", "b"], "node": [1, 1], "direction": ["x", "x"]}
    model = ReducedModel.from_matrices(np.eye(2), np.eye(2), **two)
    with pytest.raises(InputError, match="two bodies.*op4"):
        write_model(model, tmp_path, "pch")


def test_modes_are_scalar_points_beside_the_grids(tmp_path):
    """Nastran numbers grids and scalar points together: modes 1 and 2 of two bodies are neither
    each other nor nodes 1 and 2."""
    model = ReducedModel.from_matrices(
        np.diag(np.arange(1.0, 7)),
        1e6 * np.diag(np.arange(1.0, 7)),
        body=["a", "a", "a", "b", "b", "b"],
        node=[1, 1, 2, 20, 1, 2],
        direction=["x", "mode", "mode", "y", "mode", "mode"],
    )
    path, dofs = write_model(model, tmp_path, "pch")
    _, labels = read_punch(path)
    grids, scalars = ({n for n, d in labels if bool(d) == grid} for grid in (True, False))
    assert grids == {1, 20} and len(scalars) == 4 and not grids & scalars
    again = ReducedModel.from_files(path, path, dofs=dofs)
    assert again.M.diagonal().tolist() == [1, 4, 2, 3, 5, 6]
    assert again.body.tolist() == ["a", "b", "a", "a", "b", "b"]


@pytest.mark.parametrize("value", [-1.23456789012e-150, 9.99999999999e-100, -4e-320, 1e300])
def test_numbers_of_three_exponents_stay_in_their_field(tmp_path, value):
    path = tmp_path / "a.pch"
    write_punch(path, {"KAAX": np.array([[value]])}, [(1, 1)])
    assert max(map(len, path.read_text().splitlines())) <= 56
    assert read_punch(path)[0]["KAAX"][0, 0] == pytest.approx(value, rel=1e-7)


def test_numbers_of_nine_digits_are_no_grids(tmp_path):
    model = ReducedModel.from_matrices([[1.0]], [[1.0]], node=[123456789], direction=["x"])
    with pytest.raises(InputError, match="123456789.*8 digits.*op4"):
        write_model(model, tmp_path, "pch")


@pytest.mark.parametrize("kind", KINDS)
def test_cut_off_op4_is_told(tmp_path, kind):
    """Or it was cut between two matrices: then those before the cut are whole."""
    content, whole = (FILES / f"mat_{kind}.op4").read_bytes(), read_op4(FILES / f"mat_{kind}.op4")
    told = 0
    for share in np.linspace(0.02, 0.98, 25):
        (tmp_path / "a.op4").write_bytes(content[: int(share * len(content))])
        try:
            found = read_op4(tmp_path / "a.op4")
        except InputError as error:
            told += "cut off" in str(error)
            continue
        assert all((matrix != whole[name]).nnz == 0 for name, matrix in found.items())
    assert told >= 20


def test_damaged_punch_names_its_line(tmp_path):
    text = (FILES / "dmig.pch").read_text().replace("3.815000000D+02", "3.8l5000000D+02", 1)
    (tmp_path / "a.pch").write_text(text)
    with pytest.raises(InputError, match="line 6"):
        read_punch(tmp_path / "a.pch")


def test_pynastran_reads_what_is_written(tmp_path):
    op4 = pytest.importorskip("pyNastran.op4.op4")
    A = np.random.default_rng(0).normal(size=(7, 7)) * (np.arange(7) != 3)
    write_op4(tmp_path / "a.op4", {"KAA": A})
    theirs = op4.read_op4(str(tmp_path / "a.op4"), debug=None)["KAA"].data
    assert np.array_equal(theirs.toarray() if sp.issparse(theirs) else theirs, A)


def test_op2_with_pynastran():
    """A stiffness of the g-set of MSC Nastran: translations of all nodes cost no energy."""
    pytest.importorskip("pyNastran.op2.op2")
    K, _ = read_matrix(FILES / "static_solid_shell_bar_kelm.op2", "K")
    assert np.array_equal(K, K.T)
    for k in range(3):
        rigid = np.zeros(len(K))
        rigid[k::6] = 1
        assert np.abs(K @ rigid).max() < 1e-6 * np.abs(K).max()
