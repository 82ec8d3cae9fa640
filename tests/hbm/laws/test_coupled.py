"""Coupled friction in the plane, and a cubic spring, against closed forms and tables."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from tests.hbm.cases import load, solve
from tests.hbm.conformance import random_case
from tests.validation.plain_stepping import harmonics
from tipdamp.hbm import fourier, laws
from tipdamp.hbm.balance.aft import STARTS, sample_grid, slider_start
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.laws import CubicSpring, IsotropicFriction, Motion, SliderStart
from tipdamp.hbm.laws.coupled.cycle import paths, room_for
from tipdamp.hbm.laws.coupled.law import _in_forces
from tipdamp.hbm.laws.coupled.slip import PIECE, between, keep
from tipdamp.hbm.laws.sampled import projector
from tipdamp.hbm.laws.uncoupled.breaks import FORWARD, OPEN, STICK
from tipdamp.hbm.laws.uncoupled.law import located
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.testing import forces, history, shifted, total_force

E1 = load("E1")
LAW = IsotropicFriction()


def prescribed(X, Y, kt, L, n, H=3, law=LAW):
    """Complex harmonics of T1, T2 under u = (Re X e^, Re Y e^) with constant limit L."""
    pairs = laws.Contacts([0.0], [kt], [1.0], [L])
    x = np.zeros((1, 3, 2 * H + 1))
    x[0, 0, 1:3], x[0, 1, 1:3] = [X.real, X.imag], [Y.real, Y.imag]
    return fourier.to_complex(total_force(law, pairs, x, forces(law, pairs, x, samples=n)))[0]


@pytest.mark.parametrize("row", E1["ellipses"], ids=lambda r: f"{r['X']}-{r['Y']}-{r['phi']:.2f}")
def test_ellipses(row):
    X, Y = complex(row["X"]), row["Y"] * np.exp(1j * row["phi"])
    F = prescribed(X, Y, row["kt"], row["L"], 64, H=1)
    expected = [complex(*row["coupled"][k]) for k in ("Tx1", "Ty1")]
    # what the reference itself is good to
    assert np.abs(F[:2, 1] - expected).max() < 2e-8 * row["L"]
    work = np.pi * (F[0, 1] * np.conj(X) + F[1, 1] * np.conj(Y)).imag
    assert work == pytest.approx(row["coupled"]["dissipation"], rel=1e-7)


def test_circle_in_closed_form():
    for row in E1["circular_closed_form"]:
        F = prescribed(
            complex(row["R"]), row["R"] * np.exp(-0.5j * np.pi), row["kt"], row["L"], 64, H=1
        )
        work = (
            np.pi
            * (
                F[0, 1] * np.conj(row["R"]) + F[1, 1] * np.conj(row["R"] * np.exp(-0.5j * np.pi))
            ).imag
        )
        assert work == pytest.approx(row["dissipation"], rel=1e-8)


@pytest.mark.parametrize("stiffness", [1.0, 100.0])
def test_cycle_by_plain_steps(stiffness):
    """Radial return written once more (tests/validation), extrapolated from two lengths of its
    steps: what is left is where in a step a contact closes."""
    x, pairs, _ = random_case(LAW, P=8, H=3, seed=3)
    pairs = replace(pairs, kt=stiffness * pairs.kt)
    f = forces(LAW, pairs, x, samples=64)
    ours = fourier.to_complex(total_force(LAW, pairs, x, f))
    ours[:, 2, 0] -= np.maximum(0, pairs.preload)
    fine, finer = (harmonics(LAW.name, pairs, fourier.to_complex(x), 2**n) for n in (16, 17))
    assert f.shares[:, 1].max() > 0.5 and (f.shares[:, 1:] > 0.05).all(axis=1).any()
    assert np.abs(2 * finer - fine - ours).max() < 5e-6 * np.abs(ours).max()


@pytest.mark.parametrize("start", STARTS)
def test_steps_tend_to_the_cycle(start):
    """With lift-off: the straight paths of `step` come nearer with the square of the samples."""
    x, pairs, _ = random_case(LAW, P=8, H=3, seed=3)
    f = forces(LAW, pairs, x, 1.0, start, 64)
    errors = []
    for n in (256, 512, 1024):
        stepped = history(LAW, pairs, x, 1.0, start, n, 20)[0]
        weights = projector(fourier.basis(np.arange(n) * 2 * np.pi / n, 3))
        errors.append(
            np.abs(np.tensordot(stepped, weights, (0, 0)) - total_force(LAW, pairs, x, f)).max()
        )
    assert f.shares[:, 2].max() > 0.1 and errors[0] < 1e-4
    assert all(b < a / 3.5 for a, b in zip(errors[:-1], errors[1:], strict=True)), errors


@pytest.mark.parametrize("start", STARTS)
def test_cycle_takes_the_work_of_its_force(start):
    for stiffness in (1.0, 30.0, 1000.0):
        x, pairs, _ = random_case(LAW, P=40)
        pairs = replace(pairs, kt=stiffness * pairs.kt)
        f = forces(LAW, pairs, x, 1.0, start)
        assert (
            np.allclose(f.work, fourier.work(f.g, x), rtol=1e-6, atol=1e-9 * f.work.max())
            and f.work.max() > 1
        )


@pytest.mark.parametrize("H", [1, 2, 15, 25, 40, 60])
def test_forces_follow_a_shift_in_time(H):
    """Where they do not hang on where the sliders start; of a motion of one harmonic, too."""
    x, pairs, _ = random_case(LAW, P=12, H=H)
    x[::2, :, 3:] = 0.0
    f, other = (forces(LAW, pairs, x, 1.0, start) for start in STARTS)
    later, size = forces(LAW, pairs, shifted(x, 0.7)), np.abs(f.g).max()
    forgets = np.abs(f.g - other.g).max(axis=(1, 2)) < 1e-9 * size
    assert f.shares[forgets, 1].max() > 0.2
    assert np.abs(later.g - shifted(f.g, 0.7))[forgets].max() < 2e-9 * size


@pytest.mark.parametrize("H", [1, 2, 5, 15, 40])
def test_work_is_that_of_the_force_whatever_the_last_digits(H):
    """An onset of slip that was hit to the last digit was taken later, beyond the limit: 1e-7 to
    2e-6 of the work."""
    x, pairs, rng = random_case(LAW, P=12, H=H)
    for _ in range(20 if H < 15 else 3):
        u = x * (1 + 1e-15 * rng.normal(size=x.shape))
        f = forces(LAW, pairs, u)
        assert np.allclose(f.work, fourier.work(f.g, u), rtol=0, atol=1e-9 * f.work.max())


def kept(x, pairs, path):
    """Number of pieces (P,) of the cycles, which fill the path (P, m, PIECE)."""
    grid = sample_grid(x.shape[2] // 2, LAW.default_samples(x.shape[2] // 2))
    start, sliders = slider_start("zero_slider", len(pairs), 2), LAW._sliders_of(pairs)
    found = located(sliders._replace(count=0), x[:, 2:].copy(), start, grid)
    counts = np.empty(len(pairs), np.int64)
    paths(*_in_forces(sliders, x, start, grid, found), (path, counts))
    return counts


def friction_along(pieces, p, limit, tau):
    """(2, n) tangential force at the instants, of the motion p (2, n) kt and the limit (n,): in
    slip by the angle that is kept, in stick with the slider where the slip before has left it."""
    of = np.searchsorted(pieces[:, 1], tau, side="right") - 1
    T, r = np.zeros_like(p), None
    for i in (*range(len(tau)), *range(len(tau))):  # once more, from where the first round ends
        state, begin, end, psi0, *psi = pieces[of[i]]
        if state == STICK:
            T[:, i] = p[:, i] - r if r is not None else 0.0
            continue
        if state != OPEN:
            angle = between(np.array(psi), psi0, (tau[i] - begin) / (end - begin))
            T[:, i] = limit[i] * np.array([np.cos(angle), np.sin(angle)])
        else:
            T[:, i] = 0.0
        r = p[:, i] - T[:, i]
    return T


def test_path_that_is_kept_is_that_of_the_force():
    """Its pieces follow each other through the whole period, and by their angles the force is that
    of the cycle."""
    x, pairs, _ = random_case(LAW, P=12, H=3, seed=3)
    path = np.full((12, 400, PIECE), np.nan)
    counts, f = kept(x, pairs, path), forces(LAW, pairs, x)
    tau = 2 * np.pi * np.arange(4096) / 4096
    motion = np.einsum("pdh,th->pdt", x, fourier.basis(tau, 3))
    load = pairs.mu[:, None] * (pairs.preload[:, None] + pairs.kn[:, None] * motion[:, 2])
    total, seen = total_force(LAW, pairs, x, f), set()
    for c in np.flatnonzero((f.shares[:, 1] > 0.01) & (counts > 1)):
        pieces = path[c, : counts[c]]
        assert (pieces[0, 1], pieces[-1, 2]) == (0.0, 2 * np.pi)
        assert (pieces[1:, 1] == pieces[:-1, 2]).all() and (pieces[:, 2] > pieces[:, 1]).all()
        for before, after in pairwise(pieces):  # an angle goes on where another has ended
            if {before[0], after[0]} == {FORWARD}:
                assert after[3] == before[-1] != after[4]
        T = friction_along(pieces, pairs.kt[c] * motion[c, :2], load[c], tau)
        error = np.abs(T @ projector(fourier.basis(tau, 3)) - total[c, :2]).max()
        assert error < 1e-3 * np.abs(total[c, :2]).max(), (c, error)
        seen |= set(pieces[:, 0].tolist())
    assert len(seen) == 3  # stick, slip and open


def test_path_that_has_no_room_keeps_its_begin():
    """The count says that there was none, and nothing is written beyond: there `variation` does not
    know."""
    x, pairs, _ = random_case(LAW, P=12, H=3, seed=3)
    whole = np.full((12, 400, PIECE), np.nan)
    counts = kept(x, pairs, whole)
    assert np.isnan(whole[np.arange(12), counts]).all()
    short, rows = np.full((13, 3, PIECE), np.nan), np.minimum(counts, 3)
    assert (kept(x, pairs, short[:12]) == rows).all() and counts.max() > 3
    assert np.isnan(short[12]).all()
    for c in range(12):
        assert np.array_equal(short[c, : rows[c]], whole[c, : rows[c]])


def test_piece_of_no_length_is_not_kept():
    """There is no share of it at which an angle could be asked for."""
    sums = room_for(3)[1]._replace(path=np.full((2, PIECE), np.nan))
    for begin, end in ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 3.0)):
        keep(sums, STICK, begin, end, 0.0, np.zeros(PIECE - 4))
    assert sums.count[0] == 2 and sums.path[:, 1:3].tolist() == [[0.0, 1.0], [1.0, 2.0]]


def exact_orbit(c=0.05, kt=2.0, limit=0.5, F=(1.0, 0.6j), omega=1.35, n=512):
    """(motion, force) (2, n) at n instants of the period of a mass on unit springs in the plane
    that slips throughout behind an isotropic spring kt: its equation of motion with L psi' = kt u'
    . t(psi), periodic by Newton's method."""

    def rate(t, y):
        u, v, psi = y[:2], y[2:4], y[4]
        n = np.array([np.cos(psi), np.sin(psi)])
        along = np.array([-np.sin(psi), np.cos(psi)])
        drive = (np.array(F) * np.exp(1j * omega * t)).real
        return np.r_[v, drive - c * v - u - limit * n, kt / limit * (v @ along)]

    def period(y, **settings):
        return solve_ivp(
            rate, (0, 2 * np.pi / omega), y, "DOP853", rtol=1e-12, atol=1e-13, **settings
        )

    y = np.zeros(5)
    for _ in range(12):
        y = period(y).y[:, -1]
    around = np.array([0, 0, 0, 0, 2 * np.pi])
    y = fsolve(
        lambda y: (
            period(y).y[:, -1] - y - around * np.round((period(y).y[4, -1] - y[4]) / (2 * np.pi))
        ),
        y,
        xtol=1e-13,
    )
    found = period(y, t_eval=2 * np.pi / omega * np.arange(n) / n).y
    return found[:2], limit * np.array([np.cos(found[4]), np.sin(found[4])]), (kt, limit)


