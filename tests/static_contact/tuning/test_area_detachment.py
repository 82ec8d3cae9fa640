"""Detachment by area: a rigid damper on a bed of springs, whose frequency is that of the area alone
on every mesh."""

import numpy as np
import pytest
from scipy import ndimage

from tests.contact_tables import contact_table
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.contact.contact_cells import cells_in, fade_of
from tipdamp.static_contact.contact.mirror import mirrors_of
from tipdamp.static_contact.tuning.area_detachment import detach_area, keep_area
from tipdamp.static_contact.tuning.station_detachment import DetachmentOptions
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly

LENGTH, WIDTH, STIFFNESS, MASS = 60e-3, 5e-3, 2e11, 0.1  # m, m, N/m3, kg
FOLLOW = np.array([1 / np.sqrt(MASS)])


def heave(model, pairs):
    """Of a rigid damper that moves along n alone."""
    B = np.zeros((3 * len(pairs), 1))
    B[2::3] = 1.0
    return B


def assembly():
    return StuckAssembly(
        ReducedModel.from_matrices(np.array([[MASS]]), np.zeros((1, 1)), body=["damper"]), heave
    )


def bed(n, m, seed=None):
    """(pairs on both sides, their areas): n x m rectangles each, of one stiffness per area, alike
    or of random size."""
    random = np.random.default_rng(seed)
    edges = [
        np.r_[0, np.sort(random.random(k - 1)) if seed is not None else np.arange(1, k) / k, 1]
        * size
        for k, size in ((n, LENGTH), (m, WIDTH))
    ]
    x = np.repeat((edges[0][1:] + edges[0][:-1]) / 2, m)
    y = np.tile((edges[1][1:] + edges[1][:-1]) / 2, n)
    area = np.tile(np.outer(np.diff(edges[0]), np.diff(edges[1])).ravel(), 2)
    place = np.tile(np.column_stack([x, y, 0 * x]), (2, 1))
    pairs = contact_table(
        np.tile(np.eye(3), (2 * n * m, 1, 1)),
        side=np.repeat(["left", "right"], n * m),
        station=np.tile(np.repeat(np.arange(n), m), 2),
        row=np.tile(np.arange(m), 2 * n),
        position=place,
        kn=STIFFNESS * area,
        kt=0 * area,
        area=area,
    )
    return pairs, area


def hz_of(area):
    return np.sqrt(STIFFNESS * area / MASS) / (2 * np.pi)


def hollow(pairs):
    """Pressure that rises to the edges, as under a flat punch."""
    x, y, _ = (pairs.position - pairs.position.mean(axis=0)).T
    return 1 + (2 * x / LENGTH) ** 2 + (2 * y / WIDTH) ** 2


@pytest.mark.parametrize("mesh", [(6, 3, None), (13, 5, 1), (12, 1, None)])
@pytest.mark.parametrize("order", ["from_edge", "least_loaded", "from_middle"])
def test_the_frequency_is_that_of_the_area_on_every_mesh(mesh, order):
    """omega^2 = k A / m: the share that is kept follows from the target, and gives it."""
    pairs, area = bed(*mesh)
    fade = fade_of(pairs, area, hollow(pairs) * area, (1, 0, 0), order)
    full = hz_of(2 * LENGTH * WIDTH)
    found = detach_area(assembly(), pairs, fade, 0.7 * full, FOLLOW, DetachmentOptions())
    assert (found.chosen.share, found.chosen.hz) == pytest.approx((0.49, 0.7 * full), rel=1e-6)
    for side in pairs.sides:
        mine = pairs.side == side
        assert found.pairs.weight[mine] @ area[mine] == pytest.approx(
            0.49 * LENGTH * WIDTH, rel=1e-6
        )
        assert ((found.pairs.weight[mine] > 0) & (found.pairs.weight[mine] < 1)).sum() <= 1
    assert [s.hz for s in found.history] == pytest.approx(
        [full * np.sqrt(s.share) for s in found.history], rel=1e-6
    )
    assert found.hz_per_share == pytest.approx(full / (2 * 0.7), rel=0.05)
    assert keep_area(
        assembly(), pairs, fade, 0.25, FOLLOW, DetachmentOptions()
    ).chosen.hz == pytest.approx(full / 2)


def kept_at(share, order, n=20, m=9):
    pairs, area = bed(n, m)
    fade = fade_of(pairs, area, hollow(pairs) * area, (1, 0, 0), order)
    return (fade.factors(share) > 0)[: n * m].reshape(n, m)


def test_the_contact_shrinks_from_its_edge():
    """Where the pressure is least in the middle: what 'from_edge' detaches reaches to the rim;
    'least_loaded' makes a hole; 'from_middle' leaves both ends over the whole width."""
    edge, least, ends = (
        kept_at(0.6, order) for order in ("from_edge", "least_loaded", "from_middle")
    )
    for kept, holes in ((edge, 0), (least, 1)):
        label, count = ndimage.label(~kept)
        at_rim = set(np.r_[label[0], label[-1], label[:, 0], label[:, -1]]) - {0}
        assert count - len(at_rim) == holes
    assert (
        not least[8:12, 3:6].any() and ends[:5].all() and ends[-5:].all() and not ends[7:13].any()
    )


