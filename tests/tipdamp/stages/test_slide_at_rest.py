"""Stage preload where the damper slides far until it rests: side forces of the wedge whose flanks
turn as cantilevers do."""

import numpy as np
import pytest

from tests.tipdamp import soft_flanks
from tests.tipdamp.soft_flanks import ARM, LENGTH, PULL, THICK
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow

SOFT = 80e9  # Pa, of the plates
SIDES = ("right", "left")


def run(folder, stages=("reduce", "preload"), **study):
    given = load_study(soft_flanks.write(folder, E=SOFT, **study))
    store = results_folder(given, None)
    for name in stages:
        run_stage(name, given, store, quiet=True)
    return store


def of_beams(pull, mu=0.0):
    """(N, deflection in m) of a side: pull / (2 (sin + mu cos)) at 45 degrees less the turn of the
    end of a cantilever under N."""
    bending, N = SOFT * LENGTH * THICK**3 / 12, pull / 2
    for _ in range(30):
        angle = np.pi / 4 - N * ARM**2 / (2 * bending)
        N = pull / 2 / (np.sin(angle) + mu * np.cos(angle))
    return N, N * ARM**3 / (3 * bending)


def sums(store, file="preload.csv"):
    pairs = ContactTable.load(store.path(file))
    return [np.maximum(pairs.preload[pairs.side == side], 0).sum() for side in SIDES]


@pytest.fixture(scope="module")
def fine(tmp_path_factory):
    """Rows at four degrees, and a load case of half the pull."""
    return run(
        tmp_path_factory.mktemp("fine"),
        ("reduce", "preload", "full", "tune"),
        across=34,
        more="[loads.half]\npull = 20",
    )


def test_the_right_rows_carry(fine):
    """Sides as beams have them to 0.5 %, 4 % more than the rows that would close ahead."""
    N, deflection = of_beams(PULL)
    assert sums(fine) == pytest.approx([N, N], rel=5e-3)
    found = fine.read_json("preload.json")
    assert [abs(found["slide_m"][side]) for side in SIDES] == pytest.approx(
        [deflection] * 2, rel=0.15
    )
    assert not any("at rest" in said for said in found["warnings"])
    model, pairs = (
        ReducedModel.load(fine.path("model.npz")),
        ContactTable.load(fine.path("preload.csv")),
    )
    assert (pairs.gap == ContactTable.load(fine.path("pairs.csv")).gap).all()
    plain = StaticContact(model, pairs).solve(PULL * model.loads["pull"])
    assert plain.force[pairs.side == "right"].sum() < 0.96 * N


def test_newton_on_the_full_model_agrees(fine):
    assert fine.read_json("full.json")["difference"] < 1e-8


def test_a_load_case_has_gaps_of_its_own(fine):
    N, _ = of_beams(PULL / 2)
    assert sums(fine, "loads/half.csv") == pytest.approx([N, N], rel=1e-2)


def test_all_kept_and_solved_again_is_the_same(fine):
    whole, kept = (ContactTable.load(fine.path(name)) for name in ("preload.csv", "kept.csv"))
    assert kept.preload == pytest.approx(whole.preload, abs=1e-8 * whole.preload.max())


def test_with_friction(tmp_path):
    """Both sides slip along their flanks."""
    N, _ = of_beams(PULL, mu=0.3)
    store = run(tmp_path, across=34, more="friction = true\nsteps = 5")
    assert sums(store) == pytest.approx([N, N], rel=1e-2)
    assert store.read_json("preload.json")["friction"]["slipping_pairs"] > 0


def test_rows_too_far_apart_are_warned_of(tmp_path):
    """The nearest row lies two degrees off the line of contact."""
    N, _ = of_beams(PULL)
    said = run(tmp_path, across=16).read_json("preload.json")["warnings"]
    (right,) = [one for one in said if one.startswith("side 'right': at rest the damper has slid")]
    assert f"{N:.3g}" in right and "5% of its radius and 0.39 of the distance of its rows" in right
    assert "act 1.9 degrees off" in right and "more faces of the damper across the side" in right
