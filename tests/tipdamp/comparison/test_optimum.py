"""The least of a curve and its flat range: against a closed form."""

import numpy as np
import pytest

from tipdamp.comparison.optimum import envelope, lowest_at, optimum, ranks, within
from tipdamp.comparison.peaks import ComparedPeak

BEST = 8.0


def level(Fe, height, blade=1, share=0.5, error=0.0):
    """share - of the power of the force on the motion of the patch that friction takes."""
    friction = share * np.pi * 1600.0 * Fe**2 * (height or 0.0)
    return ComparedPeak(
        study="a",
        scatter="",
        phase="in_phase",
        blade=blade,
        pull=100.0,
        Fe=Fe,
        H=3,
        hz=1600.0,
        m_per_N=height,
        error=error,
        tolerance=1e-3,
        stable=True,
        at_least=None,
        slipping=0.0,
        friction_W=(friction,),
        mac=None,
        complete=True,
        ended="",
    )


def valley(ratio):
    """Of a damper between stuck and free: symmetric in log-log about its least, 1e-7 m/N."""
    return 1e-7 * 0.5 * (ratio / BEST + BEST / ratio)


def peaks(ratios):
    return [level(100.0 / r, valley(r)) for r in ratios]


def test_least_and_flat_range_of_a_valley():
    """5 % above the least: cosh(log(r / best)) = 1.05."""
    one = optimum(peaks(BEST * np.geomspace(0.1, 10, 41)))
    wide = np.exp(np.arccosh(1.05))
    assert one.ratio == pytest.approx(BEST) and one.m_per_N == pytest.approx(1e-7)
    assert one.low == pytest.approx(BEST / wide, rel=5e-3)
    assert one.high == pytest.approx(BEST * wide, rel=5e-3)
    assert one.at_end == ""


def test_ends_of_what_was_computed_are_told():
    assert optimum(peaks(BEST * np.geomspace(1, 10, 21))).at_end == "low"
    assert optimum(peaks(BEST * np.geomspace(0.1, 1, 21))).at_end == "high"
    assert optimum(peaks(BEST * np.geomspace(0.9, 1.1, 5))).at_end == "both"
    assert optimum(peaks([3.0])) is None


def test_which_way_the_least_may_lie_does_not_hang_on_rounding():
    """exp(log r) is not r."""
    for ratio in np.geomspace(2.0, 50.0, 40):
        first = [level(100.0 / ratio, 1e-7), level(25.0 / ratio, 3e-7)]
        assert optimum(first).beyond == " or less"


def test_larger_blade_counts_and_levels_without_a_peak_do_not():
    both = [level(10.0, 2e-7), level(10.0, 3e-7, 2), level(20.0, 5e-7), level(20.0, None, 2)]
    ratio, height = envelope(both)
    assert ratio.tolist() == [10.0] and height.tolist() == [3e-7]


@pytest.mark.parametrize(
    "least, idle",
    [
        (level(20.0, 0.5e-7), False),
        (level(20.0, 0.5e-7, share=0.0), True),  # of another stuck mode, or the free structure
        (level(20.0, 0.99e-7), False),
        (level(20.0, 0.99e-7, error=0.02), True),  # as high as the stuck structure
        (level(20.0, 1.1e-7), True),  # friction makes it worse
        (level(20.0, 0.7e-7, error=np.inf), False),  # not known: as it was computed
        (level(20.0, 1.1e-7, error=np.inf), True),
    ],
)
def test_where_friction_takes_nothing(least, idle):
    """Beside a level at which every pair sticks."""
    assert optimum([level(1.0, 1e-7, share=0.0), least]).idle == idle


def test_a_valley_alone_is_no_structure_without_friction():
    """Levels as high as each other about the least, of which friction takes half."""
    assert not optimum([level(10.0, 1e-7, error=0.01), level(11.0, 1.001e-7, error=0.01)]).idle


def test_ranks_and_where_a_curve_is_lowest():
    def ranked(**spans):
        return ranks({name: {"": span} for name, span in spans.items()})

    assert ranked(a=(2.0, 2.0), b=(1.0, 1.0), c=(2.0, 2.0)) == {"a": 2, "b": 1, "c": 2}
    assert ranked(a=(2.0, 2.5), b=(1.0, 2.1), c=(2.2, 3.0)) == {"a": 1, "b": 1, "c": 2}
    ratio = np.array([1.0, 10.0, 100.0])
    found = lowest_at(
        {
            "falls": (ratio, np.array([4.0, 2.0, 1.0])),
            "rises": (ratio[1:], np.array([1.0, 4.0])),
        }
    )
    assert found == {"falls": (1, 2), "rises": (1, 2)}  # over 10 to 100, where both are known


@pytest.mark.parametrize(
    "low, high, found",
    [(4.0, 16.0, [4, 8, 16]), (1.0, 8.0, [2, 4, 8]), (3.0, 99.0, [3, 4, 8, 16, 32])],
)
def test_part_of_a_curve_reaches_no_further_than_asked_and_known(low, high, found):
    """A power of Fc/Fe, which stays one between its levels in log-log."""
    ratio = 2.0 ** np.arange(1, 6)
    part, height = within((ratio, 1e-7 * ratio**1.5), low, high)
    assert part.tolist() == found and height == pytest.approx(1e-7 * part**1.5)
