"""How many modes a wanted accuracy takes, against the errors of the full pencil."""

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from tests.contact_tables import contact_table
from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.truncation import join
from tipdamp.static_contact.full.stuck_modes import full_stuck_hz
from tipdamp.static_contact.tuning.reduction_error import enough_modes, own_error, stuck_error_bound

BELOW_HZ = 1500.0


def rod(name, cells, k, m):
    """Fixed chain of point masses on a line: every dof an x displacement. m in kg, k in N/m."""
    K = sp.diags(
        [np.full(cells - 1, -k), np.full(cells, 2 * k), np.full(cells - 1, -k)], [-1, 0, 1]
    )
    n = np.arange(cells)
    return Body.from_matrices(
        name, K, m * sp.identity(cells), n + 1, np.column_stack([n, 0 * n, 0 * n]), n, 0 * n
    )


@pytest.fixture(scope="module")
def joined():
    bodies = [rod("one", 150, 2e7, 2e-3), rod("two", 110, 3e7, 1e-3)]
    pairs = contact_table(
        np.tile(np.eye(3)[[1, 2, 0]], (3, 1, 1)),
        blade_body="one",
        blade_node=[20, 60, 131],
        damper_body="two",
        damper_node=[15, 50, 90],
        kn=2e6,
    )
    parts = [
        craig_bampton(bodies[0], pairs.blade_node, 60),
        craig_bampton(bodies[1], pairs.damper_node, 60),
    ]
    full = full_stuck_hz(bodies, pairs, 12)
    return pairs, parts, full[full < BELOW_HZ]


@pytest.mark.parametrize("targets", [(1e-3, 1e-4), (1e-5, None)])
def test_errors_are_met_with_fewest_modes(joined, targets):
    pairs, parts, full = joined
    chosen = enough_modes(parts, targets, pairs, BELOW_HZ)
    cut = [p.fewer(n) for p, n in zip(parts, chosen, strict=True)]
    model = assemble(*(p.model for p in cut))
    K = model.K.copy()
    for one, two in zip(pairs.blade_node, pairs.damper_node, strict=True):
        i, j = model.dofs("one", one)[0], model.dofs("two", two)[0]
        # n along x, the chains' only direction
        K[np.ix_([i, j], [i, j])] += 2e6 * np.array([[1, -1], [-1, 1]])
    hz = np.sqrt(sl.eigh(K, model.M, eigvals_only=True)[: len(full)]) / (2 * np.pi)
    error = hz / full - 1
    assert len(full) >= 4 and error.max() <= 1.1 * sum(t or 0 for t in targets)
    bound = stuck_error_bound(model, join(*(p.truncation for p in cut)), pairs, hz)
    assert (bound >= error).all() and bound.max() <= 1.1 * sum(t or 0 for t in targets)
    for i, target in enumerate(targets):
        if target is None:
            assert chosen[i] == 60
        else:  # one mode fewer would not do
            assert own_error(parts, i, chosen[i] - 1, pairs, BELOW_HZ) > target


def test_not_enough_modes_to_choose_from(joined):
    pairs, parts, _ = joined
    few = [p.fewer(4) for p in parts]
    with pytest.raises(
        InputError,
        match=r"body 'one': the stuck frequencies below 1500 Hz are certain to .* with 4",
    ):
        enough_modes(few, (1e-6, None), pairs, BELOW_HZ)
