"""Results of the stages: frozen, stored as JSON, and a damaged file is answered with what to do."""

import numpy as np
import pytest

from tests.tipdamp.report.files import table
from tipdamp.checks.pairs import pair_names
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.results.static_results import FreeResponse, ReduceResult, SideForces


def found():
    return ReduceResult(
        reduction={"dofs": 9, "masters": 3, "modes": {"blades": 2}},
        rows={"left": np.int64(1)},
        free_modes_hz=np.array([1.0, 2.0]),
        free_response=FreeResponse(hz=np.arange(3.0), m_per_N={"patch": np.ones(3)}),
    )


def test_saved_and_loaded(tmp_path):
    found().save(Store(tmp_path))
    assert ReduceResult.load(Store(tmp_path)) == found()
    assert found().free_modes_hz == (1.0, 2.0) and found().reduction.modes["blades"] == 2


def test_results_are_frozen():
    with pytest.raises(ValueError, match="frozen"):
        found().rows = {}
    with pytest.raises(ValueError, match="Extra inputs"):
        SideForces(sum_N=1, min_N=1, max_N=1, detached=0, equilibrium_N=1, balance_error=0, sum=1)


@pytest.mark.parametrize(
    "content, words",
    [
        (
            {"rows": {"left": 1}},
            "damaged at 'reduction'.*run the stage again: tipdamp reduce STUDY\\.toml --force",
        ),
        ({**found().model_dump(), "rows": {"left": "a"}}, "damaged at 'rows.left'"),
    ],
)
def test_damaged_files(tmp_path, content, words):
    Store(tmp_path).write_json("reduce.json", content)
    with pytest.raises(InputError, match=words):
        ReduceResult.load(Store(tmp_path))


def test_names_of_pairs_tell_rows_apart():
    """The right side of the table has two rows."""
    pairs = table()
    assert pair_names(pairs, [0, 5, 6]) == ["left 0", "right 0/0", "right 0/1"]
    assert pair_names(pairs.select(pairs.row == 0), [5]) == ["right 0"]
    names = pair_names(pairs, slice(None))
    assert len(set(names)) == len(names) == 15
