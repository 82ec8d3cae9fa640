"""Unilateral preload: closed-form beams, random cases against a second method, free motions, bad
input."""

import numpy as np
import pytest

from tests.static_contact.beams import beam, random_case, supports
from tests.validation.random_beams import compare
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.contact.preload import StaticContact, preload
from tipdamp.static_contact.normal.complementarity import NoEquilibrium
from tipdamp.static_contact.surfaces.pairing import join


def test_random_beams_against_a_second_route():
    """150 of the 5 000 beams of tests/validation/random_beams.py: same set, forces to 1e-8 of the
    largest."""
    random = np.random.default_rng(20163)
    for i in range(150):
        error, same, *_ = compare(random_case(random, 8 if i % 2 else 31))
        assert same and error < 1e-8, i


@pytest.mark.parametrize("method, seed", [("pivoting", 99), ("proximal", 29)])
def test_fall_backs_find_the_same_answer(method, seed):
    """Two of the random beams on which plain Newton cycles, or meets a set that does not hold the
    beam."""
    error, same, used, *_ = compare(random_case(np.random.default_rng(seed)))
    assert (used, same) == (method, True) and error < 1e-8


def test_hard_contact_is_the_limit_of_stiff_springs():
    """F1's beam: the forces on springs tend to those of hard supports as 1/kn; closed and open sets
    agree."""
    x = np.linspace(0, 0.06, 9)
    load = np.array([56.5, 0, 0, 30, 0, 0, 10, 0, 56.5])
    model = beam(x, 0.14)
    hard = preload(model, supports(x, np.full(9, np.inf), np.zeros(9)), load)
    error = [
        np.abs(
            preload(model, supports(x, np.full(9, kn), np.zeros(9)), load).force - hard.force
        ).max()
        for kn in (1e11, 1e12)
    ]
    assert error[1] < 1e-3 and error[0] / error[1] == pytest.approx(10, rel=0.1)
    assert (hard.opening[hard.force > 0] == 0).all() and (hard.opening[hard.force == 0] > 0).all()
    assert (hard.pairs.preload == hard.force).all()  # no spring, so no negative preload


def test_hard_pairs_of_a_rigid_body():
    """A stiff beam on two hard supports: lever rule. Force 30 N at a third of the length."""
    x = np.array([0.0, 0.02, 0.06])
    kn = np.array([np.inf, 1e6, np.inf])
    found = preload(beam(x, 50.0), supports(x, kn, np.array([0, 1.0, 0])), np.array([0, 30.0, 0]))
    assert found.force == pytest.approx([20.0, 0.0, 10.0], abs=1e-9)


def test_loads_and_gaps_reuse_one_factorisation():
    """Twice the load with twice the gap is twice the preload (the problem is homogeneous)."""
    x = np.linspace(0, 0.07, 11)
    gap = 1e-5 * (1 - (2 * x / 0.07 - 1) ** 2)
    load = np.zeros(11)
    load[[0, 5, 10]] = 50, 3, 40
    once = StaticContact(beam(x, 10.0), supports(x, np.full(11, 1e6), gap)).solve(load)
    statics = StaticContact(beam(x, 10.0), supports(x, np.full(11, 1e6), np.zeros(11)))
    assert (statics.solve(load, gap=gap).pairs.preload == once.pairs.preload).all()
    twice = statics.solve(2 * load, gap=2 * gap)
    assert (twice.pairs.gap == 2 * gap).all()
    assert twice.pairs.preload == pytest.approx(2 * once.pairs.preload, rel=1e-9)


def test_weight_zero_is_no_pair():
    x = np.linspace(0, 0.07, 9)
    load = np.zeros(9)
    load[[2, 6]] = 40.0, 30.0
    table = supports(x, np.full(9, 1e6), np.zeros(9))
    kept = np.array([0, 1, 3, 8])
    weight = np.isin(np.arange(9), kept).astype(float)
    one = preload(beam(x, 5.0), table.replace(weight=weight), load).pairs.preload[kept]
    two = preload(beam(x, 5.0), table.select(kept), load).pairs.preload
    assert one == pytest.approx(two, rel=1e-9)


def test_load_that_lifts_the_body_off():
    x = np.linspace(0, 0.07, 5)
    with pytest.raises(InputError, match="do not hold the damper"):
        preload(beam(x, 5.0), supports(x, np.full(5, 1e6), np.zeros(5)), np.full(5, -3.0))


def test_no_pairs():
    x = np.linspace(0, 0.07, 5)
    table = supports(x, np.full(5, 1e6), np.zeros(5))
    for empty in (table.select([]), table.replace(weight=np.zeros(5))):
        with pytest.raises(InputError, match="no contact pairs"):
            StaticContact(beam(x, 5.0), empty)


