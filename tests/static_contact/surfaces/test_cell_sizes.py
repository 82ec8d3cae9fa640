"""Contact of unlike meshes, a damper finer or coarser than the blades: the reduced bodies beside
the unreduced ones."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from tests import boxes
from tests.modal.blocks import block
from tests.unstructured import box
from tipdamp.hbm.contact import relative_motion
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.faces import boundary_faces
from tipdamp.modal.truncation import error_bound, join, rounding
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies, SparseCompliance
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.surfaces.facets import Surface
from tipdamp.static_contact.surfaces.pairing import Side
from tipdamp.static_contact.surfaces.points import FacingSides, surface_contact

pytest.importorskip("dolfinx")
WIDTH, HEIGHT = 0.02, 0.01
SIDE = replace(Side("top", "low", "high"), blade_body="blades", damper_body="damper")
PER_AREA = 1e13  # N/m3 of the contact


def facing(low, high, unit=1.0, turn=None):
    """A free damper below a blade that is clamped at its top, and the table of their contact: the
    meshes in metres become bodies in lengths of 1/unit m, turned at random."""
    top = high.position[:, 2].max()
    high = replace(
        high,
        position=high.position + [0, 0, HEIGHT],
        node=high.node + 10**5,
        groups={"clamp": high.node[high.position[:, 2] > top - 1e-9] + 10**5},
    )
    faces = [
        [
            b[np.abs(mesh.position[b][:, :, 2] - HEIGHT).max(axis=1) < 1e-9]
            for b in boundary_faces(mesh)
        ]
        for mesh in (low, high)
    ]
    R = Rotation.identity() if turn is None else Rotation.random(random_state=turn)
    low, high = (replace(mesh, position=unit * R.apply(mesh.position)) for mesh in (low, high))
    pairs, on_blade, on_damper = surface_contact(
        [FacingSides(SIDE, Surface(high, faces[1]), Surface(low, faces[0]))],
        axis=R.apply([1, 0, 0]),
        pull=R.apply([0, 0, 1]),
    )
    steel = Material(E=207e9 / unit**2, nu=0.3, density=7850.0 / unit**4)
    bodies = (
        elastic_body(high, steel, "blades", clamp="clamp"),
        elastic_body(low, steel, "damper", free=True),
    )
    k = PER_AREA / unit**3 * pairs.area
    return (
        [
            replace(body, points=points.on(body))
            for body, points in zip(bodies, (on_blade, on_damper), strict=True)
        ],
        pairs.replace(kn=k, kt=0.9 * k, mu=np.full(len(pairs), 0.3)),
        R.apply([0, 0, 1.0]),
    )


def pushed(damper, up):
    """100 N on random nodes of a damper, towards the blade."""
    share = np.random.default_rng(0).uniform(0, 1, len(damper.node)) ** 4
    return 100 * share[damper.dof_node] / share.sum() * up[damper.dof_direction]


def springs(pairs):
    return np.column_stack([pairs.kt, pairs.kt, pairs.kn]).ravel()


def check(bodies, pairs, up, modes=12):
    """Preload with springs and with hard contact, motion and frequencies of the stuck assembly; the
    reductions."""
    parts = [craig_bampton(body, [], modes) for body in bodies]
    whole = SparseBodies.of(bodies)
    model = assemble(*(part.model for part in parts))
    f = pushed(bodies[1], up)
    loads = [
        np.r_[np.zeros(bodies[0].dofs), f],
        np.r_[np.zeros(parts[0].model.size), parts[1].condense_dofs(f)],
    ]
    for table in (pairs, pairs.replace(kn=np.full(len(pairs), np.inf))):
        exact = StaticContact(whole, table, compliance=SparseCompliance).solve(loads[0]).force
        assert StaticContact(model, table).solve(loads[1]).force == pytest.approx(
            exact, rel=0, abs=1e-8 * exact.max()
        )
        assert exact.sum() == pytest.approx(100, rel=1e-8)
    k = springs(pairs)
    B = relative_motion(whole, pairs)
    B_r = relative_motion(model, pairs).toarray()
    stuck = Factor((whole.K + B.T @ sp.diags(k) @ B).tocsr()), model.K + B_r.T * k @ B_r
    motion = [B @ stuck[0].solve(loads[0]), B_r @ np.linalg.solve(stuck[1], loads[1])]
    assert motion[1] == pytest.approx(motion[0], rel=0, abs=1e-9 * np.abs(motion[0]).max())
    exact = stuck[0].lowest_modes(whole.M, 2)[0]
    omega = np.sqrt(sl.eigh(stuck[1], model.M, subset_by_index=(0, 1), eigvals_only=True))
    bound = error_bound(stuck[1], model.M, join(*(part.truncation for part in parts)), omega)
    noise = 1e-9 + 2 * rounding(stuck[1], model.M, exact)
    assert (np.abs(omega - exact) / exact <= np.where(omega < exact, noise, bound + noise)).all()
    assert bound.max() < 0.02
    return parts


@pytest.mark.slow
@pytest.mark.parametrize(
    "damper, blade, unit, turn",
    [
        (("hexahedron20", 8), ("hexahedron20", 1), 1.0, None),
        (("tetra", 8), ("tetra10", 1), 1e3, 1),
        (("wedge", 8), ("hexahedron27", 1), 1.0, 2),
        (("tetra10", 4), ("hexahedron", 1), 1.0, 3),
        (("hexahedron27", 4), ("wedge15", 1), 1e3, None),
        (("tetra", 8), ("hexahedron20", 6), 1.0, 4),
        (("wedge15", 4), ("tetra10", 4), 1.0, None),
        (("hexahedron", 4), ("wedge18", 4), 1e3, 5),
        (("tetra10", 1), ("hexahedron20", 4), 1.0, None),
        (("hexahedron", 1), ("tetra", 4), 1.0, 6),
        (("wedge18", 1), ("hexahedron", 8), 1e3, 7),
        (("hexahedron20", 1), ("wedge", 8), 1.0, 8),
        (("tetra", 1), ("hexahedron27", 8), 1.0, None),
    ],
    ids=str,
)
def test_any_cells_from_eight_to_one_to_one_to_eight(damper, blade, unit, turn):
    low = box(*damper, 1, (WIDTH, WIDTH, HEIGHT), seed=3)
    high = box(*blade, 1, (WIDTH, WIDTH, HEIGHT), seed=5)
    check(*facing(low, high, unit, turn))


@pytest.mark.slow
@pytest.mark.parametrize("thin, unit", [(0.011, 1.0), (0.01, 1e3)])
def test_thin_cells_along_an_edge(thin, unit):
    """Four rows and columns of thin damper faces on a long blade: forces on their points follow
    from one another but for some parts in a million or less. Shapes of all that differ, and no mass
    that rounding makes negative."""
    x = WIDTH * np.r_[0, np.cumsum(np.r_[np.full(4, thin), np.full(8, (1 - 4 * thin) / 8)])]
    low = boxes.block(x, x, np.array([0, HEIGHT]))
    high = block("hexahedron20", (5, 5, 6), size=(WIDTH, WIDTH, 0.4))
    for part in check(*facing(low, high, unit)):
        shapes, inside = part.Phi[:, : part.contact_shapes], part.interior
        assert part.contact_shapes == np.linalg.matrix_rank(
            part.body.points.motion[:, inside].toarray(), tol=1e-12
        )
        mass = shapes.T @ (part.body.M[inside][:, inside] @ shapes)
        assert mass == pytest.approx(np.eye(len(mass)), abs=1e-8)