@pytest.mark.slow
def test_exact_orbit_at_high_orders():
    u, T, (kt, limit) = exact_orbit()
    pairs = laws.Contacts([0.0], [kt], [1.0], [limit])
    for H in (15, 25, 40, 60):
        weights = projector(fourier.basis(2 * np.pi * np.arange(u.shape[1]) / u.shape[1], H))
        x = np.zeros((1, 3, 2 * H + 1))
        x[0, :2] = u @ weights
        f = total_force(LAW, pairs, x, forces(LAW, pairs, x))
        assert np.abs(f[0, :2] - T @ weights).max() < 1e-8 * limit, H


@pytest.mark.slow
@pytest.mark.parametrize("H", [25, 40])
def test_curves_of_high_orders_are_complete(H):
    one = np.eye(2)
    problem = ContactProblem(
        one,
        0.05 * one,
        one,
        np.vstack([one, np.zeros((1, 2))]),
        LAW,
        laws.Contacts([0.0], [2.0], [1.0], [0.5]),
    )
    curve = follow_band(
        problem,
        np.array([1.0, 0.6j]),
        np.array([0.9, 1.8]) / (2 * np.pi),
        harmonics=H,
        outputs={"x": [1.0, 0.0]},
        truncation=False,
    )
    assert curve.complete, curve.ended


