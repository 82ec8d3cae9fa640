"""Pictures in three dimensions: what is drawn is what was computed, on the user's own node numbers."""

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hbm.contact import ContactTable
from hbm.model import ReducedModel
from modal.craig_bampton import craig_bampton
from modal.elasticity import Material, elastic_body
from tests.modal.blocks import HEIGHT, LENGTH, WIDTH, block
from tipdamp import surface
from tipdamp import visualization as pictures
from tipdamp.pressure import patches
from tipdamp.report import draw_scene, modes, scene, space_figures
from tipdamp.report.scene import Points, Segments, Solid

KINDS = ("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge", "wedge15", "wedge18")


def curved_pairs(rows=3, stations=6, seed=3) -> ContactTable:
    """One side on a circular arc with irregular stations and forces, another that is a line."""
    rng = np.random.default_rng(seed)
    y = np.cumsum(rng.uniform(1e-3, 4e-3, stations))
    angle = np.linspace(0.3, 1.1, rows)
    grid = [(s, r) for s in range(stations) for r in range(rows)]
    n = np.array([[np.cos(angle[r]), 0, np.sin(angle[r])] for _, r in grid])
    place = np.array([[0, y[s], 0] for s, _ in grid]) + 5e-3 * n
    line_n = np.tile([-1.0, 0, 0], (stations, 1))
    normal, position = np.vstack([n, line_n]), np.vstack([place, np.column_stack([-5e-3 + 0 * y, y, 0 * y])])
    t1 = np.tile([0.0, 1, 0], (len(normal), 1))
    frame = np.stack([t1, np.cross(normal, t1), normal], axis=1)
    P = len(normal)
    side = np.array(["arc"] * len(grid) + ["line"] * stations)
    return ContactTable(side, np.r_[[s for s, _ in grid], np.arange(stations)], np.r_[[r for _, r in grid],
                        np.zeros(stations, int)], ["blades"] * P, 1000 + 7 * np.arange(P), ["damper"] * P,
                        50 + 3 * np.arange(P), position, frame, np.zeros(P), np.full(P, 1e6), np.full(P, 9e5),
                        np.full(P, 0.6), rng.uniform(-1, 5, P), np.ones(P))


def drawn_force(item, points=None) -> float:
    """Integral of what an item of the picture shows as colour, linear between its corners (mm, N/mm2 or N/mm)."""
    if isinstance(item, Solid):
        a, b, c = item.position[item.triangles].transpose(1, 0, 2)
        size = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        return float((size * item.values[item.triangles].mean(axis=1)).sum())
    order = np.argsort(item.position[:, 1])
    return float(np.trapezoid(item.values[order], item.position[order, 1]) if hasattr(np, "trapezoid")
                 else np.trapz(item.values[order], item.position[order, 1]))


# ---- surfaces --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_skin_of_every_cell_is_closed_and_looks_outward(kind):
    mesh = block(kind)
    skin = surface.skin(mesh, "bar")
    a, b, c = skin.position[skin.triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a) / 2
    # area and, by the divergence theorem, volume of the box
    area = 2 * (LENGTH * WIDTH + WIDTH * HEIGHT + HEIGHT * LENGTH)
    assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(area, rel=1e-12)
    assert np.einsum("ij,ij->", a, normal) / 3 == pytest.approx(LENGTH * WIDTH * HEIGHT, rel=1e-12)
    edges = np.sort(skin.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert set(skin.node.tolist()) <= set(mesh.node.tolist())
    assert np.array_equal(mesh.position[mesh.index(skin.node)], skin.position)
    lengths = np.linalg.norm(np.diff(skin.position[skin.edges], axis=1), axis=2).sum()
    assert lengths == pytest.approx(4 * (LENGTH + WIDTH + HEIGHT), rel=1e-12)     # the twelve edges of the box alone


def test_a_fine_skin_is_thinned():
    mesh = block("hexahedron", (40, 12, 8))
    skin = surface.skin(mesh, "bar", most=300)
    whole = surface.skin(mesh, "bar")
    assert skin.thinned and not whole.thinned and 150 < len(skin.node) <= 300 < len(whole.node)
    assert np.array_equal(mesh.position[mesh.index(skin.node)], skin.position)    # real nodes, where they are
    for k, size in enumerate((LENGTH, WIDTH, HEIGHT)):
        assert np.ptp(skin.position[:, k]) > 0.85 * size
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]       # oblique to the grid of cells
    oblique = replace(mesh, position=mesh.position @ turn)
    for most in range(40, 400, 20):
        assert most / 4 < len(surface.skin(oblique, "bar", most=most).node) <= most


