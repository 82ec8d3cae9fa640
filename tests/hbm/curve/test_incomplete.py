"""A curve that was cut off, or whose highest point borders a gap, has no peak."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from tests.benchmarks.robustness import draw
from tests.hbm.cases import jenkins, load
from tests.hbm.oscillator import FORCE as OF_1N
from tests.hbm.oscillator import Y2, oscillator
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.result import ForcedResponse

PROBLEM, FORCE = jenkins(load("A1")["parameters"])


def follow(band=(0.1, 0.2), **settings):
    return follow_band(
        PROBLEM, FORCE, band, harmonics=1, outputs={"x": [1.0]}, settings=Settings(**settings)
    )


@pytest.fixture(scope="module")
def whole():
    return follow()


@pytest.fixture(scope="module")
def cut():
    return follow(max_points=12)


def without(curve, i):
    """The curve with point i failed."""
    X, good = np.array(curve.harmonics), np.array(curve.converged)
    X[i], good[i] = np.nan, False
    return replace(
        curve,
        harmonics=X,
        converged=good,
        complete=False,
        ended="reached the end of the band; 1 failed",
    )


@pytest.mark.parametrize("band", [(0.1, 0.2), (0.2, 0.1)])
@pytest.mark.parametrize("kind", ["half_peak_to_peak", "harmonic", "rms"])
def test_cut_curve_has_no_peak(band, kind, tmp_path):
    cut = follow(band, max_points=12)
    assert not cut.complete and not cut.reached_end
    for curve in (cut, ForcedResponse.load(cut.save(tmp_path / "cut.npz"))):
        with pytest.warns(
            UserWarning, match=r"no peak of 'x': at least .* m at .* Hz, stopped at .* after 12 p"
        ):
            assert np.isnan(curve.peak("x", kind)).all()
        f, a = curve.at_least("x", kind)
        assert a == curve.amplitude(kind).max() and f in curve.frequency
        assert a <= follow(band).at_least("x", kind)[1]


def test_whole_curve_has_a_peak(whole, recwarn):
    assert (
        whole.complete
        and whole.reached_end
        and whole.at_least("x") == whole.peak("x")
        and not len(recwarn)
    )


@pytest.mark.parametrize("beside", [-1, 1])
def test_gap_beside_the_highest_point(whole, beside):
    i = int(np.nanargmax(whole.amplitude()))
    curve = without(whole, i + beside)
    with pytest.warns(
        UserWarning,
        match=r"at least .*, beside a point that failed: reached the end of the band; 1 f",
    ):
        assert np.isnan(curve.peak("x")).all()
    assert curve.at_least("x") == whole.peak("x")


def test_gap_elsewhere_leaves_the_peak(whole, recwarn):
    assert without(whole, 3).peak("x") == whole.peak("x") and not len(recwarn)


def test_inner_maxima_of_a_cut_curve(whole):
    """Stopped behind its resonance: the maximum is solved, the list says that it may not be all."""
    i = int(np.nanargmax(whole.amplitude()))
    cut = follow(max_points=i + 5)
    assert not cut.complete
    with pytest.warns(UserWarning, match="maxima of 'x': the curve is incomplete, .* stopped at "):
        found = find_peaks(cut, PROBLEM, "x")
    assert len(found) == 1 and found[0] == pytest.approx(whole.peak("x"), rel=1e-7)


def test_cut_before_the_resonance(cut):
    with pytest.warns(UserWarning, match="the curve is incomplete"):
        assert find_peaks(cut, PROBLEM, "x").shape == (0, 2)


def test_nothing_solved():
    curve = without(follow(max_points=3), slice(None))
    with pytest.warns(UserWarning, match="no peak of 'x': no point is solved"):
        assert np.isnan(curve.peak("x")).all()
    assert np.isnan(curve.at_least("x")).all()


def test_folds_by_impacts_are_told():
    """A contact that closes hard, again and again: how long it is open, and what makes the branch
    simpler."""
    mu, kn, kt, level, H = next(islice(draw(199), 198, None))
    curve = follow_band(
        oscillator(mu, kn, kt),
        level * OF_1N,
        (60, 300),
        harmonics=H,
        outputs=Y2,
        start="zero_force",
        settings=Settings(max_points=200),
    )
    open_most = np.nanmax(curve.share_open, axis=1)
    said = (
        f"at half of the points open for {100 * np.median(open_most[open_most > 0]):.0f} % of the "
        "cycle"
    )
    assert (
        not curve.complete
        and "after 200 points: the branch folds" in curve.ended
        and said in curve.ended
    )
