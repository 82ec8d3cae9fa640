"""Matrices that cannot be a body, by the rows of the catalogue of bad inputs (b25, ...): each has
its one answer."""

import numpy as np
import pytest
import scipy.sparse as sp

from tests.contact_tables import contact_table
from tipdamp.hbm.contact import relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body, check_support
from tipdamp.modal.craig_bampton import craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body

from .blocks import block

STEEL = Material(E=207e9, nu=0.3, density=7850.0)


@pytest.fixture(scope="module")
def good():
    """A clamped block: its body is taken apart and given back as matrices from elsewhere."""
    return elastic_body(block("hexahedron20", (4, 2, 2)), STEEL, "block", clamp="clamp")


def given(body, **changed):
    parts = dict(
        K=body.K,
        M=body.M,
        node=body.node,
        position=body.position,
        dof_node=body.dof_node,
        dof_direction=body.dof_direction,
        groups=body.groups,
    )
    return Body.from_matrices("block", **{**parts, **changed})


def altered(A, i, j, value):
    A = sp.lil_matrix(A)
    A[i, j] = value
    return A.tocsr()


def both(good):
    """Makers of a Body and of a ReducedModel from the same matrices: (K, M) -> record."""
    node = good.node[good.dof_node]
    direction = np.array(["x", "y", "z"])[good.dof_direction]
    return (
        lambda K, M: given(good, K=K, M=M),
        lambda K, M: ReducedModel.from_matrices(M, K, node=node, direction=direction, body="block"),
    )


def one_pair(**columns):
    """Node 7 of the block against the ground."""
    return contact_table(np.eye(3)[None], damper_body="block", damper_node=7, **columns)


def test_good_matrices_pass(good):
    assert check_support(given(good)) == 0
    for make in both(good):
        make(good.K, good.M)


@pytest.mark.parametrize("label", ["K", "M"])
def test_b25_unsymmetric(good, label):
    A = {"K": good.K, "M": good.M}
    scale = abs(A[label]).max()
    A[label] = altered(A[label], 7, 30, A[label][7, 30] + 1e-9 * scale)
    for make in both(good):
        with pytest.raises(
            InputError,
            match=rf"{label} is not symmetric: \|{label}\[(7, 30|30, 7)\] - .*1.0e-09 of",
        ):
            make(A["K"], A["M"])


def test_b25_rounding_is_let_pass(good):
    given(good, K=altered(good.K, 7, 30, good.K[7, 30] + 1e-12 * abs(good.K).max()))


@pytest.mark.parametrize("label", ["K", "M"])
def test_complex_matrices(good, label):
    """As an export with structural damping holds them: the imaginary part is not dropped, it is
    refused."""
    with pytest.raises(InputError, match=f"{label} is complex .complex128.: must be real"):
        given(good, **{label: getattr(good, label) * (1 + 0.05j)})


@pytest.mark.parametrize("label", ["K", "M"])
@pytest.mark.parametrize(
    "what, words",
    [
        (np.ones((2, 2, 2)), r"an array of float64, \(2, 2, 2\)"),
        (None, "None"),
        (np.array([["a", "b"], ["c", "d"]]), r"an array of <U1, \(2, 2\)"),
    ],
)
def test_what_is_no_matrix(good, label, what, words):
    with pytest.raises(
        InputError, match=f"body 'block': {label} is {words}: must be a square matrix of numbers"
    ):
        given(good, **{label: what})


def test_b26_mass_with_a_zero_row(good):
    keep = sp.diags(np.where(np.arange(good.dofs) == 12, 0.0, 1.0))
    where = (
        f"dof 12 \\((block, )?node {good.node[good.dof_node[12]]}, {'xyz'[good.dof_direction[12]]}"
    )
    for make in both(good):
        with pytest.raises(InputError, match=f"M has a row of zeros.* at {where}"):
            make(good.K, (keep @ good.M @ keep).tocsr())


