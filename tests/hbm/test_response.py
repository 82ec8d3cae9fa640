"""forced_response on a small two-blade rig: full stick to gross slip, limits with known answers,
bad input."""

import re
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest

from tests.hbm.small_rig import small_rig
from tipdamp import Problem
from tipdamp.hbm import laws
from tipdamp.hbm.balance.parameter import Frequency
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.receptance import (
    linear_response,
    linear_response_with_peaks,
    natural_frequencies,
    stuck_receptance,
)
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.contact import relative_motion
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.solutions import solutions_at, time_history
from tipdamp.hbm.curve.trace import explain
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, follow_parameter, forced_response
from tipdamp.hbm.result import ForcedResponse

BAND = (900.0, 1800.0)  # holds the out-of-phase mode, 1347 Hz stuck
LAW = laws.DryFriction2T()


@pytest.fixture(scope="module")
def rig():
    return small_rig()


def run(rig, force, band=BAND, H=1, law=LAW, pairs=None, **more):
    model, table, tip = rig
    options = dict(harmonics=H, damping_ratio=0.02, outputs={"tip": tip}) | more
    return forced_response(
        model, table if pairs is None else pairs, law, force * tip, band, **options
    )


def test_a_stuck_curve_is_the_linear_stuck_response(rig):
    model, pairs, tip = rig
    curve = run(rig, 1.0, H=3)
    expected = linear_response(model, pairs, tip, curve.frequency, 0.02, {"tip": tip})
    assert curve.complete and not len(curve.slipping_pairs) and np.allclose(curve.share_stick, 1)
    assert np.abs(curve.harmonics[:, 0, 1] - expected[:, 0]).max() < 1e-9 * np.abs(expected).max()
    assert np.abs(curve.harmonics[:, 0, 2:]).max() == 0


@pytest.mark.slow
@pytest.mark.parametrize("H", [1, 5])
@pytest.mark.parametrize("force", [6, 12, 20, 40])
def test_complete_from_stick_to_gross_slip(rig, force, H):
    up, down = run(rig, force, BAND, H), run(rig, force, BAND[::-1], H)
    assert up.complete and down.complete and len(up.slipping_pairs) > 0
    assert up.peak("tip")[1] == pytest.approx(down.peak("tip")[1], rel=1e-5)
    assert up.peak("tip")[1] < force * run(rig, 1.0).peak("tip")[1]
    assert np.nanmin(up.dissipated) > -1e-12 and np.nanmax(up.dissipated) > 0


def test_energy_balance(rig):
    """Work of the force over a cycle equals what friction takes and one dashpot at the tip: pi w c
    sum k^2 |X_k|^2."""
    model, pairs, tip = rig
    c = 20.0
    curve = run(
        (replace(model, C=c * np.outer(tip, tip)), pairs, tip), 12.0, H=3, damping_ratio=None
    )
    X = curve.harmonics[:, 0]
    work = -np.pi * 12.0 * X[:, 1].imag
    viscous = (
        np.pi * 2 * np.pi * curve.frequency * c * np.sum(np.arange(4) ** 2 * np.abs(X) ** 2, axis=1)
    )
    assert curve.complete and curve.dissipated.sum(axis=1).max() > 0.1 * work.max()
    assert np.allclose(
        curve.dissipated.sum(axis=1) + viscous, work, rtol=1e-6, atol=1e-9 * work.max()
    )


def test_frictionless_curve_is_linear(rig):
    model, pairs, tip = rig
    # nothing else holds it along x
    slide = 1e5 * np.outer(*2 * [model.displacement_row("damper", 19, [1, 0, 0])])
    model = model.with_stiffness(model.K + slide)
    smooth = pairs.replace(mu=0 * pairs.mu)
    curve = run((model, pairs, tip), 1.0, pairs=smooth, damping_ratio=0.0)
    expected = linear_response(
        model, pairs.replace(kt=0 * pairs.kt), tip, curve.frequency, 0.0, {"tip": tip}
    )
    assert curve.complete
    assert np.abs(curve.harmonics[:, 0, 1] - expected[:, 0]).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.slow
