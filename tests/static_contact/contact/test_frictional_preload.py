"""Preload with friction: a block in a V, one pair by hand, path dependence, and the hand-over to
the response."""

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.friction import each_limited, resultant_limited
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact, FrictionSettings
from tipdamp.static_contact.contact.preload import preload

KN, KT, MU = 1.03e6, 0.94e6, 0.6


def table(normals, *, mu=MU, kn=KN, kt=KT):
    """Pairs of one damper node with the ground; t1 along y."""
    return contact_table(
        frames(normals),
        side=[f"s{i}" for i in range(len(normals))],
        station=0,
        damper_node=1,
        mu=mu,
        kn=kn,
        kt=kt,
    )


def block(K=(0.0, 0.0, 0.0), M=1.0):
    """One node on springs K to ground in x, y, z."""
    return ReducedModel.from_matrices(
        M * np.eye(3),
        np.diag(K),
        body="damper",
        node=[1, 1, 1],
        direction=["x", "y", "z"],
        position=np.zeros((3, 3)),
    )


S = np.sin(np.pi / 4)
V = [[-S, 0, S], [S, 0, S]]  # faces at 45 degrees, the block is pulled up into them


@pytest.mark.parametrize("friction", [each_limited, resultant_limited])
def test_block_pulled_into_a_v(friction):
    """kt/kn > mu: both sides slip from the start, N = Fc / (2 (sin 45 + mu cos 45)) = 49.9 N for
    113 N; T = mu N."""
    last = FrictionalContact(block(), table(V), friction=friction).solve([[0, 0, 113.0]], steps=7)[
        -1
    ]
    N = 113 / (2 * (S + MU * S))
    assert N == pytest.approx(49.94, abs=0.01)
    assert last.converged and last.slips.all() and last.force == pytest.approx(N, rel=1e-9)
    assert (
        np.abs(last.tangential[:, 1]) == pytest.approx(MU * N, rel=1e-9) and last.residual < 1e-10
    )


def test_block_that_sticks_in_the_v():
    """mu above kt/kn: nothing slips, the pull goes to springs kn and kt in parallel: N = Fc kn S /
    2 (kn + kt) S^2."""
    last = FrictionalContact(block(), table(V, mu=2.0)).solve([[0, 0, 113.0]])[-1]
    assert not last.slips.any() and (last.slider == 0).all()
    assert last.force == pytest.approx(113 * KN / (2 * (KN + KT) * S), rel=1e-10)


def test_without_friction_it_is_the_frictionless_preload():
    last = FrictionalContact(block(), table(V, mu=0.0)).solve([[30.0, 0, 113.0]], steps=3)[-1]
    assert last.force == pytest.approx(
        preload(block(), table(V), np.array([30.0, 0, 113.0])).force, rel=1e-9
    )


def test_steps_of_a_straight_path():
    """Proportional load on a V with stuck start: the same state from 1 to 64 increments."""
    problem = FrictionalContact(block((2e5, 0.0, 0.0)), table(V))
    found = [problem.solve([[40.0, 20.0, 113.0]], steps=n)[-1].force for n in (1, 4, 64)]
    assert found[0] == pytest.approx(found[2], rel=1e-9) and found[1] == pytest.approx(
        found[2], rel=1e-9
    )


def test_load_grows_monotonely():
    """In a growing pull every side force grows and the sliders only move outwards."""
    states = FrictionalContact(block(), table(V)).solve([[0, 0, 113.0]], steps=10)
    assert (np.diff([s.force for s in states], axis=0) > 0).all()
    assert (np.diff([np.abs(s.slider[:, 1]) for s in states], axis=0) > 0).all()


@pytest.mark.parametrize("push", [120.0, 200.0])
def test_one_pair_by_hand(push):
    """Pressed by P = 100 N, pushed sideways by `push` against a spring kb, let go: the locked-in
    state.

    Slips at mu P = 60 N: u1 = (push - 60)/kb, w = u1 - 60/kt. Let go: T = kt (u - w), kb u + T = 0,
    so that
    u = kt w/(kb + kt); where |T| would pass 60 N it slips back to u = 60/kb. (120 N: stuck, 200 N:
    slips back.)"""
    P, kb = 100.0, 5e5
    history = FrictionalContact(block((0.0, kb, 0.0)), table([[0, 0, 1.0]])).solve(
        [[0, 0, P], [0, push, P], [0, 0, P]], steps=5
    )
    held, pushed, let_go = (next(s for s in history if s.time == t) for t in (1.0, 2.0, 3.0))
    assert held.tangential == pytest.approx(0) and held.force == pytest.approx(P)
    w = (push - MU * P) / kb - MU * P / KT
    assert pushed.tangential[0, 0] == pytest.approx(MU * P) and pushed.slider[
        0, 0
    ] == pytest.approx(w)
    stuck = -kb * KT * w / (kb + KT)
    assert let_go.tangential[0, 0] == pytest.approx(max(stuck, -MU * P), rel=1e-9)
    assert (abs(stuck) < MU * P) == (push == 120.0)
    assert let_go.displacement[1] == pytest.approx(-let_go.tangential[0, 0] / kb, rel=1e-9)
    assert repr(pushed).startswith(
        "<FrictionState: time 2, 1 pairs, 1 slip, 0 open; "
    ) and "\n" not in repr(pushed)


