"""Functions of a curve refuse a problem or a parameter that is not the curve's."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.cases import beam
from tests.validation.random_systems import contact_systems
from tipdamp.hbm.balance.contact_setting import ContactSetting
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.response import follow_band, follow_parameter, solve_at


@pytest.fixture(scope="module")
def case():
    problem, force, outputs = beam("B8")
    return problem, 20 * force, outputs


@pytest.fixture(scope="module")
def curve(case):
    problem, force, outputs = case
    return follow_band(problem, force, (850, 950), harmonics=1, outputs=outputs)


@pytest.mark.parametrize(
    "other",
    [
        lambda p: replace(p, C=1.5 * p.C),
        lambda p: replace(p, contacts=replace(p.contacts, kt=1.1 * p.contacts.kt)),
    ],
)
def test_another_problem_is_refused(case, curve, other):
    with pytest.raises(
        InputError, match="not that of the curve: its point at .* Hz leaves a residual"
    ):
        solutions_at(curve, other(case[0]), 900.0)
    with pytest.raises(InputError, match="not that of the curve"):
        find_peaks(curve, other(case[0]), "tip")


def test_the_same_problem_made_anew_is_taken(case, curve):
    again = replace(case[0], K=np.array(case[0].K))
    assert len(solutions_at(curve, again, 900.0)) == 1


def test_another_parameter_is_refused(case):
    problem, force, outputs = case
    over = follow_parameter(
        problem, force, 900.0, ContactSetting("kt", (0,)), (1.0, 1.5), harmonics=1, outputs=outputs
    )
    assert len(solutions_at(over, problem, 1.2, ContactSetting("kt", (0,)))) == 1
    for other in (ContactSetting("kt", (1,)), ContactSetting("mu")):
        with pytest.raises(InputError, match="the curve runs over"):
            solutions_at(over, problem, 1.2, other)


def test_options_of_curves_are_checked(case):
    problem, force, outputs = case
    with pytest.raises(InputError, match="option harmonic: is unknown; did you mean 'harmonics'"):
        follow_band(problem, force, (850, 950), outputs=outputs, harmonic=3)
    with pytest.raises(InputError, match="outputs is missing: .* for example outputs={'x': 0}"):
        solve_at(problem, force, 900.0)


def test_solutions_beside_a_fold_after_an_s_bend():
    """The last point before the fold looks as if its tangent met that of the next one there, as in
    a corner."""
    system = list(contact_systems(2))[1]
    curve = follow_band(
        system.problem, system.force, system.band[::-1], harmonics=system.H, outputs=system.outputs
    )
    found = np.sort(
        np.abs([X[0, 1] for X in solutions_at(curve, system.problem, 0.2385089304701377)])
    )
    # of the curve from below
    assert found == pytest.approx([0.560418267, 0.566777604, 0.590820332], rel=1e-8)