def test_solution_that_does_not_balance_is_an_error():
    """A factor that belongs to another matrix, as a solver that fails silently would leave it."""
    x = np.linspace(0, 0.07, 5)
    statics = StaticContact(beam(x, 5.0), supports(x, np.full(5, 1e6), np.zeros(5)))
    statics.solve(np.array([9.0, 0, 1, 0, 9]))
    statics.bodies.factored.factor = (
        statics.bodies.factored.factor[0] * (1 + 1e-6),
        statics.bodies.factored.factor[1],
    )
    with pytest.raises(InputError, match=r"leaves \S+ of the load unbalanced \(allowed: 1e-08\)"):
        statics.solve(np.array([9.0, 0, 1, 0, 9]))


@pytest.mark.parametrize("kn", [1e6, np.inf])
def test_without_load_and_with_overlaps(kn):
    """A floating beam backs off from whatever overlaps: no forces, nothing overlaps. Held between
    supports above and below it cannot: 1 um too long for both springs of 1 N/um each, in series,
    0.5 N each."""
    x = np.linspace(0, 0.07, 9)
    random = np.random.default_rng(4)
    for gap in (
        np.zeros(9),
        np.full(9, -1e-6),
        random.uniform(-1e-5, 0, 9),
        random.uniform(-1e-5, 1e-5, 9),
    ):
        found = preload(beam(x, 5.0), supports(x, np.full(9, kn), gap), np.zeros(9))
        assert (found.force == 0).all() and found.method == "unloaded" and found.residual < 1e-9
        assert found.opening.min() > -1e-11
        assert found.pairs.preload.max() <= 1e-5  # open, or touching
    if kn == 1e6:
        above, below = (supports(x, np.full(9, kn), np.full(9, -0.5e-6)) for _ in range(2))
        below = below.replace(frame=-below.frame * np.array([1.0, -1, 1])[:, None])
        between = join(
            above, below.replace(side=np.full(9, "down"), blade_node=below.blade_node + 9)
        )
        found = preload(beam(x, 5.0), between, np.zeros(9))
        assert found.force == pytest.approx(np.full(18, 0.5), rel=1e-9) and found.residual < 1e-9


@pytest.mark.parametrize(
    "what, values, message",
    [
        (
            "gap",
            np.full(5, np.nan),
            "gap: nan among them; allowed are 5 finite numbers, one for each of the pairs",
        ),
        (
            "load",
            np.full(5, np.inf),
            "load: inf among them; allowed are 5 finite numbers, one for each of the dofs",
        ),
        ("gap", np.zeros(3), r"gap: shape \(3,\)"),
        ("load", np.ones((5, 1)), r"load: shape \(5, 1\)"),
    ],
)
def test_bad_loads_and_gaps(what, values, message):
    x = np.linspace(0, 0.07, 5)
    statics = StaticContact(beam(x, 5.0), supports(x, np.full(5, 1e6), np.zeros(5)))
    with pytest.raises(InputError, match=message):
        statics.solve(**{"load": np.ones(5), what: values})
    given = {"load": np.ones(5), what: values}
    with pytest.raises(InputError, match=message):
        FrictionalContact(statics.model, statics.pairs).solve([given["load"]], gap=given.get("gap"))


@pytest.mark.parametrize("number", [5, 31])
@pytest.mark.parametrize("kn", [1e5, 1e6, 1e8, np.inf])
def test_balance_on_the_last_support(number, kn):
    """50 N on the first support and -eps 50 N on the last: at eps = 0 the first carries all, at any
    tilt. Beyond, strictly nothing holds the beam: below 1e-8 of the load, what balances are allowed
    to leave, the same forces are the answer; above, the roll that goes on is named. What is left at
    the far end weighs (number - 1) times as much on the second support, by the lever."""
    x = np.linspace(0, 0.07, number)
    statics = StaticContact(beam(x, 10.0), supports(x, np.full(number, kn), np.zeros(number)))
    for eps in (0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-6, 1e-3):
        load = np.zeros(number)
        load[0], load[-1] = 50.0, -50.0 * eps
        try:
            found = statics.solve(load)
            assert eps <= 1e-8
            assert found.force == pytest.approx(
                np.r_[50.0, np.zeros(number - 1)], abs=1e-8 * 50 * (number - 1)
            )
            assert found.residual <= 1e-8
        except NoEquilibrium as error:
            assert eps >= 1e-8, eps
            assert "do not hold the damper" in str(error) and str(error).endswith(
                "free to move: roll about y"
            )