@pytest.mark.parametrize("size", [40, 10**9])
def test_b26_indefinite_mass(good, size):
    """A coupling larger than its two diagonals: names a dof of the motion that has negative
    mass."""
    n = min(size, good.dofs)
    K, M = good.K[:n, :n], good.M[:n, :n]
    value = 2 * np.sqrt(M[5, 5] * M[9, 9])
    M = altered(altered(M, 5, 9, value), 9, 5, value)
    with pytest.raises(InputError, match=r"M is indefinite: a motion mostly of dof (5|9) "):
        given(good, K=K, M=M, dof_node=good.dof_node[:n], dof_direction=good.dof_direction[:n])
    with pytest.raises(
        InputError, match=r"M is not positive definite: a motion mostly of dof (5|9) "
    ):
        ReducedModel.from_matrices(M, K)


def test_b26_mass_that_couples_some_dofs():
    """Random couplings across dofs that have none: refused exactly where an eigenvalue is
    negative."""
    rng, seen = np.random.default_rng(1), set()
    for _ in range(60):
        upper = np.triu(rng.uniform(-1, 1, (6, 6)) * (rng.random((6, 6)) < 0.2), 1)
        M = np.eye(6) + upper + upper.T
        positive = bool(np.linalg.eigvalsh(M)[0] > 0)
        seen.add((positive, bool(upper.any())))
        try:
            ReducedModel.from_matrices(M, np.eye(6))
            assert positive
        except InputError as error:
            assert not positive and "M is not positive definite" in str(error)
    assert {(True, True), (False, True)} <= seen


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("label", ["K", "M"])
def test_b27_not_finite(good, label, value):
    A = {"K": good.K, "M": good.M}
    A[label] = altered(A[label], 3, 3, value)
    for make in both(good):
        with pytest.raises(InputError, match=rf"{label}\[3, 3\] is {value}"):
            make(A["K"], A["M"])


def bent(good, place, among):
    """K minus a little more than the energy that it takes to bend three neighbours on one line, at
    the place of the first, when only the dofs `among` move: a motion with negative stiffness that
    no rigid motion and no diagonal shows."""
    x, y, z = good.position.round(9).T
    line = np.lexsort((y, z, np.abs(x - np.unique(x)[place]).round(9)))[:3]
    step = np.diff(good.position[line], axis=0)
    assert step[0] == pytest.approx(step[1])
    v = np.zeros(good.dofs)
    for node, amount in zip(line, (1.0, -2.0, 1.0), strict=True):
        v[(good.dof_node == node) & (good.dof_direction == 2)] = amount
    K = good.K.toarray()
    K -= 1.2 / (v[among] @ np.linalg.solve(K[np.ix_(among, among)], v[among])) * np.outer(v, v)
    assert K.diagonal().min() > 0 and np.linalg.eigvalsh(K)[0] < 0
    return sp.csr_matrix((K + K.T) / 2)


@pytest.mark.parametrize("petsc", [True, False])
@pytest.mark.parametrize("modes", [0, 3])
@pytest.mark.parametrize(
    "place, where",
    [
        (-1, "in a motion mostly of dof|with the other masters held"),
        (
            3,
            r"1 motion meets it with the masters fixed, the worst mostly of dof \d+ "
            r"\(node \d+, z\)",
        ),
    ],
)
def test_b26_indefinite_stiffness(good, monkeypatch, place, where, modes, petsc):
    """Among the masters, and among the others, where it would come out as a mode that is nan."""
    if not petsc:
        monkeypatch.setattr("tipdamp.modal.solvers.petsc.start", lambda: None)
    tip = good.node_dofs(good.groups["tip"])
    among = np.arange(good.dofs) if place < 0 else np.setdiff1d(np.arange(good.dofs), tip)
    body = given(good, K=bent(good, place, among))
    with pytest.raises(InputError, match=f"negative stiffness, .*({where}).*; K is indefinite"):
        craig_bampton(body, good.groups["tip"], modes)


