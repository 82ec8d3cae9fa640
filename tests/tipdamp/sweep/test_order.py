"""The order of the cases: whatever costs more or less with the values of a key, the first cases
cost what all do on the average."""

from itertools import product

import numpy as np
import pytest
from scipy.stats import qmc

from tipdamp.sweep.order import order_of_work, places


def grid(*sizes):
    return [dict(zip("abcde", values, strict=False)) for values in product(*map(range, sizes))]


@pytest.mark.parametrize("sizes", [(24,), (5, 6), (8, 2), (2, 8), (13, 4), (4, 3, 5)])
def test_each_beginning_is_spread_over_every_key(sizes):
    """The mean place of the first quarter, half and three quarters is that of all, which is 0, to
    an eighth of the range; that of the order of the file is 0.38 away."""
    place = places(grid(*sizes))
    order = order_of_work(place)
    assert sorted(order) == list(range(len(place)))
    for share in (0.25, 0.5, 0.75):
        first = place[order][: round(share * len(place))]
        assert np.abs(first.mean(axis=0)).max() < 0.125


def test_it_begins_in_the_middle():
    assert order_of_work(places(grid(25)))[0] in (11, 12, 13)


def test_samples_are_spread_as_well():
    place = qmc.LatinHypercube(3, seed=0).random(80) - 0.5
    first = place[order_of_work(place)][:20]
    assert np.abs(first.mean(axis=0)).max() < 0.125


def test_places_of_values():
    """Numbers by their size, lists and texts as they come."""
    cases = [
        {"pull": 113, "stations": [5, 4], "mesh": "b.msh"},
        {"pull": 28.0, "stations": [9, 9], "mesh": "a.msh"},
        {"pull": 56, "stations": [5, 4], "mesh": "b.msh"},
    ]
    found = places(cases)
    assert found[:, 0] == pytest.approx([1 / 3, -1 / 3, 0], abs=1e-15)
    assert found[:, 1:].tolist() == [[-0.25, -0.25], [0.25, 0.25], [-0.25, -0.25]]


def test_a_key_with_one_value_changes_nothing():
    cases = [{"pull": pull, "mesh": "a.msh"} for pull in range(9)]
    assert sorted(order_of_work(places(cases))) == list(range(9))
    assert places(cases)[:, 1].tolist() == [0.0] * 9
