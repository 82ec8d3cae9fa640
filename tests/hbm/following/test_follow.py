"""Followed peaks against those of whole curves, and folds against closed forms."""

import io
import warnings

import numpy as np
import pytest
from scipy.optimize import fsolve

from tests.hbm.cases import beam, duffing, duffing_peak, rig
from tests.hbm.modes.test_backbone import held_rig
from tipdamp.hbm.balance.equation import as_parameter
from tipdamp.hbm.balance.parameter import ModelParameter
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.varying import Unbalance
from tipdamp.hbm.curve import watched
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.following.extremum import by_frequency
from tipdamp.hbm.following.follow import follow_fold, follow_peak
from tipdamp.hbm.following.result import Followed
from tipdamp.hbm.following.run import Run
from tipdamp.hbm.laws import CubicSpring, Jenkins1D
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band, solve_at

TIP = {"tip": [1.0]}
FORCE = np.array([5.0])


def oscillator(**given):
    blade = Problem(M=[[0.05]], K=[[1e6]], **(given or {"damping_ratio": 0.01}))
    return blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem


def swept(problem, force, parameter, value, given, kind):
    """(Hz, m) of the highest peak of a whole curve at a value."""
    there, forces = as_parameter(parameter).rebuild(problem, {1: force}, value)
    options = dict(outputs=given["outputs"], harmonics=given["harmonics"], truncation=False)
    curve = follow_band(there, forces, given["band"], **options)
    return find_peaks(curve, there, next(iter(given["outputs"])), kind)[0]


def beside_sweeps(peaks, problem, force, parameter, given, places=4):
    """(value, (Hz, m) followed, (Hz, m) of a whole curve) at places of the branch."""
    for i in np.linspace(0, len(peaks.parameter) - 1, places).astype(int):
        value = peaks.parameter[i]
        whole = swept(problem, force, parameter, value, given, peaks.kind)
        yield value, (peaks.frequency[i], peaks.height[i]), whole


def check_against_sweeps(peaks, problem, force, parameter, given, places=4):
    for _, ours, whole in beside_sweeps(peaks, problem, force, parameter, given, places):
        assert ours[1] == pytest.approx(whole[1], rel=1e-8)
        assert ours[0] == pytest.approx(whole[0], rel=1e-6)
    assert (peaks.curvature < 0).all()


ON_THE_OSCILLATOR = [
    ("level", (0.2, 8.0)),
    ("preload", (4.0, 0.1)),
    ("mu", (0.1, 4.0)),
    ("damping", (0.5, 3.0)),
]


@pytest.mark.parametrize("kind", ["half_peak_to_peak", "harmonic", "rms"])
@pytest.mark.parametrize(("parameter", "between"), ON_THE_OSCILLATOR)
def test_oscillator(parameter, between, kind):
    """From stuck to full slip."""
    problem, given = oscillator(), dict(outputs=TIP, band=(600, 1200), harmonics=3)
    peaks = follow_peak(problem, FORCE, parameter, between, kind=kind, **given)
    assert peaks.complete and peaks.ended == "reached the last value"
    check_against_sweeps(peaks, problem, FORCE, parameter, given)


def test_another_unit_of_time_changes_no_step():
    """The same motions ten thousand times as fast are followed in the same places."""

    def peaks(fast):
        blade = Problem(M=[[1.0]], C=[[0.02 * fast]], K=[[fast**2]])
        problem = blade.add(CubicSpring(0.1 * fast**2), 0).contact_problem
        given = dict(outputs=TIP, band=(0.1 * fast, 0.4 * fast), harmonics=3)
        return follow_peak(problem, np.array([fast**2]), "level", (0.01, 0.1), **given)

    slow, fast = peaks(1.0), peaks(1e4)
    assert slow.complete and len(fast.parameter) == len(slow.parameter)
    assert np.allclose(fast.parameter, slow.parameter, rtol=1e-8)
    assert np.allclose(fast.height, slow.height, rtol=1e-8)
    assert np.allclose(fast.frequency, 1e4 * slow.frequency, rtol=1e-8)


