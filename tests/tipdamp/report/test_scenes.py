"""Pictures in three dimensions: what is drawn is what was computed, on the user's own node
numbers."""

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tests.tipdamp.curved_pairs import curved_pairs
from tipdamp.fields import surface
from tipdamp.fields.pressure import patches
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing import plotly_moving, plotly_scene, scene
from tipdamp.report.drawing.scene import Points, Segments, Solid
from tipdamp.report.results import load_results
from tipdamp.report.subjects import bodies
from tipdamp.report.subjects.modes import shapes as mode_shapes
from tipdamp.report.subjects.pairs import contact_pairs
from tipdamp.report.subjects.pressure import pressure_map
from tipdamp.report.templating import FOLDER
from tipdamp.study.study import load_study


def drawn_force(item, points=None) -> float:
    """Integral of what an item of the picture shows as colour, linear between its corners (mm,
    N/mm2 or N/mm)."""
    if isinstance(item, Solid):
        a, b, c = item.position[item.triangles].transpose(1, 0, 2)
        size = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        return float((size * item.values[item.triangles].mean(axis=1)).sum())
    order = np.argsort(item.position[:, 1])
    return float(
        np.trapezoid(item.values[order], item.position[order, 1])
        if hasattr(np, "trapezoid")
        else trapezoid(item.values[order], item.position[order, 1])
    )


def test_drawn_pressure_carries_side_force():
    pairs = curved_pairs()
    arc = next(p for p in patches(pairs) if p.is_area)
    smooth = pairs.preload.copy()  # between the pairs the drawing is linear, as such a pressure is
    smooth[arc.rows] = 1e6 * arc.tributary * (1 + 100 * pairs.position[arc.rows, 1])
    pairs = replace(pairs, preload=smooth)
    picture = pressure_map({"the pull": pairs}, {}, (0, 1, 0))
    solids = [i for i in picture.items if isinstance(i, Solid)]
    line = [i for i in picture.items if isinstance(i, Points) and i.name == "side 'line'"]
    assert [s.name for s in solids] == ["side 'arc'"] and len(line) == 1
    for item in (solids[0], line[0]):
        side = item.name.split("'")[1]
        mine = pairs.side == side
        force = np.maximum(pairs.preload[mine], 0).sum()
        # the drawn patch is lifted off the arc of 5 mm by 0.002 of its extent
        assert drawn_force(item) == pytest.approx(force, rel=0.01 if side == "arc" else 1e-9)


def test_stems_are_as_long_as_preload():
    pairs = curved_pairs()
    items = pressure_map({"the pull": pairs}, {}, (0, 1, 0)).items
    stems = next(i for i in items if isinstance(i, Segments))
    closed = pairs.preload > 0
    assert 0 < (~closed).sum() == len(next(i for i in items if i.name == "open pairs").position)
    assert np.allclose(stems.start, 1e3 * pairs.position[closed])
    arrow = stems.end - stems.start
    ratio = np.einsum("ij,ij->i", arrow, pairs.normal[closed]) / pairs.preload[closed]
    assert np.allclose(ratio, ratio[0]) and np.allclose(
        np.linalg.norm(arrow, axis=1), ratio * pairs.preload[closed]
    )


def test_a_single_pair_has_a_picture():
    """Which has no extent of its own."""
    pairs = curved_pairs()
    one = pairs.select(np.arange(len(pairs)) == np.flatnonzero(pairs.preload > 0)[0])
    picture = pressure_map({"the pull": one}, {}, (0, 1, 0))
    assert np.ptp(picture.box, axis=0) == pytest.approx([2.0, 2.0, 2.0])
    stem = next(i for i in picture.items if isinstance(i, Segments))
    assert np.linalg.norm(stem.end - stem.start) == pytest.approx(1.0)
    ratio = plotly_scene.figure_of(picture).layout.scene.aspectratio
    assert np.isfinite([ratio.x, ratio.y, ratio.z]).all()