@pytest.mark.parametrize("toward", [(1, 0), (0, 1), (1, -1)])
def test_the_contact_shrinks_where_the_preload_fades(toward):
    """A pressure that rises towards one edge or corner: the part next to it is kept, as the preload
    says. Points that lie in rows which are not quite straight do not matter."""
    pairs, area = bed(20, 9)
    x, y, _ = (pairs.position / [LENGTH, WIDTH, 1] - [0.5, 0.5, 0]).T
    pairs = pairs.replace(
        position=pairs.position + 1e-5 * np.random.default_rng(2).standard_normal((len(pairs), 3))
    )
    pressure = 2 + x * toward[0] + y * toward[1]
    fade = fade_of(pairs, area, pressure * area, (1, 0, 0))
    kept = fade.factors(0.3) > 0
    assert pressure[kept].min() > pressure[~kept].max() - 0.1


def test_even_pressure_shrinks_layer_by_layer():
    """From all edges alike; of a land of its own as of any other."""
    pairs, area = bed(20, 9)
    lands = pairs.select((pairs.station < 7) | (pairs.station > 12))
    fade = fade_of(lands, lands.area, lands.area * 1.0, (1, 0, 0))
    inner, outer, middle = (
        fade.begins[(lands.station == s) & (lands.row == 4)].min() for s in (6, 0, 3)
    )
    assert min(inner, outer) > middle


def test_what_is_open_leaves_first_and_its_neighbours_are_the_edge():
    """A hole that is open at rest: the closed part shrinks around it, and the open area counts for
    nothing."""
    pairs, area = bed(20, 9)
    load = area * 1.0
    hole = (np.abs(pairs.station - 9.5) < 2) & (np.abs(pairs.row - 4) < 2)
    load[hole] = -1.0
    fade = fade_of(pairs, area, load, (1, 0, 0))
    options = DetachmentOptions(load=load)
    full = hz_of(area[~hole].sum())
    found = detach_area(assembly(), pairs, fade, 0.99 * full, FOLLOW, options)
    assert found.history[0].hz == pytest.approx(full) and found.chosen.share == pytest.approx(
        0.99**2, rel=1e-6
    )
    assert not found.pairs.carrying[hole].any()
    assert (keep_area(assembly(), pairs, fade, 1.0, FOLLOW, options).pairs.weight == 1).all()
    beside = (np.abs(pairs.station - 9.5) < 3) & (np.abs(pairs.row - 4) < 3) & ~hole
    assert fade.begins[beside].min() > fade.begins[(pairs.station == 15) & (pairs.row == 4)].max()


def test_whole_cells():
    """All points of a cell stay or go together; the set nearest the target is taken, and no other
    cell bridges it."""
    pairs, area = bed(48, 4)
    size = 2.45e-3
    fade = fade_of(pairs, area, hollow(pairs) * area, (1, 0, 0), size=size)
    full = hz_of(2 * LENGTH * WIDTH)
    found = detach_area(assembly(), pairs, fade.whole(), 0.7 * full, FOLLOW, DetachmentOptions())
    mine = pairs.side == "left"
    cell = cells_in(pairs.position[mine][:, :2], size)
    assert len(np.unique(cell)) == 24 * 2
    weight = found.pairs.weight[mine]
    assert set(weight) == {0.0, 1.0} and all(
        np.ptp(weight[cell == c]) == 0 for c in np.unique(cell)
    )
    kept = found.pairs.weight @ area / area.sum()
    assert found.chosen.hz == pytest.approx(
        full * np.sqrt(kept)
    ) and found.chosen.share == pytest.approx(kept)
    assert abs(kept - 0.49) <= 0.6 / 48
    graded = detach_area(assembly(), pairs, fade, 0.7 * full, FOLLOW, DetachmentOptions())
    assert graded.chosen.share == pytest.approx(0.49, rel=1e-6)


def test_a_share_of_a_few_whole_cells():
    """Six cells a side: half of them are kept; less than one is refused."""
    pairs, area = bed(12, 4)
    fade = fade_of(pairs, area, hollow(pairs) * area, (1, 0, 0), size=11 / 12 * LENGTH / 6).whole()
    found = keep_area(assembly(), pairs, fade, 0.6, FOLLOW, DetachmentOptions())
    assert found.chosen.hz == pytest.approx(hz_of(LENGTH * WIDTH)) and len(found.history) == 6
    assert found.chosen.share == pytest.approx(0.5)
    with pytest.raises(
        InputError, match="10 % of the closed area is less than one cell, which is 16.7 %"
    ):
        keep_area(assembly(), pairs, fade, 0.1, FOLLOW, DetachmentOptions())