def test_contact_forces_balance_the_motion(rig):
    """M q'' + C q' + K q + B' (f - preload) = F for the mean and every harmonic; |T| <= mu N in
    time, nearly."""
    model, pairs, tip = rig
    damping = 20.0 * np.outer(tip, tip)
    whole = {f"q{i}": row for i, row in enumerate(np.eye(model.size))}
    curve = run(
        (replace(model, C=damping), pairs, tip),
        20.0,
        H=3,
        damping_ratio=None,
        outputs=whole,
        contact=True,
    )
    i = int(curve.dissipated.sum(axis=1).argmax())
    f, q = curve.contact_force[i].copy(), curve.harmonics[i]
    wave = f.reshape(-1, 4) @ np.exp(1j * np.outer(np.arange(4), np.linspace(0, 2 * np.pi, 200)))
    T1, T2, N = wave.real.reshape(18, 3, 200).transpose(1, 0, 2)
    assert (np.abs(T1) < 0.5 * N + 0.1 * N.max()).all() and (
        np.abs(T2) < 0.5 * N + 0.1 * N.max()
    ).all()
    f[:, 2, 0] -= pairs.preload
    B = relative_motion(model, pairs).toarray()
    for k in range(4):
        w = 2 * np.pi * curve.frequency[i] * k
        left = (model.K - w**2 * model.M + 1j * w * damping) @ q[:, k] + B.T @ f[:, :, k].ravel()
        assert np.abs(left - (20.0 * tip if k == 1 else 0)).max() < 1e-6
    assert np.allclose(curve.contact_motion[i].reshape(-1, 4), B @ q, atol=1e-9 * np.abs(q).max())


def test_no_force_gives_the_static_state(rig):
    curve = run(rig, 0.0)
    assert curve.complete and len(curve.frequency) == 2 and np.abs(curve.harmonics).max() == 0


def test_detached_pairs_take_no_part(rig):
    model, pairs, tip = rig
    weight = np.ones(18)
    weight[4] = 0
    curve = run(rig, 12.0, pairs=pairs.replace(weight=weight))
    alone = run(rig, 12.0, pairs=pairs.select(weight > 0))
    assert curve.share_stick.shape[1] == 18 and np.array_equal(curve.harmonics, alone.harmonics)


def test_damper_free_to_roll():
    model, pairs, tip = small_rig(roll=0.0)
    curve = forced_response(
        model, pairs, LAW, 40 * tip, BAND, harmonics=1, damping_ratio=0.02, outputs={"tip": tip}
    )
    assert (
        not curve.complete
        and "the damper rolls" in curve.ended
        and "(1.00, " in curve.ended.replace("-", "")
    )


def test_save_and_load(rig, tmp_path):
    curve = run(rig, 12.0)
    again = ForcedResponse.load(curve.save(tmp_path / "curve.npz"))
    assert (
        np.array_equal(again.harmonics, curve.harmonics)
        and again.ended == curve.ended
        and again.H == 1
    )
    assert again.peak("tip") == curve.peak("tip")


def test_amplitude_kinds(rig):
    curve = run(rig, 20.0, H=3)
    tau = np.linspace(0, 2 * np.pi, 4000)
    X = curve.harmonics[10, 0]
    wave = X[0].real + sum((X[k] * np.exp(1j * k * tau)).real for k in range(1, 4))
    assert curve.amplitude()[10, 0] == pytest.approx(np.ptp(wave) / 2, rel=1e-5)
    assert curve.amplitude("rms")[10, 0] == pytest.approx(np.std(wave[:-1]), rel=1e-6)
    assert curve.amplitude("harmonic")[10, 0] == pytest.approx(abs(X[1]), rel=1e-15)
    with pytest.raises(InputError, match="half_peak_to_peak"):
        curve.amplitude("peak_to_peak")


@pytest.mark.parametrize(
    "change,words",
    [
        (dict(H=-1), "harmonics = -1"),
        (dict(H=1.5), "whole number"),
        (dict(H=10**6), "between 0 and 200"),
        (dict(band=(900.0, 900.0)), "different"),
        (dict(band=(-1.0, 900.0)), "positive"),
        (dict(band=(900.0,)), "band"),
        (dict(damping_ratio=-0.1), "damping_ratio"),
        (dict(damping_ratio=None), "damping"),
        (dict(start="somewhere"), "zero_force"),
        (dict(origin="loaded"), "preloaded"),
        (dict(outputs={}), "outputs"),
        (dict(outputs={"tip": [1.0]}), "length 120"),
        (dict(static=np.zeros(120)), "unloaded"),
    ],
)
def test_bad_input_is_refused(rig, change, words):
    with pytest.raises(InputError, match=words):
        run(rig, 1.0, **change)


def test_bad_models_are_refused(rig):
    model, pairs, tip = rig
    with pytest.raises(InputError, match="no pair carries"):
        run(rig, 1.0, pairs=pairs.replace(weight=np.zeros(18)))
    with pytest.raises(InputError, match="unrestrained"):
        run(rig, 1.0, pairs=pairs.select(np.array([0])))
    with pytest.raises(InputError, match="finite"):
        run((model, pairs, np.nan * tip), 1.0, outputs={"tip": tip})
    with pytest.raises(InputError, match="both"):
        stuck_receptance(model.M, 0 * model.K, model.K, 0.01)