@pytest.fixture(scope="module")
def bar():
    mesh = block("hexahedron20", (4, 2, 1))
    body = elastic_body(mesh, Material(207e9, 0.3, 7850), "bar", clamp="clamp" if "clamp" in mesh.groups else None,
                        free="clamp" not in mesh.groups)
    masters = mesh.node[np.abs(mesh.position[:, 0] - LENGTH) < 1e-9]
    return mesh, craig_bampton(body, masters, 4)


def test_skin_moves_as_the_recovery_of_the_reduction(bar, tmp_path):
    mesh, reduction = bar
    skin = surface.skin(mesh, "bar", reduction)
    surface.save([skin], tmp_path / "s.npz")
    again = surface.load(tmp_path / "s.npz")["bar"]
    q = np.random.default_rng(0).standard_normal(reduction.model.size)
    full = reduction.recover(q)[mesh.index(again.node)]
    assert np.abs(again.displacement(q) - full).max() < 1e-5 * np.abs(full).max()     # single precision


# ---- preload and pressure --------------------------------------------------------------------------------------


def test_the_drawn_pressure_carries_the_side_force():
    pairs = curved_pairs()
    arc = next(p for p in patches(pairs) if p.is_area)
    smooth = pairs.preload.copy()                   # between the pairs the drawing is linear, as such a pressure is
    smooth[arc.rows] = 1e6 * arc.share * (1 + 100 * pairs.position[arc.rows, 1])
    pairs = replace(pairs, preload=smooth)
    picture = space_figures.pressure_map({"the pull": pairs}, {}, (0, 1, 0))
    solids = [i for i in picture.items if isinstance(i, Solid)]
    line = [i for i in picture.items if isinstance(i, Points) and i.name == "side 'line'"]
    assert [s.name for s in solids] == ["side 'arc'"] and len(line) == 1
    for item in (solids[0], line[0]):
        side = item.name.split("'")[1]
        mine = pairs.side == side
        force = np.maximum(pairs.preload[mine], 0).sum()
        # the drawn patch is lifted off the arc of 5 mm by 0.002 of its extent
        assert drawn_force(item) == pytest.approx(force, rel=0.01 if side == "arc" else 1e-9)
    for patch in patches(pairs):
        load = patch.load(pairs.preload)
        factor = 1e6 if patch.is_area else 1e3
        assert (load * patch.share).sum() * factor == pytest.approx(np.maximum(pairs.preload[patch.rows], 0).sum())
        assert (load >= 0).all() and (load[pairs.preload[patch.rows] <= 0] == 0).all()


def test_the_share_of_a_pair_is_its_cell_of_the_grid_whichever_way_its_rectangles_are_cut():
    """Half the distance to each neighbour, along the chords of the arc: a quarter of a rectangle at a corner."""
    pairs = curved_pairs(rows=4, stations=7)
    arc = next(p for p in patches(pairs) if p.is_area)
    grid = np.lexsort((pairs.row[arc.rows], pairs.station[arc.rows]))
    place = pairs.position[arc.rows][grid].reshape(7, 4, 3)
    across, along = (np.linalg.norm(np.diff(place, axis=axis), axis=2) for axis in (1, 0))
    cell = np.outer(half_to_neighbours(along[:, 0]), half_to_neighbours(across[0]))
    assert arc.share[grid] == pytest.approx(cell.ravel(), rel=1e-9)


def half_to_neighbours(steps):
    return np.convolve(steps, [0.5, 0.5])