def test_tangents_coupled_or_not():
    """Pushed at 30 degrees beyond slip: coupled, T has size mu N along the push; uncoupled, each
    has its limit."""
    push = 300 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    model = block((1e5, 1e5, 0.0))
    pairs = table([[0, 0, 1.0]])
    load = [[0, 0, 100.0], [push[0], push[1], 100.0]]
    one = FrictionalContact(model, pairs, friction=resultant_limited).solve(load)[-1]
    two = FrictionalContact(model, pairs).solve(load)[-1]
    t = pairs.frame[0, :2, :2] @ push / 300
    assert one.tangential[0] == pytest.approx(60 * t, rel=1e-9)
    assert two.tangential[0] == pytest.approx(60 * np.sign(t), rel=1e-9)


def test_tangent_of_the_law_by_differences():
    random = np.random.default_rng(1)
    pairs = table(np.tile([[0, 0, 1.0]], (40, 1)))
    for friction in (each_limited, resultant_limited):
        law = FrictionalContact(block((1e6,) * 3), pairs, friction=friction).law
        u, w = random.normal(0, 1e-4, 120), random.normal(0, 1e-4, (40, 2))
        _, J, _ = law.forces(u, w, pairs.gap)
        h = 1e-10
        for k in range(3):
            step = np.tile(h * np.eye(3)[k], 40)
            d = (law.forces(u + step, w, pairs.gap)[0] - law.forces(u - step, w, pairs.gap)[0]) / (
                2 * h
            )
            assert d.reshape(-1, 3) == pytest.approx(J[:, :, k], abs=1e-4 * KN)


def test_state_is_handed_to_the_response():
    """Under the same static load, from the sliders of the history and with next to no excitation,
    order 0 of the response is the locked-in state; from sliders at zero it is another one."""
    from tipdamp.hbm.laws import DryFriction2T
    from tipdamp.hbm.response import forced_response

    model, pairs = block((0.0, 5e5, 0.0), M=1e-3), table([[0, 0, 1.0]])
    end = FrictionalContact(model, pairs).solve([[0, 0, 100.0], [0, 120.0, 100.0], [0, 0, 100.0]])[
        -1
    ]
    given = dict(
        harmonics=1,
        damping_ratio=0.01,
        outputs={"y": np.array([0, 1.0, 0])},
        origin="unloaded",
        static=end.load,
    )
    force = np.array([0, 1e-3, 0])
    curve = forced_response(
        model, pairs, DryFriction2T(), force, (20.0, 21.0), start=end.slider, **given
    )
    assert curve.harmonics[0, 0, 0].real == pytest.approx(end.displacement[1], rel=1e-3)
    assert abs(end.displacement[1]) > 1e-6
    other = forced_response(
        model, pairs, DryFriction2T(), force, (20.0, 21.0), start="zero_slider", **given
    )
    assert abs(other.harmonics[0, 0, 0]) < 1e-3 * abs(end.displacement[1])


