"""Contact points of a body through its reduction: exact in statics, whether their nodes are masters
or not."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from tipdamp.hbm.points import ContactPoints
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body

pytest.importorskip("dolfinx")


@pytest.fixture(scope="module")
def body(bar):
    body = elastic_body(bar, Material(E=207e9, nu=0.3, density=7850.0), "bar", clamp="clamp")
    nodes = bar.group("tip")[:6]
    share = sp.kron(
        np.array([[0.2, 0.3, 0.5, 0, 0, 0], [0, 0, 0, 0.1, 0.1, 0.8]]), np.eye(3), format="csr"
    )
    return replace(
        body,
        points=ContactPoints(
            [10**6, 10**6 + 1], np.zeros((2, 3)), share @ body.motion_of("bar", nodes)
        ),
    )


def test_motion_of_masters_and_of_the_interior(body, bar):
    """All nodes of the points masters, or none of them: the full static motion, and that of the
    recovery."""
    tip = bar.group("tip")
    load = np.random.default_rng(1).standard_normal((len(tip), 3))
    f = np.zeros(body.dofs)
    for n, force in zip(tip, load, strict=True):
        f[body.node_dofs([n])] = force
    full = body.points.motion @ sp.linalg.spsolve(body.K.tocsc(), f)
    for masters, shapes in ((tip, 0), (tip[6:], 6)):
        part = craig_bampton(body, masters, 4)
        for one in (part, part.fewer(2)):
            q = np.linalg.solve(one.model.K, one.condense(tip, load))
            mine = one.model.motion_of("bar", [10**6, 10**6 + 1]) @ q
            dofs = one.recover(q)[body.dof_node, body.dof_direction]
            assert mine == pytest.approx(body.points.motion @ dofs, rel=1e-9)
            assert mine == pytest.approx(full, rel=1e-7) and one.contact_shapes == shapes


def test_bodies_side_by_side(body, bar):
    """The points of each body take its own dofs, behind those of the body before it."""
    one = craig_bampton(body, bar.group("tip"), 2).model
    two = craig_bampton(replace(body, name="other"), bar.group("tip"), 3).model
    model = assemble(one, two)
    for part, start in ((one, 0), (two, one.size)):
        name = part.body[0]
        whole = model.motion_of(name, [10**6 + 1]).toarray()
        assert np.array_equal(
            whole[:, start : start + part.size], part.motion_of(name, [10**6 + 1]).toarray()
        )
        assert not np.delete(whole, np.s_[start : start + part.size], axis=1).any()
