"""Contact between unlike meshes: uniform pressure passes, forces and moments balance, curves
converge."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp

from tests.modal.blocks import HEIGHT, LENGTH, WIDTH, block
from tipdamp.hbm.contact import relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.faces import boundary_faces, face_rule, triangle_rule
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.static_contact.surfaces import overlap as overlap_module
from tipdamp.static_contact.surfaces import weights as weights_of
from tipdamp.static_contact.surfaces.clip import areas, intersections
from tipdamp.static_contact.surfaces.facets import Surface
from tipdamp.static_contact.surfaces.overlap import overlap
from tipdamp.static_contact.surfaces.pairing import Side
from tipdamp.static_contact.surfaces.pick import FacePick, faces_of, triangle_distance
from tipdamp.static_contact.surfaces.points import FacingSides, surface_contact
from tipdamp.static_contact.surfaces.settings import DEFAULT
from tipdamp.static_contact.surfaces.stations import stations_and_rows

SIDE = Side("top", "low", "high")
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


def faces_at(mesh, z):
    return [
        b[np.abs(mesh.position[b][:, :, 2] - z).max(axis=1) < 1e-9] for b in boundary_faces(mesh)
    ]


def stacked(damper, blade, damper_cells=(5, 3, 1), blade_cells=(7, 4, 1), move=(0.0, 0.0, 0.0)):
    """A damper and a blade on top of it: meshes and faces of the common plane."""
    low, high = block(damper, damper_cells), block(blade, blade_cells)
    high = replace(
        high, position=high.position + [0, 0, HEIGHT] + np.array(move), node=high.node + 5000
    )
    return low, faces_at(low, HEIGHT), high, faces_at(high, HEIGHT + move[2])


def facing(side, blade, blade_faces, damper, damper_faces):
    return FacingSides(side, Surface(blade, blade_faces), Surface(damper, damper_faces))


def pressure_load(mesh, faces):
    """(n,) force of a unit pressure on faces, by quadrature over each face: nothing of the
    overlap."""
    force = np.zeros(len(mesh.node))
    for block_of in (b for b in faces if len(b)):
        shape, slope, weight = face_rule(block_of.shape[1])
        tangent = np.einsum("grk,fkx->fgrx", slope, mesh.position[block_of])
        area = np.linalg.norm(np.cross(tangent[:, :, 0], tangent[:, :, 1]), axis=2)
        np.add.at(force, block_of, np.einsum("fg,gk->fk", area * weight, shape))
    return force


@pytest.mark.parametrize(
    "damper, blade",
    [(d, b) for d, b in product(KINDS, KINDS) if "tetra10" in (d, b) or d == "hexahedron20"],
)
def test_uniform_pressure_passes(damper, blade):
    """p on every point is the consistent load of p on both bodies, on every pair of cells; areas
    are positive."""
    low, its, high, theirs = stacked(damper, blade)
    met = overlap(Surface(low, its), Surface(high, theirs))
    for weights, mesh, faces in ((met.damper, low, its), (met.blade, high, theirs)):
        load = pressure_load(mesh, faces)
        assert weights.T @ met.area == pytest.approx(load, abs=1e-12 * np.abs(load).max())
        assert np.allclose(weights.sum(axis=1), 1, atol=1e-13)
    assert met.area.min() > 0 and met.area.sum() == pytest.approx(LENGTH * WIDTH, rel=1e-12)
    assert (
        met.covered == pytest.approx(1) and not len(met.doubled) and np.abs(met.gap).max() < 1e-15
    )
    assert met.normal == pytest.approx(np.tile([0, 0, 1.0], (len(met.area), 1)))


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron27"])
def test_a_finer_quadrature_changes_nothing(kind, monkeypatch):
    """On plane faces the weights are exact: of the functions of the corners times those of all
    nodes."""
    low, its, high, theirs = stacked(kind, kind)
    usual = overlap(Surface(low, its), Surface(high, theirs))
    monkeypatch.setattr(overlap_module, "triangle_rule", lambda n: triangle_rule(n + 2))
    finer = overlap(Surface(low, its), Surface(high, theirs))
    for name in ("damper", "blade"):
        assert abs(getattr(usual, name) - getattr(finer, name)).max() < 1e-13


@pytest.mark.parametrize("strip", [0.1, 1e-2, 1e-3, 1e-5])
def test_a_strip_of_a_face_counts(strip):
    """The blade covers whole rows of the damper's faces and a strip of the next: its area and load
    are there, and no point moves by more than its nodes do."""
    low, its, high, theirs = stacked(
        "hexahedron20", "hexahedron27", (5, 3, 1), (1, 1, 1), ((0.4 - 0.2 * strip) * LENGTH, 0, 0)
    )
    met = overlap(Surface(low, its), Surface(high, theirs))
    assert met.area.sum() == pytest.approx((0.6 + 0.2 * strip) * LENGTH * WIDTH, rel=1e-12, abs=0)
    force = [(weights.T @ met.area) for weights in (met.damper, met.blade)]
    moment = [f @ mesh.position for f, mesh in zip(force, (low, high), strict=True)]
    assert moment[0] == pytest.approx(moment[1], rel=1e-12, abs=0)
    assert abs(met.damper).max() < 1 and abs(met.blade).max() < 1


def test_graded_faces_across_a_wide_gap():
    """Faces of many sizes on both sides, and between them nine tenths of the widest gap, several
    small faces wide."""
    gap = 0.9 * DEFAULT.reach * LENGTH
    low, its, high, theirs = stacked("hexahedron", "tetra10", (20, 3, 1), (13, 5, 1), (0, 0, gap))
    low, high = (
        replace(
            mesh,
            position=np.column_stack([mesh.position[:, 0] ** 2 / LENGTH, mesh.position[:, 1:]]),
        )
        for mesh in (low, high)
    )
    met = overlap(Surface(low, its), Surface(high, theirs))
    assert met.area.sum() == pytest.approx(LENGTH * WIDTH, rel=1e-12) and met.gap == pytest.approx(
        gap
    )


def bodies_of(low, high):
    """Bodies of which the dof table alone counts."""
    found = []
    for name, mesh in (("damper", low), ("blades", high)):
        n = len(mesh.node)
        none = sp.csr_matrix((3 * n, 3 * n))
        dofs = np.repeat(np.arange(n), 3), np.tile(np.arange(3), n)
        found.append(Body(name, mesh.node, mesh.position, *dofs, none, none))
    return found


@pytest.mark.parametrize(
    "move", [(0.0, 0.0, 0.0), (0.31 * LENGTH, 0.27 * WIDTH, 0.0), (0.6 * LENGTH, -0.7 * WIDTH, 0.0)]
)
def test_any_forces_are_in_balance(move):
    """Random forces at the points: their sum and their moment about any axis vanish over both
    bodies together."""
    low, its, high, theirs = stacked("tetra10", "hexahedron20", move=move)
    side = replace(SIDE, blade_body="blades", damper_body="damper")
    pairs, on_blade, on_damper = surface_contact(
        [facing(side, high, theirs, low, its)], axis=(1, 0, 0), pull=(0, 0, 1)
    )
    bodies = bodies_of(low, high)
    points = [
        replace(body, points=one.on(body))
        for body, one in zip(bodies, (on_damper, on_blade), strict=True)
    ]
    order = np.argsort(pairs.blade_node)
    assert pairs.position[order] == pytest.approx(on_damper.position, abs=1e-15)
    force = np.random.default_rng(0).standard_normal(3 * len(pairs))
    load = (relative_motion(AssembledBodies(points), pairs).T @ force).reshape(-1, 3)
    place = np.vstack([low.position, high.position])
    assert np.abs(load[: len(low.node)].sum(axis=0)).max() > 0.1
    assert (
        np.abs(load.sum(axis=0)).max() < 1e-12
        and np.abs(np.cross(place, load).sum(axis=0)).max() < 1e-13
    )
    assert pairs.area.sum() == pytest.approx(
        (LENGTH - abs(move[0])) * (WIDTH - abs(move[1])), rel=1e-12
    )


def bent(mesh, radius):
    """The block around the y axis: its plane z = HEIGHT becomes a cylinder of that radius."""
    x, y, z = mesh.position.T
    angle, r = (x - LENGTH / 2) / radius, radius + z - HEIGHT
    return replace(mesh, position=np.column_stack([r * np.sin(angle), y, r * np.cos(angle)]))


def curved(n, kinds=("tetra10", "hexahedron20")):
    low, its, high, theirs = stacked(*kinds, (2 * n, 2 * n // 3, 1), (3 * n - 1, n, 1))
    return bent(low, 0.08), its, bent(high, 0.08), theirs


@pytest.mark.slow
@pytest.mark.parametrize("kinds", [("tetra10", "hexahedron20"), ("hexahedron20", "tetra10")])
def test_curved_surfaces_converge(kinds):
    """Cylindrical sides: normals and gaps are exact; with the face size the error of the area falls
    with the fourth power, that of the work of a uniform pressure on smooth motions of the blade
    with the third, that of its single nodal loads with the first."""
    errors = []
    for n in (6, 12):
        low, its, high, theirs = curved(n, kinds)
        met = overlap(Surface(low, its), Surface(high, theirs))
        place = met.damper @ low.position * [1, 0, 1]
        assert met.normal == pytest.approx(
            place / np.linalg.norm(place, axis=1)[:, None], abs=1e-12
        )
        motion = np.cos(30 * high.position)[:, [1, 2, 0]]
        force = met.blade.T @ (met.area[:, None] * met.normal)
        exact = np.zeros_like(force)
        for faces in (f for f in theirs if len(f)):
            shape, slope, weight = face_rule(faces.shape[1])
            tangent = np.einsum("grk,fkx->fgrx", slope, high.position[faces])
            inward = -np.cross(tangent[:, :, 0], tangent[:, :, 1])
            np.add.at(exact, faces, np.einsum("fgx,g,gk->fkx", inward, weight, shape))
        off = force - exact
        errors.append(
            [
                abs(met.area.sum() / (LENGTH * WIDTH) - 1),
                abs((off * motion).sum() / (exact * motion).sum()),
                np.abs(off).sum() / np.abs(exact).sum(),
            ]
        )
        assert np.abs(met.gap).max() < 1e-14
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (rates[-1] > [3.8, 2.8, 0.9]).all() and (errors[-1] < np.array([1e-8, 1e-5, 1e-2])).all()


def test_clipped_triangles():
    """Random triangles: the area of the intersection by counting points; identical, disjoint, one
    inside the other."""
    rng = np.random.default_rng(2)
    one, other = rng.uniform(0, 1, (2, 60, 3, 2))
    one, other = (np.where(areas(t)[:, None, None] < 0, t[:, ::-1], t) for t in (one, other))
    piece, pair = intersections(one, other)
    found = np.bincount(pair, areas(piece), minlength=60)
    assert areas(piece).min() > -1e-15
    x = (np.arange(300) + 0.5) / 300
    grid = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)

    def inside(triangle):
        edge = np.roll(triangle, -1, axis=0) - triangle
        arm = grid[:, None] - triangle
        return (edge[:, 0] * arm[:, :, 1] - edge[:, 1] * arm[:, :, 0] >= 0).all(axis=1)

    counted = [(inside(a) & inside(b)).mean() for a, b in zip(one, other, strict=True)]
    assert found == pytest.approx(counted, abs=2e-3) and (found > 0.005).sum() > 10
    for a, b, area in (
        (one, one, areas(one)),
        (one, one + 5, np.zeros(60)),
        (0.1 * one + 0.45, one * 0 + [[0, 0], [3, 0], [0, 3]], 0.01 * areas(one)),
    ):
        piece, pair = intersections(a, b)
        assert np.bincount(pair, areas(piece), minlength=60) == pytest.approx(
            area, rel=1e-12, abs=1e-15
        )


def test_distance_of_triangles():
    """Against the least over a fine net of the triangle."""
    rng = np.random.default_rng(4)
    corner, point = rng.standard_normal((20, 3, 3)), rng.standard_normal((20, 3))
    s, t = (g.ravel() for g in np.meshgrid(np.linspace(0, 1, 400), np.linspace(0, 1, 400)))
    net = np.column_stack([1 - s, s * (1 - t), s * t])
    for c, p, d in zip(corner, point, triangle_distance(corner, point), strict=True):
        assert np.linalg.norm(net @ c - p, axis=1).min() == pytest.approx(d, abs=2e-2) and d > 0


def test_faces_picked_by_geometry():
    """Plane, box, cylinder, distance of the other body and a group find the same top face."""
    low, its, high, theirs = stacked("tetra10", "hexahedron20")
    count = sum(map(len, its))
    for pick in (
        FacePick(plane=(0, 0, 2.0), point=(1, 1, HEIGHT)),
        FacePick(within=1e-4),
        FacePick(box=((0, 0, 0.9 * HEIGHT), (1, 1, 1))),
    ):
        assert sum(map(len, pick.faces(low, high))) == count
    round_low, _, round_high, _ = curved(3)
    found = FacePick(cylinder=(0, 1, 0), point=(0, 7, 0), radius=0.08).faces(round_low, round_high)
    assert sum(map(len, found)) == sum(
        map(len, faces_at(stacked("tetra10", "hexahedron20", (6, 2, 1))[0], HEIGHT))
    )
    assert not sum(map(len, FacePick(plane=(0, 0, 1.0), point=(0, 0, 2 * HEIGHT)).faces(low, high)))
    top = np.unique(np.concatenate([f.ravel() for f in its]))
    corners = np.unique(np.concatenate([f[:, :3].ravel() for f in its]))
    for nodes in (top, corners):
        assert (
            sum(map(len, faces_of(replace(low, groups={"top": low.node[nodes]}), "top"))) == count
        )


@pytest.mark.parametrize(
    "damper_cells, blade_cells",
    [((5, 3, 1), (2, 2, 1)), ((2, 2, 1), (7, 5, 1)), ((9, 7, 1), (1, 1, 1))],
)
def test_faces_near_the_other_body_reach_beyond_its_rim(damper_cells, blade_cells):
    """Moved along, most of the blade's faces at the rim is off the damper, and their centres with
    it."""
    low, its, high, theirs = stacked(
        "hexahedron", "tetra10", damper_cells, blade_cells, (0.4 * LENGTH, 0.4 * WIDTH, 0)
    )
    near = FacePick(within=1e-3 * HEIGHT).faces(high, low)
    assert sum(map(len, near)) <= sum(map(len, theirs))
    found, whole = (
        overlap(Surface(low, its), Surface(high, faces)).covered for faces in (near, theirs)
    )
    assert found == pytest.approx(whole, rel=1e-12) and whole == pytest.approx(0.36, rel=1e-9)


def test_a_large_face_near_a_small_body():
    """It is picked, wherever on it the small body lies."""
    low, _, high, theirs = stacked("hexahedron", "hexahedron20", (1, 1, 1), (1, 1, 1))
    low = replace(
        low, position=low.position * [0.05, 0.05, 1] + np.array([0.2 * LENGTH, 0.58 * WIDTH, 0])
    )
    [found] = [block for block in FacePick(within=1e-3 * HEIGHT).faces(high, low) if len(block)]
    assert np.array_equal(np.sort(found), np.sort(np.concatenate(theirs)))


@pytest.mark.parametrize("edge", range(3))
def test_a_face_that_reaches_over_the_middle_of_an_edge_is_near(edge):
    """A narrow one: neither its own centre nor a corner lies over the other."""
    high = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0], [0.5, 0.3, 1.0]])
    middle = (high[edge] + high[(edge + 1) % 3]) / 2
    inwards = high[:3].mean(axis=0) - middle
    across = 0.2 * np.array([-inwards[1], inwards[0], 0])
    tip, base = middle + 0.5 * inwards, middle - 4 * inwards
    low = np.array([tip, base - across, base + across, base - [0, 0, 1.0]]) - [0, 0, 1e-6]
    cells = {"tetra": np.array([[0, 1, 2, 3]])}
    one, other = (Mesh(np.arange(1, 5), place, cells) for place in (high, low))
    [found] = [block for block in FacePick(within=1e-4).faces(one, other) if len(block)]
    assert np.sort(found).tolist() == [[0, 1, 2]]


def test_stations_of_rows_and_of_none():
    """Vertices in lines keep their lines; others fall into intervals as wide as the faces, counted
    without a gap."""
    grid = np.array([[i, j, 0.0] for i in range(5) for j in range(3)])
    jitter = 0.02 * np.random.default_rng(0).standard_normal(grid.shape)
    [(station, row)] = stations_and_rows(
        [grid + jitter], [1.0], np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    )
    assert np.array_equal(station, grid[:, 0]) and np.array_equal(row, grid[:, 1])
    cloud = np.random.default_rng(1).uniform(0, 1, (200, 3)) * [10, 2, 0]
    both = stations_and_rows(
        [cloud, cloud + [0, 0, 1]], [0.5, 0.5], np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    )
    for station, row in both:
        assert (
            np.array_equal(np.unique(station), np.arange(20))
            and len(np.unique(station * 1000 + row)) == 200
        )
        assert all(np.ptp(cloud[station == s, 0]) <= 0.5 for s in range(20))


def test_rows_are_the_same_heights_in_all_stations():
    """The points of a flank that leans, those of a hexahedron's corners moved about, the lowest of
    station 0 left out: its others keep their rows; a point beside another of its interval goes one
    up."""
    place = np.array([[i, j, 0.0] for i in range(6) for j in range(4)])
    place = place + np.random.default_rng(2).uniform(-0.3, 0.3, place.shape) * [1, 1, 0]
    place[::4, 1], place[3::4, 1] = 0, 3  # the edges
    lean = np.array([[1.0, 0, 0], [0, 0.5, np.sqrt(0.75)], [0, np.sqrt(0.75), -0.5]])
    whole = place @ lean
    for kept in (np.arange(24), np.arange(1, 24)):
        [(station, row)] = stations_and_rows(
            [whole[kept]], [1.001], np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
        )
        assert len(np.unique(station * 100 + row)) == len(kept)
        lowest = np.array([place[kept, 1][station == s].min() for s in range(station.max() + 1)])
        assert np.array_equal(np.unique(station[row == 0]), np.flatnonzero(lowest < 0.5))
        assert (row >= np.rint(place[kept, 1])).all() and place[kept, 1][row == 0].max() < 0.5


def test_triangles_with_a_common_edge():
    """Of the platform wedge, cells cut into eight twice: their edges lie on one line but for the
    last digit, which the clipped polygon crosses four times."""
    one = np.array(
        [
            [-0.0011547005383792518, 0.0011250000000000008],
            [-0.0011547005383792518, -0.003374999999999999],
            [0.0034641016151377535, -0.003374999999999999],
        ]
    )
    other = np.array(
        [[0, 0], [-0.0011547005383792518, 0.0011250000000000008], [-0.00115470053837925, 0]]
    )
    piece, _ = intersections(one[None], other[None])
    assert areas(piece).sum() == pytest.approx(areas(other[None])[0], rel=1e-12)


def test_bad_surfaces():
    """Each in one line with the sets, the count, the distance in the unit of the study, and what to
    do."""

    def refused(
        match,
        move=(0.0, 0.0, 0.0),
        turn=None,
        scale=1.0,
        faces=None,
        damper_at=(0.0, 0.0, 0.0),
        **settings,
    ):
        low, its, high, theirs = stacked("tetra10", "hexahedron20", move=move)
        position = (
            high.position
            if turn is None
            else (high.position - [0, 0, HEIGHT]) @ turn.T + [0, 0, HEIGHT]
        )
        high = replace(high, position=position)
        low = replace(low, position=scale * low.position + np.array(damper_at))
        with pytest.raises(InputError, match=match) as caught:
            surface_contact(
                [facing(SIDE, high, theirs if faces is None else faces(high), low, its)],
                axis=(1, 0, 0),
                pull=(0, 0, 1),
                shown=lambda m: f"{1e3 * m:.3g} mm",
                **settings,
            )
        assert "\n" not in str(caught.value) and "side 'top': 30 damper faces of 'high' and" in str(
            caught.value
        )

    refused("do not touch: their centres are 20.* mm apart.*gaps up to 10 mm", move=(0.3, 0, 0))
    # an inch in mm would lie there
    refused(r"do not touch: their centres are 1.* mm apart", damper_at=(0.2, 0, 0))
    refused(
        r"lie opposite to each other with a gap of 20 mm or more; up to 10 mm \(a tenth of the "
        r"damper\) counts",
        move=(0, 0, 0.02),
    )
    refused("penetrate each other by 20 mm or more; up to 10 mm", move=(0, 0, -0.02))
    refused("do not overlap: .* lie beside each other", move=(1.02 * LENGTH, 0, 0))
    refused(
        "do not face each other: their normals are 90 degrees off",
        faces=lambda mesh: [
            b[mesh.position[b][:, :, 0].max(axis=1) < 1e-9] for b in boundary_faces(mesh)
        ],
    )
    c, s = np.cos(np.radians(25)), np.sin(np.radians(25))
    refused("are 25 degrees off being parallel", turn=np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))
    refused(
        r"penetrate by more than 0.1 of a face's size around 24 of 24 points, most by 3 mm at .* "
        r"\"closed\"",
        move=(0, 0, -0.003),
    )
    refused(
        "the damper is 1e.05 mm in size, the blades 100 mm; 0.001 times its .*different units",
        scale=1e3,
    )
    refused(
        "the damper is 0.1 mm in size, the blades 100 mm; 1000 times its .*different units",
        scale=1e-3,
    )
    refused(
        "the damper is 3.94 mm in size, the blades 100 mm; 25.4 times its .*different units",
        scale=1 / 25.4,
    )
    refused(
        "the damper is 3.94e.03 mm in size, the blades 100 mm; 0.0254 times its .*units",
        scale=1 / 0.0254,
    )
    refused(
        "the damper is 2.54e.03 mm in size, the blades 100 mm; 0.03937 times its .*different units",
        scale=25.4,
    )
    low, its, high, theirs = stacked("tetra10", "hexahedron20", move=(0, 0, -0.003))
    closed, *_ = surface_contact(
        [facing(SIDE, high, theirs, low, its)], axis=(1, 0, 0), pull=(0, 0, 1), closed=True
    )
    assert not closed.gap.any()
    lip = replace(high, position=high.position + [0, 0, 0.007])
    twice = replace(
        high,
        node=np.concatenate([high.node, high.node + 9000]),
        position=np.vstack([high.position + [0, 0, 0.004], lip.position]),
    )
    both = [np.concatenate([f, f + len(high.node)]) for f in theirs]
    with pytest.raises(
        InputError, match="two layers of blade faces at 30 places, at .* 0.001 m and 0.004 m away"
    ):
        surface_contact([facing(SIDE, twice, both, low, its)], axis=(1, 0, 0), pull=(0, 0, 1))


def test_second_moments_of_the_points(monkeypatch):
    """A bed of springs under a flat resists rolling by int x^2 dA: the points, halfway between the
    centres of their areas and their corners, have it to the third power of the face size, where
    either alone has it to the second."""
    usual = DEFAULT.shift
    errors: dict[float, list] = {0.0: [], usual: [], 1.0: []}
    for shift, found in errors.items():
        monkeypatch.setattr(weights_of, "DEFAULT", replace(DEFAULT, shift=shift))
        for n in (2, 4, 8):
            low, its, high, theirs = stacked("tetra10", "hexahedron20", (2 * n, n, 1))
            met = overlap(Surface(low, its), Surface(high, theirs))
            x = (met.blade @ high.position)[:, 1] - WIDTH / 2
            found.append(met.area @ x**2 / (WIDTH**3 * LENGTH / 12) - 1)
    rates = {shift: np.log2(np.abs(found[1]) / np.abs(found[2])) for shift, found in errors.items()}
    assert rates[usual] > 2.8 and abs(errors[usual][-1]) < 2e-3 and abs(errors[usual][0]) < 0.05
    assert all(1.5 < rates[shift] < 2.5 and abs(errors[shift][-1]) > 0.02 for shift in (0.0, 1.0))
