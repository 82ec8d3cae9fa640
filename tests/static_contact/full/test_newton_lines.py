"""Newton on the full model where the nodes of each body lie on one line, and without load: as the
condensed route."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

pytest.importorskip("petsc4py")

from tests.static_contact.bodies.test_free_motions import TURNS, S, damper_on_two_lines  # noqa: E402
from tipdamp.hbm.errors import InputError  # noqa: E402
from tipdamp.modal.body import Body  # noqa: E402
from tipdamp.static_contact.contact.preload import StaticContact  # noqa: E402
from tipdamp.static_contact.full.newton import full_preload  # noqa: E402
from tipdamp.static_contact.surfaces.pairing import join  # noqa: E402


def bodies_of(model):
    """The bodies of a model as those of the full route, dofs in the same order."""
    found = []
    for name in dict.fromkeys(model.body.tolist()):
        mine = np.flatnonzero(model.body == name)
        node, at, of = np.unique(model.node[mine], return_index=True, return_inverse=True)
        found.append(
            Body(
                name,
                node,
                model.position[mine[at]],
                of,
                np.array(["xyz".index(d) for d in model.direction[mine]]),
                sp.csr_matrix(model.K[np.ix_(mine, mine)]),
                sp.identity(len(mine), format="csr"),
                free=name == "damper",
            )
        )
    return found


@pytest.mark.parametrize("turn", TURNS)
def test_nodes_on_one_line(turn):
    """A turn about the line moves no node and is no motion, along x and along an oblique line; the
    slide is free and refused when loaded. 40 N into the V: 40 / (2 sin 45) on each side, pair by
    pair as the condensed route finds."""
    model, table = damper_on_two_lines(0.07, turn, 0.0)
    load = np.zeros((63, 3))
    load[:21] = np.tile(turn / 7, (7, 1))
    found = StaticContact(model, table).solve(load @ [0, 0, 40.0])
    other = full_preload(bodies_of(model), table, {"damper": (load @ [0, 0, 40.0])[:21]})
    for side in ("left", "right"):
        assert other.force[table.side == side].sum() == pytest.approx(20 / S, rel=1e-9)
    assert (
        other.force == pytest.approx(found.force, abs=1e-8 * found.force.max())
        and not other.reactions
    )
    with pytest.raises(
        InputError, match="slide along . is loaded: .* N, and no contact resists it"
    ):
        full_preload(bodies_of(model), table, {"damper": (load @ [2.0, 0, 40.0])[:21]})


@pytest.mark.parametrize("gap", [0.0, 1e-5, -1e-6])
@pytest.mark.parametrize("kn", [1e6, np.inf])
def test_without_load(kn, gap):
    """The damper backs off from what overlaps: no force, every pair open or touching."""
    model, table = damper_on_two_lines(0.07, TURNS[1], 0.0)
    table = table.replace(kn=np.full(14, kn), gap=gap * np.linspace(0.5, 1, 14))
    found = full_preload(bodies_of(model), table, {})
    assert (found.force == 0).all() and not found.reactions and found.iterations == 0
    # 1e-11 m of overlap is none, as for the condensed route
    assert found.pairs.preload.max() <= 1e-11 * 1e6
    assert (StaticContact(model, table).solve(np.zeros(63)).force == 0).all()


@pytest.mark.parametrize("tilt", [0.0, 1e-4])
def test_wedged_without_load(tilt):
    """Pairs on opposite sides that overlap by 2 um cannot all open: forces without load, the same
    by both routes; what normals that tilt a little leave of them along the slide is measured
    against the forces, and taken up."""
    model, table = damper_on_two_lines(0.07, np.eye(3), 0.0)
    turn = Rotation.from_rotvec(np.outer(np.linspace(-1, 1.2, 14), [0, tilt, 0])).as_matrix()
    opposite = table.replace(
        frame=-table.frame * np.array([1.0, -1, 1])[:, None], gap=np.full(14, -2e-6)
    )
    turned = table.replace(frame=table.frame @ turn.transpose(0, 2, 1))
    table = join(
        turned, opposite.replace(side=np.char.add("other ", table.side), station=table.station + 7)
    )
    found = StaticContact(model, table).solve(np.zeros(63))
    other = full_preload(bodies_of(model), table, {})
    assert found.force.min() > 0 and other.residual < 1e-8
    assert other.force == pytest.approx(found.force, abs=1e-6 * found.force.max())
    assert set(other.reactions) == ({"slide along x"} if tilt else set()) == set(found.reactions)
    for name, amount in found.reactions.items():
        assert other.reactions[name] == pytest.approx(amount, rel=1e-3)
