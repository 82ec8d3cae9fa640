"""Nonlinear modes against closed forms, published tables and forced motions at phase resonance."""

import warnings

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import fsolve

from tests.beam_elements import bending
from tests.hbm.cases import coupled, duffing, load, rig
from tests.hbm.small_rig import small_rig
from tipdamp.hbm.balance import residual
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.spring import Hold
from tipdamp.hbm.laws import CubicSpring, DryFriction2T, Jenkins1D, PlainForce, UnilateralSpring
from tipdamp.hbm.modes import backbone as backbones
from tipdamp.hbm.modes.backbone import backbone
from tipdamp.hbm.modes.result import Backbone
from tipdamp.hbm.modes.stuck_modes import stuck_modes
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band, solve_at

J1 = load("J1")
X = {"x": [1.0]}


def friction_oscillator(**damping):
    p = {name: J1["parameters"][name] for name in ("m", "k", "kt")}
    one = Problem(M=[[p["m"]]], K=[[p["k"]]], **(damping or {"damping_ratio": 0.0}))
    limit = J1["parameters"]["L"]
    return one.add(Jenkins1D(), 0, kt=p["kt"], mu=1.0, preload=limit).contact_problem


def cantilever(law, **settings):
    """(problem with the law at the tip, force and output there): ten elements of 1 m, the first
    resonance at 1 Hz without it."""
    K, M = bending(np.linspace(0, 1, 11), 1.0, 1.0)
    K, M = K[2:, 2:], M[2:, 2:]
    K *= (2 * np.pi / 3.5160152685) ** 2
    tip = np.eye(20)[18]
    free = Problem(M=M, K=K, damping_ratio=0.002)
    return free.add(law, 18, **settings).contact_problem, tip


@pytest.mark.parametrize("H", [1, 3, 9, 21])
def test_table_of_the_friction_oscillator(H):
    """J1: closed form at one harmonic, and its table of more."""
    rows = J1["results"]
    mode = backbone(friction_oscillator(), 1, [r["a"] for r in rows], outputs=X, harmonics=H)
    assert mode.complete
    for row in rows:
        i = np.flatnonzero(mode.amplitude == row["a"])[0]
        known = row.get(f"EPMC_H{H}", row)  # everything sticks: the closed form
        assert 2 * np.pi * mode.frequency[i] == pytest.approx(known["omega"], rel=1e-7)
        assert mode.damping_ratio[i] == pytest.approx(known["zeta"], abs=1e-7)


def test_full_slip():
    """One harmonic far beyond slip: w -> sqrt(k/m), and the damping is that of Coulomb friction."""
    p = J1["parameters"]
    a = 1e4 * p["xc"]
    mode = backbone(friction_oscillator(), 1, (0.1, a), outputs=X, harmonics=1)
    w = 2 * np.pi * mode.frequency[-1]
    assert w == pytest.approx(np.sqrt(p["k"] / p["m"]), rel=1e-4)
    energy = 4 * p["L"] * (a - p["xc"]) / (2 * np.pi * p["m"] * w**2 * a**2)
    assert mode.damping_ratio[-1] == pytest.approx(energy, rel=1e-9)
    assert mode.share_slip[-1, 0] > 0.99


def test_largest_damping():
    known = J1["max_damping"]
    mode = backbone(friction_oscillator(), 1, (0.1, known["a"], 6), outputs=X, harmonics=1)
    i = np.flatnonzero(mode.amplitude == known["a"])[0]
    assert mode.damping_ratio[i] == pytest.approx(known["zeta"], rel=1e-7)
    assert mode.damping_ratio.max() == mode.damping_ratio[i]


def test_damping_of_the_structure_is_part_of_the_mode():
    """Of one dof the same w; zeta w gains c / 2 m."""
    at = (0.1, 0.5, 2.0)
    bare, damped = (
        backbone(friction_oscillator(**given), 1, at, outputs=X, harmonics=1)
        for given in ({"damping_ratio": 0.0}, {"C": [[0.03]]})
    )
    for a in at:
        i, j = (np.flatnonzero(m.amplitude == a)[0] for m in (bare, damped))
        assert damped.frequency[j] == pytest.approx(bare.frequency[i], rel=1e-9)
        w = 2 * np.pi * bare.frequency[i]
        gained = damped.damping_ratio[j] - bare.damping_ratio[i]
        assert gained == pytest.approx(0.015 / w, rel=1e-7)


