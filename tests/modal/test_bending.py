"""A clamped bar of 10 : 2 : 1 under a force at its tip, against Timoshenko's beam: what linear
cells lock."""

import numpy as np
import pytest

from tests.modal.blocks import HEIGHT, LENGTH, WIDTH, block
from tipdamp.checks.plausibility import LOCKING
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material, elastic_body

STEEL = Material(E=207e9, nu=0.3, density=7850.0)
QUADRATIC = {"tetra10": (3, 2), "hexahedron20": (3, 2), "hexahedron27": (2, 1.5), "wedge15": (3, 2)}


def too_stiff(kind, layers):
    """Percent; the cells are cubes."""
    mesh = block(kind, (10 * layers, 2 * layers, layers))
    body = elastic_body(mesh, STEEL, "bar", clamp="clamp")
    force = np.zeros((len(body.node), 3))
    force[mesh.index(mesh.groups["tip"]), 2] = 1 / len(mesh.groups["tip"])
    f = force[body.dof_node, body.dof_direction]
    inertia, shear = WIDTH * HEIGHT**3 / 12, 5 / 6 * STEEL.shear * WIDTH * HEIGHT
    return 100 * (
        (LENGTH**3 / (3 * STEEL.E * inertia) + LENGTH / shear) / (f @ Factor(body.K).solve(f)) - 1
    )


@pytest.mark.parametrize("kind", [*LOCKING, *QUADRATIC])
def test_stiffness_in_bending(kind):
    """With one and two layers: as `inspect` warns of linear cells; quadratic ones a few percent
    (the clamped end)."""
    expected = {**LOCKING, **QUADRATIC}[kind]
    assert [too_stiff(kind, layers) for layers in (1, 2)] == pytest.approx(expected, abs=0.6)
