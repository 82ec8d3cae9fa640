"""Large systems in the few modes that matter: against all modes, and against the equation of
motion."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from tests.hbm.cases import with_damping_matrix
from tests.hbm.small_rig import small_rig
from tipdamp.hbm.balance import problem as problems
from tipdamp.hbm.balance import residual
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.reduced import reduced_receptance
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.response import follow_band, follow_parameter

FEW = replace(DEFAULT, few_modes_of_matrix=0, few_modes_of_ratio=0, reduced_share=0.9)
BAND = (300.0, 800.0)


def cases(kind, stations=9):
    """(problem with all its modes, the same without, force): of its pairs the first two slip
    soon."""
    model, pairs, tip = small_rig(stations=stations)
    pairs = pairs.replace(preload=pairs.preload * np.where(np.arange(len(pairs)) < 2, 0.02, 50.0))
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.02)
    if kind == "matrix":  # a dashpot at the tip couples the modes
        row = tip / np.linalg.norm(tip)
        C = with_damping_matrix(problem).C
        problem = replace(problem, C=C + 30.0 * np.outer(row, row), damping_ratio=None)
    problem.receptance()
    return problem, replace(problem), tip


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(problems, "DEFAULT", FEW)
    monkeypatch.setattr("tipdamp.hbm.balance.reduced.DEFAULT", FEW)


@pytest.mark.parametrize("kind, tolerance", [("matrix", 1e-11), ("ratio", 1e-7)])
def test_response_to_forces_of_two_contacts(few, kind, tolerance):
    """At all frequencies up to the highest, at every dof, against a dense solution; no more forces
    than asked for."""
    problem, large, tip = cases(kind)
    columns = np.column_stack([sp.csr_matrix(problem.B)[:6].toarray().T, tip])
    top = 2 * np.pi * 1500.0
    found = reduced_receptance(large.reducible, columns, top)
    assert found.shapes.shape[1] < problem.receptance().shapes.shape[1]
    for w in np.linspace(0.0, 1.0, 9) * top:
        all_modes, some = (
            R.shapes @ (R.factors(w)[0] * (R.shapes.T @ columns))
            for R in (problem.receptance(), found)
        )
        assert np.abs(some - all_modes).max(axis=0) == pytest.approx(
            0.0, abs=tolerance * np.abs(all_modes).max()
        )
        if kind == "matrix":
            residual = (
                problem.stuck_stiffness - w**2 * problem.M + 1j * w * problem.C
            ) @ some - columns
            assert np.abs(residual).max() < 1e-8 * np.abs(columns).max()


@pytest.mark.parametrize("kind, tolerance", [("matrix", 1e-10), ("ratio", 1e-8)])
def test_curve_is_that_of_all_modes(few, kind, tolerance):
    problem, large, tip = cases(kind, stations=20)
    both = [
        follow_band(p, 40 * tip, BAND, harmonics=3, outputs={"tip": tip}, truncation=False)
        for p in (problem, large)
    ]
    assert "_receptance" not in large.__dict__
    assert both[1].complete and not both[1].at_border("tip")
    assert list(both[1].slipping_pairs) == list(both[0].slipping_pairs) == [0, 1]
    assert np.nanmax(both[1].force_residual) < tolerance
    tops = [curve.peak("tip") for curve in both]
    assert tops[1] == pytest.approx(tops[0], rel=tolerance)


def test_modes_do_not_depend_on_the_order_of_the_contacts(few):
    """One contact after the other starts to slip, upwards or downwards in level: the solutions are
    the same."""
    _, large, tip = cases("matrix")
    large = replace(
        large, contacts=replace(large.contacts, preload=np.linspace(1.0, 60.0, len(large.contacts)))
    )
    w, found = 2 * np.pi * 330.0, []
    for levels in ((5.0, 20.0, 80.0), (80.0, 20.0, 5.0)):
        balance = HarmonicBalance(replace(large), {1: tip}, 3)
        at = {}
        for level in levels:

            def evaluate(x, p, level=level, balance=balance):
                return balance.evaluate(x, p, level)

            point = solve_fixed(evaluate, balance.linear(w, level), w, balance.weights)
            assert point.converged
            at[level] = point
        found.append(at)
    slipping = [len(found[0][level].detail.forces.contacts) for level in (5.0, 20.0, 80.0)]
    assert slipping[0] < slipping[1] < slipping[2]
    covers = [found[0][level].detail.balance.cover[1:].sum() for level in (5.0, 20.0, 80.0)]
    assert covers[0] < covers[2]
    for level in (5.0, 20.0, 80.0):
        a, b = found[0][level].x, found[1][level].x
        assert np.abs(a - b).max() < 1e-9 * np.abs(a).max()


def test_modes_are_sought_a_few_times(few, monkeypatch):
    """Twelve contacts start to slip one after the other, over the level: not once for each of
    them."""
    _, large, tip = cases("matrix", stations=20)
    large = replace(
        large,
        contacts=replace(large.contacts, preload=np.geomspace(0.02, 3.0, len(large.contacts))),
    )
    sought = []
    monkeypatch.setattr(
        residual,
        "reduced_receptance",
        lambda *given: sought.append(1) or reduced_receptance(*given),
    )
    curve = follow_parameter(
        large, tip, 330.0, "level", (0.1, 25.0), harmonics=1, outputs={"tip": tip}, truncation=False
    )
    slipping = (curve.share_slip > 0).sum(axis=1)
    assert curve.complete and slipping.min() == 0 and slipping.max() >= 12
    assert len(sought) <= 6, len(sought)
    found = follow_parameter(
        large, tip, 330.0, "level", (0.1, 25.0), harmonics=1, outputs={"tip": tip}
    )
    assert len(sought) <= 18 and np.isfinite(found.truncation).all()
