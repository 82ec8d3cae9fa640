"""Slivers are told from regular and from stretched cells."""

from dataclasses import replace

import numpy as np
import pytest

from tests.modal.blocks import CORNERS, block
from tipdamp.modal.cell_shape import FEW, SLIVER, cell_shapes, sliver_warning, slivers
from tipdamp.modal.elements.cells import CELLS

ROOT3 = np.sqrt(3)
REGULAR = {
    "tetra": [(1, 1, 1), (1, -1, -1), (-1, -1, 1), (-1, 1, -1)],
    "hexahedron": CELLS["hexahedron"].reference,
    "wedge": [
        (0, 0, 0),
        (1, 0, 0),
        (0.5, ROOT3 / 2, 0),
        (0, 0, 1),
        (1, 0, 1),
        (0.5, ROOT3 / 2, 1),
    ],
}


def shape_of(kind, corners):
    return cell_shapes(kind, np.array(corners, dtype=float), np.arange(len(corners))[None])[0]


@pytest.mark.parametrize("kind", REGULAR)
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_a_regular_cell_of_any_size_and_place_has_one(kind, size):
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    corners = size * (np.array(REGULAR[kind]) @ turn.T + [3.0, -2.0, 1.0])
    assert shape_of(kind, corners) == pytest.approx(1, abs=1e-7)


@pytest.mark.parametrize("height", [1e-2, 1e-4])
def test_four_corners_near_a_plane_are_a_sliver(height):
    """Two diagonals of a square, one a little above the other: no edge is short. V = h/3."""
    corners = [(0, 0, 0), (1, 1, 0), (0, 1, height), (1, 0, height)]
    by_hand = 6 * np.sqrt(2) * (height / 3) / ((4 * (1 + height**2) + 4) / 6) ** 1.5
    assert abs(shape_of("tetra", corners)) == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("kind", ["hexahedron", "wedge"])
def test_stretched_layers_are_none_and_sheared_ones_are(kind):
    corners = np.array(REGULAR[kind]) * [1, 1, 1e-3]
    assert shape_of(kind, corners) == pytest.approx(1, abs=1e-9)
    sheared = np.array(REGULAR[kind])
    sheared[:, 0] += 1e3 * sheared[:, 2]
    assert 0 < shape_of(kind, sheared) < SLIVER


@pytest.mark.parametrize("kind", CORNERS)
def test_meshes_of_every_kind_are_silent(kind):
    mesh = block(kind, distort=0.3)
    assert slivers(mesh).flat == 0 and slivers(mesh).worst > 0.1
    assert sliver_warning(mesh, 1e-3, "mm") == ""


@pytest.mark.parametrize("share, told", [(0.5 * FEW, False), (2 * FEW, True)])
def test_more_than_a_few_are_told_with_their_place(share, told):
    """Cells whose last corner is pushed almost into the face opposite to it."""
    regular = np.array(REGULAR["tetra"], dtype=float)
    flat = regular.copy()
    flat[3] = flat[:3].mean(axis=0) + 1e-3 * (flat[3] - flat[:3].mean(axis=0))
    total = 1000
    count = round(share * total)
    place = np.vstack([flat + [5.0, 6.0, 7.0]] * count + [regular] * (total - count))
    mesh = block("tetra")
    cells = np.arange(4 * total).reshape(-1, 4)
    mesh = replace(mesh, position=1e-3 * place, cells={"tetra": cells})
    assert slivers(mesh).flat == count
    said = sliver_warning(mesh, 1e-3, "mm")
    assert bool(said) == told
    if told:
        assert f"{count} of {total} cells are slivers (shape below 0.01" in said
        at = flat.mean(axis=0) + [5.0, 6.0, 7.0]
        assert f"({', '.join(f'{x:.3g}' for x in at)}) mm)" in said
