"""One call from a curve to the time integration; several laws in one model, integrated."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.hbm.cases import coupled, load, solve, unilateral
from tests.hbm.conformance import LAWS, SteppedFriction, one_dof
from tests.hbm.small_rig import small_rig
from tipdamp.hbm import comparison
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.comparison import compare, compare_point, integrator_of
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.curve.starts import first_point
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import DryFriction2T, Jenkins1D, MixedLaw, UnilateralSpring
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, follow_parameter, forced_response
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.time import shooting
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.sampled import SampledIntegrator
from tipdamp.hbm.time.settings import IntegrationSettings


@pytest.mark.slow
@pytest.mark.parametrize("contact", [True, False])
def test_a_point_of_a_curve_in_one_call(contact):
    """Three bodies, one pair left out, slip: from the orbit until the map repeats; below 1 % at H =
    5."""
    model, pairs, tip = small_rig(stations=3)
    pairs = replace(pairs, weight=np.array([1.0, 1, 1, 1, 0, 1]))
    outputs = {"tip": tip}
    curve = forced_response(
        model,
        pairs,
        DryFriction2T(),
        60 * tip,
        (200, 600),
        harmonics=5,
        damping_ratio=0.02,
        outputs=outputs,
        contact=contact,
    )
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.02)
    hz = curve.peak("tip")[0]
    found = compare(curve, problem, hz)
    assert found.agrees and found.steady.period_change <= 1e-8 and found.difference < 1e-2
    assert found.difference > 1e-12 and curve.share_slip.max() > 0.1
    assert abs(found.steady.harmonics[0, 1]) == pytest.approx(
        np.nanmax(curve.amplitude("harmonic")), rel=1e-2
    )
    assert (found.origin, found.start, found.H) == (
        "preloaded",
        "zero_slider",
        5,
    ) and found.hz == pytest.approx(hz)
    assert (found.steady.origin, found.steady.start) == ("preloaded", "zero_slider")
    with pytest.raises(InputError, match="900 Hz: the band of the curve is 200 to 600 Hz"):
        compare(curve, problem, 900.0)
    with pytest.raises(
        InputError, match="the problem has 1 contacts and .* dofs, that of the curve had 5"
    ):
        compare(
            curve,
            contact_problem(model, pairs.select([0]), DryFriction2T(), damping_ratio=0.02)[0],
            hz,
        )


@pytest.mark.slow
@pytest.mark.parametrize("omega", [1.0, 1.5])
def test_mixture_of_one_law(omega):
    """D1: slip at 1.0, slip and lift-off at 1.5, against the exact orbit; by samples to second
    order."""
    problem, force = coupled(load("D1")["parameters"])
    problem = replace(problem, law=MixedLaw((DryFriction2T(),), [0]))
    q, point, balance = solve(problem, force, omega, 9)
    expected = np.array(next(r for r in load("D1")["results"] if r["Omega"] == omega)["X1"])
    errors = []
    sampled = [
        SampledIntegrator(balance, omega, IntegrationSettings(samples=samples))
        for samples in (64, 256)
    ]
    for integrator in (*sampled, integrator_of(balance, omega)):
        steady = shooting.shoot(integrator, integrator.on_orbit(point), np.eye(len(q)))
        assert steady.periodic
        errors.append(np.abs(np.abs(steady.harmonics[:, 1]) - expected).max() / expected.max())
    assert errors[1] < 2e-4 and errors[1] < errors[0] / 8  # 1/16 at second order
    assert steady.method == "event-driven" and errors[2] < 1e-8


def side_by_side(laws):
    """(problem, force) of one mass for each law, each in three directions on a contact to the
    ground."""
    singles, n = [one_dof(law) for law in laws], len(laws)
    model = ReducedModel.from_matrices(
        np.eye(3 * n),
        np.kron(np.eye(n), singles[0][0].K),
        body="mass",
        node=np.repeat(np.arange(1, n + 1), 3),
        direction=["x", "y", "z"] * n,
    )
    tables = [s[1] for s in singles]
    columns = {name: np.concatenate([getattr(t, name) for t in tables]) for name in vars(tables[0])}
    pairs = ContactTable(**columns | {"damper_node": np.arange(1, n + 1)})
    problem, _ = contact_problem(model, pairs, MixedLaw(tuple(laws), range(n)), damping_ratio=0.03)
    return problem, np.concatenate([s[2] for s in singles])


@pytest.mark.slow
@pytest.mark.parametrize(
    "names,method",
    [
        (("Jenkins1D", "DryFriction2T", "UnilateralSpring"), "event-driven"),
        (("DryFriction2T", "UnilateralSpring", "IsotropicFriction", "CubicSpring"), "sampled"),
    ],
)
def test_laws_of_every_kind_in_one_model(names, method):
    """Every mass at H = 9 as in the integration, which is event-driven where every law has a table,
    and says so."""
    laws = [next(case.law for case in LAWS if case.law.name == name) for name in names]
    q, point, balance = solve(*side_by_side(laws), 2 * np.pi * 1.7, 9, samples=512)
    found = compare_point(balance, point, np.eye(3 * len(laws)), IntegrationSettings(samples=128))
    assert found.steady.periodic and found.difference < 1e-3 and not found.left
    assert found.method == method and ("MixedLaw is not piecewise linear" in found.said) == (
        method == "sampled"
    )
    apart = np.abs(np.abs(found.steady.harmonics[:, 1]) - np.abs(q[:, 1])) / np.abs(q[:, 1]).max()
    assert (apart.reshape(len(laws), 3).max(axis=1) < 1e-3).all()


def test_event_driven_mixture_is_its_parts():
    laws = [Jenkins1D(), DryFriction2T(), UnilateralSpring()]
    w, found = 2 * np.pi * 1.7, []
    for some in (laws, *([law] for law in laws)):
        problem, force = side_by_side(some)
        integrator = ExactIntegrator(
            HarmonicBalance(problem, {1: force}, 5), w, IntegrationSettings(tolerance=1e-9)
        )
        cycle = integrator.periods(integrator.at_rest(), 30)
        found.append(
            (
                np.abs(integrator.stuck.harmonics(np.eye(3 * len(some)), cycle.force)),
                cycle.dissipated,
            )
        )
    assert found[0][0] == pytest.approx(np.concatenate([X for X, _ in found[1:]]), abs=1e-8)
    assert found[0][1] == pytest.approx(np.concatenate([work for _, work in found[1:]]), abs=1e-8)


def test_comparison_of_each_solution(tmp_path):
    """C1 at 1.15 rad/s, H = 5: of the three solutions the middle one is unstable; over the level as
    over the band."""
    problem, force = unilateral(load("C1")["parameters"])
    hz = 1.15 / (2 * np.pi)
    band = follow_band(
        problem, force, (0.8 * hz, 1.4 * hz), harmonics=5, outputs={"x": [1.0]}, at=[hz]
    )
    level = follow_parameter(
        problem, force, hz, "level", (0.2, 3.0), harmonics=5, outputs={"x": [1.0]}
    )
    for curve, value in ((band, hz), (level, 1.0)):
        sizes = np.abs(solutions_at(curve, problem, value)[:, 0, 1])
        middle = int(np.argsort(sizes)[1])
        assert len(sizes) == 3
        for i, size in enumerate(sizes):
            found = compare(curve, problem, value, which=i)
            assert found.agrees and found.stable == (i != middle), found.said
            assert i == middle or abs(found.steady.harmonics[0, 1]) == pytest.approx(size, rel=2e-2)
        with pytest.raises(InputError, match="3 solutions at .* say which = 0 to 2"):
            compare(curve, problem, value)
        with pytest.raises(InputError, match="which = 3: 3 solutions"):
            compare(curve, problem, value, 3)
    loaded = ForcedResponse.load(band.save(tmp_path / "curve.npz"))
    assert (
        loaded == band
        and compare(loaded, problem, hz, 0).difference == compare(band, problem, hz, 0).difference
    )


def test_stability_after_newton_in_a_krylov_space():
    """The middle solution of C1 is unstable, also where Newton finds its orbit without a whole
    derivative."""
    settings = IntegrationSettings(max_columns=0)
    problem, force = unilateral(load("C1")["parameters"])
    hz = 1.15 / (2 * np.pi)
    curve = follow_band(
        problem, force, (0.8 * hz, 1.4 * hz), harmonics=5, outputs={"x": [1.0]}, at=[hz]
    )
    order = np.argsort(np.abs(solutions_at(curve, problem, hz)[:, 0, 1]))
    said = [compare(curve, problem, hz, i, settings).said for i in order]
    assert ["unstable" in words for words in said] == [False, True, False]


def test_more_harmonics_advised():
    """One Jenkins element near its resonance: at H = 1 the square corners of the force are
    missing."""
    model, pairs, force = one_dof(Jenkins1D())
    said = {}
    for H in (1, 15):
        curve = forced_response(
            model,
            pairs,
            Jenkins1D(),
            force,
            (1.5, 1.9),
            harmonics=H,
            damping_ratio=0.03,
            outputs={"x": [1.0, 0, 0]},
        )
        problem, _ = contact_problem(model, pairs, Jenkins1D(), damping_ratio=0.03)
        found = compare(curve, problem, 1.7)
        said[H] = found.said, found.difference
    assert said[1][1] > 1e-3 and said[1][0].endswith("; more harmonics than H = 1 bring it closer")
    assert said[15][1] < 1e-3 and "more harmonics" not in said[15][0]


@pytest.mark.parametrize(
    "H, samples, lacking", [(9, 36, "samples than 36"), (1, 256, "harmonics than H = 1")]
)
def test_samples_or_harmonics_advised(H, samples, lacking):
    """Coupled friction near its resonance, beside the balance with 15 harmonics and 512 samples."""
    law = SteppedFriction()
    model, pairs, force = one_dof(law)
    problem, _ = contact_problem(model, pairs, law, damping_ratio=0.03)
    row, w = np.eye(model.size)[:1], 2 * np.pi * 1.7
    balance, fine = (
        HarmonicBalance(problem, {1: force}, *of)
        for of in ((H, "zero_slider", samples), (15, "zero_slider", 512))
    )
    point, true = (first_point(b, w, Settings()) for b in (balance, fine))
    X, x = true.detail.outputs(row), point.detail.outputs(row)
    difference = abs(abs(x[0, 1]) / abs(X[0, 1]) - 1)
    assert difference > 1e-3 and point.detail.forces.shares[0, 1] > 0.1
    steady = SimpleNamespace(method="sampled", harmonics=X)
    judged = comparison._Judged(steady, difference, False)
    said = comparison._advice(balance, point, row, judged, IntegrationSettings())
    assert said == f"; more {lacking} bring it closer"