def test_a_terminal_sees_how_far_it_is(monkeypatch):
    """From the first value to the last, by the parameter's unit."""
    said = io.StringIO()
    monkeypatch.setattr(watched, "_stream", lambda: said)
    monkeypatch.setattr(watched, "PATIENCE", 0.0)
    monkeypatch.setattr(watched, "EVERY", 0.0)
    given = dict(outputs=TIP, band=(600, 1200), harmonics=1)
    peaks = follow_peak(oscillator(), FORCE, "level", (0.5, 2.0), **given)
    shares = [line.count("#") for line in said.getvalue().split("\r") if "#" in line]
    assert peaks.complete and shares == sorted(shares) and shares[0] < 12 < shares[-1]


@pytest.mark.parametrize("parameter", ["kt", "own"])
def test_oscillator_over_its_stiffness(parameter):
    """kt with a damping matrix, which does not change with it, and the mass as a parameter of
    one's own."""
    problem, given = oscillator(C=[[4.0]]), dict(outputs=TIP, band=(500, 1500), harmonics=3)
    if parameter == "own":
        parameter = ModelParameter("mass", lambda p, m: oscillator_of(m))
    peaks = follow_peak(problem, FORCE, parameter, (0.5, 2.0), **given)
    assert peaks.complete
    check_against_sweeps(peaks, problem, FORCE, parameter, given)


@pytest.mark.slow
@pytest.mark.parametrize(("parameter", "last"), [("level", 1e6), ("damping", 1e-5)])
def test_a_peak_that_grows_by_decades(parameter, last):
    """To where friction hardly counts: a peak is one however far it grows. Closed form of
    harmonic 1 under full slip."""
    given = dict(outputs=TIP, band=(600, 1000), harmonics=1)
    peaks = follow_peak(oscillator(), 10 * FORCE, parameter, (1.0, last), **given)
    assert peaks.complete and "minimum" not in peaks.ended and not peaks.jumps.any()
    level, damping = (last, 1.0) if parameter == "level" else (1.0, last)
    a, w = peaks.height[-1], 2 * np.pi * peaks.frequency[-1]
    friction = 4 / np.pi * 20 * (1 - 20 / (5e5 * a))
    viscous = 2 * 0.01 * damping * np.sqrt(1.5e6 * 0.05) * w * a
    assert friction + viscous == pytest.approx(50 * level, rel=2e-4)
    assert (peaks.curvature < -0.1).all()


def test_power_of_friction_and_places():
    """What the force puts in and the damper of the structure does not take."""
    problem, given = oscillator(C=[[4.0]]), dict(outputs=TIP, band=(600, 1200), harmonics=3)
    peaks = follow_peak(problem, FORCE, "level", (0.5, 8.0), at=[1.0, 4.0], **given)
    w, X = 2 * np.pi * peaks.frequency[:, None], peaks.harmonics[:, 0]
    speed = 1j * np.arange(4) * w * X
    put_in = 0.5 * (peaks.parameter * FORCE * speed[:, 1].conj()).real
    taken = 0.5 * 4.0 * (np.abs(speed) ** 2).sum(axis=1)
    assert peaks.friction_W.shape == (len(peaks), 1)
    assert np.allclose(peaks.friction_W[:, 0], put_in - taken, atol=1e-7 * put_in.max(), rtol=1e-7)
    assert peaks.friction_W[-1, 0] > 0.2 * put_in[-1]
    assert [peaks.parameter[peaks.at(level)] for level in (1.0, 4.0)] == [1.0, 4.0]
    with pytest.raises(InputError, match="value = 3: no place is solved there, the nearest is"):
        peaks.at(3)


def oscillator_of(mass):
    blade = Problem(M=[[0.05 * mass]], K=[[1e6]], C=[[4.0]])
    return blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem


@pytest.mark.slow
@pytest.mark.parametrize("case", ["B8", "C8"])
def test_beam(case):
    """Eight contacts, of friction alone and with lift-off."""
    problem, force, outputs = beam(case)
    given = dict(outputs=outputs, band=(500, 1400), harmonics=3)
    peaks = follow_peak(problem, force, "level", (1.0, 60.0), **given)
    assert peaks.complete and peaks.share_slip.max() > 0.3
    check_against_sweeps(peaks, problem, force, "level", given)


