"""The series of the far modes: what came before does not change it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.cases import rig
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.series import ContactReceptance
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
