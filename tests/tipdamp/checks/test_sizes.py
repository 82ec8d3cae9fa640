"""The sizes of a study: how many pairs stay, and what its curves are."""

import pytest

from tests.conftest import STUDY, changed
from tipdamp.checks.sizes import SETTINGS, size_of
from tipdamp.results.static_results import InspectResult
from tipdamp.study.study import load_study

SIDE = dict(
    stations=31,
    length_m=1,
    across_m=1,
    mean_normal=[0, 0, 1],
    normals_within_deg=0,
    off_surface_deg=None,
    apart_along_n_m=[0, 0],
    apart_across_m=0,
    force_per_pull=1,
    trouble=None,
)
# of the small rig: one row on the left, two on the right
FOUND = InspectResult(
    bodies={"blades": {"groups": {"patch_1": 5, "patch_2": 4}}},
    pairs={"left": 31, "right": 62},
    pair_checks={
        "left": {"pairs": 31, "rows": 1, **SIDE},
        "right": {"pairs": 62, "rows": 2, **SIDE},
    },
)


@pytest.fixture
def of(tmp_path):
    """The size of the rig's study with changes of its text."""

    def size(*changes):
        (tmp_path / "rig.toml").write_text(changed(STUDY, *changes))
        return size_of(load_study(tmp_path / "rig.toml"), FOUND)

    return size


@pytest.mark.parametrize(
    "tune, kept",
    [
        ("stations = [5, 4]", 9 + 9),
        ("stations = 'all'", 31 + 31),
        ("by = 'area'\nkept_share = 0.5", 31),
        ("target_hz = 2800", SETTINGS.kept * 62),
    ],
)
def test_pairs_that_stay(of, tune, kept):
    """Of the side whose lower edge alone is kept one row in two."""
    assert of(("stations = [5, 4]", tune)).kept_pairs == round(kept)


def test_curves_of_a_study(of):
    given = of()
    assert given.curves == (1, 1) and not given.auto and given.outputs == 9
    auto = of(("harmonics = [1]", "search = 0"))
    assert auto.curves == SETTINGS.tried * 2 and auto.auto and auto.search == 0


def test_pairs_that_slip(of):
    """Where it is not known four in five of the kept ones, or of those that are followed."""
    size = of()
    assert size.slipping == (round(0.8 * 18),)
    fewer = of(("levels = [1, 20]", "levels = [1, 20]\ninterface = 'reduced'\nfollowed = 10"))
    assert fewer.slipping == (8,)
