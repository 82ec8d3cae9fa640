"""Peaks predicted from backbones against those of whole curves."""

import re

import numpy as np
import pytest

from tests.hbm.cases import beam, rig
from tests.hbm.modes.test_backbone import cantilever
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import ContactLaw, CubicSpring, Jenkins1D, UnilateralSpring
from tipdamp.hbm.modes.backbone import backbone
from tipdamp.hbm.modes.synthesis import _off, synthesis
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band

X = {"x": [1.0]}


def oscillator():
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    return blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem


def tip_of(law, **settings):
    problem, tip = cantilever(law, **settings)
    return problem, tip, {"x": tip}


CASES = {
    "oscillator": (lambda: (oscillator(), np.ones(1), X), (1e-8, 5e-3), (500, 1200)),
    "friction beam": (
        lambda: tip_of(Jenkins1D(), kt=2.0, mu=1.0, preload=0.1),
        (1e-5, 5.0),
        (0.8, 1.6),
    ),
    "cubic beam": (lambda: tip_of(CubicSpring(200.0)), (1e-5, 1.0), (0.8, 1.9)),
    "eight contacts": (lambda: beam("B8"), (1e-8, 0.1), (500, 1400)),
    "eight contacts that lift off": (lambda: beam("C8"), (1e-8, 0.1), (500, 1400)),
}
LEVELS = {
    "oscillator": (0.3, 1.0, 3.0, 5.0, 20.0),
    "friction beam": (1e-3, 1e-2, 0.05, 0.15),
    "cubic beam": (1e-3, 3e-3, 8e-3),
    "eight contacts": (1.0, 10.0, 60.0),
    "eight contacts that lift off": (1.0, 10.0, 60.0),
}


def peaks(case, levels):
    """(level, synthesis, its peak, that of the whole curve) of a problem under forces, over
    amplitudes in m, in a band in Hz; H = 3."""
    (problem, force, outputs), amplitudes, band = case[0](), *case[1:]
    mode = backbone(problem, 1, amplitudes, outputs=outputs, harmonics=3)
    first = next(iter(outputs))
    for level in levels:
        given = dict(outputs={first: outputs[first]}, harmonics=3, truncation=False)
        curve = follow_band(problem, level * force, band, **given)
        found = synthesis(mode, problem, force, level)
        yield level, found, found.peak(first), curve.peak(first)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_peaks(name):
    """1 % in height, and the place to 0.05 %, though friction damps by up to 9 %: its work in a
    cycle does not depend on the frequency."""
    for _, found, peak, whole in peaks(CASES[name], LEVELS[name]):
        assert found.peak_reached and found.said == ""
        assert peak[1] == pytest.approx(whole[1], rel=0.01)
        assert peak[0] == pytest.approx(whole[0], rel=0.0005)


def rig_alone():
    """The rig with the first of its outputs."""
    problem, force, outputs = rig()
    name = next(iter(outputs))
    return problem, force, {name: outputs[name]}


RIG = rig_alone, (1e-6, 1e-4), (1450, 1600)
RIG_LEVELS = (5.0, 20.0, 40.0)


@pytest.mark.slow
def test_peaks_of_the_rig():
    for _, _, peak, whole in peaks(RIG, RIG_LEVELS):
        assert peak[1] == pytest.approx(whole[1], rel=0.05)
        assert peak[0] == pytest.approx(whole[0], rel=0.002)


def test_a_stuck_response_is_the_linear_one():
    """At every frequency, of a beam with all its modes."""
    problem, tip, outputs = tip_of(Jenkins1D(), kt=2.0, mu=1.0, preload=0.1)
    mode = backbone(problem, 1, (1e-7, 1e-1), outputs=outputs, harmonics=1)
    found = synthesis(mode, problem, tip, 1e-4)
    w = 2 * np.pi * found.frequency
    linear = problem.receptance().respond(tip[None], 1e-4 * tip, w)
    size = np.abs(linear).max()
    assert np.abs(found.harmonics[:, :, 1] - linear).max() < 1e-8 * size
    assert np.ptp(found.frequency) > 0.5


@pytest.mark.parametrize("level", [4.0, 8.0, 15.0, 25.0])
def test_a_hysteresis_is_exact_for_one_mode(level):
    """With one order and one coordinate the backbone has all that the response needs: the damping
    of friction by its work, that of the structure by the speed. What is left is interpolation."""
    hard = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.05)
    hard = hard.add(Jenkins1D(), 0, kt=1e6, mu=0.5, preload=40.0).contact_problem
    amplitudes = np.geomspace(1e-7, 2e-3, 60)
    mode = backbone(hard, 1, amplitudes, outputs=X, harmonics=1)
    assert mode.damping_ratio.max() > 0.15
    found = synthesis(mode, hard, np.ones(1), level)
    given = dict(outputs=X, harmonics=1, truncation=False)
    curve = follow_band(hard, level * np.ones(1), (300, 1700), **given)
    hz, height = curve.peak("x")
    assert found.peak("x")[1] == pytest.approx(height, rel=2e-3)
    assert found.peak("x")[0] == pytest.approx(hz, rel=1e-3)
    a = found.amplitude()[:, 0]
    for side in (slice(0, found.top), slice(found.top + 1, None)):
        f = found.frequency[side]
        inside = (f > 0.8 * hz) & (f < 1.2 * hz)
        there = np.interp(f[inside], curve.frequency, curve.amplitude()[:, 0])
        assert np.abs(a[side][inside] / there - 1).max() < 0.02