@pytest.mark.parametrize("factor", [1.1, 0.01])
def test_target_out_of_reach(factor):
    pairs, area = bed(6, 3)
    fade = fade_of(pairs, area, area, (1, 0, 0))
    with pytest.raises(
        InputError, match=r"target [\d.]+ Hz is not reachable: \d+\.\.\d+ Hz with 3.12..100 %"
    ):
        detach_area(
            assembly(), pairs, fade, factor * hz_of(2 * LENGTH * WIDTH), FOLLOW, DetachmentOptions()
        )


@pytest.mark.parametrize("beyond, reached", [(0.4, True), (0.6, False)])
def test_half_a_cell_beyond_the_ends_is_nearest_to_them(beyond, reached):
    """Two cells a side that leave whole: the frequencies of all and of half of the area, and half
    the step between them on both sides."""
    pairs, area = bed(2, 1)
    fade = fade_of(pairs, area, np.tile([1.0, 2.0], 2) * area, (1, 0, 0)).whole()
    low, high = hz_of(LENGTH * WIDTH), hz_of(2 * LENGTH * WIDTH)
    for target, share in ((high + beyond * (high - low), 1.0), (low - beyond * (high - low), 0.5)):
        if reached:
            found = detach_area(assembly(), pairs, fade, target, FOLLOW, DetachmentOptions())
            assert found.chosen.share == pytest.approx(share)
        else:
            with pytest.raises(InputError, match="is not reachable"):
                detach_area(assembly(), pairs, fade, target, FOLLOW, DetachmentOptions())


def moment_left(pairs, load, weight):
    """Of forces along n on what is kept, scaled to the whole load, about the middle, over load
    times length."""
    kept = weight * load
    arm = pairs.position - [LENGTH / 2, WIDTH / 2, 0]
    return np.abs((kept / kept.sum()) @ arm[:, :2]).max() / LENGTH


def noisy(pairs, share, seed=3):
    """An even pressure, within that share of itself as an unsymmetric mesh of the counterpart
    leaves it."""
    return pairs.area * (1 + share * np.random.default_rng(seed).uniform(-1, 1, len(pairs)))


@pytest.mark.parametrize("order", ["from_edge", "least_loaded", "from_middle"])
def test_mirrored_parts_go_together(order):
    """A pressure that is symmetric but for the noise of a mesh: whatever is kept leaves no moment
    but that noise."""
    pairs, area = bed(20, 9)
    load = noisy(pairs, 0.02)
    mirrors = mirrors_of(pairs, area, load, (1, 0, 0), (0, 0, 1))
    assert [m.pairwise for m in mirrors] == [True, True] and all(
        0.005 < m.noise < 0.02 for m in mirrors
    )
    alone, together = (
        [
            moment_left(
                pairs, load, fade_of(pairs, area, load, (1, 0, 0), order, None, found).factors(s)
            )
            for s in np.linspace(0.02, 0.5, 40)
        ]
        for found in ((), mirrors)
    )
    assert max(together) < 0.01 and (order == "from_middle" or max(alone) > 0.1)


def test_mirrored_parts_of_an_unsymmetric_mesh_go_together():
    """Points that have no images, as their distance doubles along the axis: of each share, mirrored
    parts are kept to about a point."""
    even, _ = bed(31, 7)
    edges = np.arange(32) / 31
    edges = LENGTH * edges * (2 + edges) / 3
    area = np.diff(edges)[even.station] * WIDTH / 7
    along = (edges[even.station] + edges[even.station + 1]) / 2
    pairs = even.replace(position=np.column_stack([along, even.position[:, 1:]]), area=area)
    load = noisy(pairs, 0.02)
    mirrors = mirrors_of(pairs, area, load, (1, 0, 0), (0, 0, 1))
    assert [m.pairwise for m in mirrors] == [False, True]
    alone, together = (
        [
            moment_left(
                pairs,
                load,
                fade_of(pairs, area, load, (1, 0, 0), "least_loaded", None, found).factors(s),
            )
            for s in np.linspace(0.05, 0.9, 15)
        ]
        for found in ((), mirrors)
    )
    assert max(together) < 0.02 and max(alone) > 0.1


@pytest.mark.parametrize("pull", [(1, 0), (0, 1)])
def test_what_is_not_symmetric_has_no_mirror(pull):
    """A pressure that rises along the axis is symmetric about the plane along it alone; one that
    rises across, as of a roll, on both sides in the same sense, about the plane across it alone."""
    pairs, area = bed(20, 9)
    pairs = pairs.replace(
        position=pairs.position + np.outer(pairs.side == "right", [0, 4 * WIDTH, 0])
    )
    x, y, _ = (pairs.position / [LENGTH, WIDTH, 1] - [0.5, 0.5, 0]).T
    y = np.where(pairs.side == "right", y - 4, y)
    mirrors = mirrors_of(pairs, area, area * (2 + pull[0] * x + pull[1] * y), (1, 0, 0), (0, 0, 1))
    normals = [np.abs(m.normal).argmax() for m in mirrors]
    assert normals == [pull[0]] and all(m.noise < 1e-9 for m in mirrors)
    assert mirrors[0].onto == (
        {"left": "right", "right": "left"} if pull[0] else {"left": "left", "right": "right"}
    )