@pytest.mark.slow
def test_rig_with_friction_carries_less(rig_results):
    """The wedge effect on the small rig: equilibrium with the friction forces, a lower sum of N
    than without friction, and halving the increments changes the map by less and less."""
    model = ReducedModel.load(rig_results.path("model.npz"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    problem = FrictionalContact(model, pairs)
    load = 113 * model.loads["pull"]
    found = [problem.solve([load], steps=n)[-1] for n in (1, 10)]
    assert all(s.converged and s.residual < 1e-8 for s in found)
    force = -(
        found[0].force[:, None] * pairs.normal
        + np.einsum("pd,pdx->px", found[0].tangential, pairs.frame[:, :2])
    ).sum(axis=0)
    assert force == pytest.approx([0, 0, -113], abs=1e-5)
    # nearly all pairs slip across: 113 / (2 (sin 45 + mu cos 45)) on each side
    for side in ("left", "right"):
        assert found[0].force[pairs.side == side].sum() == pytest.approx(
            113 / (2 * 1.6 * S), rel=1e-3
        )
    assert found[1].force == pytest.approx(found[0].force, abs=1e-8 * 113)


def test_rig_remembers_its_history(rig_results):
    """Pulled to 113 N and let down to 60 N it is wedged: more side force than pulled to 60 N. With
    random gaps plain Newton fails on the way, and what the dashpots find is an equilibrium."""
    model = ReducedModel.load(rig_results.path("model.npz"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    gap = np.random.default_rng(4).uniform(0, 2e-5, len(pairs))
    problem, pull = FrictionalContact(model, pairs), model.loads["pull"]
    down = problem.solve([113 * pull, 60 * pull], steps=10, gap=gap)
    up = problem.solve([60 * pull], steps=10, gap=gap)
    assert all(s.converged and s.residual < 1e-8 for s in (*down, *up))
    assert down[-1].force.sum() > 1.2 * up[-1].force.sum()
    plain = FrictionalContact(model, pairs, settings=FrictionSettings(dashpot_steps=0))
    assert not plain.solve([60 * pull], steps=10, gap=gap)[-1].converged


def test_load_beyond_friction_ends_the_history():
    """60 N of friction hold no 70 N: the history ends short of it and says so."""
    history = FrictionalContact(block(), table([[0, 0, 1.0]])).solve(
        [[0, 0, 100.0], [0, 70.0, 100.0]], steps=10
    )
    assert not history[-1].converged and all(s.converged for s in history[:-1])
    assert history[-2].time == pytest.approx(1 + 60 / 70, abs=0.1)


def test_bad_input():
    with pytest.raises(InputError, match="not even stuck"):
        FrictionalContact(block(), table([[0, 0, 1.0]], kt=0.0))
    with pytest.raises(InputError, match="not even stuck"):
        FrictionalContact(block(), table([[0, 0, 1.0]], kt=0.0, kn=np.inf))


# ---- rigid springs -------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [each_limited, resultant_limited])
def test_hard_block_pulled_into_a_v(friction):
    """Hard faces stop the block dead, so that kt is not stretched: the frictionless 113 / (2 sin
    45) on each side. Are the tangents rigid too, the split of the pull between N and T is not
    determined: some split within the cone."""
    pairs = table(V, kn=np.inf)
    last = FrictionalContact(block(), pairs, friction=friction).solve([[0, 0, 113.0]])[-1]
    assert last.converged and last.displacement == pytest.approx(0, abs=1e-15)
    assert last.force == pytest.approx(
        113 / (2 * S), rel=1e-9
    ) and last.tangential == pytest.approx(0, abs=1e-9)
    rigid = FrictionalContact(block(), table(V, kn=np.inf, kt=np.inf), friction=friction).solve(
        [[0, 0, 113.0]]
    )[-1]
    total = rigid.force @ pairs.normal + np.einsum(
        "pd,pdx->x", rigid.tangential, pairs.frame[:, :2]
    )
    assert rigid.converged and total == pytest.approx([0, 0, 113.0], abs=1e-9)
    assert (np.abs(rigid.tangential) <= MU * rigid.force[:, None] * (1 + 1e-9)).all()


@pytest.mark.parametrize("kn, kt", [(np.inf, KT), (np.inf, np.inf), (KN, np.inf), (KN, KT)])
def test_random_pairs_against_all_sets(kn, kt):
    """Three pairs on random elastic bodies: what Newton finds is one of the 4^3 sets (open, stuck,
    slipping either way) whose linear system with multipliers satisfies every inequality. Forces to
    1e-8."""
    random, slipped, opened = np.random.default_rng(7), 0, 0
    for _ in range(40):
        A = random.normal(size=(9, 12))
        model = ReducedModel.from_matrices(
            np.eye(9),
            1e5 * (A @ A.T + 0.3 * np.eye(9)),
            body="damper",
            node=np.repeat([1, 2, 3], 3),
            direction=list("xyz") * 3,
            position=np.repeat(random.normal(size=(3, 3)), 3, axis=0),
        )
        pairs = table(np.tile([0, 0, 1.0], (3, 1)), kn=kn, kt=kt)
        pairs = pairs.replace(damper_node=[1, 2, 3], gap=random.uniform(0, 2e-4, 3))
        load = random.normal(0, 60, 9) + np.tile([0, 0, 90.0], 3)
        load[np.arange(9) % 3 == 0] = 0.0
        held = FrictionalContact(_without_x(model), pairs).solve([load], steps=1)[-1]
        assert held.converged and held.residual < 1e-9
        found = np.column_stack([held.tangential[:, 0], held.force])
        sets = list(_consistent_sets(_without_x(model), pairs, load))
        assert min(np.abs(found - f).max() for f in sets) < 1e-8 * max(np.abs(found).max(), 1.0)
        slipped, opened = slipped + held.slips.sum(), opened + (held.force == 0).sum()
    assert slipped > 10 and opened > 5


def _without_x(model):
    """The same with x, the second tangent, held fast and uncoupled."""
    K, x = model.K.copy(), model.direction == "x"
    K[x], K[:, x] = 0.0, 0.0
    K[x, x] = 1e12
    return ReducedModel.from_matrices(
        model.M,
        K,
        body=model.body,
        node=model.node,
        direction=model.direction,
        position=model.position,
    )


def _consistent_sets(model, pairs, load):
    """(P, 2) forces along t1 = y and n = z of every set that satisfies K q + B' f = F and all
    conditions."""
    from itertools import product

    P, r = len(pairs), model.size
    t = np.flatnonzero(model.direction == "y")
    n = np.flatnonzero(model.direction == "z")
    B = np.zeros((2 * P, r))
    B[np.arange(P), t] = B[P + np.arange(P), n] = 1.0
    c = np.concatenate([1 / pairs.kt, 1 / pairs.kn])
    for kind in product("ok+-", repeat=P):
        kind = np.array(kind)
        A = np.block([[model.K, B.T], [B, -np.diag(c)]])
        right = np.concatenate([load, np.zeros(P), pairs.gap])
        for i in range(P):
            if kind[i] == "o":
                A[r + i], A[r + P + i], right[r + P + i] = 0.0, 0.0, 0.0
                A[r + i, r + i] = A[r + P + i, r + P + i] = 1.0
            elif kind[i] != "k":
                A[r + i] = 0.0
                A[r + i, [r + i, r + P + i]] = 1.0, -pairs.mu[i] * (1 if kind[i] == "+" else -1)
        scale = np.concatenate([np.full(r, 1e3), np.full(2 * P, 1e-3)])  # balances m and N
        x = scale * np.linalg.solve(A * scale, right)
        T, N, u = x[r : r + P], x[r + P :], B @ x[:r]
        slip = u[:P] - c[:P] * T
        good = np.select(
            [kind == "o", kind == "k", kind == "+", kind == "-"],
            [
                u[P:] <= pairs.gap + 1e-15,
                (N >= 0) & (np.abs(T) <= pairs.mu * N),
                (N >= 0) & (slip >= 0),
                (N >= 0) & (slip <= 0),
            ],
        )
        if good.all():
            yield np.column_stack([T, N])


@pytest.mark.slow
def test_stiff_springs_tend_to_rigid_ones(rig_results):
    """The rig's damper with friction: forces on springs 100 and 1000 times stiffer come nearer to
    those of rigid ones, as 1/k; without friction the rigid ones are the frictionless hard
    contact."""
    model = ReducedModel.load(rig_results.path("model.npz"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    load = [113 * model.loads["pull"]]
    hard = pairs.replace(kn=np.full(len(pairs), np.inf))
    rigid = FrictionalContact(model, hard).solve(load, steps=4)[-1]
    error = [
        np.abs(
            FrictionalContact(model, pairs.replace(kn=f * pairs.kn)).solve(load, steps=4)[-1].force
            - rigid.force
        ).max()
        for f in (1e3, 1e4)
    ]
    assert rigid.converged and rigid.residual < 1e-8
    assert error[1] < 0.02 * rigid.force.max() and error[0] / error[1] == pytest.approx(10, rel=0.3)
    none = FrictionalContact(model, hard.replace(mu=np.zeros(len(pairs)))).solve(load, steps=1)[-1]
    assert none.force == pytest.approx(
        preload(model, hard, load[0]).force, abs=1e-7 * rigid.force.max()
    )


@pytest.mark.parametrize("steps", [0, -1, 2.5, True])
def test_steps_are_counted(steps):
    with pytest.raises(InputError, match=f"steps = {steps}: must be a whole number, 1 or more"):
        FrictionalContact(block(), table(V)).solve([[0, 0, 113.0]], steps=steps)


@pytest.mark.parametrize("missed", [0, 1, 2, 5])
def test_every_newton_step_is_counted(monkeypatch, missed):
    """Those in vain and those with dashpots, too; the state is the same however it was found."""
    problem, steps = FrictionalContact(block((2e5, 0.0, 0.0)), table(V)), []
    (expected,) = problem.solve([[40.0, 20.0, 113.0]], steps=1)
    real = FrictionalContact._equilibrium

    def failing(self, load, z, w, gap, damped=0.0):
        found, count = real(self, load, z, w, gap, damped)
        steps.append(count)
        undamped = damped == 0.0 and sum(plain) < missed
        plain.append(damped == 0.0)
        return (None if undamped else found), count

    plain: list[bool] = []
    monkeypatch.setattr(FrictionalContact, "_equilibrium", failing)
    (found,) = problem.solve([[40.0, 20.0, 113.0]], steps=1)
    assert found.converged and found.iterations == sum(steps)
    assert len(steps) == 1 + 2 * missed
    assert found.force == pytest.approx(expected.force, rel=1e-9)
