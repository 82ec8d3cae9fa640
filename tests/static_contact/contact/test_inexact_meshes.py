"""A pin on two lines whose node coordinates are not exact: slide and roll are free but for what the
errors make."""

from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks import cost_floor
from tipdamp.hbm.errors import InputError
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import elastic_body
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.surfaces.pairing import Side, join, pair

PULL = 113.0  # N, between faces at 45 degrees: PULL / sqrt(2) on each side


def parts(error):
    """({name: Body}, pairs): coordinates off by up to `error` m at random."""
    random = np.random.default_rng(3)
    meshes = {}
    for name, mesh in cost_floor.body_meshes(0.3).items():
        lines = {
            f"line_{s}": cost_floor.contact_line(mesh, s)[0]
            for s in cost_floor.TURN
            if name in ("damper", s)
        }
        meshes[name] = replace(
            mesh,
            groups={**mesh.groups, **lines},
            position=mesh.position + error * random.uniform(-1, 1, mesh.position.shape),
        )
    pairs = join(
        *(
            pair(
                meshes[s],
                meshes["damper"],
                Side(s, f"line_{s}", f"line_{s}", blade_body=s),
                axis=[0, 1, 0],
                pull=[0, 0, 1],
                tolerance=1e-5,
            )
            for s in cost_floor.TURN
        )
    )
    pairs = pairs.replace(
        kn=np.full(len(pairs), 3e6), kt=np.full(len(pairs), 3e6), mu=np.full(len(pairs), 0.5)
    )
    return {
        name: elastic_body(
            mesh,
            cost_floor.STEEL,
            name,
            clamp=None if name == "damper" else "clamp",
            free=name == "damper",
        )
        for name, mesh in meshes.items()
    }, pairs


def pin(error, shift=0.0):
    """(model, pairs, load): coordinates off by up to `error` m; the pull `shift` m beside the pin's
    axis."""
    bodies, pairs = parts(error)
    model = assemble(
        *(
            craig_bampton(
                body,
                pairs.damper_node if name == "damper" else pairs.blade_node[pairs.side == name],
                0,
            ).model
            for name, body in bodies.items()
        )
    )
    on = (
        np.isin(model.node, pairs.damper_node) & (model.body == "damper") & (model.direction == "z")
    )
    x = model.position[on, 0]
    load = np.zeros(model.size)
    load[on] = PULL * (1 / on.sum() + shift * (x - x.mean()) / ((x - x.mean()) @ (x - x.mean())))
    return model, pairs, load


@pytest.mark.slow
@pytest.mark.parametrize("error", [1e-11, 1e-9, 1e-8, 1e-7, 1e-6])
@pytest.mark.parametrize("constrain", [False, True])
def test_errors_of_coordinates_are_taken_up(error, constrain):
    """The sides carry what they do on the exact mesh, to a multiple of error/size; what the
    reference holds along slide and roll is reported, and with it the whole balance closes to
    1e-8."""
    model, pairs, load = pin(error)
    statics = StaticContact(model, pairs)
    found = statics.solve(load, constrain=constrain)
    for side in cost_floor.TURN:
        assert found.force[pairs.side == side].sum() == pytest.approx(
            PULL / np.sqrt(2), rel=1e-8 + 1e3 * error
        )
    left = model.K @ found.displacement + statics.B.T @ found.force - load
    assert found.residual <= 1e-8 and found.balance <= 1e-8
    if found.reactions:
        amount = np.array([found.reactions.get(name, 0.0) for name, _ in statics.motions.names])
        # 1e-10 of the pull, and of the pull at the pin's 4 mm, may be left out
        assert statics.motions.shape.T @ -left == pytest.approx(amount, rel=1e-6, abs=1e-9 * PULL)
        assert 0 < np.abs(amount).max() < 1e-3 * PULL
    else:
        assert np.linalg.norm(left) <= 1e-8 * np.linalg.norm(load)
    assert bool(found.reactions) == (error >= 1e-9)


@pytest.mark.parametrize("error", [0.0, 1e-7])
def test_a_roll_that_the_load_makes_is_refused(error):
    """113 N beside the axis by 0.02 mm: 0.00226 N m, 5e-3 of what 113 N do at 4 mm; one tenth of it
    is 5e-4."""
    model, pairs, load = pin(error, shift=2e-5)
    with pytest.raises(
        InputError, match="roll about y is loaded: 0.0022. N m, and no contact resists it"
    ):
        StaticContact(model, pairs).solve(load)
    model, pairs, load = pin(error, shift=2e-6)
    assert abs(StaticContact(model, pairs).solve(load).reactions["roll about y"]) == pytest.approx(
        2.26e-4, rel=0.05
    )


