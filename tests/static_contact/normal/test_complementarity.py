"""Pairs that face two ways in three dimensions: many random gaps, soft and hard, against a second
solver."""

from functools import cache

import numpy as np
import pytest

from tests.static_contact.corner import SHARES, by_interior_point, corner, pulls, random_pairs
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.normal.complementarity import NoEquilibrium

made = cache(corner)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHARES)
def test_random_gaps_against_an_interior_point(name):
    """60 cases for each way of pulling, every third hard. Symmetric ones balance on single lines of
    pairs, where many positions of the damper are solutions; the forces are the same in all of
    them."""
    bodies, reduced, model, pairs = made()
    load = pulls(bodies, reduced, name)[1]
    random = np.random.default_rng(0)
    for i in range(60):
        case = random_pairs(pairs, random, hard=i % 3 == 0)
        statics = StaticContact(model, case)
        found = statics.solve(load)
        N = by_interior_point(model.K, statics.B.toarray(), load, case.gap, case.kn)
        assert found.force == pytest.approx(N, abs=1e-8 * N.max()), i
        assert found.residual < 1e-8 and found.balance < 1e-8


def test_what_lifts_off_is_still_refused():
    bodies, reduced, model, pairs = made()
    load = pulls(bodies, reduced, "both")[1]
    with pytest.raises(NoEquilibrium, match="do not hold the damper"):
        StaticContact(model, random_pairs(pairs, np.random.default_rng(1), hard=False)).solve(-load)
