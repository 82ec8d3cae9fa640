"""Stage preload: the load at rest, further load cases, and cases of given matrices."""

import shutil

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import own_pairs
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.stages import preload
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study

SPEED, ARM = 100.0, 0.105  # rad/s, m: the cube's centre from the axis along x and along z
EACH = 7850 * corner_study.A**3 * SPEED**2 * ARM  # N on each side
CASE = corner_study.TURNING.format(pull=0) + '[preload]\ncase = "turning"\n'
TUNE = "[tune]\nstations = 'all'\n[respond]"


def run(folder, text, *stages, change=()):
    study = load_study(corner_study.write(folder, change=[("[respond]", text + TUNE), *change]))
    store = results_folder(study, None)
    return store, [run_stage(name, study, store, quiet=True) for name in stages]


def sums(folder, store, name):
    pairs = ContactTable.load(store.path(name))
    return [
        np.maximum(pairs.preload, 0)[(pairs.side == s) & pairs.carrying].sum()
        for s in ("one", "two")
    ]


@pytest.mark.parametrize(
    "friction, preload", [(False, "scaled"), (False, "resolved"), (True, "scaled")]
)
def test_a_case_in_place_of_the_pull(tmp_path, friction, preload):
    """The damper pressed by rotation alone: mass times speed^2 r on each side, in the map and on
    the kept pairs. With friction and kt = kn every pair slips in the corner: 1/(1 + mu) of it."""
    store, _ = run(
        tmp_path,
        CASE + ("friction = true\n" if friction else ""),
        "reduce",
        "preload",
        "tune",
        change=[("stations = 'all'", f"stations = 'all'\npreload = '{preload}'")],
    )
    expected = EACH / 1.3 if friction else EACH
    assert sums(tmp_path, store, "preload.csv") == pytest.approx([expected] * 2, rel=1e-3)
    assert sums(tmp_path, store, "kept.csv") == pytest.approx([expected] * 2, rel=1e-3)
    for found in (
        store.read_json("preload.json")["sides"],
        store.read_json("tune.json")["preload_kept"],
    ):
        assert all(side["balance_error"] < 1e-4 for side in found.values())


def test_pull_slightly_off_centre(tmp_path):
    """10 N along (1, 1e-4, 1): 10 x 1e-4 / sqrt(2) N along y, where no side stands."""
    study = load_study(
        corner_study.write(tmp_path, change=[("[1, 0, 1]", "[1, 1e-4, 1]"), ("[respond]", TUNE)])
    )
    store = results_folder(study, None)
    for name in ("reduce", "preload"):
        run_stage(name, study, store, quiet=True)
    found = store.read_json("preload.json")
    assert abs(found["reactions"]["slide along y"]) == pytest.approx(1e-3 / np.sqrt(2), rel=1e-3)
    assert found["warnings"] == [
        "the pull has a component of 0.00071 N along the slide along y, which no contact "
        "resists (inexact coordinates): a constraint reaction balances it"
    ]


def test_a_changed_case_is_solved_again(tmp_path):
    heavy = '[loads.heavy]\npull = 20\n[preload]\ncase = "heavy"\n'
    store, _ = run(tmp_path, heavy, "reduce", "preload")
    before = sums(tmp_path, store, "preload.csv")
    store, how = run(tmp_path, heavy.replace("20", "40"), "reduce", "preload")
    assert how[1] == "done" and sums(tmp_path, store, "preload.csv") == pytest.approx(
        2 * np.array(before)
    )


def test_all_stations_are_kept(tmp_path):
    store, _ = run(tmp_path, "", "reduce", "preload", "tune")
    assert store.read_json("tune.json")["tuned_pairs"] == {"front": 2, "back": 1}
    assert ContactTable.load(store.path("kept.csv")).carrying.all()
    store, _ = run(tmp_path, "", "reduce", "preload", "tune", change=[("'all'", "[3, 0]")])
    assert ContactTable.load(store.path("kept.csv")).carrying.all()
    for bad, words in (("[0, 0]", "not both 0, or 'all'"), ('"every"', "or 'all'")):
        with pytest.raises(InputError, match=words):
            run(tmp_path, "", change=[("'all'", bad)])


def test_case_that_is_not_there(tmp_path):
    with pytest.raises(
        InputError, match=r"\[preload\] case: no load case \[loads.turn\]; did you mean 'turning'"
    ):
        run(tmp_path, CASE.replace('case = "turning"', 'case = "turn"'))


def test_given_matrices_take_another_pull_as_a_case(tmp_path, capsys):
    """A case that states its pull needs no load of its own in the matrices; one that states nothing
    is named."""
    store, _ = run(tmp_path, "", "reduce", "preload")
    shutil.copy(store.path("model.npz"), tmp_path)
    shutil.copy(store.path("preload.csv"), tmp_path / "my_pairs.csv")
    text = (
        corner_study.MATRICES.split("[contact.one]")[0].replace("pairs.csv", "my_pairs.csv")
        + """[loads.heavy]
pull = 30
[preload]
friction = true
history = ["heavy"]
"""
    )
    path = tmp_path / "given.toml"
    path.write_text(text)
    assert main(["reduce", str(path), "--quiet"]) == main(["preload", str(path), "--quiet"]) == 0
    sides = results_folder(load_study(path), None).read_json("preload.json")["cases"]["heavy"][
        "sides"
    ]
    # all pairs slip, as above
    assert sides["one"]["sum_N"] == pytest.approx(30 / np.sqrt(2) / 1.3, rel=1e-3)
    path.write_text(text + "stress = true\n")
    assert main(["preload", str(path), "--quiet"]) == 2
    assert "[preload] stress needs meshes, and the study gives matrices" in capsys.readouterr().err
    path.write_text(text.replace("pull = 30", ""))
    assert main(["reduce", str(path), "--quiet"]) == 0
    assert main(["preload", str(path), "--quiet"]) == 2
    assert (
        "[loads.heavy]: the model holds no load named 'heavy', and no pull is stated"
        in capsys.readouterr().err
    )


@pytest.mark.slow
def test_zero_contact_pairs(copy, capsys):
    """A table of one's own in which every pair is detached."""
    pairs = ContactTable.load(copy / "results" / "rig" / "preload.csv")
    pairs.replace(weight=np.zeros(len(pairs))).save(copy / "mine.csv")
    path = own_pairs(copy)
    assert main(["reduce", path, "--quiet"]) == 0
    assert main(["preload", path, "--quiet"]) == 2
    assert "no contact pairs" in capsys.readouterr().err


def test_open_pairs_are_counted_and_have_no_force(tmp_path):
    """The middle of one side stands 0.1 mm back: the range is that of the closed pairs."""
    study = load_study(
        corner_study.write(
            tmp_path,
            change=[
                ('damper = "face_x"', 'damper = "face_x"\ngap = [[0, 0], [0.005, 1e-4], [0.01, 0]]')
            ],
        )
    )
    store = results_folder(study, None)
    for name in ("reduce", "preload"):
        run_stage(name, study, store, quiet=True)
    pairs = ContactTable.load(store.path("preload.csv"))
    side = store.read_json("preload.json")["sides"]["one"]
    mine = pairs.preload[pairs.side == "one"]
    assert mine.min() < -90 and side["detached"] == (mine <= 0).sum() == 3
    assert (side["min_N"], side["max_N"]) == (mine[mine > 0].min(), mine.max())
    assert f"one: 7.07 N, {side['min_N']:.2f}..{side['max_N']:.2f} N, 3 open; two" in preload.line(
        store
    )