def test_b26_zero_row_or_wrong_sign(good):
    keep = sp.diags(np.where(np.arange(good.dofs) == 12, 0.0, 1.0))
    with pytest.raises(InputError, match="K has a row of zeros at dof 12 .*nothing holds it"):
        check_support(given(good, K=(keep @ good.K @ keep).tocsr()))
    with pytest.raises(InputError, match="negative stiffness, K is -.* on its diagonal at dof"):
        check_support(given(good, K=-good.K))
    with pytest.raises(
        InputError, match=r"negative stiffness, a rigid motion meets it, mostly a \w+ \w+ [xyz]"
    ):
        check_support(given(good, K=altered(good.K, 12, 12, 0.1 * good.K[12, 12])))
    slide = (good.dof_direction == 1).astype(float)
    driven = good.K - sp.csr_matrix(
        np.outer(slide, slide) * 3 * good.K.diagonal().max() / slide.sum()
    )
    with pytest.raises(InputError, match="a rigid motion meets it, mostly a slide along y"):
        check_support(given(good, K=driven))


def test_mass_by_direction(good):
    """Ten times the mass along y; and the same of a free body whose M couples the directions."""

    def heavy(body):
        scale = sp.diags(np.where(body.dof_direction == 1, np.sqrt(10.0), 1.0))
        return (scale @ body.M @ scale).tocsr()

    with pytest.raises(InputError, match="its mass along x, y, z is .* must be the same to 1e-06"):
        given(good, M=heavy(good))
    free = elastic_body(block("hexahedron20", (2, 1, 1)), STEEL, "pin", free=True)
    M = heavy(free).tolil()
    M[0, 1] = M[1, 0] = 1e-3 * M[0, 0]
    with pytest.raises(InputError, match="its mass along x, y, z is"):
        given(free, M=M.tocsr(), free=True)


def test_nodes_that_are_none(good):
    number = np.where(good.node == good.node[5], good.node[2], good.node)
    with pytest.raises(InputError, match=f"node {good.node[2]} is in the table of nodes 2 times"):
        given(good, node=number)
    position = good.position.copy()
    position[4, 1] = np.nan
    with pytest.raises(
        InputError, match=rf"node {good.node[4]} is at \[.*nan.*\]: every position must be finite"
    ):
        given(good, position=position)
    for column in ("node", "dof_node", "dof_direction"):
        with pytest.raises(InputError, match=f"{column} is an array of float64, .* whole numbers"):
            given(good, **{column: getattr(good, column).astype(float)})


def test_b28_free_body(good):
    """Declared free: six rigid modes. Undeclared: refused. Declared free and held: refused."""
    mesh = block("hexahedron20", (2, 1, 1))
    free = elastic_body(mesh, STEEL, "pin", free=True)
    assert check_support(free) == 6
    reduction = craig_bampton(free, mesh.group("tip"), 4)
    assert reduction.rigid == 6
    values = np.linalg.eigvalsh(
        np.linalg.solve(
            np.linalg.cholesky(reduction.model.M),
            np.linalg.solve(np.linalg.cholesky(reduction.model.M), reduction.model.K).T,
        )
    )
    assert np.abs(values[:6]).max() < 1e-9 * values[6]
    with pytest.raises(InputError, match="nothing holds it, 6 rigid motions are free"):
        check_support(elastic_body(mesh, STEEL, "pin"))
    with pytest.raises(InputError, match="declared free but 6 of its 6 rigid motions are held"):
        check_support(elastic_body(mesh, STEEL, "pin", clamp="clamp", free=True))


@pytest.mark.parametrize(
    "column, value, message",
    [
        ("kn", -1.0, "kn = -1, must be"),
        ("kt", -2.0, "kt = -2, must be"),
        ("kn", np.nan, "kn = nan"),
    ],
)
def test_b30_negative_stiffness(column, value, message):
    with pytest.raises(InputError, match=f"pair 1: {message}"):
        one_pair(**{column: [value]})