def test_the_patch_is_the_grid_of_the_pairs():
    pairs = curved_pairs(rows=4, stations=7)
    arc = next(p for p in patches(pairs) if p.is_area)
    assert len(arc.cells) == 2 * 3 * 6
    place = pairs.position[arc.rows][arc.cells]
    normal = np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0])
    assert (np.einsum("ij,ij->i", normal, pairs.normal[arc.rows[arc.cells[:, 0]]]) > 0).all()
    station, row = pairs.station[arc.rows][arc.cells], pairs.row[arc.rows][arc.cells]
    assert np.ptp(station, axis=1).max() == 1 and np.ptp(row, axis=1).max() == 1


def test_stems_are_as_long_as_the_preload_and_open_pairs_have_none():
    pairs = curved_pairs()
    items = space_figures.pressure_map({"the pull": pairs}, {}, (0, 1, 0)).items
    stems = next(i for i in items if isinstance(i, Segments))
    closed = pairs.preload > 0
    assert 0 < (~closed).sum() == len(next(i for i in items if i.name == "open pairs").position)
    assert np.allclose(stems.start, 1e3 * pairs.position[closed])
    arrow = stems.end - stems.start
    ratio = np.einsum("ij,ij->i", arrow, pairs.normal[closed]) / pairs.preload[closed]
    assert np.allclose(ratio, ratio[0]) and np.allclose(np.linalg.norm(arrow, axis=1), ratio * pairs.preload[closed])


def test_rig_picture_carries_what_the_run_found(rig_results):
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    surfaces = surface.load(rig_results.path("surface.npz"))
    picture = space_figures.pressure_map({"the pull": pairs}, surfaces, (0, 1, 0))
    sides = rig_results.read_json("preload.json")["sides"]
    flat = next(i for i in picture.items if isinstance(i, Solid) and i.values is not None)
    line = next(i for i in picture.items if isinstance(i, Points) and i.name == "side 'left'")
    assert drawn_force(flat) == pytest.approx(sides["right"]["sum_N"], rel=1e-3)      # lifted by 0.14 mm, plane
    assert drawn_force(line) == pytest.approx(sides["left"]["sum_N"], rel=1e-9)
    bodies = [i for i in picture.items if isinstance(i, Solid) and i.values is None]
    assert [b.name for b in bodies] == ["blades", "damper"] and bodies[0].opacity < 0.3 and bodies[1].opacity == 1
    box = np.array([bodies[1].position.min(axis=0), bodies[1].position.max(axis=0)])
    assert (picture.box[0] < box[0]).all() and (picture.box[1] > box[1]).all()
    assert np.allclose(box, 1e3 * np.array(rig_results.read_json("inspect.json")["bodies"]["damper"]["box_m"]))


def test_cases_are_chosen_from_a_menu():
    pairs = curved_pairs()
    other = pairs.replace(preload=2 * pairs.preload)
    picture = space_figures.pressure_map({"the pull": pairs, "takeoff": other}, {}, (0, 1, 0))
    assert picture.cases == ["the pull", "takeoff"]
    figure = draw_scene.figure_of(picture)
    buttons = figure.layout.updatemenus[0].buttons
    assert [b.label for b in buttons] == picture.cases
    shown = [list(b.args[0]["visible"]) for b in buttons]
    assert [bool(t.visible) for t in figure.data] == shown[0] and shown[0] == [not v for v in shown[1]]
    solids = [t for t in figure.data if t.type == "mesh3d"]
    assert np.allclose(np.asarray(solids[1].intensity), 2 * np.asarray(solids[0].intensity))
    assert solids[0].cmax == solids[1].cmax == pytest.approx(np.max(solids[1].intensity), rel=1e-6)


# ---- pairs -----------------------------------------------------------------------------------------------------