def rig_alone(**given):
    """(problem, force of 20 N, what is asked) of the rig with the first of its outputs."""
    problem, force, outputs = rig()
    name = next(iter(outputs))
    asked = dict(outputs={name: outputs[name]}, band=(1450, 1600), harmonics=3)
    return problem, 20 * force, asked | given


ON_THE_RIG = [("level", (0.5, 2.5)), ("preload", (1.0, 0.45)), ("mu", (1.0, 0.5))]


@pytest.mark.slow
@pytest.mark.parametrize(("parameter", "between"), ON_THE_RIG)
def test_rig(parameter, between):
    problem, force, given = rig_alone()
    peaks = follow_peak(problem, force, parameter, between, **given)
    assert peaks.complete and peaks.share_slip[-1].max() > 0.2
    check_against_sweeps(peaks, problem, force, parameter, given, places=3)


@pytest.mark.slow
def test_the_rig_drifts_at_a_named_end():
    problem, force, given = rig_alone()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peaks = follow_peak(problem, force, "level", (0.5, 5.0), **given)
    assert not peaks.complete and peaks.ended.count("hold its mean position") == 1


@pytest.mark.slow
def test_a_drift_is_named_before_the_kink_that_it_makes():
    """Of the damper along y, which whole curves beyond tell."""
    problem, force, given = rig_alone()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peaks = follow_peak(problem, force, "preload", (0.4, 0.2), **given)
    assert not peaks.complete and 0.36 < peaks.parameter[-1] < 0.39
    drift = peaks.ended.index("slides along (0.00, 1.00, 0.00)")
    assert drift < peaks.ended.rindex("a kink") and peaks.ended.count("hold its mean") == 1


@pytest.mark.slow
def test_a_held_damper_is_followed_from_stuck_to_slip_of_every_contact():
    """Its mean along y is held, and no drift ends the branch. Beside solutions at both sides of the
    peak: whole curves do not solve all of theirs."""
    problem, tip, _ = held_rig()
    given = dict(outputs={"tip": tip}, band=(240, 395), harmonics=1)
    peaks = follow_peak(problem, 20 * tip, "pull", (4.0, 0.13), **given)
    assert peaks.ended == "reached the last value" and not peaks.jumps.any()
    assert (peaks.share_stick[0] == 1).all() and (peaks.share_stick[-1] < 0.4).all()
    for i in np.linspace(0, len(peaks) - 1, 6).astype(int):
        there, forces = as_parameter("pull").rebuild(problem, {1: 20 * tip}, peaks.parameter[i])
        asked = dict(outputs={"tip": tip}, harmonics=1, guess=peaks.unknowns[i])
        before, top, after = (
            solve_at(there, forces, s * peaks.frequency[i], **asked).amplitude()[0]
            for s in (1 - 1e-5, 1, 1 + 1e-5)
        )
        assert top == pytest.approx(peaks.height[i], rel=1e-8) and top > max(before, after)


@pytest.mark.slow
def test_duffing_peaks_in_closed_form():
    given = dict(outputs={"x": [1.0]}, band=(0.05, 1.0), harmonics=1)
    peaks = follow_peak(duffing(0.1), np.ones(1), "level", (0.05, 3.0), at=[0.5, 2.0], **given)
    assert peaks.complete and {0.5, 2.0} <= set(peaks.parameter)
    for level, hz, height in zip(peaks.parameter, peaks.frequency, peaks.height, strict=True):
        w, A = duffing_peak(0.1, level)
        assert height == pytest.approx(A, rel=1e-7)
        assert 2 * np.pi * hz == pytest.approx(w, rel=1e-6)


def duffing_with_friction(d):
    """(problem, F(A, w)) with a friction element that slips from A = d on, H = 1, in closed form:
    F = A |Z| with the equivalent stiffness k and damping s of the element, which have a kink
    there."""
    c, kt = 0.05, 0.3

    def force(A, w):
        turn = np.arccos(1 - 2 * np.minimum(d / A, 1.0))
        k = np.where(A > d, kt / np.pi * (turn - np.sin(turn) * np.cos(turn)), kt)
        s = np.where(A > d, 4 * kt * d * (A - d) / (np.pi * A**2), 0.0)
        return A * np.hypot(1 + k + 0.75 * A**2 - w**2, c * w + s)

    made = Problem([[1.0]], [[c]], [[1.0]]).add(CubicSpring(1.0), 0)
    return made.add(Jenkins1D(), 0, kt=kt, mu=1.0, preload=kt * d).contact_problem, force