def test_b31_sizes_that_disagree(good):
    """All shapes are named."""
    with pytest.raises(
        InputError,
        match=rf"K is \({good.dofs}, {good.dofs}\), M is \(3, 3\), the dof table has "
        rf"{good.dofs} nodes and {good.dofs} directions",
    ):
        given(good, M=np.eye(3))
    with pytest.raises(InputError, match="the dof table has 5 nodes"):
        given(good, dof_node=good.dof_node[:5])
    with pytest.raises(InputError, match=r"positions are \(2, 3\)"):
        given(good, position=good.position[:2])
    with pytest.raises(
        InputError, match=r"M is \(3, 3\), C is \(2, 2\), K is \(4, 4\); node has 5 rows: all must"
    ):
        ReducedModel.from_matrices(np.eye(3), np.eye(4), np.eye(2), node=np.arange(5))
    with pytest.raises(InputError, match=r"node has 5 rows, M and K are \(3, 3\)"):
        ReducedModel.from_matrices(np.eye(3), np.eye(3), node=np.arange(5))
    with pytest.raises(
        InputError, match=r"load 'pull' must hold 3 finite numbers, got shape \(2,\)"
    ):
        ReducedModel.from_matrices(np.eye(3), np.eye(3), loads={"pull": [1.0, 2.0]})


def test_b32_dof_table_with_absent_nodes(good):
    node = good.dof_node.copy()
    node[4] = len(good.node)
    with pytest.raises(
        InputError,
        match=f"dof 4 has node index {len(good.node)}, which does not exist or is eliminated",
    ):
        given(good, dof_node=node)
    node[4] = node[0]
    with pytest.raises(InputError, match="is in the dof table twice"):
        given(good, dof_node=node)
    with pytest.raises(
        InputError, match="group 'block/clamp': node 7 of body 'block' has no dof in the model"
    ):
        ReducedModel.from_matrices(
            np.eye(3),
            np.eye(3),
            body="block",
            node=[1, 1, 1],
            direction=["x", "y", "z"],
            groups={"block/clamp": [7]},
        )
    model = ReducedModel.from_matrices(
        np.eye(3), np.eye(3), body="block", node=[1, 1, 1], direction=["x", "y", "z"]
    )
    with pytest.raises(InputError, match="node 7 of body 'block' is not in the reduced model"):
        relative_motion(model, one_pair())
    with pytest.raises(InputError, match="is the same as dof 0"):
        ReducedModel.from_matrices(
            np.eye(2), np.eye(2), body="block", node=[1, 1], direction=["x", "x"]
        )


def test_b33_damping_that_drives():
    """Negative damping in one motion, though the diagonal of C is positive."""
    C = np.array([[1.0, 2.0], [2.0, 1.0]])
    with pytest.raises(
        InputError, match="C feeds energy in: a motion mostly of dof (0|1) .* negative damping -1"
    ):
        ReducedModel.from_matrices(np.eye(2), np.eye(2), C)
    # one motion undamped
    ReducedModel.from_matrices(np.eye(2), np.eye(2), np.array([[1.0, -1.0], [-1.0, 1.0]]))


@pytest.mark.parametrize(
    "asked, message",
    [
        ({"modes": -1}, "-1 modes asked for: must be between 0 and the"),
        ({"modes": 10**6}, "1000000 modes asked for"),
        ({"modes": 2.5}, "modes = 2.5 must be a whole number"),
        ({"modes": True}, "modes = True must be a whole number"),
        ({"below_hz": np.nan}, "below_hz = nan must be finite"),
        ({"below_hz": np.inf}, "below_hz = inf must be finite"),
        ({"below_hz": -5.0}, "below_hz = -5 must be finite and not negative"),
    ],
)
def test_b35_modes_that_are_no_number(good, asked, message):
    with pytest.raises(InputError, match=message):
        craig_bampton(good, good.groups["tip"], **asked)


def test_b35_no_modes_is_guyan(good):
    """Static condensation: stiffness of the tip exact, no modal dofs."""
    tip = good.groups["tip"]
    model = craig_bampton(good, tip, 0).model
    assert model.size == 3 * len(tip) and "mode" not in model.direction
    rows = good.node_dofs(tip)
    flexibility = np.linalg.inv(good.K.toarray())[np.ix_(rows, rows)]
    assert np.linalg.inv(model.K) == pytest.approx(
        flexibility, rel=1e-6, abs=1e-9 * np.abs(flexibility).max()
    )