@pytest.mark.parametrize("error", [1e-8, 1e-7, 1e-6])
def test_positions_that_do_not_quite_fit(error):
    """Positions off by up to `error` m from those that the matrices were made of, as tables with
    few digits beside them give: no stiffness of a rigid motion. Slide and roll stay free, and each
    side carries what it does."""
    model, pairs, load = pin(0.0)
    body_node = np.array([f"{b} {n}" for b, n in zip(model.body, model.node, strict=True)])
    _, of = np.unique(body_node, return_inverse=True)
    noise = np.random.default_rng(1).uniform(-1, 1, (of.max() + 1, 3))[of]
    statics = StaticContact(replace(model, position=model.position + error * noise), pairs)
    assert sorted(name for name, _ in statics.motions.names) == ["roll about y", "slide along y"]
    found = statics.solve(load)
    for side in cost_floor.TURN:
        assert found.force[pairs.side == side].sum() == pytest.approx(
            PULL / np.sqrt(2), rel=1e-8 + 1e3 * error
        )


@pytest.mark.parametrize("digits", [8, 10])
def test_stiffness_with_few_digits(digits):
    """K as a text file gives it: what its digits leave along a rigid motion is noise of either
    sign, and holds nothing. The sides carry the pull to K's digits; a newton along the slide is
    refused."""
    model, pairs, load = pin(0.0)
    K = np.vectorize(lambda x: float(f"{x:.{digits - 1}e}"))(np.triu(model.K))
    statics = StaticContact(replace(model, K=K + np.triu(K, 1).T), pairs)
    assert sorted(name for name, _ in statics.motions.names) == ["roll about y", "slide along y"]
    found = statics.solve(load, constrain=True)
    for side in cost_floor.TURN:
        assert found.force[pairs.side == side].sum() == pytest.approx(PULL / np.sqrt(2), rel=1e-5)
    along = (model.body == "damper") & (model.direction == "y")
    with pytest.raises(InputError, match="slide along y is loaded: 1 N, and no contact resists it"):
        statics.solve(load + along / along.sum())


@pytest.mark.slow
@pytest.mark.parametrize("error, shift", [(0.0, 0.0), (1e-9, 0.0), (1e-7, 0.0), (1e-7, 2e-6)])
def test_the_full_model_takes_up_the_same(error, shift):
    """Newton on the unreduced equations accepts what the condensed route accepts and reports the
    same; forces to a multiple of error/size, as the two spread what is held over other nodes."""
    pytest.importorskip("petsc4py")
    from tipdamp.static_contact.full.newton import SETTINGS as FULL
    from tipdamp.static_contact.full.newton import full_preload

    model, pairs, load = pin(error, shift)
    bodies, _ = parts(error)
    damper = bodies["damper"]
    nodal = np.zeros(damper.dofs)
    for i in np.flatnonzero(load):
        nodal[damper.node_dofs([model.node[i]])["xyz".index(model.direction[i])]] = load[i]
    found = StaticContact(model, pairs).solve(load)
    other = full_preload(list(bodies.values()), pairs, {"damper": nodal})
    # the full model reports less: what it leaves out is below its own threshold
    both = {
        name: amount
        for name, amount in found.reactions.items()
        if name in other.reactions or abs(amount) > FULL.reported * np.abs(load).sum()
    }
    assert set(other.reactions) == set(both) and bool(found.reactions) == (error > 0 or shift > 0)
    for name, amount in both.items():
        assert other.reactions[name] == pytest.approx(amount, rel=1e-3)
    assert other.force == pytest.approx(
        found.force, abs=(1e-10 + 1e3 * error + 10 * shift) * found.force.max()
    )
    with pytest.raises(
        InputError, match="roll about y is loaded: 0.011. N m, and no contact resists it"
    ):
        full_preload(
            list(bodies.values()), pairs, {"damper": nodal + couple(0.0113, damper, model, load)}
        )


def couple(amount, damper, model, load):
    """(d,) N: `amount` N m about y on the nodes of the damper that the pull acts on."""
    nodal = np.zeros(damper.dofs)
    on = np.flatnonzero(load)
    x = model.position[on, 0] - model.position[on, 0].mean()
    for i, force in zip(on, amount * x / (x @ x), strict=True):
        nodal[damper.node_dofs([model.node[i]])[2]] = force
    return nodal