def test_triads_are_drawn_right_handed_and_nodes_are_the_users():
    pairs = curved_pairs()
    places = {"blades": pairs.position + 3e-6 * pairs.normal, "damper": pairs.position}
    picture = space_figures.contact_pairs(pairs, places, {}, (0, 1, 0))
    arrow = {i.name[:2].rstrip(","): i.end - i.start for i in picture.items if isinstance(i, Segments)}
    t1, t2, n = (arrow[k] / np.linalg.norm(arrow[k], axis=1)[:, None] for k in ("t1", "t2", "n"))
    assert np.allclose(np.cross(t1, t2), n) and np.allclose(n, pairs.normal) and np.allclose(t1, [0, 1, 0])
    texts = [t for i in picture.items if isinstance(i, Points) and i.name.startswith("damper nodes") for t in i.hover]
    for i, text in enumerate(texts):       # the sides one after the other, as in the table
        found = re.search(r"side (\w+), station (\d+), row (\d+)\nblade node (\d+), damper node (\d+)\n"
                          r"nodes apart: ([\d.]+) µm along n", text)
        assert found.groups()[:5] == (pairs.side[i], str(pairs.station[i]), str(pairs.row[i]), str(1000 + 7 * i),
                                      str(50 + 3 * i))
        assert float(found[6]) == pytest.approx(3.0)
    gap = next(i for i in picture.items if i.name == "from node to node")
    assert np.allclose(gap.end - gap.start, 3e-3 * pairs.normal)


def test_every_side_is_seen_from_outside():
    pairs = curved_pairs()
    for turn in np.linalg.qr(np.random.default_rng(1).standard_normal((4, 3, 3)))[0]:
        turned = pairs.replace(position=pairs.position @ turn.T)
        axis = turn @ [0, 1, 0]
        look = scene.view(turn @ np.array([0.3, 0, 1.0]), axis)
        assert np.dot(look["up"], axis) == pytest.approx(0, abs=1e-12) and len(turned) == len(pairs)
        for lean in (-0.7, 0.7):         # sides that lean by 35 degrees to either hand
            side = turn @ np.array([0.3 + lean, 0, 1.0 - 0.3 * lean])
            assert np.dot(look["eye"], side) > 0


# ---- modes -----------------------------------------------------------------------------------------------------


def unpacked(text):
    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, 3)


@pytest.fixture(scope="module")
def rig_modes(rig_results):
    model, surfaces = ReducedModel.load(rig_results.path("model.npz")), surface.load(rig_results.path("surface.npz"))
    found = [pictures.Shapes.load(rig_results.path(n)) for n in ("stuck_modes.npz", "free_modes.npz")]
    return model, surfaces, found, modes.mode_shapes(surfaces, model, found, (0, 0, 1), (0, 1, 0))


def test_list_of_modes_is_what_the_stages_found(rig_results, rig_modes):
    *_, picture = rig_modes
    tune, free = rig_results.read_json("tune.json"), rig_results.read_json("reduce.json")
    kept = [m for m in picture.modes if m.kind == "kept stations stuck"]
    assert [m.hz for m in kept[:6]] == pytest.approx(tune["stuck_modes_hz"]["tuned"][:6])
    tracked = [m for m in kept if "tracked" in m.label]
    assert len(tracked) == 1 and tracked[0].hz == pytest.approx(tune["stuck_hz"]["tuned"])
    alone = [m for m in picture.modes if m.kind == "blades by themselves"]
    assert [m.hz for m in alone] == pytest.approx(free["free_modes_hz"][:6], rel=1e-9)
    assert all(set(m.shapes) == {"blades"} for m in alone) and all(len(m.shapes) == 2 for m in kept)
    damper = [m for m in picture.modes if m.kind == "damper by itself"]
    assert len(damper) == 6 and min(m.hz for m in damper) > 1000       # no rigid motion among them
    for m in picture.modes:
        assert max(np.linalg.norm(u, axis=1).max() for u in m.shapes.values()) == pytest.approx(1, rel=1e-6)
        assert f"{m.hz:.1f} Hz" in m.caption


