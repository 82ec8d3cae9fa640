"""A pin in two round flanks that end inside of its faces: sides and pressures on the axis, no
equilibrium off it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from tests.modal.blocks import block
from tests.static_contact.surfaces.test_contact_points import faces_at
from tipdamp.hbm.errors import InputError
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.faces import face_corners, face_places, face_shapes
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies, SparseCompliance
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.surfaces.facets import Surface
from tipdamp.static_contact.surfaces.normals import smooth_normals
from tipdamp.static_contact.surfaces.pairing import Side, pair
from tipdamp.static_contact.surfaces.pick import faces_of
from tipdamp.static_contact.surfaces.points import FacingSides, surface_contact

pytest.importorskip("dolfinx")

RADIUS, LENGTH, PULL, SOFT = 4e-3, 6e-3, 40.0, 1e10  # m, m, N, N/m3: the bodies are rigid beside it


def shell(kind, cells, inner, outer, angles, first=1):
    """A part of a ring around z between two angles (degrees from x) and radii; groups "inner" and
    "outer"."""
    flat = block(kind, cells, size=(1.0, 1.0, 1.0))
    turn, r, z = flat.position.T
    angle = np.radians(angles[0] + (angles[1] - angles[0]) * (1 - turn))
    radius = inner + (outer - inner) * r
    place = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), LENGTH * z])
    groups = {"inner": np.abs(r) < 1e-9, "outer": np.abs(r - 1) < 1e-9}
    return replace(
        flat,
        node=first + np.arange(len(flat.node)),
        position=place,
        groups={name: first + np.flatnonzero(there) for name, there in groups.items()},
    )


def together(one, other):
    """Two meshes as one, with groups (name, 0) and (name, 1)."""
    n = len(one.node)
    return Mesh(
        np.r_[one.node, other.node],
        np.vstack([one.position, other.position]),
        {kind: np.vstack([cells, other.cells[kind] + n]) for kind, cells in one.cells.items()},
        {
            f"{name}{i}": nodes
            for i, m in enumerate((one, other))
            for name, nodes in m.groups.items()
        }
        | {"clamp": np.r_[one.groups["outer"], other.groups["outer"]]},
        source="flanks",
    )


def sides_of(pin, blades):
    """Both flanks of blades, groups "inner0" and "inner1", against the outer face of a pin."""
    return [
        FacingSides(
            Side(name, f"inner{i}", "outer"),
            Surface(blades, faces_of(blades, f"inner{i}")),
            Surface(pin, faces_of(pin, "outer")),
        )
        for i, name in enumerate(("right", "left"))
    ]


def elastic_bodies(pin, blades, material, points):
    """Clamped blades and a free pin, with contact points on blades and pin."""
    bodies = [
        elastic_body(blades, material, "blades", clamp="clamp"),
        elastic_body(pin, material, "damper", free=True),
    ]
    return SparseBodies.of(
        [replace(body, points=one.on(body)) for body, one in zip(bodies, points, strict=True)]
    )


@cache
def case(kinds, flank, clearance=0.0, unit=1.0, turn=(0.3, -0.5, 0.9), across=11):
    """(problem, table, places of its points in the axes of the pin in m): a half-pin of 10 to 170
    degrees between two flanks from flank[0] to flank[1] degrees and mirrored; unit : lengths in a
    metre."""
    R = Rotation.from_rotvec(turn).as_matrix()
    pin = shell(kinds[0], (across, 2, 3), 0.4 * RADIUS, RADIUS, (10, 170))
    blades = together(
        *(
            shell(kinds[1], (5, 1, 4), RADIUS + clearance, 1.6 * RADIUS, angles, first)
            for angles, first in ((flank, 10_000), ((180 - flank[1], 180 - flank[0]), 20_000))
        )
    )
    pin, blades = (replace(m, position=unit * m.position @ R.T) for m in (pin, blades))
    pairs, on_blades, on_pin = surface_contact(sides_of(pin, blades), axis=R[:, 2], pull=R[:, 1])
    steel = Material(E=205e9 / unit**2, nu=0.29, density=7800 / unit**4)
    whole = elastic_bodies(pin, blades, steel, (on_blades, on_pin))
    springs = SOFT / unit**3 * pairs.area
    problem = StaticContact(
        whole, pairs.replace(kn=springs, kt=springs), compliance=SparseCompliance
    )
    return problem, R, unit


def pull(problem, R, unit, off=0.0):
    """(r,) N: the pull along y through x = off m, at half the length."""
    model = problem.model
    mine = np.flatnonzero((model.body == "damper") & model.moves)
    place = model.position[mine] @ R / unit - [0, 0, LENGTH / 2]
    share = np.linalg.lstsq(
        np.column_stack([np.ones(len(mine)), place]).T, [1, off, 0, 0], rcond=None
    )[0]
    load = np.zeros(model.size)
    along = R[["xyz".index(d) for d in model.direction[mine]], 1]
    load[mine] = 3 * PULL * share * along
    return load


def rigid(flank, clearance):
    """(N of each side, motion d in m) of a rigid pin, p = SOFT (d sin(angle) - clearance) where
    positive."""
    low, high = np.radians(flank)
    angle = low + (high - low) * (np.arange(20_000) + 0.5) / 20_000
    piece = RADIUS * LENGTH * (high - low) / 20_000

    def force(d):
        return SOFT * np.maximum(d * np.sin(angle) - clearance, 0) * piece

    d = brentq(
        lambda d: 2 * force(d) @ np.sin(angle) - PULL, clearance, clearance + 1e-2, xtol=1e-15
    )
    return force(d).sum(), d


@pytest.mark.slow
@pytest.mark.parametrize("flank", [(17, 83), (17, 90)], ids=["nose partly covered", "nose covered"])
@pytest.mark.parametrize(
    "kinds, clearance, unit",
    [
        (("hexahedron", "hexahedron"), 0.0, 1.0),
        (("tetra", "hexahedron"), 0.0, 1e3),
        (("tetra10", "tetra10"), 0.0, 1.0),
        (("hexahedron20", "tetra10"), 0.0, 1e3),
        (("hexahedron27", "hexahedron20"), 1e-5, 1.0),
        (("tetra10", "hexahedron20"), 1e-5, 1e3),
        (("tetra", "hexahedron"), 1e-5, 1.0),
    ],
)
def test_a_pin_in_two_flanks(kinds, clearance, unit, flank):
    """On its axis sides are those of a rigid pin to 1e-3, and pressures to a hundredth of the
    largest, at the edges too; pulled 0.4 mm off it no normal resists the roll, and there is no
    equilibrium."""
    problem, R, _ = made = case(kinds, flank, clearance, unit)
    found, (side, d) = problem.solve(pull(*made)), rigid(flank, clearance)
    pairs = problem.pairs
    for name in ("right", "left"):
        assert found.force[pairs.side == name].sum() == pytest.approx(side, rel=1e-3)
    place = pairs.position @ R
    sine = place[:, 1] / np.hypot(place[:, 0], place[:, 1])
    right = np.maximum(d * sine - clearance, 0)
    assert found.force / pairs.area * unit**2 / SOFT == pytest.approx(right, abs=0.01 * right.max())
    with pytest.raises(InputError, match="roll about . is loaded: .*, and no contact resists it"):
        problem.solve(pull(*made, off=4e-4))


def from_corners(place):
    """(f, k, 3): the nodes where those of straight faces with the same corners lie."""
    k = place.shape[1]
    corners = face_corners(k)
    return np.einsum("kc,fcx->fkx", face_shapes(corners, face_places(k))[0], place[:, :corners])


def cylinder(kind):
    """Faces of an irregular quarter of a cylinder of radius 1 around z, and their nodes' places."""
    mesh = block(kind, (5, 6, 1), size=(1.0, 1.0, 1.0))
    x, y, z = mesh.position.T
    angle = 1.5 * (x + 0.25 * x * (1 - x) * np.sin(7 * y))
    place = np.column_stack([(1 + z) * np.cos(angle), (1 + z) * np.sin(angle), 1.3 * y**1.4])
    return [(b, place[b]) for b in faces_at(mesh, 0.0)]