def by_amplitude(force, A, w, h=1e-4):
    """First and second derivative of F by A, by differences."""
    low, here, high = (force(A + s * h, w) for s in (-1, 0, 1))
    return (high - low) / (2 * h), (high - 2 * here + low) / h**2


WITH_FOLDS = dict(outputs={"x": [1.0]}, band=(0.1, 0.9), harmonics=1)


@pytest.mark.slow
def test_a_fold_ends_beside_the_kink_where_it_meets_another():
    """At a fold F has an extremum over A at its frequency; a kink at d = 0.8 makes a second one
    close above it, and both meet where the second derivative is zero."""
    problem, force = duffing_with_friction(0.8)
    fold = follow_fold(problem, np.ones(1), "level", (1.0, 0.2), near=0.2, **WITH_FOLDS)
    w, A = 2 * np.pi * fold.frequency, fold.height
    assert np.allclose(force(A, w), fold.parameter, rtol=1e-7)
    assert np.abs(by_amplitude(force, A, w)[0] / fold.parameter).max() < 1e-3
    assert not fold.complete and "two folds meet" in fold.ended
    A, w = fsolve(lambda v: by_amplitude(force, *v), [A[-1], w[-1]], xtol=1e-10)
    assert 0.8 < A < 0.83
    assert fold.parameter[-1] == pytest.approx(force(A, w), rel=1e-4)


@pytest.mark.slow
def test_a_fold_ends_at_a_kink_by_name():
    """Where the amplitude falls to d = 1.5 the element stops slipping: the fold follows the closed
    form up to there."""
    problem, force = duffing_with_friction(1.5)
    fold = follow_fold(problem, np.ones(1), "level", (1.0, 0.1), near=0.6, **WITH_FOLDS)
    w, A = 2 * np.pi * fold.frequency, fold.height
    assert not fold.complete and "a kink of the curve ends the branch of folds" in fold.ended
    assert A[0] > 3 and 0 <= A[-1] / 1.5 - 1 < 1e-3
    assert np.allclose(force(A, w), fold.parameter, rtol=1e-7)
    slips = A > 1.501
    slope = by_amplitude(force, A[slips], w[slips])[0]
    assert np.abs(slope / fold.parameter[slips]).max() < 1e-3


class DuffingFolds:
    """F^2 = s ((1 - w^2 + 3/4 s)^2 + c^2 w^2), s = A^2, of H = 1: a fold where its derivative by s
    is zero, two meet where the second is."""

    c = 0.1

    def followed(self):
        """The fold from 1 N on until it meets the other."""
        given = dict(outputs={"x": [1.0]}, band=(0.1, 1.0), harmonics=1, samples=64)
        force = np.ones(1)
        return follow_fold(duffing(self.c), force, "level", (1.0, 0.01), near=0.3, **given)

    def squared(self, s, w):
        return s * ((1 - w**2 + 0.75 * s) ** 2 + (self.c * w) ** 2)

    def slope(self, s, w):
        b = 1 - w**2
        return b**2 + (self.c * w) ** 2 + 3 * b * s + 27 / 16 * s**2

    def meet(self, fold):
        """(N, rad/s) where two folds meet, from the end of one."""

        def both(v):
            s, w = v
            return [self.slope(s, w), 3 * (1 - w**2) + 27 / 8 * s]

        begin = [fold.height[-1] ** 2, 2 * np.pi * fold.frequency[-1]]
        s, w = fsolve(both, begin, xtol=1e-13)
        return np.sqrt(self.squared(s, w)), w


@pytest.mark.slow
def test_folds_of_duffing_until_they_meet():
    exact = DuffingFolds()
    fold = exact.followed()
    w, s = 2 * np.pi * fold.frequency, fold.height**2
    assert np.allclose(exact.squared(s, w), fold.parameter**2, rtol=1e-7)
    assert np.abs(exact.slope(s, w) / s**2).max() < 1e-5
    assert not fold.complete and "two folds meet" in fold.ended
    level, w = exact.meet(fold)
    assert fold.parameter[-1] == pytest.approx(level, rel=1e-6)
    assert fold.frequency[-1] == pytest.approx(w / (2 * np.pi), rel=1e-4)