def test_duffing_by_its_elliptic_integral():
    """x'' + x + x^3 = 0: the period is an integral over the quarter cycle. The amplitude there is
    the largest x, that of the mode its first harmonic."""
    mode = backbone(duffing(0.0), 1, (0.01, 10.0), outputs=X, harmonics=31, samples=256)
    assert mode.complete and np.abs(mode.damping_ratio).max() < 1e-12
    for i in range(0, len(mode.amplitude), 5):
        A = mode.amplitudes("x")[i]

        def rate(s, A=A):  # x = A sin s
            return 1 / np.sqrt(1 + 0.5 * A**2 * (1 + np.sin(s) ** 2))

        period = 4 * quad(rate, 0, np.pi / 2, epsabs=0, epsrel=1e-13)[0]
        assert mode.frequency[i] * period == pytest.approx(1, rel=1e-10)


def forced(problem, force, hz, mode, i):
    """Harmonics (r, H+1) of the motion under a force near point i of a backbone."""
    u = mode.unknowns[i, :-2]
    first = u.reshape(-1, 2 * mode.H + 1)[:, 1:3]
    guess = u * np.linalg.norm(problem.B @ mode.shape[i]) / np.linalg.norm(first)
    rows = {str(k): row for k, row in enumerate(np.eye(len(force)))}
    given = dict(outputs=rows, harmonics=mode.H, guess=guess)
    found = solve_at(problem, force, hz, **given)
    assert found.converged
    return found.harmonics


def at_phase_resonance(problem, tip, mode, i):
    """(Hz, damping ratio) of the motion that a force at the tip, in quadrature to it, holds at the
    amplitude of point i; the ratio by the work of the force and the inertia of that motion."""
    a, w = mode.amplitude[i], 2 * np.pi * mode.frequency[i]
    F = 2 * mode.damping_ratio[i] * w**2 * mode.modal_amplitude[i] ** 2 / a

    def motion(share, level):
        return forced(problem, 1j * level * F * tip, share * mode.frequency[i], mode, i)

    def away(v):
        x = tip @ motion(*v)[:, 1] / a
        return [x.real - 1, x.imag]

    share, level = fsolve(away, [1.0, 1.0], xtol=1e-11, epsfcn=1e-12)
    q, w = motion(share, level), share * w
    return w / (2 * np.pi), ratio_of_work(problem, np.pi * level * F * a, w, q)


def ratio_of_work(problem, work, w, q):
    """Damping ratio of a force 2 zeta w M q' that does this work in a cycle of q (r, H+1)."""
    speed = np.arange(q.shape[1]) * q
    return work / (2 * np.pi * w**2 * np.einsum("rk,rs,sk->", speed.conj(), problem.M, speed).real)


def test_friction_beam_against_forced_motions_at_phase_resonance():
    """A force at the tip, not the damping, drives the beam, and its other modes too."""
    problem, tip = cantilever(Jenkins1D(), kt=2.0, mu=1.0, preload=0.1)
    amplitudes = (0.02, 0.08, 0.15, 0.4, 1.0)
    mode = backbone(problem, 1, amplitudes, outputs={"x": tip}, harmonics=3)
    assert mode.complete and mode.damping_ratio.max() > 0.029
    for a in amplitudes[1:]:
        i = np.flatnonzero(mode.amplitude == a)[0]
        hz, zeta = at_phase_resonance(problem, tip, mode, i)
        assert mode.frequency[i] == pytest.approx(hz, rel=1e-4)
        assert mode.damping_ratio[i] == pytest.approx(zeta, rel=1e-3)


def at_the_peak(level):
    """((Hz, damping ratio) of the mode, the same of the forced peak) of the beam with a cubic
    tip."""
    problem, tip = cantilever(CubicSpring(200.0))
    rows = {str(k): row for k, row in enumerate(np.eye(len(tip)))}
    given = dict(outputs=rows, harmonics=3, truncation=False)
    curve = follow_band(problem, level * tip, (0.9, 2.0), **given)
    hz, a = find_peaks(curve, problem, "18", "harmonic")[0]
    mode = backbone(problem, 1, (1e-4, a, 1.1 * a), outputs={"x": tip}, harmonics=3)
    i = np.flatnonzero(mode.amplitude == a)[0]
    q = solutions_at(curve, problem, hz * (1 - 1e-9))[0]
    zeta = ratio_of_work(problem, np.pi * level * a, 2 * np.pi * hz, q)
    return (mode.frequency[i], mode.damping_ratio[i]), (hz, zeta)