def test_rig_scene_carries_the_preload(rig_results):
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    surfaces = surface.load(rig_results.path("surface.npz"))
    picture = pressure_map({"the pull": pairs}, surfaces, (0, 1, 0))
    sides = rig_results.read_json("preload.json")["sides"]
    flat = next(i for i in picture.items if isinstance(i, Solid) and i.values is not None)
    line = next(i for i in picture.items if isinstance(i, Points) and i.name == "side 'left'")
    # lifted by 0.14 mm, plane
    assert drawn_force(flat) == pytest.approx(sides["right"]["sum_N"], rel=1e-3)
    assert drawn_force(line) == pytest.approx(sides["left"]["sum_N"], rel=1e-9)
    bodies = [i for i in picture.items if isinstance(i, Solid) and i.values is None]
    assert (
        [b.name for b in bodies] == ["blades", "damper"]
        and bodies[0].opacity < 0.3
        and bodies[1].opacity == 1
    )
    box = np.array([bodies[1].position.min(axis=0), bodies[1].position.max(axis=0)])
    assert (picture.box[0] < box[0]).all() and (picture.box[1] > box[1]).all()
    assert np.allclose(
        box, 1e3 * np.array(rig_results.read_json("inspect.json")["bodies"]["damper"]["box_m"])
    )


def test_load_cases_in_a_menu():
    pairs = curved_pairs()
    other = pairs.replace(preload=2 * pairs.preload)
    picture = pressure_map({"the pull": pairs, "takeoff": other}, {}, (0, 1, 0))
    assert picture.cases == ["the pull", "takeoff"]
    drawn = [item for item in picture.items if getattr(item, "scale", None) is not None]
    for title in {item.scale.title for item in drawn}:  # one range of colours for both cases
        alike = [item for item in drawn if item.scale.title == title]
        assert {item.case for item in alike} == set(picture.cases)
        assert {item.scale.high for item in alike} == {max(item.values.max() for item in alike)}
    figure = plotly_scene.figure_of(picture)
    buttons = figure.layout.updatemenus[0].buttons
    assert [b.label for b in buttons] == picture.cases
    shown = [list(b.args[0]["visible"]) for b in buttons]
    assert [bool(t.visible) for t in figure.data] == shown[0] and shown[0] == [
        not v for v in shown[1]
    ]
    solids = [t for t in figure.data if t.type == "mesh3d"]
    assert np.allclose(np.asarray(solids[1].intensity), 2 * np.asarray(solids[0].intensity))
    assert solids[0].cmax == solids[1].cmax == pytest.approx(np.max(solids[1].intensity), rel=1e-6)


def test_frames_are_right_handed():
    pairs = curved_pairs()
    places = {"blades": pairs.position + 3e-6 * pairs.normal, "damper": pairs.position}
    picture = contact_pairs(pairs, places, {}, (0, 1, 0))
    arrow = {
        i.name[:2].rstrip(","): i.end - i.start for i in picture.items if isinstance(i, Segments)
    }
    t1, t2, n = (arrow[k] / np.linalg.norm(arrow[k], axis=1)[:, None] for k in ("t1", "t2", "n"))
    assert (
        np.allclose(np.cross(t1, t2), n)
        and np.allclose(n, pairs.normal)
        and np.allclose(t1, [0, 1, 0])
    )
    start = np.concatenate(
        [i.start for i in picture.items if isinstance(i, Segments) and i.name.startswith("t1")]
    )
    # not within the faces
    assert np.einsum("px,px->p", start - 1e3 * places["damper"], pairs.normal).min() > 0
    texts = [
        t
        for i in picture.items
        if isinstance(i, Points) and i.name.startswith("damper nodes")
        for t in i.hover
    ]
    for i, text in enumerate(texts):  # the sides one after the other, as in the table
        found = re.search(
            r"side (\w+), station (\d+), row (\d+)\nblade node (\d+), damper node (\d+)\n"
            r"nodes apart: ([\d.]+) µm along n",
            text,
        )
        assert found.groups()[:5] == (
            pairs.side[i],
            str(pairs.station[i]),
            str(pairs.row[i]),
            str(1000 + 7 * i),
            str(50 + 3 * i),
        )
        assert float(found[6]) == pytest.approx(3.0)
    gap = next(i for i in picture.items if i.name == "from node to node")
    assert np.allclose(gap.end - gap.start, 3e-3 * pairs.normal)


