"""Interface reduction: followed pairs exact in statics, stuck frequencies and response within the errors stated."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl

from hbm.balance.receptance import linear_response
from hbm.contact import relative_motion
from hbm.interface import SETTINGS, reduce_interface
from hbm.laws import DryFriction2T, IsotropicFriction
from hbm.model import ReducedModel
from hbm.response import forced_response
from tests.benchmarks.hundreds import FACES_BAND, SLIP, face_to_face

PAIRS, H, ZETA, LEVEL = 64, 3, 0.01, 5.0


@pytest.fixture(scope="module")
def case():
    """A blade and a damper that meet at 64 pairs, 8 of which slip; 384 dofs. One pair is open at rest."""
    arrays, pairs, push = face_to_face(PAIRS)
    preload = pairs.preload.copy()
    preload[5] = -1e-3
    model = ReducedModel.from_matrices(**arrays, loads={"push": push})
    return model, pairs.replace(preload=preload), push


def reduced(case, followed=14, moment=SETTINGS.moment, law=None):
    model, pairs, push = case
    return reduce_interface(model, pairs, law or DryFriction2T(), [LEVEL * push], FACES_BAND, H,
                            replace(SETTINGS, followed=followed, moment=moment, ratio=ZETA))


@pytest.fixture(scope="module")
def found(case):
    return reduced(case)


def stuck(model, pairs):
    """(K of the closed pairs stuck, relative motion of all)."""
    B = relative_motion(model, pairs).toarray()
    k = np.column_stack([pairs.kt, pairs.kt, pairs.kn]) * (pairs.preload > 0)[:, None]
    return model.K + B.T * k.ravel() @ B, B


def test_followed_pairs_are_exact_in_statics(case, found):
    """Their motion under forces on themselves and under the load; the load itself in the new dofs."""
    model, pairs, push = case
    assert found.model.size < model.size / 2 and found.followed.sum() == 14
    rows, compliance, driven = np.repeat(found.followed, 3), [], []
    for one, load in ((model, push), (found.model, found.model.loads["push"])):
        K, B = stuck(one, pairs)
        compliance.append(B[rows] @ np.linalg.solve(K, B[rows].T))
        driven.append(B[rows] @ np.linalg.solve(K, load))
    for exact, mine in (compliance, driven):
        assert mine == pytest.approx(exact, rel=0, abs=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("moment", [2e-3, 5e-2])
def test_frequencies_and_response_within_the_errors_stated(case, moment):
    """Stuck frequencies up to the end of the band, and the stuck response over it; the errors follow the tolerance."""
    model, pairs, push = case
    few = reduced(case, moment=moment)
    hz = [np.sqrt(sl.eigh(stuck(one, pairs)[0], one.M, eigvals_only=True)) / (2 * np.pi) for one in (model, few.model)]
    low = hz[1] < FACES_BAND[1]
    true = hz[1][low] / hz[0][:low.sum()] - 1
    assert (true > -1e-9).all() and true.max() <= few.frequency_error + 1e-9
    closed, at = pairs.select(pairs.preload > 0), np.linspace(*FACES_BAND, 60)
    whole = linear_response(model, closed, push, at, ZETA, {"out": push})
    mine = linear_response(few.model, closed, push @ few.basis, at, ZETA, {"out": push @ few.basis})
    assert np.abs(mine - whole).max() <= max(few.response_error, 1e-8) * np.abs(whole).max()
    assert (few.response_error < 1e-3) is (moment < 1e-2)


def test_slipping_pairs_are_found_and_the_peak_kept(case, found):
    """What slips is among the followed pairs, and the curve is that of all dofs."""
    model, pairs, push = case
    curves = [forced_response(one, pairs, DryFriction2T(), LEVEL * push @ V, FACES_BAND, damping_ratio=ZETA,
                              outputs={"out": push @ V}, harmonics=H)
              for one, V in ((model, np.eye(model.size)), (found.model, found.basis))]
    slips = [(curve.share_slip > 0).any(axis=0) for curve in curves]
    assert slips[0].sum() >= SLIP and (slips[0] == slips[1]).all() and found.followed[slips[0]].all()
    (hz, top), (its_hz, its_top) = (curve.peak("out") for curve in curves)
    assert its_top == pytest.approx(top, rel=1e-4) and its_hz == pytest.approx(hz, rel=1e-5)


def test_nothing_where_it_does_not_pay(case):
    """All pairs followed are no fewer shapes; a law that does not tell what sticks gives no order."""
    assert reduced(case, followed=PAIRS) is None

    class Unknown(IsotropicFriction):
        def sticks_surely(self, contacts, amplitude):
            return np.zeros(len(contacts), dtype=bool)

    assert reduced(case, law=Unknown()) is None