def test_stuck_pairs_move_together_in_the_picture(rig_results, rig_modes):
    """The tracked mode: the relative motion of the kept pairs is small, and that of the nodes is B q."""
    model, surfaces, (stuck, _), picture = rig_modes
    kept = ContactTable.load(rig_results.path("kept.csv"))
    kept = kept.select(kept.carrying)
    tracked = next(m for m in picture.modes if "tracked" in m.label)
    u = {b: dict(zip(surfaces[b].node.tolist(), tracked.shapes[b], strict=True)) for b in surfaces}
    blade = np.array([u["blades"][n] for n in kept.blade_node.tolist()])
    damper = np.array([u["damper"][n] for n in kept.damper_node.tolist()])
    q = stuck.q[:, [i for i, t in enumerate(stuck.label) if "tracked" in t][0]]
    rows = [q[model.dofs("blades", n)] for n in kept.blade_node.tolist()]
    ratio = np.linalg.norm(rows) / np.linalg.norm(blade)
    assert np.allclose(np.array(rows) / ratio, blade, atol=1e-5)
    assert np.linalg.norm(damper - blade) < np.linalg.norm(blade)


def test_first_frame_is_the_mode(rig_modes, tmp_path):
    """modes.js at phase 0: rest + amplitude * shape, at phase pi/2 the rest, at pi the other way."""
    node = shutil.which("node") or pytest.skip("node is not installed")
    *_, picture = rig_modes
    data = modes.data_of(picture)
    body, mode = data["bodies"][1], data["modes"][0]
    rest, shape = body["rest"], mode["shapes"][body["name"]]
    (tmp_path / "data.json").write_text(json.dumps([rest, shape, mode["amplitude"]]))
    script = Path(modes.__file__).with_name("modes.js")
    code = f"""const {{decoded, displaced}} = require({json.dumps(str(script))});
const [rest, shape, size] = JSON.parse(require("fs").readFileSync(process.argv[1]));
const x0 = decoded(rest, Float32Array), u = decoded(shape, Float32Array);
const frame = p => displaced(x0, u, size * Math.cos(p)).map(v => [...v]);
console.log(JSON.stringify([0, Math.PI / 2, Math.PI].map(frame)));"""
    out = subprocess.run([node, "-e", code, str(tmp_path / "data.json")], capture_output=True, text=True, check=True)
    frames = np.array(json.loads(out.stdout)).transpose(0, 2, 1)
    surf, first = picture.surfaces["damper"], picture.modes[0]
    assert np.allclose(frames[0], 1e3 * surf.position + first.amplitude * first.shapes["damper"], atol=1e-4)
    assert np.allclose(frames[1], 1e3 * surf.position, atol=1e-4)
    assert np.allclose(frames[0] + frames[2], 2 * frames[1], atol=1e-4)
    assert np.array_equal(unpacked(shape), first.shapes["damper"])


# ---- files for ParaView ----------------------------------------------------------------------------------------


def test_preload_can_be_looked_at_in_paraview(rig_results):
    meshio = pytest.importorskip("meshio")
    found = meshio.read(rig_results.path("preload.vtu"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    assert np.array_equal(found.point_data["preload (N), pull"], pairs.preload)
    assert np.array_equal(found.point_data["damper node"], pairs.damper_node)
    a, b, c = found.points[found.cells_dict["triangle"]].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    p = found.point_data["pressure (N/mm2), pull"][found.cells_dict["triangle"]].mean(axis=1)
    force = rig_results.read_json("preload.json")["sides"]["right"]["sum_N"]
    assert 1e6 * (area * p).sum() == pytest.approx(force, rel=1e-3)         # linear between the pairs


def test_stuck_modes_can_be_looked_at_in_paraview(rig_results, rig_modes):
    meshio = pytest.importorskip("meshio")
    model, surfaces, (stuck, _), _ = rig_modes
    found = meshio.read(rig_results.path("stuck_modes.vtu"))
    names = [n for n in found.point_data if "stuck" in n]
    assert names == [f"{k}, {t}" for k, t in zip(stuck.kind, stuck.label, strict=True)]
    damper = found.point_data["body"] == 1
    assert np.array_equal(found.point_data["node"][damper], surfaces["damper"].node)
    u = surfaces["damper"].displacement(stuck.q[model.body == "damper", 0])
    assert np.allclose(found.point_data[names[0]][damper], u, rtol=1e-5)
