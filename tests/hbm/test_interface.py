"""Interface reduction: followed pairs exact in statics, stuck frequencies and response within the
errors stated."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.linalg as sl

from tests.benchmarks.hundreds import FACES_BAND, SLIP, face_to_face, loosened, sliding
from tests.hbm.conformance import own_law
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.receptance import linear_response
from tipdamp.hbm.contact import relative_motion
from tipdamp.hbm.hold.spring import Hold, held_motions
from tipdamp.hbm.interface import SETTINGS, Excitation, reduce_interface
from tipdamp.hbm.laws import DryFriction2T, IsotropicFriction
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, forced_response, solve_at

PAIRS = 64
H = 3
ZETA = 0.01
LEVEL = 5.0
# Hz, around the resonance where nothing but the contacts holds the damper along y
SLIDING = (700.0, 1100.0)


@pytest.fixture(scope="module")
def case():
    """A blade and a damper that meet at 64 pairs, 8 of which slip; 384 dofs. One pair is open at
    rest."""
    arrays, pairs, push = face_to_face(PAIRS)
    preload = pairs.preload.copy()
    preload[5] = -1e-3
    model = ReducedModel.from_matrices(**arrays, loads={"push": push})
    return model, pairs.replace(preload=preload), push


def reduced(
    case, followed=14, moment=SETTINGS.moment, law=None, band=FACES_BAND, held=(), static=()
):
    model, pairs, push = case
    return reduce_interface(
        model,
        pairs,
        law or DryFriction2T(),
        Excitation([LEVEL * push, *static], band, H),
        held,
        replace(SETTINGS, followed=followed, moment=moment, ratio=ZETA),
    )


@pytest.fixture(scope="module")
def found(case):
    return reduced(case)


def stuck(model, pairs):
    """(K of the closed pairs stuck, relative motion of all)."""
    B = relative_motion(model, pairs).toarray()
    k = np.column_stack([pairs.kt, pairs.kt, pairs.kn]) * (pairs.preload > 0)[:, None]
    return model.K + B.T * k.ravel() @ B, B


def test_followed_pairs_are_exact_in_statics(case, found):
    """Their motion under forces on themselves and under the load; the load itself in the new
    dofs."""
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
    """Stuck frequencies up to the end of the band, and the stuck response over it; the errors
    follow the tolerance."""
    model, pairs, push = case
    few = reduced(case, moment=moment)
    hz = [
        np.sqrt(sl.eigh(stuck(one, pairs)[0], one.M, eigvals_only=True)) / (2 * np.pi)
        for one in (model, few.model)
    ]
    low = hz[1] < FACES_BAND[1]
    true = hz[1][low] / hz[0][: low.sum()] - 1
    assert (true > -1e-9).all() and true.max() <= few.frequency_error + 1e-9
    closed, at = pairs.select(pairs.preload > 0), np.linspace(*FACES_BAND, 60)
    whole = linear_response(model, closed, push, at, ZETA, {"out": push})
    mine = linear_response(few.model, closed, push @ few.basis, at, ZETA, {"out": push @ few.basis})
    assert np.abs(mine - whole).max() <= max(few.response_error, 1e-8) * np.abs(whole).max()
    assert (few.response_error < 1e-3) is (moment < 1e-2)


def test_slipping_pairs_are_found_and_the_peak_kept(case, found):
    """What slips is among the followed pairs, and the curve is that of all dofs."""
    model, pairs, push = case
    curves = [
        forced_response(
            one,
            pairs,
            DryFriction2T(),
            LEVEL * push @ V,
            FACES_BAND,
            damping_ratio=ZETA,
            outputs={"out": push @ V},
            harmonics=H,
        )
        for one, V in ((model, np.eye(model.size)), (found.model, found.basis))
    ]
    slips = [(curve.share_slip > 0).any(axis=0) for curve in curves]
    assert (
        slips[0].sum() >= SLIP and (slips[0] == slips[1]).all() and found.followed[slips[0]].all()
    )
    (hz, top), (its_hz, its_top) = (curve.peak("out") for curve in curves)
    assert its_top == pytest.approx(top, rel=1e-4) and its_hz == pytest.approx(hz, rel=1e-5)


@dataclass(frozen=True)
class Unknown(IsotropicFriction):
    """Coulomb friction that does not say what sticks."""

    def sticks_surely(self, contacts, amplitude):
        return np.zeros(len(contacts), dtype=bool)


def test_laws_that_do_not_tell_what_sticks(case):
    """Asked for their forces, they follow those that slip, as where they tell, and mostly the same
    beside them."""
    told, asked = (reduced(case, law=law).followed for law in (IsotropicFriction(), Unknown()))
    slips = sliding(PAIRS)
    assert slips.sum() == SLIP and told[slips].all() and asked[slips].all() and asked.sum() == 14
    assert (told & asked).sum() >= 11


def bouc_wen(pairs):
    """With three times the slip limit of the friction of each pair."""
    return own_law("bouc_wen").BoucWen(0.1, 3 * pairs.mu * pairs.preload / pairs.kt)


def curves_of(case, law, found, band=FACES_BAND, held=(), static=None, samples=None):
    """The curve on all dofs, and in the shapes found."""
    model, pairs, push = case
    made = []
    for one, V, holds in (
        (model, np.eye(model.size), held),
        (found.model, found.basis, found.held),
    ):
        load = None if static is None else static @ V
        problem, _ = contact_problem(one, pairs, law, damping_ratio=ZETA, static=load)
        made.append(
            follow_band(
                replace(problem, held=tuple(holds)),
                LEVEL * push @ V,
                band,
                harmonics=H,
                outputs={"out": push @ V},
                samples=samples,
            )
        )
    return made


@pytest.mark.parametrize(
    "of, hz", [(lambda _: Unknown(), 1780.0), (bouc_wen, 1740.0)], ids=["friction", "Bouc-Wen"]
)
def test_their_response_is_that_of_all_dofs(of, hz):
    """Near the peak: Coulomb friction, and hysteresis that leaves its springs from the first motion
    on, everywhere."""
    arrays, pairs, push = face_to_face(24)
    pairs = pairs.replace(frame=pairs.frame[:, [1, 0, 2]] * [[1], [-1], [1]])  # t1 along the push
    model, law = ReducedModel.from_matrices(**arrays), of(pairs)
    found = reduced((model, pairs, push), 8, law=law)
    points = []
    for one, V in ((model, np.eye(model.size)), (found.model, found.basis)):
        problem, _ = contact_problem(one, pairs, law, damping_ratio=ZETA)
        points.append(
            solve_at(
                problem, LEVEL * push @ V, hz, harmonics=H, outputs={"out": push @ V}, samples=64
            )
        )
    whole, few = (point.harmonics[0] for point in points)
    assert points[0].converged and (points[0].share_slip > 0.05).sum() >= SLIP
    assert np.abs(few - whole).max() <= max(2 * found.response_error, 1e-6) * np.abs(whole).max()


@pytest.fixture(scope="module")
def loose():
    """As `case`; nothing but friction holds the damper along y."""
    arrays, pairs, push = face_to_face(PAIRS)
    arrays["K"] = loosened(arrays["K"], PAIRS)
    return ReducedModel.from_matrices(**arrays, loads={"push": push}), pairs, push


@pytest.mark.parametrize("mean", [False, True])
def test_beside_a_hold(loose, mean):
    """The peak, the force on what holds and its change with a stiffer spring are those on all
    dofs."""
    model, pairs, _ = loose
    held = held_motions(model, pairs, Hold("y", mean=mean))
    drag = np.r_[np.zeros(3 * PAIRS), np.tile([0, 0.3 / PAIRS, 0], PAIRS)]
    found = reduced(loose, band=SLIDING, held=held, static=[drag])
    whole, few = curves_of(loose, DryFriction2T(), found, SLIDING, held, drag)
    (hz, top), (its_hz, its_top) = whole.peak("out"), few.peak("out")
    assert its_top == pytest.approx(top, rel=1e-4) and its_hz == pytest.approx(hz, rel=1e-5)
    forces = [
        curve.reaction[np.abs(curve.frequency - at).argmin(), 0]
        for curve, at in ((whole, hz), (few, its_hz))
    ]
    assert forces[1] == pytest.approx(forces[0], abs=1e-3 * np.abs(forces[0]).max())
    assert not mean or forces[0][0] == pytest.approx(drag.sum()), (
        "all pairs stick or slip alike: the hold has the drag"
    )
    assert few.held_change == pytest.approx(whole.held_change, rel=0.01, abs=1e-9)
    # the motion itself lies in the shapes, and no other spring acts on it than the hold's
    (one,), (there,) = held, found.held
    assert (
        found.basis @ there.motion == pytest.approx(one.motion, abs=1e-9)
        and there.row @ there.motion == pytest.approx(one.row @ one.motion)
        and there.stiffness == one.stiffness
    )


def test_nothing_where_it_does_not_pay(case):
    """All pairs followed are no fewer shapes."""
    assert reduced(case, followed=PAIRS) is None