def test_peak_at_the_border_of_the_band(rig, recwarn):
    """The stuck resonance lies at 1347 Hz: a band below it ends on the slope."""
    slope = run(rig, 1.0, (1000.0, 1300.0))
    assert slope.at_border("tip")
    with pytest.warns(UserWarning, match="peak of 'tip': .* border of the band, 1300 Hz"):
        assert slope.peak("tip")[0] == 1300.0
    recwarn.clear()
    whole = run(rig, 1.0, (1000.0, 1500.0))
    assert not whole.at_border("tip") and 1340 < whole.peak("tip")[0] < 1355 and not len(recwarn)


def test_a_border_above_the_peak_inside():
    """A weak mode of 0.159 Hz in the band, a strong one of 0.318 Hz beyond its end."""
    problem = Problem(M=np.eye(2), C=0.02 * np.eye(2), K=np.diag([1.0, 4.0]))
    problem = problem.add(laws.Jenkins1D(), 1, kt=1e-3, mu=1.0, preload=1e9).force(0).force(1, 30.0)
    curve = problem.follow_band((0.12, 0.31), outputs={"both": [1.0, 1.0]})
    with pytest.warns(UserWarning, match=r"inside, the highest maximum is 5\d\.\d+ at 0\.1589"):
        assert curve.peak("both")[0] == 0.31


def test_curve_over_the_level(rig, recwarn):
    """At 1200 Hz: the largest amplitude is at the largest level, and each level has its own
    solution."""
    model, pairs, tip = rig
    problem, _ = contact_problem(model, pairs, LAW, damping_ratio=0.02)
    curve = follow_parameter(
        problem, 20 * tip, 1200.0, "level", (0.05, 3.0), harmonics=1, outputs={"tip": tip}, at=[1.0]
    )
    assert (
        curve.complete
        and curve.peak("tip")[0] == 3.0
        and curve.at_border("tip")
        and not len(recwarn)
    )
    alone = follow_band(problem, 20 * tip, (1200.0, 1210.0), harmonics=1, outputs={"tip": tip})
    for level, force in ((1.0, alone.harmonics[0]), (0.1, None)):
        found = solutions_at(curve, problem, level)
        assert found.shape == (1, 1, 2) and (
            force is None or np.allclose(found[0], force, rtol=1e-8, atol=1e-15)
        )