def rotating(row, samples=None):
    """Radius of the orbit of the oscillator under a force that rotates in the plane, nearest the
    first exact one."""
    one = np.eye(2)
    B = np.vstack([one, np.zeros((1, 2))])
    pairs = laws.Contacts([0.0], [row["kt"]], [1.0], [row["L"]])
    problem = ContactProblem(row["m"] * one, row["c"] * one, row["k"] * one, B, LAW, pairs)
    X = -1j * row["R_exact"][0] * np.array([1, -1j])
    guess = np.zeros((3, 3))
    guess[:2, 1], guess[:2, 2] = X.real, X.imag
    q, _, _ = solve(
        problem,
        row["F"] * np.array([1, -1j]),
        row["Omega"],
        1,
        samples=samples,
        guess=guess.ravel(),
    )
    assert abs(abs(q[0, 1]) - abs(q[1, 1])) < 1e-6 * abs(q[0, 1])
    return abs(q[0, 1])


@pytest.mark.parametrize("row", E1["rotating_force_oscillator"], ids=lambda r: f"{r['Omega']}")
def test_exact_radius_under_a_rotating_force(row):
    assert np.abs(rotating(row) / np.array(row["R_exact"]) - 1).min() < 1e-8


def test_frame_may_turn():
    x, pairs, _ = random_case(LAW, H=2)
    u = x @ fourier.basis(np.linspace(0, 4 * np.pi, 400), 2).T
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    states = [
        LAW.initial_state(v[:, :, 0], SliderStart(np.zeros((30, 2)), False), pairs)
        for v in (u, turn @ u)
    ]
    for i in range(1, 400):
        f, states[0] = LAW.step(Motion(u[:, :, i], 0, 1), states[0], pairs)
        turned, states[1] = LAW.step(Motion((turn @ u)[:, :, i], 0, 1), states[1], pairs)
        assert np.allclose(turned, f @ turn.T, atol=1e-12)
        assert (np.hypot(f[:, 0], f[:, 1]) <= pairs.mu * f[:, 2] * (1 + 1e-9) + 1e-15).all()
        assert (f[pairs.preload + pairs.kn * u[:, 2, i] <= 0] == 0).all()