def test_sides_are_seen_from_outside():
    pairs = curved_pairs()
    for turn in np.linalg.qr(np.random.default_rng(1).standard_normal((4, 3, 3)))[0]:
        turned = pairs.replace(position=pairs.position @ turn.T)
        axis = turn @ [0, 1, 0]
        look = scene.view(turn @ np.array([0.3, 0, 1.0]), axis)
        assert np.dot(look.up, axis) == pytest.approx(0, abs=1e-12) and len(turned) == len(pairs)
        for lean in (-0.7, 0.7):  # sides that lean by 35 degrees to either hand
            side = turn @ np.array([0.3 + lean, 0, 1.0 - 0.3 * lean])
            assert np.dot(look.eye, side) > 0


def unpacked(text):
    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, 3)


@pytest.fixture(scope="module")
def rig_modes(rig, rig_results):
    results = load_results(
        load_study(rig / "rig.toml"), rig_results, dict.fromkeys(("reduce", "preload", "tune"), [])
    )
    return results.model, results.surfaces, results.shapes, next(mode_shapes(results))


def test_modes_are_those_of_the_stages(rig_results, rig_modes):
    *_, picture = rig_modes
    tune = rig_results.read_json("tune.json")
    free = rig_results.read_json("reduce.json")
    kept = [m for m in picture.motions if m.kind == "kept stations stuck"]
    assert [m.hz for m in kept[:6]] == pytest.approx(tune["stuck_modes_hz"]["tuned"][:6])
    tracked = [m for m in kept if "tracked" in m.label]
    assert len(tracked) == 1 and tracked[0].hz == pytest.approx(tune["stuck_hz"]["tuned"])
    alone = [m for m in picture.motions if m.kind == "blades by themselves"]
    assert [m.hz for m in alone] == pytest.approx(free["free_modes_hz"][:6], rel=1e-9)
    assert all(set(m.shapes) == {"blades"} for m in alone) and all(len(m.shapes) == 2 for m in kept)
    damper = [m for m in picture.motions if m.kind == "damper by itself"]
    assert len(damper) == 6 and min(m.hz for m in damper) > 1000  # no rigid motion among them
    for m in picture.motions:
        assert max(np.linalg.norm(u, axis=-1).max() for u in m.shapes.values()) == pytest.approx(
            1, rel=1e-6
        )
        assert f"{m.hz:.1f} Hz" in m.caption


def test_stuck_pairs_move_together(rig_results, rig_modes):
    """The tracked mode: the relative motion of the kept pairs is small, and that of the nodes is B
    q."""
    model, surfaces, (stuck, _), picture = rig_modes
    kept = ContactTable.load(rig_results.path("kept.csv"))
    kept = kept.select(kept.carrying)
    tracked = next(m for m in picture.motions if "tracked" in m.label)
    u = {
        b: dict(zip(surfaces[b].node.tolist(), tracked.shapes[b][0], strict=True)) for b in surfaces
    }
    blade = np.array([u["blades"][n] for n in kept.blade_node.tolist()])
    damper = np.array([u["damper"][n] for n in kept.damper_node.tolist()])
    q = stuck.q[:, [i for i, t in enumerate(stuck.label) if "tracked" in t][0]]
    rows = [q[model.dofs("blades", n)] for n in kept.blade_node.tolist()]
    ratio = np.linalg.norm(rows) / np.linalg.norm(blade)
    assert np.allclose(np.array(rows) / ratio, blade, atol=1e-5)
    assert np.linalg.norm(damper - blade) < np.linalg.norm(blade)