@pytest.mark.parametrize("level", [1e-3, 3e-3, 8e-3])
def test_beam_with_a_cubic_tip_against_forced_peaks(level):
    """The peak of a lightly damped beam, up to 10 % above the linear resonance, is at phase
    resonance but for the square of the damping."""
    (hz, zeta), peak = at_the_peak(level)
    assert hz == pytest.approx(peak[0], rel=1e-4)
    assert zeta == pytest.approx(peak[1], rel=1e-3)


def test_force_that_balances_the_damping():
    """2 zeta w M q' as a force: at one harmonic the forced motion is that of the mode, however much
    of it is friction."""
    problem, tip = cantilever(Jenkins1D(), kt=10.0, mu=1.0, preload=0.5)
    mode = backbone(problem, 1, (0.02, 0.08, 0.3), outputs={"x": tip}, harmonics=1)
    assert mode.damping_ratio.max() > 0.08
    for i in (len(mode.amplitude) // 2, -1):
        w = 2 * np.pi * mode.frequency[i]
        force = 2j * mode.damping_ratio[i] * w**2 * (problem.M @ mode.shape[i])
        found = forced(problem, force, mode.frequency[i], mode, i)[:, 1]
        assert np.allclose(found, mode.shape[i], rtol=0, atol=1e-8 * mode.amplitude[i])


def test_where_no_vibration_exists_the_branch_ends():
    """k x - x^3 softens until it does not restore: w^2 = 1 - 3/4 a^2 at one harmonic."""
    mode = backbone(duffing(0.0, -1.0), 1, (0.1, 5.0), outputs=X, harmonics=1)
    assert not mode.complete
    assert "the frequency falls to zero" in mode.ended
    assert mode.amplitude[-1] == pytest.approx(2 / np.sqrt(3), rel=1e-3)
    w = 2 * np.pi * mode.frequency
    assert np.allclose(w**2, 1 - 0.75 * mode.amplitude**2, atol=1e-8)


class Dashpot(PlainForce):
    """Force that depends on the velocity."""

    components = ("n",)

    def force(self, u, v):
        return 0.3 * v * v * v


def with_dashpot():
    one = Problem(M=np.diag([1.0, 2.0]), K=[[2.0, -1.0], [-1.0, 2.0]], C=0.01 * np.eye(2))
    return one.add(Dashpot(), 0).add(CubicSpring(0.5), (0, 1)).contact_problem


def held_rig():
    model, pairs, tip = small_rig(stations=3)
    given = dict(damping_ratio=0.01, hold=Hold("y", mean=True))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return contact_problem(model, pairs, DryFriction2T(), **given)[0], tip, 1e-3


EQUATIONS = {
    "friction": lambda: (friction_oscillator(), np.ones(1), 0.5),
    "coupled damping and velocity": lambda: (with_dashpot(), np.eye(2)[0], 0.7),
    "normal and tangential": lambda: (coupled(load("D1")["parameters"])[0], np.eye(2)[0], 1.0),
    "held in the mean": held_rig,
}


@pytest.mark.parametrize("name", EQUATIONS)
def test_derivatives(name, monkeypatch):
    """Newton's step from a random place along its own direction, by central differences; without
    the regularisation, which is no part of the residual."""
    monkeypatch.setattr(residual, "regularise", lambda *given: None)
    problem, row, a = EQUATIONS[name]()
    equation = backbones.mode_equation(problem, 1, {"x": row}, 3, None)[0]
    rng = np.random.default_rng(0)
    x = equation.stuck()
    x[:-2] += 0.1 * np.abs(x[:-2]).max() * rng.normal(size=len(x) - 2)
    x[-2:] += 0.05
    e, border = equation.evaluate(x, a), rng.normal(size=len(x))
    dx, da = e.solve(border, 0.3 / a, 0.7)
    assert border @ dx + 0.3 / a * da == pytest.approx(0.7)
    h = 1e-7 / max(np.abs(dx).max(), abs(da) / a)
    after, before = (equation.evaluate(x + s * dx, a + s * da).residual for s in (h, -h))
    assert np.allclose((after - before) / (2 * h), -e.residual, rtol=0, atol=1e-5)
    assert e.forces.active.any()


def test_of_a_repeated_frequency_the_one_that_the_output_sees():
    """A mass that swings in two directions, turned by 30 degrees against the friction: the motion
    along the output is the mode."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    one = Problem(M=np.eye(2), K=np.eye(2), damping_ratio=0.0)
    problem = one.add(CubicSpring(1.0), [c, s]).contact_problem
    mode = backbone(problem, 1, (0.1, 1.0), outputs={"along": [c, s]}, harmonics=1)
    assert np.allclose(2 * np.pi * mode.frequency, np.sqrt(1 + 0.75 * mode.amplitude**2))
    assert np.allclose(mode.shape[-1], [c, s])


@pytest.mark.slow
@pytest.mark.parametrize("mode", [1, 2])
def test_of_equal_frequencies_the_one_at_the_contact(mode):
    """Whichever number it has; that which no contact sees is linear."""
    plane = Problem(np.eye(2), 0.01 * np.eye(2), np.eye(2)).add(CubicSpring(0.5), 0)
    alone = Problem([[1.0]], [[0.01]], [[1.0]]).add(CubicSpring(0.5), 0)
    found, single = (
        backbone(one, mode if one is plane else 1, (0.01, 3.0), outputs={"x": 0}, harmonics=3)
        for one in (plane, alone)
    )
    assert found.frequency[-1] == pytest.approx(single.frequency[-1], rel=1e-9)
    with pytest.raises(InputError, match=f"mode = {mode}: does not move any contact, it is linear"):
        backbone(plane, mode, (0.01, 3.0), outputs={"y": 1}, harmonics=3)


@pytest.mark.parametrize("squared", [1.0, 4.0, 9.0])
@pytest.mark.parametrize("damping", [0.0, 0.01])
def test_a_mode_that_no_contact_sees_has_no_say(squared, damping):
    """Not at twice or three times the frequency either, where its impedance is 0."""
    alone = Problem([[1.0]], [[damping]], [[1.0]]).add(CubicSpring(0.5), 0)
    both = Problem(np.eye(2), damping * np.eye(2), np.diag([1.0, squared]))
    both = both.add(CubicSpring(0.5), 0)
    a, b = (backbone(one, 1, (0.01, 3.0), outputs={"x": 0}, harmonics=3) for one in (alone, both))
    assert b.complete and b.frequency[-1] == pytest.approx(a.frequency[-1], rel=1e-9)


def test_the_rig_drifts_where_nothing_holds_its_damper():
    """As its curves say."""
    problem, _, outputs = rig()
    mode = backbone(problem, 1, (1e-6, 1e-3), outputs=outputs, harmonics=1)
    assert not mode.complete and "hold its mean position" in mode.ended
    assert mode.frequency[0] == pytest.approx(problem.receptance().frequencies[0], rel=1e-9)
    assert mode.damping_ratio[0] == pytest.approx(0.022, rel=1e-9)


def test_small_rig_with_a_held_damper_slips_fully():
    problem, tip, _ = held_rig()
    mode = backbone(problem, 1, (1e-7, 3e-3), outputs={"tip": tip}, harmonics=3)
    assert mode.complete
    assert (mode.share_stick[0] == 1).all() and (mode.share_stick[-1] < 0.6).all()


def test_a_free_motion_beside_it_has_no_mean():
    """Two masses that float, coupled by friction: the mode is that of their relative motion."""
    one = Problem(M=np.eye(2), K=[[1.0, -1.0], [-1.0, 1.0]], damping_ratio=0.0)
    problem = one.add(Jenkins1D(), (0, 1), kt=0.5, mu=1.0, preload=0.1).contact_problem
    assert stuck_modes(problem).moves.tolist() == [[True, False], [True, True]]
    mode = backbone(problem, 1, (0.1, 2.0), outputs={"x": [1.0, -1.0]}, harmonics=3)
    alone = Problem(M=[[0.5]], K=[[1.0]], damping_ratio=0.0)
    alone = alone.add(Jenkins1D(), 0, kt=0.5, mu=1.0, preload=0.1).contact_problem
    same = backbone(alone, 1, (0.1, 2.0), outputs=X, harmonics=3)
    assert np.allclose(mode.frequency, same.frequency, rtol=1e-8)
    assert np.allclose(mode.damping_ratio, same.damping_ratio, atol=1e-8)


def test_saved_and_loaded(tmp_path):
    mode = backbone(friction_oscillator(), 1, (0.1, 1.0), outputs=X, harmonics=1)
    assert Backbone.load(mode.save(tmp_path / "mode.npz")) == mode
    assert repr(mode).startswith("<Backbone of mode 1: 0.1 to 1 m")
    with pytest.raises(InputError, match="backbone not found"):
        Backbone.load(tmp_path / "none.npz")
    np.savez(tmp_path / "other.npz", mode=1)
    with pytest.raises(InputError, match="is not a backbone as"):
        Backbone.load(tmp_path / "other.npz")
    with pytest.raises(InputError, match="output 'y' is not in this backbone"):
        mode.amplitudes("y")


def test_without_outputs_the_dof_that_moves_most_is_followed():
    problem, tip = cantilever(Jenkins1D(), kt=2.0, mu=1.0, preload=0.1)
    given = dict(outputs={"tip": tip}, harmonics=1)
    mode, same = (backbone(problem, 1, (0.02, 0.3), **more) for more in ({"harmonics": 1}, given))
    size = np.abs(mode.shape[0])
    assert mode.output_names.tolist() == [f"dof {size.argmax()}"]
    assert mode.amplitude[0] == pytest.approx(size.max())
    assert mode.frequency[0] == pytest.approx(same.frequency[0], rel=1e-9)


def gap():
    one = Problem(M=[[1.0]], K=[[1.0]], damping_ratio=0.0)
    return one.add(UnilateralSpring(), 0, kn=1.0, preload=-0.1).contact_problem


WRONG = {
    "mode too high": (dict(mode=3), "mode = 3: the stuck system has 1, the lowest is 1"),
    "mode zero": (dict(mode=0), "mode = 0: must be a whole number, 1 or more"),
    "amplitudes down": (dict(amplitudes=(1.0, 0.1)), r"amplitudes = \(1.0, 0.1\): must be two"),
    "amplitude alone": (dict(amplitudes=[1.0]), "must be two or more in m, positive and asc"),
    "amplitude beyond all": (
        dict(amplitudes=[1.0, 1e300]),
        r"positive and ascending, below 1e\+100",
    ),
    "amplitude zero": (dict(amplitudes=[0.0, 1.0]), "positive and ascending"),
    "no harmonic": (dict(harmonics=0), "harmonics = 0: a mode vibrates in order 1"),
    "blind output": (dict(outputs={"x": [0.0]}), "outputs: 'x', .* does not see mode 1"),
    "no problem": (dict(problem=[[1.0]]), "problem = .*must be a Problem"),
}


@pytest.mark.parametrize("name", WRONG)
def test_bad_input_is_one_line(name):
    changed, said = WRONG[name]
    given = dict(problem=friction_oscillator(), mode=1, amplitudes=(0.1, 1.0), outputs=X)
    with pytest.raises(InputError, match=said) as told:
        backbone(**{**given, **changed})
    assert "\n" not in str(told.value)


def test_no_motion_at_the_first_amplitude():
    with pytest.raises(InputError, match="amplitudes begin at 3 m: no free motion of mode 1 was"):
        backbone(duffing(0.0, -1.0), 1, (3.0, 5.0), outputs=X, harmonics=1)


def test_a_spring_with_a_gap_stiffens():
    """Open at rest: the mode begins as that of the mass alone, and ends as between the two."""
    mode = backbone(gap(), 1, (0.05, 100.0), outputs=X, harmonics=9)
    w = 2 * np.pi * mode.frequency
    assert mode.complete and w[0] == pytest.approx(1.0)
    both = 2 / (1 / 1 + 1 / np.sqrt(2))  # half a period on each spring
    assert w[-1] == pytest.approx(both, rel=1e-3)


def test_an_internal_resonance_is_told():
    """Two masses, one on a cubic spring: at three times its frequency the first mode meets the
    second one [Kerschen, Peeters, Golinval, Vakakis 2009]; with one harmonic it cannot."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    two = Problem(M=np.eye(2), K=K, damping_ratio=0.01).add(CubicSpring(0.5), 0)
    given = dict(outputs={"x": [1.0, 0.0]})
    met = backbone(two, 1, (0.01, 15.0), harmonics=3, **given)
    assert met.complete and "the amplitude turns back" in met.ended
    assert (np.diff(met.amplitude) < 0).any()
    plain = backbone(two, 1, (0.01, 15.0), harmonics=1, **given)
    assert plain.ended == "reached the last amplitude" and (np.diff(plain.amplitude) > 0).all()


def test_a_linear_mode_stays_as_it_is():
    alone = Problem(M=[[1.0]], K=[[1.0]], damping_ratio=0.02)
    mode = backbone(alone, 1, (1e-3, 1.0), outputs={"x": 0}, harmonics=1)
    assert mode.frequency == pytest.approx(1 / (2 * np.pi), rel=1e-12)
    assert mode.damping_ratio == pytest.approx(0.02, rel=1e-12)
