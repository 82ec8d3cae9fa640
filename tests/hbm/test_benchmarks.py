"""What the benchmarks refuse: figures of another system, or of another code, than they say."""

import json
import sys

import numpy as np
import pytest

from tests.benchmarks import hbm_truth_robustness as truth
from tests.benchmarks.hbm_peer_pyharm import dof_of
from tests.benchmarks.hbm_speed import held_slipping, measured, one_in_eight


@pytest.mark.parametrize(("make", "n", "level"), [(held_slipping, 32, 20), (one_in_eight, 16, 40)])
def test_as_many_pairs_move_as_are_said_to(make, n, level):
    """8 of 32 in 1-D, 2 of 16 in 3-D, at every point of the curve; another number ends the run."""
    case, moves = make(n)
    row = measured(case, "held", 1, level, moves, repeats=1)
    assert row["moving"] == moves == (8 if make is held_slipping else 2) and row["contacts"] == n
    with pytest.raises(SystemExit, match=rf"{moves} to {moves} pairs slip or open, not {moves + 1}"):
        measured(case, "held", 1, level, moves + 1, repeats=1)


def test_the_peer_takes_single_dofs_only():
    assert dof_of(np.array([0.0, 1.0, 0.0])) == 1
    with pytest.raises(SystemExit, match=r"dofs \[0, 2\]"):
        dof_of(np.array([0.5, 0.0, 0.5]))


def test_a_store_of_other_code_is_refused(tmp_path, monkeypatch, capsys):
    """And one of this code is gone on with: an oscillator that is there is not computed again."""
    path = tmp_path / "store.jsonl"
    path.write_text(json.dumps({"code": "other"}) + "\n")
    monkeypatch.setattr(sys, "argv", ["truth", "--store", str(path), "--count", "2"])
    with pytest.raises(SystemExit):
        truth.main()
    assert "is of other code of hbm; --fresh begins anew" in capsys.readouterr().err
    path.write_text(json.dumps({"code": truth.fingerprint("hbm")}) + "\n" + json.dumps({"oscillator": 0, "points": []})
                    + "\n")
    monkeypatch.setattr(truth, "one", lambda i, settings: {"oscillator": i, "points": [], "seconds": 0.0})
    truth.main()
    assert [json.loads(x)["oscillator"] for x in path.read_text().splitlines()[1:]] == [0, 1]


def test_states_are_counted_apart():
    points = [("stable", 1e-3, None), ("stable", 1e-2, 5), ("unstable", 6e-3, None), ("unsettled", None, None),
              ("no solution", None, None), ("not periodic", 0.1, None), ("left", 0.5, None)]
    found = truth.summary([{"oscillator": 3, "state": s, "difference": d, "H_again": a} for s, d, a in points])
    assert found["agree"] == {"stable": 1, "unstable": 0} and found["agree_with_more"] == {"stable": 1, "unstable": 0}
    assert sum(found["states"].values()) == len(points) == found["points"] and found["worst"]["stable"] == 1e-2


@pytest.mark.slow
def test_a_point_finds_its_smallest_number_of_harmonics():
    """The planar oscillator where it sticks all through: linear, H = 1, on the orbit to rounding; 163 Hz needs more."""
    from hbm.response import follow_band
    from tests.hbm.oscillator import FORCE, oscillator
    problem = oscillator()
    for hz, least in ((100.0, 1), (163.0, 3)):
        curve = follow_band(problem, FORCE, (hz - 1, hz + 1), harmonics=5, at=[hz],
                            outputs={f"q{j}": r for j, r in enumerate(np.eye(6))})
        i = np.abs(curve.frequency - hz).argmin()
        row = dict(zip(truth.COLUMNS, truth.check(curve.frequency[i], problem, FORCE, curve.harmonics[i]), strict=True))
        assert row["state"] == "stable" and row["H"] >= least and (row["H"] == 1) == (least == 1)
        assert row["difference"] < (1e-10 if least == 1 else truth.AGREES)
