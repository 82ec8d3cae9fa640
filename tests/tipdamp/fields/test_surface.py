"""The outside of the bodies: closed, outward, and moving as the reduced model says."""

from dataclasses import replace

import numpy as np
import pytest

from tests.modal.blocks import HEIGHT, LENGTH, WIDTH, block
from tipdamp.fields import surface
from tipdamp.modal.craig_bampton import craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body

KINDS = (
    "tetra",
    "tetra10",
    "hexahedron",
    "hexahedron20",
    "hexahedron27",
    "wedge",
    "wedge15",
    "wedge18",
)


@pytest.mark.parametrize("kind", KINDS)
def test_skin_is_closed_and_outward(kind):
    mesh = block(kind)
    skin = surface.skin(mesh, "bar")
    a, b, c = skin.position[skin.triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a) / 2
    # area and, by the divergence theorem, volume of the box
    area = 2 * (LENGTH * WIDTH + WIDTH * HEIGHT + HEIGHT * LENGTH)
    assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(area, rel=1e-12)
    assert np.einsum("ij,ij->", a, normal) / 3 == pytest.approx(LENGTH * WIDTH * HEIGHT, rel=1e-12)
    edges = np.sort(skin.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert set(skin.node.tolist()) <= set(mesh.node.tolist())
    assert np.array_equal(mesh.position[mesh.index(skin.node)], skin.position)
    lengths = np.linalg.norm(np.diff(skin.position[skin.edges], axis=1), axis=2).sum()
    # the twelve edges of the box alone
    assert lengths == pytest.approx(4 * (LENGTH + WIDTH + HEIGHT), rel=1e-12)


def test_fine_skin_is_thinned():
    mesh = block("hexahedron", (40, 12, 8))
    skin = surface.skin(mesh, "bar", max_nodes=300)
    whole = surface.skin(mesh, "bar")
    assert skin.thinned and not whole.thinned and 150 < len(skin.node) <= 300 < len(whole.node)
    # real nodes, where they are
    assert np.array_equal(mesh.position[mesh.index(skin.node)], skin.position)
    for k, size in enumerate((LENGTH, WIDTH, HEIGHT)):
        assert np.ptp(skin.position[:, k]) > 0.85 * size
    # oblique to the grid of cells
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    oblique = replace(mesh, position=mesh.position @ turn)
    for nodes in range(40, 400, 20):
        assert nodes / 4 < len(surface.skin(oblique, "bar", max_nodes=nodes).node) <= nodes


@pytest.fixture(scope="module")
def bar():
    mesh = block("hexahedron20", (4, 2, 1))
    body = elastic_body(
        mesh,
        Material(207e9, 0.3, 7850),
        "bar",
        clamp="clamp" if "clamp" in mesh.groups else None,
        free="clamp" not in mesh.groups,
    )
    masters = mesh.node[np.abs(mesh.position[:, 0] - LENGTH) < 1e-9]
    return mesh, craig_bampton(body, masters, 4)


def test_skin_moves_as_recovered(bar, tmp_path):
    mesh, reduction = bar
    skin = surface.skin(mesh, "bar", reduction)
    surface.save([skin], tmp_path / "s.npz")
    again = surface.load(tmp_path / "s.npz")["bar"]
    q = np.random.default_rng(0).standard_normal(reduction.model.size)
    full = reduction.recover(q)[mesh.index(again.node)]
    # single precision
    assert np.abs(again.displacement(q) - full).max() < 1e-5 * np.abs(full).max()