@pytest.mark.parametrize("kind", ["hexahedron", "tetra", "hexahedron20", "tetra10", "wedge18"])
@pytest.mark.parametrize("straight", [False, True])
def test_normals_of_a_cylinder(kind, straight):
    """Exact at every node, at the rim too, where faces differ in size; nodes in the middle of
    straight edges lie on the chord, and their normals have the length that they have."""
    faces = cylinder(kind)
    if straight:
        faces = [(f, from_corners(place)) for f, place in faces]
    for (_, place), normal in zip(faces, smooth_normals(faces), strict=True):
        assert -normal == pytest.approx(place * [1, 1, 0], abs=1e-9)


def test_normals_end_at_creases():
    """Two flats that meet at 45 degrees and a cube's corner keep the normals of each; at 20 degrees
    they are smooth."""
    for degrees, sharp in ((45, True), (90, True), (20, False)):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        place = np.array(
            [[x, y, 0.0] for x in range(-2, 1) for y in range(3)]
            + [[x * c, y, -x * s] for x in (1, 2) for y in range(3)]
        )
        quads = np.array(
            [
                [3 * i + j, 3 * i + 3 + j, 3 * i + 4 + j, 3 * i + 1 + j]
                for i in range(4)
                for j in range(2)
            ]
        )
        [normal] = smooth_normals([(quads, place[quads])])
        flat = np.repeat([[0, 0, 1.0], [s, 0, c]], [4, 4], axis=0)
        assert (np.abs(normal - flat[:, None]).max() < 1e-14) == sharp


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hexahedron", "tetra", "hexahedron20"])
def test_matching_nodes_of_a_round_side(kind):
    """Nodes of the pin and of its flank that lie at one place: their normals pass through the
    axis."""
    pin, flank = (
        shell(kind, (5, 1, 3), *radii, (20, 85), first)
        for radii, first in (((0.4 * RADIUS, RADIUS), 1), ((RADIUS, 1.6 * RADIUS), 10_000))
    )
    pairs = pair(
        flank, pin, Side("right", "inner", "outer"), axis=(0, 0, 1), pull=(0, 1, 0), tolerance=1e-6
    )
    radial = pairs.position * [1, 1, 0]
    assert pairs.normal == pytest.approx(radial / np.linalg.norm(radial, axis=1)[:, None], abs=1e-9)
