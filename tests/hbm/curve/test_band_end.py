"""A branch that leaves its band before the fold: said, warned of, and followed beyond on demand."""

import warnings

import numpy as np
import pytest

from tests.hbm.cases import duffing, duffing_peak
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts, UnilateralSpring
from tipdamp.hbm.response import follow_band, follow_parameter

X = {"x": [1.0]}


def amplitudes(c, F, cubic, w):
    """All amplitudes of a Duffing oscillator with H = 1: the positive roots A^2 of a cubic."""
    g, a = 0.75 * cubic, 1 - w**2
    roots = np.roots([g * g, 2 * a * g, a * a + (c * w) ** 2, -F * F])
    real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
    return np.sqrt(np.sort(real[real > 0]))


def curve_of(c, F, cubic, band, **options):
    """Over a band in rad/s."""
    options = {"harmonics": 1, "outputs": X} | options
    return follow_band(duffing(c, cubic), np.array([F]), np.array(band) / (2 * np.pi), **options)


def solutions(curve, problem, w):
    """(amplitudes in rising order, warnings) at w rad/s."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = solutions_at(curve, problem, w / (2 * np.pi))
    return np.sort(np.abs(found[:, 0, 1])), [str(one.message) for one in said]


def fold(c, F, cubic, inside, outside):
    """rad/s between two values where there are three solutions, and one."""
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        inside, outside = (
            (middle, outside) if len(amplitudes(c, F, cubic, middle)) == 3 else (inside, middle)
        )
    return middle


CASES = {
    "a fold far beyond": (0.02, 0.2, 1.0, (0.4, 2.0), 1.9, 3.2),
    "a large force": (0.05, 4.0, 1.0, (0.3, 8.0), 3.0, 9.0),
    "softening, downwards": (0.02, 0.03, -0.1, (2.0, 0.92), 0.94, 0.7),
}


@pytest.mark.parametrize("c,F,cubic,band,w,beyond", CASES.values(), ids=CASES)
def test_the_branch_leaves_its_band_before_the_fold(c, F, cubic, band, w, beyond):
    curve, every = curve_of(c, F, cubic, band), amplitudes(c, F, cubic, w)
    assert curve.complete and len(every) == 3
    found, said = solutions(curve, duffing(c, cubic), w)
    assert "the branch leaves the band before its fold, near " in curve.ended
    assert curve.further in curve.ended
    near = 2 * np.pi * float(curve.further.split("near ")[1].split(" Hz")[0])
    assert near == pytest.approx(fold(c, F, cubic, band[1], beyond), rel=2e-3)
    assert len(said) == 1 and "others than those of the curve are possible" in said[0]
    assert len(found) == 1
    curve = curve_of(c, F, cubic, band, beyond=beyond / (2 * np.pi))
    found, said = solutions(curve, duffing(c, cubic), w)
    assert found == pytest.approx(every, rel=1e-8) and not said and not curve.further
    low, high = sorted(np.array(band) / (2 * np.pi))
    assert low <= curve.parameter.min() and curve.parameter.max() <= high
    assert curve.parameter[[0, -1]] * 2 * np.pi == pytest.approx(band) and curve.complete
    assert "it left the band before its fold and was followed beyond, to " in curve.ended


@pytest.mark.slow
@pytest.mark.parametrize("ends_inside", [False, True])
def test_what_would_be_the_same_backwards(ends_inside):
    """Up to past the fold of a Duffing oscillator; or to between its folds, where the linear
    response leads to the lower solution and the branch ends on the upper one."""
    w = 2.0 if ends_inside else 4.0
    assert len(amplitudes(0.02, 0.2, 1.0, w)) == (3 if ends_inside else 1)
    up = curve_of(0.02, 0.2, 1.0, (0.4, w))
    assert up.complete and up.end_confirmed == up.alike_backwards == (not ends_inside)
    down = curve_of(0.02, 0.2, 1.0, (w, 0.4))
    ends = [abs(curve.harmonics[i, 0, 1]) for curve, i in ((up, -1), (down, 0))]
    assert (abs(ends[0] / ends[1] - 1) < 1e-6) == (not ends_inside)


def test_said_exactly_where_the_end_has_three_solutions():
    """Random oscillators whose bands end before, in and behind what has three solutions."""
    rng, counts = np.random.default_rng(5), [0, 0]
    for _ in range(8):
        c, F, cubic = 10 ** rng.uniform([-2.0, -2.0, -1.0], [-1.0, 0.5, 1.0])
        band = 0.3, rng.uniform(1.0, 1.2 * duffing_peak(c, F, cubic)[0])
        curve = curve_of(c, F, cubic, band)
        found, _ = solutions(curve, duffing(c, cubic), band[1])
        missing = len(amplitudes(c, F, cubic, band[1])) - len(found)
        assert curve.complete and bool(curve.further) == (missing > 0)
        counts[missing > 0] += 1
    assert min(counts) >= 2


@pytest.mark.slow
def test_a_band_that_holds_the_fold_says_nothing():
    for band in ((0.4, 3.5), (3.5, 0.4), (0.4, 0.9)):
        curve = curve_of(0.02, 0.2, 1.0, band)
        assert not curve.further and curve.ended == "reached the end of the band"


@pytest.mark.slow
def test_a_fold_that_was_not_reached():
    """What was looked at is said, and no more."""
    curve = curve_of(0.02, 0.2, 1.0, (0.4, 2.0), beyond=2.5 / (2 * np.pi))
    assert curve.complete and "no fold was found up to 0.397887 Hz" in curve.ended
    assert "before its fold" not in curve.ended
    curve = curve_of(0.002, 0.2, 1.0, (0.4, 2.0))
    assert "there is another solution at 0.31831 Hz, where the band ends, to which" in curve.ended
    assert "no fold was found up to 0.63662 Hz" in curve.ended
    assert "before its fold" not in curve.ended


@pytest.mark.slow
def test_over_another_parameter():
    """Over the force at 2 rad/s: the branch ends before its fold, and nothing is evaluated
    beyond."""
    c, w = 0.02, 2.0

    def over_level(**options):
        return follow_parameter(
            duffing(c),
            np.array([1.0]),
            w / (2 * np.pi),
            "level",
            (3.0, 0.5),
            harmonics=1,
            outputs=X,
            **options,
        )

    curve = over_level()
    assert len(amplitudes(c, 0.5, 1.0, w)) == 3 and len(amplitudes(c, 3.0, 1.0, w)) == 1
    assert "another solution at level = 0.5, where the band ends, to which" in curve.further
    curve = over_level(beyond=0.01)
    found = np.sort(np.abs(solutions_at(curve, duffing(c), 0.6)[:, 0, 1]))
    assert found == pytest.approx(amplitudes(c, 0.6, 1.0, w), rel=1e-8) and not curve.further


def test_a_gap_that_closes():
    """1 kg on 1 N/m, a stop of 10 N/m behind a gap of 1 m that it hits up to beyond the band."""
    one, stop = np.ones((1, 1)), Contacts([10.0], [0.0], [0.0], [-10.0])
    problem = ContactProblem(one, 0.02 * one, one, one, UnilateralSpring(), stop)

    def over(first, last, **options):
        band = np.array([first, last]) / (2 * np.pi)
        return follow_band(problem, np.array([0.2]), band, harmonics=5, outputs=X, **options)

    curve, whole = over(0.5, 1.15), over(0.5, 3.0)
    assert curve.complete and whole.complete
    every, _ = solutions(whole, problem, 1.14)
    found, said = solutions(curve, problem, 1.14)
    assert len(every) == 3 and len(found) == 1 and "leaves the band before its fold" in said[0]
    untouched = 0.2 / np.hypot(1 - 1.14**2, 0.02 * 1.14)
    assert every[0] == pytest.approx(untouched, rel=1e-9)
    found, said = solutions(over(0.5, 1.15, beyond=3.0 / (2 * np.pi)), problem, 1.14)
    assert found == pytest.approx(every, rel=1e-8) and not said


@pytest.mark.slow
def test_the_solutions_by_time_integration():
    """From a grid of starts the motion settles on the upper and the lower one; the third is
    unstable."""
    c = 0.02
    F = 0.2
    w = 1.9
    steps = 80
    curve = curve_of(c, F, 1.0, (0.4, 2.0), beyond=3.2 / (2 * np.pi), harmonics=7)
    low, _, high = solutions(curve, duffing(c), w)[0]
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(-2.2, 2.2, 5), np.linspace(-4, 4, 5)))
    h, y = 2 * np.pi / w / steps, np.array([u, v])

    def rate(t, y):
        return np.array([y[1], F * np.cos(w * t) - c * y[1] - y[0] - y[0] ** 3])

    last = []
    for n in range(steps * 250):
        t = n * h
        k1 = rate(t, y)
        k2 = rate(t + h / 2, y + h / 2 * k1)
        k3 = rate(t + h / 2, y + h / 2 * k2)
        k4 = rate(t + h, y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if n >= steps * 249:
            last.append(y[0])
    turn = np.exp(-2j * np.pi * (np.arange(steps) + 1) / steps)
    first = np.abs(turn @ np.array(last)) * 2 / steps
    for known in (low, high):
        assert np.abs(first - known).min() < 2e-3 * known
    assert (np.minimum(np.abs(first / low - 1), np.abs(first / high - 1)) < 0.05).all()


@pytest.mark.parametrize(
    "beyond,words",
    [
        (1.0, r"beyond = 1 Hz: must lie past the end of band = \(1, 2\) Hz"),
        (1.5, "must lie past the end"),
        (2.0, "must lie past the end"),
        (-3.0, "must be one positive number"),
        ("3", "must be one positive number"),
    ],
)
def test_beyond_must_lie_past_the_end(beyond, words):
    with pytest.raises(InputError, match=words):
        follow_band(duffing(0.02), np.array([0.2]), (1.0, 2.0), outputs=X, beyond=beyond)


BETWEEN_FOLDS = {
    "to the end past the upper fold": (1.9, 4.0),
    "wholly between": (1.7, 2.0),
    "downwards": (4.0, 1.9),
}


@pytest.mark.parametrize("band", BETWEEN_FOLDS.values(), ids=BETWEEN_FOLDS)
def test_a_band_that_begins_or_ends_between_folds(band):
    """On the lower solution, to which the linear response leads: the fold over which the branch
    comes back is told, and solutions there warn."""
    c, F, cubic = 0.02, 0.2, 1.0
    curve, w = curve_of(c, F, cubic, band), 1.95
    assert curve.complete and len(amplitudes(c, F, cubic, w)) == 3
    found, said = solutions(curve, duffing(c, cubic), w)
    assert len(found) == 1 and len(said) == 1
    assert "the branch folds outside the band, near " in curve.further
    near = 2 * np.pi * float(curve.further.split("near ")[1].split(" Hz")[0])
    assert near == pytest.approx(fold(c, F, cubic, 1.9, 1.0), rel=5e-3)


BEGINS = {
    "hardening, downwards": (0.02, 0.2, 1.0, (1.4, 0.4)),
    "a large force": (0.05, 4.0, 1.0, (3.0, 0.3)),
    "nearly a fold": (0.0035, 0.026, 2.4, (1.14, 0.5)),
    "softening, upwards": (0.0115, 0.025, -0.2556, (0.86, 2.68)),
}


@pytest.mark.parametrize("c,F,cubic,band", BEGINS.values(), ids=BEGINS)
def test_another_solution_where_the_band_begins(c, F, cubic, band):
    """The branch of the resonance begins inside its band, the lower solution beside it."""
    curve = curve_of(c, F, cubic, band)
    inside = band[0] + 0.02 * (band[1] - band[0])
    assert curve.complete and len(amplitudes(c, F, cubic, inside)) == 3
    found, said = solutions(curve, duffing(c, cubic), inside)
    assert len(found) == 3 or "where the band begins" in curve.further and said


def test_where_the_band_begins_with_one_solution_nothing_is_told():
    curve = curve_of(0.1, 1.0, 1.0, (0.4, 5.0))
    assert curve.complete and not curve.further
