"""Several laws in one model: each contact behaves as under its law alone."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.conformance import LAWS, mixed, one_dof, random_case
from tests.hbm.small_rig import small_rig
from tipdamp.hbm import laws
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import IsotropicFriction, MixedLaw
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import forced_response
from tipdamp.hbm.testing import forces, full_derivative


def test_forces_are_those_of_each_law_alone():
    x, contacts, _ = random_case(laws.DryFriction2T(), P=24)
    law = mixed(24)
    b = forces(law, contacts, x, samples=64)
    k, D = law.stuck_stiffness(contacts), full_derivative(b, x)
    for i, case in enumerate(LAWS):
        at = np.arange(i, 24, len(LAWS))
        columns = ["t1 t2 n".split().index(c) for c in case.law.components]
        own = contacts.select(at)
        alone = forces(case.law, own, x[np.ix_(at, columns)], samples=64)
        assert np.array_equal(b.g[np.ix_(at, columns)], alone.g) and np.array_equal(
            b.shares[at], alone.shares
        )
        assert np.array_equal(k[np.ix_(at, columns)], case.law.stuck_stiffness(own))
        others = [c for c in range(3) if c not in columns]
        assert (
            not b.g[np.ix_(at, others)].any()
            and not D[at][:, others].any()
            and not D[at][:, :, :, others].any()
        )


@pytest.mark.slow
def test_curve_with_all_laws():
    """Points side by side, each with its own law: the one curve holds the curves of the points
    alone."""
    singles = [one_dof(case.law) for case in LAWS]
    n = len(LAWS)
    K = np.kron(np.eye(n), singles[0][0].K)
    model = ReducedModel.from_matrices(
        np.eye(3 * n),
        K,
        body="mass",
        node=np.repeat(np.arange(1, n + 1), 3),
        direction=["x", "y", "z"] * n,
    )
    tables = [s[1] for s in singles]
    columns = {name: np.concatenate([getattr(t, name) for t in tables]) for name in vars(tables[0])}
    pairs = ContactTable(**columns | {"damper_node": np.arange(1, n + 1)})
    force = np.concatenate([s[2] for s in singles])
    law = mixed(n)
    given = dict(harmonics=3, damping_ratio=0.03, samples=128, at=[1.7], truncation=False)
    outputs = {"all": np.ones(3 * n)} | {str(i): np.eye(3 * n)[3 * i] for i in range(n)}
    curve = forced_response(model, pairs, law, force, (1.69, 1.71), outputs=outputs, **given)
    assert curve.complete, curve.ended
    for i, (alone, table, F) in enumerate(singles):
        outputs = {"x": [1.0, 0, 0]}
        own = forced_response(alone, table, LAWS[i].law, F, (1.69, 1.71), outputs=outputs, **given)
        assert np.allclose(
            curve.harmonics[curve.frequency == 1.7][0, 1 + i],
            own.harmonics[own.frequency == 1.7][0, 0],
            atol=1e-9,
        )


def test_detached_pairs_are_left_out():
    model, pairs, tip = small_rig(stations=3)
    law = MixedLaw((laws.DryFriction2T(), IsotropicFriction()), [1, 0, 1, 0, 1, 0])
    some = replace(pairs, weight=np.array([1.0, 0, 1, 1, 1, 1]))
    problem, kept = contact_problem(model, some, law, damping_ratio=0.02)
    assert problem.law.of_pair == (1, 1, 0, 1, 0) and kept.tolist() == [
        True,
        False,
        True,
        True,
        True,
        True,
    ]
    assert problem.stuck_stiffness.shape == model.K.shape


def test_unfit_assignments_are_refused():
    with pytest.raises(InputError, match="from 0 to 1"):
        MixedLaw((laws.Jenkins1D(), laws.DryFriction2T()), [0, 2])
    model, pairs, force = one_dof(laws.Jenkins1D())
    with pytest.raises(InputError, match="of_pair has 2 entries"):
        forced_response(
            model,
            pairs,
            MixedLaw((laws.Jenkins1D(),), [0, 0]),
            force,
            (1, 2),
            harmonics=1,
            damping_ratio=0.03,
            outputs={"x": [1.0, 0, 0]},
        )


def test_parameters_are_cut_with_their_contacts():
    """Parameters count the contacts of their law alone: of the three cubic springs the last two
    stay."""
    law = MixedLaw((laws.CubicSpring([1.0, 2, 3]), laws.UnilateralSpring()), [0, 1, 0, 1, 0])
    _, contacts, _ = random_case(law, P=5)
    law.check(contacts)
    kept = law.select(np.array([False, True, True, False, True]))
    assert kept.of_pair == (1, 0, 0) and kept.laws[0].cubic.tolist() == [2, 3]
    with pytest.raises(
        InputError, match="CubicSpring: cubic has 3 values, must be one number or one per contact"
    ):
        MixedLaw(law.laws, [0, 1, 1, 1, 0]).check(contacts)
