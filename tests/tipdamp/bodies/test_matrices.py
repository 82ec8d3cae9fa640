"""Faults of given matrices and their pairs: one line that names the file and the fault."""

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """(arrays of a model, its pairs) of the cube in its corner."""
    study = load_study(corner_study.write(tmp_path_factory.mktemp("good")))
    store = results_folder(study, None)
    for name in ("reduce", "preload"):
        run_stage(name, study, store, quiet=True)
    with np.load(store.path("model.npz"), allow_pickle=False) as z:
        return dict(z), ContactTable.load(store.path("preload.csv"))


def answer(folder, capsys, good, pairs=None, **changed):
    np.savez(folder / "model.npz", **{**good[0], **changed})
    (pairs or good[1]).save(folder / "pairs.csv")
    (folder / "study.toml").write_text(corner_study.MATRICES)
    codes = [
        main([stage, str(folder / "study.toml")]) for stage in ("inspect", "reduce", "preload")
    ]
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return max(codes), said


def test_nothing_to_complain_of(good, tmp_path, capsys):
    assert answer(tmp_path, capsys, good)[0] == 0


def body(good, name):
    mine = good[0]["body"] == name
    return np.ix_(mine, mine)


def test_faulty_matrices(good, tmp_path, capsys):
    """Unsymmetric, zero row of mass, not a number."""
    for key, change, words in (
        ("K", lambda A: A.__setitem__((0, 1), A[0, 1] + 1e-6 * A.max()), "K is not symmetric"),
        (
            "M",
            lambda A: (A.__setitem__(5, 0.0), A.__setitem__((slice(None), 5), 0.0)),
            "M has a row of zeros at dof 5",
        ),
        ("K", lambda A: A.__setitem__((2, 2), np.nan), r"K[2, 2] is nan"),
    ):
        A = good[0][key].copy()
        change(A)
        code, said = answer(tmp_path, capsys, good, **{key: A})
        assert code == 2 and words in said


def test_blades_that_float(good, tmp_path, capsys):
    K = good[0]["K"].copy()
    K[body(good, "blades")] = 0.0
    code, said = answer(tmp_path, capsys, good, K=K)
    assert (
        code == 2
        and "motions of the blades meet no stiffness" in said
        and "only the damper may be free" in said
    )


@pytest.mark.parametrize("name", ["blades", "damper"])
def test_negative_stiffness(good, tmp_path, capsys, name):
    K = good[0]["K"].copy()
    K[body(good, name)] *= -1
    code, said = answer(tmp_path, capsys, good, K=K)
    assert (
        code == 2 and "K is indefinite: a motion mostly of dof" in said and f"of the {name}" in said
    )


@pytest.mark.parametrize("column, value", [("kn", 0.0), ("kn", np.inf), ("kt", np.inf)])
def test_springs_that_the_dynamics_cannot_use(good, tmp_path, capsys, column, value):
    springs = getattr(good[1], column).copy()
    springs[3] = value
    code, said = answer(tmp_path, capsys, good, pairs=good[1].replace(**{column: springs}))
    assert code == 2 and f"pair 4: {column} = {value:g} must be finite" in said


def test_pickled_objects_are_not_read(good, tmp_path, capsys):
    code, said = answer(tmp_path, capsys, good, M=np.array([object()], dtype=object))
    assert code == 2 and "allow_pickle=False" in said


@pytest.mark.parametrize(
    "name, content", [("model.npz", b"not a zip"), ("pairs.csv", "side\n\u00e9".encode("utf-16"))]
)
def test_unreadable_files_are_one_line(variant, tmp_path, capsys, name, content):
    variant("inspect")
    (tmp_path / name).write_bytes(content)
    assert main(["reduce", str(tmp_path / "rig.toml"), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert name in error and error.count("\n") == 1
