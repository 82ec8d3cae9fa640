"""Contact points: weighted means of dofs that the contact reads beside nodes; matched nodes are
read as ever."""

from dataclasses import fields, replace

import numpy as np
import pytest
import scipy.sparse as sp

from tests.hbm.small_rig import small_rig
from tipdamp.hbm.contact import GROUND, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.matrices_out import write_model
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.points import ContactPoints


def by_the_node(model, pairs):
    """B written entry by entry: the definition u = frame (u_damper - u_blade)."""
    B = np.zeros((3 * len(pairs), model.size))
    for i in range(len(pairs)):
        for body, node, sign in (
            (pairs.damper_body[i], pairs.damper_node[i], 1.0),
            (pairs.blade_body[i], pairs.blade_node[i], -1.0),
        ):
            for k, dof in enumerate(model.dofs(body, node) if body != GROUND else ()):
                if dof >= 0:
                    B[3 * i : 3 * i + 3, dof] += sign * pairs.frame[i, :, k]
    return B


@pytest.fixture
def rig():
    return small_rig()[:2]


@pytest.fixture
def mixed(rig):
    """Two points on the damper and one on the blades: means of two nodes of each body."""
    model, pairs = rig
    rng, points = np.random.default_rng(3), {}
    for body, nodes, count in (
        ("damper", pairs.damper_node, 2),
        ("blade1", pairs.blade_node[pairs.blade_body == "blade1"], 1),
    ):
        share = rng.uniform(0.2, 0.8, count)
        ends = [model.motion_of(body, nodes[k : k + count]) for k in (0, 2)]
        motion = sum(
            sp.diags(np.repeat(s, 3)) @ end for s, end in zip((share, 1 - share), ends, strict=True)
        )
        points[body] = ContactPoints(1000 + np.arange(count), np.zeros((count, 3)), motion)
    return replace(model, points=points)


def test_nodes_are_read_to_the_last_digit(rig):
    """A matched pair is two nodes, be one of them ground: the same matrix as entry by entry, in
    sorted columns."""
    model, pairs = rig
    for table in (
        pairs,
        pairs.replace(blade_body=np.where(pairs.station == 1, GROUND, pairs.blade_body)),
    ):
        B = relative_motion(model, table)
        assert np.array_equal(B.toarray(), by_the_node(model, table)) and B.has_sorted_indices


def test_points_beside_nodes(mixed, rig):
    """Numbers of points and of nodes stand in one column, in any order."""
    model, pairs = rig
    points = mixed.points["damper"]
    motion = mixed.motion_of("damper", [1001, pairs.damper_node[4], 1000, 1001])
    node = model.motion_of("damper", pairs.damper_node[4:5])
    want = sp.vstack([points.motion[3:6], node, points.motion[:3], points.motion[3:6]])
    assert np.array_equal(motion.toarray(), want.toarray())
    number = pairs.damper_node.copy()
    number[2] = 1001
    B = relative_motion(mixed, pairs.replace(damper_node=number)).toarray()
    other = by_the_node(mixed, pairs)
    assert np.array_equal(np.delete(B, slice(6, 9), 0), np.delete(other, slice(6, 9), 0))
    blade = model.motion_of(pairs.blade_body[2], pairs.blade_node[2:3])
    assert np.allclose(B[6:9], pairs.frame[2] @ (points.motion[3:6] - blade).toarray(), atol=1e-15)


def test_points_survive_files_and_cuts(mixed, tmp_path):
    """Saved and read, and cut to one body, a point takes the same dofs."""
    again = ReducedModel.load(mixed.save(tmp_path / "model.npz"))
    for name, points in mixed.points.items():
        assert np.array_equal(again.points[name].motion.toarray(), points.motion.toarray())
        assert np.array_equal(again.points[name].number, points.number)
        assert np.array_equal(again.points[name].position, points.position)
        part = mixed.part(name)
        assert list(part.points) == [name]
        assert np.array_equal(
            part.points[name].motion.toarray(), points.motion[:, mixed.body == name].toarray()
        )


def test_export_keeps_points_or_is_refused(mixed, tmp_path):
    """A file without the motions of the points would read as a model without contact."""
    assert write_model(mixed, tmp_path, "npz") and ReducedModel.load(tmp_path / "model.npz").points
    for kind in ("mat", "mtx"):
        with pytest.raises(
            InputError, match=f"export to '{kind}': the model has 3 contact points.*export to 'npz'"
        ):
            write_model(mixed, tmp_path / kind, kind)
        assert not (tmp_path / kind).exists()


def test_points_that_do_not_fit(mixed):
    """Another number of dofs, a node's number, one number twice: refused with body and number."""
    points = mixed.points["damper"]
    given = {f.name: vars(mixed)[f.name] for f in fields(mixed)}
    for bad, message in (
        (
            ContactPoints(points.number, points.position, points.motion[:, :-1]),
            "a column for each of",
        ),
        (
            ContactPoints([5, 2000], points.position, points.motion),
            "contact point 5 has the number",
        ),
        (ContactPoints(points.number, points.position, np.nan * points.motion), "must be finite"),
    ):
        with pytest.raises(InputError, match=f"body 'damper'.*{message}"):
            ReducedModel.from_matrices(**{**given, "points": {"damper": bad}})
    with pytest.raises(InputError, match="2 different ones"):
        ContactPoints([7, 7], points.position, points.motion)
