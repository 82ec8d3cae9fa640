"""What curves are forecast to cost beside what they did: CPU time and bytes of the stage `respond`
of studies of several kinds, recorded on one machine."""

from dataclasses import dataclass, replace

import pytest

from tipdamp.checks import curve_cost
from tipdamp.checks.machine import COMMON, Machine
from tipdamp.checks.sizes import Size

MACHINE = Machine(factor=0.4, solve=1.5e-3, flops=1.8e10, evaluation=1.7e-3)  # as `measured` there


@dataclass(frozen=True)
class Recorded:
    """orders - H of the curves of each level; acting - pairs that the stuck response of each moves;
    seconds, bytes - of the whole stage."""

    pairs: int
    outputs: int
    orders: tuple[int, ...]
    acting: tuple[int, ...]
    seconds: float
    bytes: float
    auto: bool = False
    stability: str = "peaks"

    @property
    def size(self) -> Size:
        return Size(
            {},
            self.pairs,
            self.orders * len(self.acting),
            acting=self.acting,
            auto=self.auto,
            outputs=self.outputs,
            search=0.3,
            stability=self.stability,
        )


TRIED = (3, 15)  # of harmonics = "auto"
STUDIES = {
    # matrices of docs/studies/matrices_only under 60 N, 5, 20 and 40 N
    "matrices": Recorded(4, 2, (7,), (0, 2, 4), 3.22, 6.7e5),
    "matrices, auto": Recorded(4, 2, TRIED, (0, 2, 4), 8.89, 1.63e6, auto=True),
    "matrices, all": Recorded(4, 2, (7,), (0, 2, 4), 6.19, 6.8e5, stability="all"),
    # the small rig of tests/conftest.py
    "rig": Recorded(18, 10, (1,), (0, 18), 3.16, 7.8e5),
    "rig, auto": Recorded(18, 10, TRIED, (0, 18), 25.2, 4.72e6, auto=True),
    # docs/studies/two_blade_rig/twin.toml; with H by a tolerance of 1e-3 at 6 and 20 N; with
    # stability everywhere, H = 5, at 1, 12 and 20 N
    "twin": Recorded(18, 10, (1, 5), (0, 8, 13, 15, 18), 12.0, 4.48e6),
    "twin, auto": Recorded(18, 10, TRIED, (8, 18), 26.3, 4.49e6, auto=True),
    "twin, all": Recorded(18, 10, (5,), (0, 15, 18), 10.8, 2.01e6, stability="all"),
    # tests/reference/platform-wedge, held along y, at 0.1, 1 and 3 N
    "wedge": Recorded(102, 34, (1,), (102, 102, 102), 78.5, 4.8e6),
    "unlike wedge": Recorded(70, 34, (1,), (70, 70, 70), 46.5, 3.72e6),
    # the corner of tests/tipdamp/corner_study.py at 1 and 5 N: all stick
    "corner": Recorded(18, 18, TRIED, (0, 0), 2.45, 7.35e5, auto=True),
}


@pytest.mark.parametrize("name", STUDIES)
def test_within_a_factor_of_two(name):
    known = STUDIES[name]
    forecast = curve_cost.seconds(known.size, known.acting, MACHINE)
    assert known.seconds / 2 < forecast < 2 * known.seconds
    assert known.bytes / 2 < curve_cost.disk(known.size, known.acting) < 2 * known.bytes


def test_a_slower_machine_takes_longer():
    """Each part by its own measure: small arrays, and products of large matrices."""
    slow = replace(MACHINE, flops=MACHINE.flops / 10)
    few, many = (
        curve_cost.seconds(Size({}, pairs, (1,)), (pairs,), slow)
        / curve_cost.seconds(Size({}, pairs, (1,)), (pairs,), MACHINE)
        for pairs in (4, 400)
    )
    assert few < 1.2 and many > 9
    slow = replace(COMMON, evaluation=10 * COMMON.evaluation)
    size = Size({}, 18, (5,) * 5)
    assert curve_cost.seconds(size, (18,), slow) > 5 * curve_cost.seconds(size, (18,), COMMON)


def test_a_level_at_which_all_stick_is_content_with_the_first_curve():
    size = Size({}, 18, TRIED * 2, auto=True)
    assert list(curve_cost.curves_of(size, (0, 5))) == [(3, 0), (3, 5), (15, 5)]
    assert list(curve_cost.curves_of(replace(size, auto=False), (0, 5))) == [
        *((H, 0) for H in TRIED),
        *((H, 5) for H in TRIED),
    ]
    assert len(list(curve_cost.curves_of(size, (5,)))) == len(size.curves)
