"""A curve that was interrupted anywhere goes on from its journal with the same numbers."""

import numpy as np
import pytest

from tests.hbm.cases import beam, load, rig, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.journal import Journal, JournalBlock, StaleJournal, packed, unpacked
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.response import follow_band, solve_at


def folding():
    """A unilateral spring whose branch folds, leaves the band and comes back, with crossings."""
    problem, force = unilateral(load("C1")["parameters"] | {"F": 1.2})
    return problem, force, (0.3, 0.1), {"harmonics": 5, "outputs": {"x": [1.0]}, "at": (0.2,)}


def from_a_guess_inside():
    """Both ways from a solution in the middle of the band."""
    problem, force = unilateral(load("C1")["parameters"] | {"F": 1.2})
    options = {"harmonics": 5, "outputs": {"x": [1.0]}}
    guess = 0.2, solve_at(problem, force, 0.2, **options).unknowns
    return problem, force, (0.1, 0.3), options | {"guess": guess}


def rubbing():
    return oscillator(), FORCE, (60.0, 300.0), {"harmonics": 3, "outputs": Y2}


def clamped():
    problem, force, outputs = beam("B8")
    return problem, 20.0 * force, (700.0, 1200.0), {"harmonics": 3, "outputs": outputs}


def with_many_modes():
    """Of which the far ones enter by a series."""
    problem, force, outputs = rig()
    return problem, 20.0 * force, (2775.0, 2785.0), {"harmonics": 5, "outputs": outputs}


def out_of_budget():
    settings = Settings(max_calls=30, calls_per_point=1, large=1)
    return oscillator(), FORCE, (60.0, 300.0), {"harmonics": 3, "outputs": Y2, "settings": settings}


class Stop(Exception):
    pass


def interrupted(case, steps):
    """Blocks that a curve left which was killed after so many steps, some of these not yet handed
    over."""
    problem, force, band, options = case
    blocks, times = [], iter(np.arange(steps) * 1.0)

    def clock():
        now = next(times, None)
        if now is None:
            raise Stop
        return now

    try:
        follow_band(problem, force, band, journal=Journal(blocks.append, clock=clock), **options)
    except Stop:
        pass
    return blocks


@pytest.mark.parametrize(
    "case", [folding, from_a_guess_inside, rubbing, clamped, with_many_modes, out_of_budget]
)
def test_interrupted_anywhere(case, monkeypatch):
    """Equal in every bit, and solved from where the journal ends."""
    made = []
    real = HarmonicBalance.evaluate
    monkeypatch.setattr(
        HarmonicBalance, "evaluate", lambda *a, **k: made.append(1) or real(*a, **k)
    )
    problem, force, band, options = case()
    whole = follow_band(problem, force, band, **options)
    calls, blocks = len(made), []
    assert (
        follow_band(
            problem, force, band, journal=Journal(blocks.append, clock=lambda: 0.0), **options
        )
        == whole
    )
    steps = int(1e6)
    random = np.random.default_rng(3)
    for _ in range(4):
        blocks = interrupted(case(), steps)
        made.clear()
        # counted before: a slow machine hands over further blocks while it goes on
        known = sum(1 for block in blocks for mark, _ in unpacked(block) if mark < 0)
        kept = list(blocks)
        again = follow_band(problem, force, band, journal=Journal(blocks.append, kept), **options)
        assert again == whole
        # asked anew: the last ones, and each point around a peak once, for the slopes there
        assert len(made) <= calls - known + 6 + len(whole.frequency) * (case is with_many_modes)
        steps = int(random.integers(10, 6 * calls))


def test_a_journal_is_a_journal():
    problem, force, band, options = rubbing()
    with pytest.raises(InputError, match="journal = 'a file': must be a Journal"):
        follow_band(problem, force, band, journal="a file", **options)


def test_journal_of_another_curve():
    """It is refused, whichever of the two arrays is another one; the curve is then to be made
    anew."""
    problem, force, band, options = rubbing()
    blocks = interrupted((problem, 1.01 * force, band, options), 200)
    with pytest.raises(StaleJournal):
        follow_band(problem, force, band, journal=Journal(blocks.append, blocks), **options)


@pytest.mark.parametrize("damage", ["numbers cut", "layout cut", "sizes", "negative"])
def test_damaged_block(damage):
    block = packed([(7, (np.arange(6.0).reshape(2, 3), np.array(1j))), (-2, (np.array(3.0),))])
    (_, (a, b)), (mark, (c,)) = unpacked(block)
    assert (a == np.arange(6.0).reshape(2, 3)).all() and b == 1j and (mark, c) == (-2, 3.0)
    numbers, layout = block.numbers, block.layout.copy()
    if damage == "numbers cut":
        numbers = numbers[:-1]
    elif damage == "layout cut":
        layout = layout[:-2]
    else:
        layout[4] = -5 if damage == "negative" else 500
    with pytest.raises(StaleJournal):
        list(unpacked(JournalBlock(numbers, layout)))


@pytest.mark.parametrize(
    "numbers, layout",
    [
        (np.array(["a", "b"]), np.array([1, 0])),
        (np.zeros(2, complex), np.array([1, 0])),
        (np.zeros(2), np.array(3)),
        (np.zeros(2), np.array([1.5, 2.5])),
        (np.zeros(2), np.array([1, 1, 0, 1, -3])),
    ],
)
def test_blocks_that_no_journal_writes_are_stale(numbers, layout):
    with pytest.raises(StaleJournal):
        list(unpacked(JournalBlock(numbers, layout)))