class Dashpot(ContactLaw):
    """T = c du/dt."""

    components = ("t1",)
    c = 4.0

    def step(self, motion, state, contacts):
        """The force follows the speed."""
        return self.c * motion.v, state


def test_damping_by_speed_is_that_of_a_dashpot():
    """The linear response, in closed form."""
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).add(Dashpot(), 0).contact_problem
    mode = backbone(blade, 1, (1e-7, 1e-3), outputs=X, harmonics=1)
    found = synthesis(mode, blade, np.ones(1), 5.0)
    w = 2 * np.pi * found.frequency
    c = 2 * 0.01 * np.sqrt(0.05 * 1e6) + Dashpot.c
    exact = 5.0 / (1e6 - 0.05 * w**2 + 1j * c * w)
    assert np.abs(found.harmonics[:, 0, 1] - exact).max() < 1e-6 * np.abs(exact).max()


def test_much_damping_is_told():
    hard = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    hard = hard.add(Jenkins1D(), 0, kt=3e6, mu=0.5, preload=40.0).contact_problem
    mode = backbone(hard, 1, (1e-7, 2e-3), outputs=X, harmonics=1)
    assert "contacts damp by 2" in synthesis(mode, hard, np.ones(1), 20.0).said
    assert synthesis(mode, hard, np.ones(1), 5.0).said == ""


def test_other_modes_that_overlap_are_told():
    """Two equal oscillators, weakly coupled: 1 % apart with 1 % of damping."""
    K = np.array([[1.01, -0.01], [-0.01, 1.01]])
    pair = Problem(M=np.eye(2), K=K, damping_ratio=0.01).add(CubicSpring(1e-9), 0)
    mode = backbone(pair, 1, (1e-6, 1.0), outputs={"x": [1.0, 0.0]}, harmonics=1)
    assert "other modes are" in synthesis(mode, pair, np.array([1.0, 0.0]), 1e-3).said


def test_modes_that_overlap_where_the_contact_slips_are_told():
    """5 % apart stuck, 1 % apart under slip: there the peak of the mode is a third too low."""
    K = np.array([[1.01, -0.01], [-0.01, 1.01]])
    pair = Problem(M=np.eye(2), K=K, damping_ratio=0.01)
    pair = pair.add(Jenkins1D(), 0, kt=0.1, mu=1.0, preload=0.05)
    mode = backbone(pair, 2, (1e-4, 20.0), outputs={"x": [1.0, 0.0]}, harmonics=1)
    force, given = np.array([1.0, 0.0]), dict(outputs={"x": 0}, harmonics=1)
    stuck, slips = (synthesis(mode, pair, force, level) for level in (1e-3, 0.5))
    assert stuck.said == "" and "other modes are" in slips.said
    for found, level, good in ((stuck, 1e-3, True), (slips, 0.5, False)):
        height = pair.force(0, level).follow_band((0.13, 0.2), **given).peak("x")[1]
        assert (abs(found.peak("x")[1] / height - 1) < 0.03) == good


