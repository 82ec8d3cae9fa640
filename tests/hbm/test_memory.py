"""The predicted memory of slipping contacts against what a curve takes, and the message where it
lacks."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks import hundreds
from tests.hbm.small_rig import small_rig
from tipdamp.hbm import fourier, memory, response
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.comparison import left_orbit
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.memory import curve_bytes, newton_bytes
from tipdamp.hbm.response import follow_band, forced_response
from tipdamp.hbm.time.settings import IntegrationSettings

MODEL, PAIRS, TIP = small_rig(stations=6)


def curve(level=200.0, harmonics=15):
    return forced_response(
        MODEL,
        PAIRS,
        DryFriction2T(),
        level * TIP,
        (300, 330),
        harmonics=harmonics,
        damping_ratio=0.02,
        outputs={"tip": TIP},
    )


@pytest.mark.slow
def test_forecast_of_a_curve():
    """Ten of twelve pairs slip or lift: at H = 15 what is predicted for these is needed, to a
    factor of two."""
    curve(harmonics=1)  # what is loaded or compiled once is not the curve's
    tracemalloc.start()
    found = curve()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    moving = int(((found.share_slip + found.share_open) > 0).sum(axis=1).max())
    assert moving == 10 and 0.5 < curve_bytes(moving, 12, 3, 15) / peak < 2, (
        curve_bytes(moving, 12, 3, 15) / peak
    )


def test_points_keep_no_matrices(monkeypatch):
    """Nor the derivatives of their contact forces, peaks and what is drawn between them
    included."""
    seen, real = [], response.record

    def record(branch, *rest):
        seen.extend(point.detail for point in branch.points)
        found = real(branch, *rest)
        assert not any(one.kept or one.parts or one.border for one in seen)
        return found

    monkeypatch.setattr(response, "record", record)
    assert curve(harmonics=3).complete and len(seen) > 20


def test_what_was_forgotten_comes_back():
    """To the last digit, with other settings of the contacts, too."""
    problem, _ = contact_problem(MODEL, PAIRS, DryFriction2T(), damping_ratio=0.02)
    balance, w = HarmonicBalance(problem, {1: 200 * TIP}, 3), 2 * np.pi * 312
    softer = replace(problem.contacts, mu=0.5 * problem.contacts.mu)
    for settings in (None, softer):
        here = balance.evaluate(balance.linear(w), w, contacts=settings)
        row = np.zeros(len(here.x))
        first = here.solve(row, 1.0, 0.0)
        assert len(here.forces.contacts) > 0 and here.kept
        here.forget()
        assert not here.kept
        again = here.solve(row, 1.0, 0.0)
        assert np.array_equal(first[0], again[0]) and first[1] == again[1]


@pytest.mark.slow
def test_forecast_of_many_contacts_that_stick():
    """Eight of 128 slip: what the points hold of all contacts is most of it."""
    hundreds.beam(16)(harmonics=1)  # loads and compiles
    follow = hundreds.beam(128)
    tracemalloc.start()
    found = follow(harmonics=5)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(found.slipping_pairs) == 8 and newton_bytes(8, 3, 5) < 0.2 * peak
    assert 0.5 < curve_bytes(8, 128, 3, 5) / peak < 2, curve_bytes(8, 128, 3, 5) / peak


def test_too_many_harmonics_are_refused_at_input(monkeypatch):
    """128 pairs in three dimensions at H = 200: a warning with 8 GB, whose number fits; refused
    before the modes with so little that not one pair can slip."""
    columns = {
        name: np.resize(getattr(PAIRS, name), (128, *getattr(PAIRS, name).shape[1:]))
        for name in PAIRS.__dataclass_fields__
    }
    problem, _ = contact_problem(
        MODEL, PAIRS.replace(**columns), DryFriction2T(), damping_ratio=0.02
    )
    monkeypatch.setattr(memory, "available_bytes", lambda: 8e9)
    with pytest.warns(
        UserWarning,
        match=r"harmonics = 200: 32 of the 128 contacts.* need .* GB .* 8 GB are "
        r"available: at most harmonics = (\d+) here",
    ) as caught:
        memory.check_harmonics_fit(128, 3, 200)
    named = int(str(caught[0].message).split("at most harmonics = ")[1].split()[0])
    assert 50 < named < 200 and curve_bytes(32, 128, 3, named) <= 8e9 < curve_bytes(
        32, 128, 3, named + 1
    )
    monkeypatch.setattr(memory, "available_bytes", lambda: 5e7)
    monkeypatch.setattr(memory, "SMALL", 0.0)
    with pytest.raises(InputError, match="harmonics = 200: one contact that slips or lifts needs"):
        follow_band(problem, TIP, (300, 330), harmonics=200, outputs={"tip": TIP})
    assert "_receptance" not in problem.__dict__


def test_pairs_that_slip_later_are_refused_by_name(monkeypatch):
    """Where more slip than the door foresaw, before the matrix is made; none slip at a low level,
    and all is well."""
    monkeypatch.setattr(memory, "_VECTORS", 20)  # what the points hold is most of it here
    monkeypatch.setattr(memory, "available_bytes", lambda: 1.1 * curve_bytes(3, 12, 3, 15))
    monkeypatch.setattr(memory, "SMALL", 0.0)
    assert curve(level=1e-3).complete
    with pytest.raises(
        InputError, match=r"harmonics = 15: \d+ of the 12 contacts, which slip or lift at once here"
    ):
        curve()


@pytest.mark.slow
def test_curve_continues_where_the_matrix_fits(monkeypatch):
    """What it holds already is not asked for again: with the need of the largest matrix free at
    every point."""
    monkeypatch.setattr(memory, "_VECTORS", 20)  # what the points hold is most of it here
    free = newton_bytes(12, 3, 15, share=0.4)
    monkeypatch.setattr(memory, "SMALL", 0.0)
    monkeypatch.setattr(memory, "available_bytes", lambda: free)
    assert curve().complete


def test_comparison_with_bounded_harmonics(monkeypatch):
    """It solves with 2H + 1 of them where they fit."""
    problem, _ = contact_problem(MODEL, PAIRS, DryFriction2T(), damping_ratio=0.02)
    balance = HarmonicBalance(problem, {1: 200 * TIP}, 7)
    w = 2 * np.pi * 312
    point = solve_fixed(balance.evaluate, balance.linear(w), w, balance.weights)
    monkeypatch.setattr(memory, "SMALL", 0.0)
    monkeypatch.setattr(memory, "available_bytes", lambda: newton_bytes(12, 3, 7))
    same = fourier.to_complex(point.x.reshape(balance.n_components, -1))
    assert point.converged and len(point.detail.forces.contacts) == 12
    assert not left_orbit(balance, point, same, 0.01, IntegrationSettings())


def test_warning_where_few_contacts_may_slip(monkeypatch):
    """512 of 2048 pairs in three dimensions at H = 7 ask for 19.7 GB.

    How many will slip is not known at input.
    """
    monkeypatch.setattr(memory, "available_bytes", lambda: 8e9)
    with pytest.warns(
        UserWarning,
        match="512 of the 2048 contacts, should they slip or lift at once, need 19.7 GB",
    ):
        memory.check_harmonics_fit(2048, 3, 7)
