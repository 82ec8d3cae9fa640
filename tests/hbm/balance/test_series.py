"""The series of the far modes: what came before does not change it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.balance.test_general import direct, random_matrices
from tests.hbm.cases import rig
from tipdamp.hbm.balance.receptance import general_receptance
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.series import ContactReceptance, contact_receptance
from tipdamp.hbm.balance.settings import DEFAULT


@pytest.mark.parametrize("before", [0.3, 0.7, 0.95, 1.2, 3.0])
def test_the_way_to_a_frequency_does_not_count(before):
    problem = rig()[0]
    receptance = problem.receptance()
    shapes, w, rows = problem.B @ receptance.shapes, 2 * np.pi * 2800.0, np.arange(12)

    def between(made, w):
        return made.between(rows, rows, receptance.factors(w * np.arange(4))[0], w)

    fresh, used = (ContactReceptance(receptance, shapes) for _ in range(2))
    between(used, before * w)
    assert (between(used, w) == between(fresh, w)).all()
    one_by_one = np.einsum(
        "am,bm,mk->abk", shapes[rows], shapes[rows], receptance.factors(w * np.arange(4))[0]
    )
    assert np.abs(between(fresh, w) - one_by_one).max() < 1e-9 * np.abs(one_by_one).max()


@pytest.mark.parametrize("w", [1.0, 17600.0])
def test_many_components_at_once(w):
    """Order by order, as those of few; also where no mode is as low as the frequency."""
    problem, few = rig()[0], DEFAULT.few_between
    receptance = problem.receptance()
    shapes, rows = problem.B @ receptance.shapes, np.arange(54)
    many = np.tile(rows, 1 + int(few**0.5) // len(rows))
    factors = receptance.factors(w * np.arange(4))[0]
    made = ContactReceptance(receptance, shapes)
    found = made.between(many, many, factors, w)
    assert len(many) ** 2 > few
    expected = made.between(rows, rows, factors, w)
    assert np.abs(found[:54, -54:] - expected).max() < 1e-12 * np.abs(expected).max()


def test_all_curves_of_a_problem_share_it():
    """Of levels, numbers of harmonics and directions, and with other preloads; not with other
    stiffnesses."""
    problem, force, _ = rig()
    cases, own = ((1, 5), (20, 5), (20, 9)), problem.contacts
    made = [
        HarmonicBalance(problem, {1: level * force}, H).contact_receptance for level, H in cases
    ]
    same, other = (
        problem.with_contacts(replace(own, **change))
        for change in ({"mu": 2 * own.mu}, {"kt": 2 * own.kt})
    )
    assert made[0] is made[1] is made[2] is same.contact_receptance is not other.contact_receptance


@pytest.mark.parametrize("w", [0.5, 3.0])
def test_what_acts_there_and_moves_here_is_not_what_acts_here_and_moves_there(w):
    """Of matrices that are not symmetric, with a chain's far modes: the entries of the inverse of
    the dynamic stiffness, row by row and column by column."""
    n = 60
    far = np.diag(np.geomspace(1e2, 1e5, n))
    M, C, K = random_matrices(n)
    K = K + far
    receptance = general_receptance(M, C, K, None)
    made = contact_receptance(receptance, np.eye(n))
    assert made.terms(3 * w, np.arange(n))[1] is not None  # by a series
    to, at = np.array([0, 4, 31]), np.array([2, 4])
    found = made.between(to, at, receptance.factors(w * np.arange(4))[0], w)
    for k in range(4):
        expected = direct(M, C, K, k * w)[np.ix_(to, at)]
        assert np.abs(found[:, :, k] - expected).max() < 1e-8 * np.abs(expected).max()