def chain(seed):
    """(Problem, driven dof, observed dof, number of a mode) : 3 to 8 masses on springs, with one to
    three sliders, cubic springs or stops."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    m, k = rng.uniform(0.5, 1.5, n), (n + 1) * rng.uniform(0.5, 2.0, n + 1)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    made = Problem(np.diag(m), K=K, damping_ratio=float(rng.choice([0.003, 0.01, 0.02])))
    for _ in range(rng.integers(1, 4)):
        i = int(rng.integers(0, n))
        where = i if rng.random() < 0.5 or i == 0 else (i, i - 1)
        a, b = rng.uniform(0, 1, 2)
        if seed % 3 == 0:
            made = made.add(Jenkins1D(), where, kt=0.1 + 1.9 * a, mu=0.5, preload=0.5 + 1.5 * b)
        elif seed % 3 == 1:
            made = made.add(CubicSpring(0.05 + 0.45 * a), where)
        else:
            made = made.add(UnilateralSpring(), where, kn=0.1 + 0.9 * a, preload=-0.05 - 0.25 * b)
    return made, int(rng.integers(0, n)), int(rng.integers(0, n)), int(rng.integers(1, 3))


CHAINS = [(0, 1.0), (1, 0.3), (3, 1.0), (18, 0.3), (20, 0.3), (38, 0.1), (45, 2.0)]


@pytest.mark.parametrize(("seed", "level"), CHAINS)
def test_how_far_the_peak_is_off_is_told(seed, level):
    """To a per cent of the peak, and nothing where it is right."""
    made, driven, seen, number = chain(seed)
    force, given = np.eye(made.size)[driven], dict(outputs={"x": seen}, harmonics=3)
    mode = backbone(made, number, (1e-4, 30.0), **given)
    found = synthesis(mode, made, force, level)
    hz, height = found.peak("x")
    curve = made.force(driven, level).follow_band((0.95 * hz, 1.05 * hz), **given, truncation=False)
    off = height / curve.peak("x")[1] - 1
    assert abs(off - told_of(found)) < 0.015
    assert abs(off) > 0.02 or found.said == ""


def told_of(found):
    """How far a peak is too high by what is said, 0 where nothing is."""
    told = re.match(r"the peak of 'x' is some (\d+)% too (high|low)", found.said)
    return {"high": 0.01, "low": -0.01}[told[2]] * int(told[1]) if told else 0.0


def test_the_peak_is_that_of_the_mode():
    """Not the higher resonance of the linear mode further up, which the way passes too."""
    K = np.array([[1.2, -0.2], [-0.2, 4.0]])
    pair = Problem(M=np.eye(2), K=K, damping_ratio=0.01).add(CubicSpring(0.1), 0)
    outputs = {"x": [1.0, 0.0], "y": [0.0, 1.0]}
    mode = backbone(pair, 1, (1e-6, 0.5), outputs=outputs, harmonics=1)
    found = synthesis(mode, pair, np.array([0.0, 1.0]), 0.05)
    assert found.frequency[found.amplitude()[:, 1].argmax()] > 0.3  # of mode 2
    hz, height = found.peak("y")
    given = dict(outputs={"y": [0.0, 1.0]}, harmonics=1, truncation=False)
    curve = follow_band(pair.contact_problem, np.array([0.0, 0.05]), (0.14, 0.22), **given)
    assert hz == pytest.approx(curve.peak("y")[0], rel=1e-3)
    assert height == pytest.approx(curve.peak("y")[1], rel=0.02)


def test_the_backbone_must_reach_far_enough():
    mode = backbone(oscillator(), 1, (1e-6, 1e-5), outputs=X, harmonics=1)
    found = synthesis(mode, oscillator(), np.ones(1), 5.0)
    assert not found.peak_reached and np.isnan(found.peak("x")).all()
    assert "the backbone ends below the amplitude of the peak" in found.said
    assert "peak of 'x' none" in repr(found) and "\n" not in repr(found)
    with pytest.raises(InputError, match="excites mode 1 to less than 1e-06 m"):
        synthesis(mode, oscillator(), np.ones(1), 1e-4)
    with pytest.raises(InputError, match="output 'y' is not in this synthesis"):
        found.peak("y")


def one_blade(K=1e6, mu=0.5):
    blade = Problem(M=[[0.05]], K=[[K]], damping_ratio=0.01)
    return blade.add(Jenkins1D(), 0, kt=5e5, mu=mu, preload=40.0)


WRONG = {
    "mode = None: must be the Backbone": lambda mode: synthesis(None, one_blade(), [1.0]),
    "forcing: is zero": lambda mode: synthesis(mode, one_blade(), [0.0]),
    r"level = \[1, 2\]: must be one": lambda mode: synthesis(mode, one_blade(), [1.0], [1, 2]),
    "has not the stuck mode 1 of the backbone": lambda mode: synthesis(mode, one_blade(2e6), [1.0]),
    "at 0.0001 m is none with its contacts": lambda mode: synthesis(mode, one_blade(mu=0.1), [1.0]),
    "the stuck mode 1 of the backbone, at 871.": lambda mode: synthesis(
        mode, beam("B8")[0], beam("B8")[1]
    ),
}


@pytest.mark.parametrize("said", WRONG)
def test_bad_input_is_told_in_a_line(said):
    mode = backbone(one_blade(), 1, (1e-6, 1e-4), outputs={"x": [1.0]}, harmonics=1)
    with pytest.raises(InputError, match=said) as told:
        WRONG[said](mode)
    assert "\n" not in str(told.value)


def test_a_peak_beside_which_nothing_is_solved_is_not_judged():
    """What is solved farther off is lower than any peak: no word of "too high" from there."""
    mode = backbone(oscillator(), 1, (1e-6, 1e-4), outputs=X, harmonics=1)
    made = np.zeros((7, 1, 2), dtype=complex)
    made[:, 0, 1] = [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]
    far, beside = (np.isin(np.arange(7), some) for some in ([0, 1, 5, 6], [0, 1, 2, 5, 6]))
    assert "does not lie near enough" in _off(mode, made, made[far], far)[0]
    assert "33% too high" in _off(mode, made, made[beside], beside)[0]
