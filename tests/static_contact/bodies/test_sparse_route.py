"""The unreduced bodies by sparse factors against their dense matrices: the same answers, and the
same refusals."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from tests.contact_tables import contact_table, frames
from tests.modal.blocks import HEIGHT, block
from tipdamp.hbm.contact import GROUND, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.spring import Hold, held_motions
from tipdamp.hbm.laws.friction import each_limited, resultant_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.points import ContactPoints
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.static_contact.bodies.compliance import Compliance
from tipdamp.static_contact.bodies.iterative_bodies import (
    IterationSettings,
    IterativeBodies,
    bodies_on_springs,
    gmres,
)
from tipdamp.static_contact.bodies.sparse_bodies import (
    SparseBodies,
    SparseCompliance,
    sparse_stuck_bodies,
)
from tipdamp.static_contact.bodies.stuck_bodies import StuckBodies, stuck_bodies
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact, FrictionSettings
from tipdamp.static_contact.contact.preload import StaticContact

pytest.importorskip("dolfinx")
ROUTES = (Compliance, SparseCompliance)
HARD, SOFT = {"kn": np.inf}, {"kn": 1e7}
# of the motion: forces of hard contact agree to 1e-9 of the largest
CLOSE = FrictionSettings(tolerance=1e-12)


def plates(kind="hexahedron", unit=1.0, points=0):
    """A clamped plate, a free one on it, and their pairs: nodes that face each other, or `points`
    means of such nodes;
    unit : lengths in a metre (1e3: mm, N, t)."""
    steel = Material(E=207e9 / unit**2, nu=0.3, density=7850.0 / unit**4)
    meshes = (block(kind), block(kind))
    low = replace(meshes[0], position=unit * (meshes[0].position - [0, 0, HEIGHT]))
    low = replace(low, groups={"clamp": low.node[low.position[:, 2] < -0.999 * unit * HEIGHT]})
    high = replace(meshes[1], position=unit * meshes[1].position, node=meshes[1].node + 5000)
    bodies = [
        elastic_body(low, steel, "blade", clamp="clamp"),
        elastic_body(high, steel, "damper", free=True),
    ]
    faces = [one.node[np.abs(one.position[:, 2]) < 1e-9 * unit] for one in (low, high)]
    if points:
        bodies = [
            replace(body, points=means(body, face, points))
            for body, face in zip(bodies, faces, strict=True)
        ]
        faces = [body.points.number for body in bodies]
    P = len(faces[0])
    table = contact_table(
        frames(np.tile([0, 0, -1.0], (P, 1))),
        blade_body="blade",
        blade_node=faces[0],
        mu=0.3,
        damper_node=faces[1],
        kn=1e7 / unit,
        kt=1e7 / unit,
        gap=2e-7 * unit * np.random.default_rng(0).uniform(0, 1, P),
    )
    return bodies, table


def means(body, nodes, count):
    """Contact points that are weighted means of some of the nodes."""
    W = sp.random(count, len(nodes), 0.2, random_state=1) + sp.eye(count, len(nodes))
    W = sp.csr_matrix(W / W.sum(axis=1))
    return ContactPoints(
        90000 + np.arange(count),
        W @ body.position[np.searchsorted(body.node, nodes)],
        sp.kron(W, sp.eye(3)) @ body.motion_of(body.name, nodes),
    )


def dense(whole):
    """The same as a ReducedModel."""
    first = dict(
        zip(
            (one.name for one in whole.bodies),
            np.cumsum([0, *(b.dofs for b in whole.bodies)]),
            strict=False,
        )
    )
    return ReducedModel.from_matrices(
        whole.M,
        whole.K,
        body=whole.body,
        node=whole.node,
        direction=whole.direction,
        position=whole.position,
        rigid=whole.rigid,
        points={
            one.name: one.points.among(first[one.name], whole.size)
            for one in whole.bodies
            if one.points is not None
        },
    )


def force(model, x=0.0, y=0.0, z=-100.0, body="damper"):
    """(r,) spread over the upper nodes of a body."""
    mine, height = model.body == body, model.position[:, 2]
    mine &= height > height[mine].max() - 1e-9 * np.ptp(height)
    return sum(
        amount * (one := mine & (model.direction == d)) / one.sum()
        for d, amount in zip("xyz", (x, y, z), strict=True)
    )


def solved(bodies, table, holds=(), gap=None, **load):
    """Of both routes."""
    whole, found = SparseBodies.of(bodies), []
    for model, kind in zip((dense(whole), whole), ROUTES, strict=True):
        held = held_motions(model, table, list(holds))
        contact = StaticContact(model, table, held=held, compliance=kind)
        found.append(contact.solve(force(model, **load), gap=gap))
        assert found[-1].residual < 1e-11 and (
            found[-1].balance is None or found[-1].balance < 1e-12
        )
        assert contact.forces(force(model, **load), gap=gap).force == pytest.approx(
            found[-1].force, abs=1e-10
        )
    return found


def agree(one, other):
    """Forces, openings, displacements along motions that nothing resists too, and what holds
    take."""
    assert other.pairs.preload == pytest.approx(
        one.pairs.preload, abs=1e-10 * np.abs(one.pairs.preload).max()
    )
    assert (other.opening > 0).tolist() == (one.opening > 0).tolist()
    assert other.displacement == pytest.approx(
        one.displacement, abs=1e-9 * np.abs(one.displacement).max()
    )
    assert other.held == pytest.approx(one.held, abs=1e-9)
    assert sorted(motion.name for motion in other.motions) == sorted(
        motion.name for motion in one.motions
    )


@pytest.mark.parametrize(
    "changed",
    [
        SOFT,
        HARD,
        {"kn": [np.inf, 1e7]},
        {"weight": [1.0, 0.0, 0.4]},
        {"blade_body": [GROUND]},
        {"blade_body": [GROUND, "blade"]},
    ],
    ids=str,
)
@pytest.mark.parametrize(
    "kind, unit", [("hexahedron", 1.0), ("hexahedron20", 1e3), ("tetra10", 1e-3)]
)
def test_the_same_answer(kind, unit, changed):
    bodies, table = plates(kind, unit)
    repeated = {
        name: np.resize(np.divide(value, unit) if name == "kn" else value, len(table))
        for name, value in changed.items()
    }
    found = solved(bodies, table.replace(**repeated))
    assert (found[0].force > 0).sum() > 3
    agree(*found)


@pytest.mark.parametrize("kn", [1e7, np.inf])
def test_the_same_answer_on_points(kn):
    bodies, table = plates(points=12)
    agree(*solved(bodies, table.replace(kn=np.full(12, kn))))


def test_the_same_answer_under_loads_on_both_bodies():
    bodies, table = plates()
    whole, found = SparseBodies.of(bodies), []
    for model, kind in zip((dense(whole), whole), ROUTES, strict=True):
        found.append(
            StaticContact(model, table, compliance=kind).solve(
                force(model) + force(model, x=30.0, y=7.0, z=-40.0, body="blade")
            )
        )
    agree(*found)


def test_the_same_answer_with_inexact_normals():
    """Normals that lean by 1e-4 load the slides, which nothing resists, a little: constraints take
    it up."""
    bodies, table = plates()
    lean = Rotation.from_rotvec(
        1e-4 * np.random.default_rng(3).standard_normal((len(table), 3))
    ).as_matrix()
    one, other = solved(bodies, table.replace(frame=table.frame @ lean))
    assert one.reactions and other.reactions == pytest.approx(one.reactions, rel=1e-4)
    assert other.force == pytest.approx(one.force, abs=1e-5 * one.force.max())
    assert other.displacement == pytest.approx(
        one.displacement, abs=1e-4 * np.abs(one.displacement).max()
    )


def test_the_same_answer_against_a_stop():
    """The ground is the damper; and pairs that overlap, with a load and without, and room for
    all."""
    bodies, table = plates()
    agree(
        *solved(
            bodies[:1],
            table.replace(damper_body=np.full(len(table), GROUND)),
            z=100.0,
            body="blade",
        )
    )
    for gap, z in ((-2e-3, -100.0), (-1e-7, 0.0), (1e-7, 0.0)):
        one, other = solved(bodies, table, gap=np.full(len(table), gap), z=z)
        assert other.displacement == pytest.approx(one.displacement, abs=1e-12)


def test_the_same_answer_where_motions_are_held():
    bodies, table = plates()
    for holds in ([Hold("x", 3e4)], [Hold("x", 3e4), Hold("about z", 0.2)], [Hold("z", 3e4)]):
        load = {"x": 5.0} if holds[0].motion == "x" else {}
        agree(*solved(bodies, table, holds, **load))


@pytest.mark.parametrize(
    "changed, load, match",
    [
        ({}, {"z": 100.0}, "free to move: slide along z"),
        ({}, {"x": 1.0}, "slide along x is loaded: 1 N"),
        ({"weight": [0.0]}, {}, "no contact pairs"),
        ({"damper_node": [5999]}, {}, "node 5999 of body 'damper'|body 'damper' has no node 5999"),
        ({"blade_body": ["blad"]}, {}, "no body 'blad'.*did you mean 'blade'"),
        ({"blade_node": [99999]}, {}, "node 99999 of body 'blade'|body 'blade' has no node 99999"),
        ({"blade_node": [10]}, {}, "node 10 of body 'blade' is (clamped|not in the reduced model)"),
        ({"weight": [1.0, 1.0] + 40 * [0.0]}, {}, "roll about y is loaded"),
    ],
    ids=str,
)
def test_the_same_refusals(changed, load, match):
    bodies, table = plates()
    table = table.replace(**{name: np.resize(value, len(table)) for name, value in changed.items()})
    whole = SparseBodies.of(bodies)
    for model, kind in zip((dense(whole), whole), ROUTES, strict=True):
        with pytest.raises(InputError, match=match):
            StaticContact(model, table, compliance=kind).solve(force(model, **load))


def test_bodies_that_are_refused():
    (blade, damper), table = plates()
    more = (
        sp.block_diag([damper.K, damper.K], format="csr"),
        sp.block_diag([damper.M, damper.M], format="csr"),
    )
    twin = replace(
        damper,
        K=more[0],
        M=more[1],
        node=np.r_[damper.node, damper.node + 10000],
        position=np.r_[damper.position, damper.position + [0.2, 0, 0]],
        M_clamped=None,
        dof_node=np.r_[damper.dof_node, damper.dof_node + len(damper.node)],
        dof_direction=np.r_[damper.dof_direction, damper.dof_direction],
    )
    for bodies, match in (
        ([], "no bodies"),
        ([blade, replace(damper, name="blade")], "two bodies 'blade'"),
        ([blade, replace(damper, free=False)], "nothing holds it"),
        ([blade, twin], "'damper' floats .*2 pieces"),
    ):
        with pytest.raises(InputError, match=match):
            SparseBodies.of(bodies)
    buckled = replace(blade, K=(blade.K - 0.3 * sp.diags(blade.K.diagonal())).tocsr())
    dof = int(blade.K.diagonal().argmin())
    pushed = sp.csr_matrix(([0.999 * blade.K[dof, dof]], ([dof], [dof])), shape=blade.K.shape)
    for one in (buckled, replace(blade, K=(blade.K - pushed).tocsr())):
        with pytest.raises(InputError, match="body 'blade': negative stiffness"):
            StaticContact(SparseBodies.of([one, damper]), table, compliance=SparseCompliance)


@pytest.mark.parametrize("friction", [each_limited, resultant_limited])
@pytest.mark.parametrize(
    "changed", [SOFT, HARD, {"kn": np.inf, "kt": np.inf}, {"blade_body": GROUND}], ids=str
)
def test_the_same_friction(changed, friction):
    """Pressed, then pushed both ways until some pairs slip and some open; without dense matrices
    too, with the springs of the start all along and with others whenever two iterations were not
    enough."""
    bodies, table = plates()
    table = table.replace(
        **{name: np.full(len(table), value) for name, value in changed.items()}, gap=20 * table.gap
    )
    whole = SparseBodies.of(bodies)
    kinds = [
        stuck_bodies,
        sparse_stuck_bodies,
        *(partial(IterativeBodies, settings=IterationSettings(slow=slow)) for slow in (2, 1000)),
    ]
    one, *others = (
        FrictionalContact(
            dense(whole) if kind is stuck_bodies else whole,
            table,
            stuck=kind,
            friction=friction,
            settings=CLOSE,
        ).solve([force(whole), force(whole, x=22.0, y=5.0)], steps=3)[-1]
        for kind in kinds
    )
    assert one.converged and one.slips.any() and (one.force == 0).any()
    for other in others:
        assert other.converged and other.residual < 1e-9
        assert other.force == pytest.approx(one.force, abs=1e-8)
        assert other.tangential == pytest.approx(one.tangential, abs=1e-8)
        assert other.displacement == pytest.approx(
            one.displacement, abs=1e-9 * np.abs(one.displacement).max()
        )


def test_thousands_of_pairs_have_no_dense_compliance():
    bodies, table = plates()
    whole = SparseBodies.of(bodies)
    B = relative_motion(whole, table)
    springs = np.full(3 * len(table), 1e6)
    for many, kind in ((len(table), IterativeBodies), (len(table) + 1, StuckBodies)):
        assert type(bodies_on_springs(whole, B, springs, many)) is kind


def test_gmres_against_dense_algebra():
    """Exact after as many iterations as the matrix differs from I in its rank; less where less is
    enough."""
    random = np.random.default_rng(3)
    A = np.eye(40) + 0.01 * random.normal(size=(40, 6)) @ random.normal(size=(6, 40))
    b = random.normal(size=40)
    x, count = gmres(lambda v: A @ v, b, 1e-10, 40)
    assert x == pytest.approx(np.linalg.solve(A, b), rel=1e-8) and count == 7
    near, fewer = gmres(lambda v: A @ v, b, 0.3 * np.linalg.norm(b), 40)
    assert np.linalg.norm(A @ near - b) <= 0.3 * np.linalg.norm(b) and fewer < 7
    assert gmres(lambda v: A @ v, b, 1e-10, 3)[1] == 3