def test_model_without_normal_motion(rig):
    """Its normal load is constant: the law with a variable one gives what the constant load gives,
    and says so."""
    model, pairs, tip = rig
    keep = np.flatnonzero(model.direction == "x")
    block = np.ix_(keep, keep)
    only_x = ReducedModel.from_matrices(
        model.M[block],
        model.K[block] + 1e4 * np.eye(len(keep)),
        body=model.body[keep],
        node=model.node[keep],
        direction=model.direction[keep],
        position=model.position[keep],
    )
    with pytest.warns(
        UserWarning,
        match=rf"pair 1 \(left, station 0\) and {len(pairs) - 1} more: the model has no dof "
        r"along the normal \(0, -0.82, 0.57\)",
    ):
        contact_problem(only_x, pairs, LAW, damping_ratio=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        contact_problem(only_x, pairs, laws.Jenkins1D(), damping_ratio=0.02)
        contact_problem(model, pairs, LAW, damping_ratio=0.02)
        some = laws.MixedLaw((laws.Jenkins1D(), laws.UnilateralSpring()), np.arange(18) % 2)
        contact_problem(model, pairs, some, damping_ratio=0.02)
    mixed = laws.MixedLaw((laws.Jenkins1D(), laws.UnilateralSpring()), np.r_[[0] * 17, 1])
    with pytest.warns(UserWarning, match=r"pair 18 \(\w+, station \d+\): the model has no dof"):
        contact_problem(only_x, pairs, mixed, damping_ratio=0.02)


def test_linear_response_is_drawn_with_its_peaks(rig):
    """From 11 points over 400 Hz: as of 20001, and the resonance lies between them."""
    model, pairs, tip = rig
    outputs = {"tip": tip, "other": np.roll(tip, 30)}
    hz, x = linear_response_with_peaks(
        model, pairs, tip, np.linspace(1150, 1550, 11), 2e-3, outputs
    )
    fine = np.linspace(1340, 1355, 20001)
    there = np.abs(linear_response(model, pairs, tip, fine, 2e-3, outputs)).max(axis=0)
    assert np.abs(x).max(axis=0) == pytest.approx(there, rel=1e-6)
    assert (np.abs(x).max(axis=0) >= there * (1 - 1e-9)).all() and (np.diff(hz) > 0).all()


def test_two_solved_points_on_one_peak(rig):
    """The highest is one of them by rounding: the peak is solved, and told once."""
    curve = run(rig, 1.0)
    at = int(np.flatnonzero(curve.peak_points[:, 0])[0])
    twice = {
        f.name: np.insert(getattr(curve, f.name), at, getattr(curve, f.name)[at], axis=0)
        for f in fields(curve)
        if np.shape(getattr(curve, f.name))[:1] == curve.frequency.shape
    }
    twice["peak_points"][at] = False
    twice["harmonics"] = twice["harmonics"].copy()
    twice["harmonics"][at] *= 1 + 1e-10
    both = replace(curve, **twice)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert both.peak("tip")[1] == pytest.approx(curve.peak("tip")[1], rel=1e-9)


def test_a_body_that_is_not_there_is_named(rig):
    with pytest.raises(
        InputError, match=r"no body 'blade' \(node 10\); did you mean 'blade\d'\? valid: blade1"
    ):
        rig[0].displacement_row("blade", 10, [0, 1, 0])


def test_the_records_print_in_one_line(rig):
    """However many dofs, pairs and points they hold."""
    model, pairs, tip = rig
    curve = run(rig, 12.0)
    problem, _ = contact_problem(model, pairs, LAW, damping_ratio=0.02)
    steady = compare(curve, problem, 1200.0)
    for record, words in (
        (model, r"<ReducedModel: 120 dofs \(blade1 30, blade2 30, damper 60\), 0 of them modes; C"),
        (pairs, r"<ContactTable: 18 pairs \(left 9, right 9\), 18 carry; preload .* N>"),
        (
            curve,
            r"<ForcedResponse: 900 to 1800 Hz, \d+ points \(0 failed\), output_names .*; "
            r"\d+ of 18 pairs slip",
        ),
        (steady, r"^<Comparison at 1200 Hz, H = 1: the integration stays on the orbit"),
        (steady.steady, r"^<Steady: periodic after \d+ periods"),
    ):
        assert (
            re.search(words, repr(record)) and "\n" not in repr(record) and len(repr(record)) < 500
        ), repr(record)


def test_a_point_over_time(rig):
    """x(t) = X_0 + Re sum X_k exp(i k w t), sampled over one period."""
    curve = run(rig, 12.0, (1190.0, 1210.0), H=3)
    problem, _ = contact_problem(*rig[:2], LAW, damping_ratio=0.02)
    t, x = time_history(curve, problem, "tip", 1200.0, n=64)
    X = solutions_at(curve, problem, 1200.0)[0, 0]
    assert np.allclose(np.diff(t), 1 / 1200.0 / 64)
    series = sum((X[k] * np.exp(2j * np.pi * 1200.0 * k * t)).real for k in range(4))
    assert np.allclose(x, series, rtol=0, atol=1e-12 * abs(X[1]))
    with pytest.raises(InputError, match="which = 1: the curve has 1 solutions at 1200"):
        time_history(curve, problem, "tip", 1200.0, which=1)


def test_band_from_free_and_stuck_frequencies(rig):
    """A lightly damped stuck curve peaks at a stuck frequency; without contact the damper is free
    but for its roll."""
    model, pairs, _ = rig
    stuck, free = natural_frequencies(model, pairs), natural_frequencies(model)
    hz = run(rig, 1e-3, damping_ratio=1e-4).peak("tip")[0]
    assert np.abs(stuck / hz - 1).min() < 1e-5 and (stuck >= free * (1 - 1e-9)).all()
    assert (free[:5] < 1e-3 * free[6]).all() and free[6] > 100


def test_the_widest_gap_where_a_branch_was_left():
    """Left at 2 Hz and taken up at 6, with 3 Hz solved between and 5 failed; and taken up at once,
    at 9.5."""
    values, restarts = [1.0, 2, 3, 5, 6, 9, 9.5, 20], [(2.0, 6.0), (9.5, 9.0)]
    points = [Point(np.zeros(1), 2 * np.pi * v, v != 5, 1) for v in values]
    branch = Branch(
        points,
        "end",
        points[-1].parameter,
        True,
        restarts=[tuple(2 * np.pi * np.array(x)) for x in restarts],
    )
    said = explain(branch, Frequency())
    assert "2 Hz to 6 Hz, 9.5 Hz to 9 Hz; solved points there are up to 3 Hz apart" in said
    none = np.empty((8, 0))
    curve = ForcedResponse(
        np.array(values),
        np.array([]),
        none,
        "frequency",
        np.array(values),
        none,
        none,
        none,
        none,
        np.array([p.converged for p in points]),
        none,
        "",
        False,
        1,
        "",
        "",
        0.0,
        8,
        restarts=np.array(restarts),
    )
    assert curve.widest_gap == pytest.approx(3)
    assert replace(curve, restarts=np.empty((0, 2))).widest_gap == 0