def test_first_frame_is_the_mode(rig_modes, tmp_path):
    """moving.js at phase 0: rest + amplitude * shape, at phase pi/2 the rest, at pi the other
    way."""
    node = shutil.which("node") or pytest.skip("node is not installed")
    *_, picture = rig_modes
    data = plotly_moving.data_of(picture)
    body, mode = data["bodies"][1], data["motions"][0]
    rest, shape = body["rest"], mode["shapes"][body["name"]]
    (tmp_path / "data.json").write_text(json.dumps([rest, shape, mode["amplitude"]]))
    script = FOLDER / "moving.js"
    code = f"""const {{decoded, displaced, factors}} = require({json.dumps(str(script))});
const [rest, shape, size] = JSON.parse(require("fs").readFileSync(process.argv[1]));
const x0 = decoded(rest, Float32Array), u = decoded(shape, Float32Array);
const frame = p => displaced(x0, u, factors([1], p).map(f => size * f)).map(v => [...v]);
console.log(JSON.stringify([0, Math.PI / 2, Math.PI].map(frame)));"""
    out = subprocess.run(
        [node, "-e", code, str(tmp_path / "data.json")], capture_output=True, text=True, check=True
    )
    frames = np.array(json.loads(out.stdout)).transpose(0, 2, 1)
    surf, first = picture.surfaces["damper"], picture.motions[0]
    assert np.allclose(
        frames[0], 1e3 * surf.position + first.amplitude * first.shapes["damper"][0], atol=1e-4
    )
    assert np.allclose(frames[1], 1e3 * surf.position, atol=1e-4)
    assert np.allclose(frames[0] + frames[2], 2 * frames[1], atol=1e-4)
    assert np.array_equal(unpacked(shape), first.shapes["damper"][0])


def test_what_is_shown_first_is_what_the_first_button_shows():
    """Each button shows its own case and what belongs to all; names that start switched off wait in
    the legend, wherever they are shown."""
    pairs = curved_pairs()
    cases = {"the pull": pairs, "another": pairs.replace(preload=0.5 * pairs.preload)}
    picture = pressure_map(cases, {}, (0, 1, 0))
    off = next(item.name for item in picture.items if item.name)
    drawn = plotly_scene.figure_of(replace(picture, hidden=frozenset({off})))
    buttons = drawn.layout.updatemenus[0].buttons
    assert len(buttons) == len(picture.cases) == 2
    assert [trace.visible for trace in drawn.data] == list(buttons[0].args[0]["visible"])
    for button, case in zip(buttons, picture.cases, strict=True):
        states = button.args[0]["visible"]
        for item, state in zip(picture.items, states, strict=True):
            there = item.case in ("", case)
            assert state == (("legendonly" if item.name == off else True) if there else False)


def test_groups_that_a_study_does_not_name_share_an_entry_where_they_are_many():
    """Files of gmsh have a group for every surface; each point still says its own."""
    n = np.arange(40)
    mesh = SimpleNamespace(
        groups={f"surface {k}": n[k : k + 1] for k in n},
        dimension={},
        position=np.zeros((40, 3)),
        index=lambda nodes: nodes,
    )
    found = list(bodies._groups({"blades": mesh}, {("blades", "surface 3")}))
    assert found[0][0].name == "blades: surface 3" and found[0][1]
    assert {points.name for points, named in found if not named} == {"blades: other groups"}
    assert found[1][0].hover == ("blades, group surface 0\nnode 0",)
    few = SimpleNamespace(**{**vars(mesh), "groups": dict(list(mesh.groups.items())[:5])})
    assert len({points.name for points, _ in bodies._groups({"blades": few}, set())}) == 5