def test_straight_motion_is_a_jenkins_element():
    F = prescribed(1 + 0j, 0j, 2.0, 0.3, 64)
    J = prescribed(1 + 0j, 0j, 2.0, 0.3, 64, law=laws.DryFriction2T())
    assert np.allclose(F[0], J[0], atol=1e-9)


@pytest.mark.slow
def test_duffing_folds():
    I1 = load("I1")
    p = I1["parameters"]
    one = np.ones((1, 1))
    problem = ContactProblem(
        p["m"] * one,
        p["c"] * one,
        p["k"] * one,
        one,
        CubicSpring(p["k3"]),
        laws.Contacts([0.0], [0.0], [0.0], [0.0]),
    )
    curve = follow_band(
        problem,
        np.array([p["F"]]),
        np.array([0.5, 2.0]) / (2 * np.pi),
        harmonics=7,
        outputs={"x": [1.0]},
        settings=Settings(largest_step=0.02),
    )
    assert curve.complete
    w, X = 2 * np.pi * curve.frequency, np.abs(curve.harmonics[:, 0, 1])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(w)))) + 1
    assert len(turns) == 2
    folds = [(1.52244802904, 6.52160390), (1.25201495911, 2.59293932)]  # verification.md
    for i, (omega, amplitude) in zip(turns, folds, strict=True):
        # frequency over amplitude turns there
        c = np.polyfit(X[i - 1 : i + 2] - X[i], w[i - 1 : i + 2], 2)
        top = -0.5 * c[1] / c[0]
        assert np.polyval(c, top) == pytest.approx(omega, rel=1e-5) and X[i] + top == pytest.approx(
            amplitude, rel=5e-4
        )