def absorber():
    """A mass with an absorber on a friction contact: with little force it sticks, one peak; with
    much it slides and is tuned, two."""
    M, K = np.diag([1.0, 0.05]), np.array([[1.05, -0.05], [-0.05, 0.05]])
    one = Problem(M=M, K=K, C=np.diag([0.01, 0.0]) + 0.002 * np.array([[1, -1], [-1, 1]]))
    return one.add(Jenkins1D(), (0, 1), kt=0.2, mu=1.0, preload=0.02).contact_problem


@pytest.mark.slow
def test_a_peak_ends_where_it_meets_a_minimum():
    problem, force = absorber(), np.array([1.0, 0.0])
    given = dict(outputs={"x": [1.0, 0.0]}, harmonics=1)
    peaks = follow_peak(problem, force, "level", (1.0, 0.01), band=(0.165, 0.25), **given)
    assert not peaks.complete and "the peak meets a minimum of the curve" in peaks.ended
    end = peaks.parameter[-1]
    for level, count in ((1.01 * end, 2), (0.99 * end, 1)):
        curve = follow_band(problem, level * force, (0.1, 0.25), truncation=False, **given)
        assert len(find_peaks(curve, problem, "x")) == count


def test_another_peak_is_taken_up():
    """In the whole band the other one is there: the higher one at the end."""
    problem, force = absorber(), np.array([0.0, 1.0])
    given = dict(outputs={"x": [0.0, 1.0]}, band=(0.1, 0.3), harmonics=1)
    peaks = follow_peak(problem, force, "level", (1.0, 0.001), **given)
    assert peaks.complete
    hz, height = swept(problem, force, "level", peaks.parameter[-1], given, peaks.kind)
    assert peaks.height[-1] == pytest.approx(height, rel=1e-6)


def test_derivative_by_the_frequency():
    """Of a linearisation made for another parameter it is that of the balance itself."""
    problem, force, outputs = beam("C8")
    found = solve_at(problem, 60 * force, 915, outputs=outputs, harmonics=3)
    balance, w = HarmonicBalance(problem, {1: 60 * force}, 3), 2 * np.pi * 915
    own = balance.evaluate(found.unknowns, w).by_parameter
    assert found.share_slip.max() > 0.1
    near = dict(rtol=0, atol=1e-12 * np.abs(own).max())
    for name in ("level", "mu", "kn", "preload"):
        other = as_parameter(name).evaluate(balance, found.unknowns, w, 1.0)
        assert np.allclose(by_frequency(other).by_parameter, own, **near)
        held = as_parameter(name).held(balance, found.unknowns, w, 1.0)
        assert np.allclose(held.by_parameter, own, **near)


def test_values_that_are_not_solved_are_told(monkeypatch):
    given = dict(outputs=TIP, band=(600, 1200), harmonics=1, at=[1.25, 1.5])
    whole = follow_peak(oscillator(), FORCE, "level", (1.0, 2.0), **given)
    assert {1.25, 1.5} <= set(whole.parameter) and whole.ended == "reached the last value"
    monkeypatch.setattr(Run, "at", lambda *given: False)
    peaks = follow_peak(oscillator(), FORCE, "level", (1.0, 2.0), **given)
    assert peaks.ended == "reached the last value; not solved at level = 1.25, 1.5"


def test_saved_and_loaded(tmp_path):
    given = dict(outputs=TIP, band=(600, 1200), harmonics=1)
    peaks = follow_peak(oscillator(), FORCE, "level", (1.0, 2.0), **given)
    assert Followed.load(peaks.save(tmp_path / "peaks.npz")) == peaks
    assert repr(peaks).startswith("<Followed peak of 'tip': level 1 to 2")
    with pytest.raises(InputError, match="followed peaks not found"):
        Followed.load(tmp_path / "none.npz")
    np.savez(tmp_path / "other.npz", what="peak")
    with pytest.raises(InputError, match="is not what Followed.save writes"):
        Followed.load(tmp_path / "other.npz")


WRONG = {
    "parameter": (dict(parameter="muu"), "parameter = 'muu': is unknown"),
    "frequency": (dict(parameter="frequency"), "parameter = 'frequency': is unknown"),
    "output": (dict(output="top"), "output = 'top': is none of outputs"),
    "kind": (dict(kind="peak"), "kind = 'peak': must be one of"),
    "band": (dict(band=(100, 200)), "the curve at level = 1 has no peak inside it"),
    "between": (dict(between=(1.0, 1.0)), "between = "),
    "at": (dict(at=[3.0]), "at = 3: lies outside between"),
}


def test_forces_that_depend_on_the_frequency_are_refused():
    rotor = Problem(M=[[2.0]], C=[[8.0]], K=[[2e5]]).force(0, Unbalance(1e-4))
    stop = rotor.add(CubicSpring(1e9), 0)
    with pytest.raises(InputError, match="that depend on the frequency"):
        follow_peak(stop, np.ones(1), "level", (1.0, 2.0), outputs=TIP, band=(20, 100))


def test_forces_of_the_problem_itself():
    """Taken where none are given; what is given takes their place."""
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    blade = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    given = dict(outputs=TIP, band=(600, 1200), harmonics=1)
    own = follow_peak(blade.force(0, 5.0), None, "mu", (1.0, 0.8), **given)
    assert own == follow_peak(blade, FORCE, "mu", (1.0, 0.8), **given)
    assert own == follow_peak(blade.force(0, 9.0), FORCE, "mu", (1.0, 0.8), **given)
    with pytest.raises(InputError, match="no excitation: force"):
        follow_peak(blade, None, "mu", (1.0, 0.8), **given)


@pytest.mark.parametrize("name", WRONG)
def test_bad_input_is_one_line(name):
    changed, said = WRONG[name]
    given = dict(parameter="level", between=(1.0, 2.0), outputs=TIP, band=(600, 1200), harmonics=1)
    with pytest.raises(InputError, match=said) as told:
        follow_peak(oscillator(), FORCE, **{**given, **changed})
    assert "\n" not in str(told.value)


def test_a_linear_resonance_has_no_fold():
    with pytest.raises(InputError, match="has no fold inside it"):
        given = dict(outputs=TIP, band=(600, 1200), harmonics=1)
        follow_fold(oscillator(), FORCE, "level", (0.1, 1.0), **given)


def test_equal_calls_give_equal_numbers():
    """Also where memory is used otherwise in between."""
    given = dict(outputs={"x": [0.0, 1.0]}, band=(0.1, 0.3), harmonics=1)
    first, *others = (
        follow_peak(absorber(), np.array([0.0, 1.0]), "level", (1.0, 0.1), **given)
        for _ in range(4)
    )
    assert all(other == first for other in others)


def test_as_a_table():
    pytest.importorskip("pandas")
    given = dict(outputs=TIP, band=(600, 1200), harmonics=1)
    peaks = follow_peak(oscillator(), FORCE, "level", (1.0, 2.0), **given)
    table = peaks.to_pandas()
    assert table["level"].tolist() == peaks.parameter.tolist()
    assert table["height"].tolist() == peaks.height.tolist() and set(table["peak_of"]) == {"tip"}


def test_the_damping_varies_without_a_problem_made_anew():
    """Of damping ratios and of a matrix that couples the modes, against differences."""
    for more in (dict(damping_ratio=0.02), dict(C=np.array([[4.0, 1.0], [1.0, 2.0]]))):
        blade = Problem(M=np.diag([0.05, 0.1]), K=1e6 * np.array([[2.0, -1], [-1, 2]]), **more)
        problem = blade.add(CubicSpring(1e9), 0).contact_problem
        balance = HarmonicBalance(problem, {1: np.array([5.0, 1.0])}, 3)
        x, w, parameter = balance.linear(4000.0), 4100.0, as_parameter("damping")
        found, h = parameter.evaluate(balance, x, w, 0.7), 1e-4
        near = [
            balance.rebuilt(problem.with_damping(0.7 + s), balance.forces).evaluate(x, w)
            for s in (0, h, -h)
        ]
        assert np.allclose(found.residual, near[0].residual, rtol=0, atol=1e-14)
        rate = (near[1].residual - near[2].residual) / (2 * h)
        assert np.allclose(found.by_parameter, rate, rtol=1e-6, atol=1e-6 * np.abs(rate).max())
