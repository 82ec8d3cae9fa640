"""Blades and a wedge damper whose meshes do not match, from files to a report; the same blades with
a damper that matches and one that does not; and the matching meshes taken as surfaces, beside the
same taken as pairs of nodes."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.conftest import changed
from tests.refined_meshes import refine
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.faces import group_faces
from tipdamp.readers.dispatch import read_mesh

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
FOLDER = Path(__file__).parents[1] / "reference" / "platform-wedge"
# of 60 N between flats at 30 and 45 degrees to the pull
BALANCE = {
    "left": 60 * np.sin(np.radians(45)) / np.sin(np.radians(75)),
    "right": 60 * np.sin(np.radians(30)) / np.sin(np.radians(75)),
}


def run(folder, name, meshes, *changes, verbs=("run",)):
    """Results of unlike.toml with some meshes and changes, under a name of its own."""
    for body in ("blades", "damper"):
        shutil.copy(FOLDER / f"{meshes}_{body}.msh", folder)
    text = (FOLDER / "unlike.toml").read_text(encoding="utf-8").replace("unlike_", f"{meshes}_")
    path = folder / f"{name}.toml"
    path.write_text(changed(text, *changes), encoding="utf-8")
    for verb in verbs:
        assert main([verb, str(path), "--quiet"]) == 0
    return Store(folder / "results" / name)


def test_from_unlike_meshes_to_a_report(tmp_path):
    """Side forces of the balance, frequencies over the free one and the peak of the matching
    meshes."""
    store = run(
        tmp_path,
        "unlike",
        "unlike",
        ("pull = 60", 'pull = 60\nhold = "y"'),
        ("levels = [0.1, 1, 3]", "levels = [3]"),
    )
    sides = store.read_json("preload.json")["sides"]
    for name, force in BALANCE.items():
        assert (
            sides[name]["sum_N"] == pytest.approx(force, rel=1e-6)
            and sides[name]["balance_error"] < 1e-8
        )
    free = store.read_json("reduce.json")["free_modes_hz"][0]
    assert store.read_json("tune.json")["stuck_hz"]["full_area"] / free == pytest.approx(
        855.16 / 824.3, rel=3e-3
    )
    up = store.read_json("summary.json")["responses"][0]
    assert up["complete"] and up["alike_backwards"]
    assert up["peak_hz"] / free == pytest.approx(823.62 / 824.3, rel=3e-4)
    assert up["peak_m"] == pytest.approx(3.1395e-3, rel=0.02)
    pairs = ContactTable.load(store.path("preload.csv"))
    left = pairs.select(pairs.side == "left")
    assert pairs.on_surface.all() and left.kn / left.area == pytest.approx(
        np.full(len(left), 102e6 / left.area.sum())
    )
    assert left.area.sum() == pytest.approx(36e-3 * 4.6188e-3, rel=1e-4)
    assert (store.folder / "report.html").is_file() and (
        store.folder / "figures" / "preload.png"
    ).is_file()
    tuned_by_area(tmp_path, store, free)


def tuned_by_area(folder, before, free):
    """The same, tuned half way to the free frequency: what is kept is where the preload is, in one
    piece on the side that rests on its lower edge."""
    target = round((before.read_json("tune.json")["stuck_hz"]["full_area"] + free) / 2, 1)
    path = folder / "unlike.toml"
    path.write_text(
        changed(path.read_text(), ('stations = "all"', f'by = "area"\ntarget_hz = {target}'))
    )
    assert main(["tune", str(path), "--quiet"]) == 0
    found, whole, kept = (
        before.read_json("tune.json"),
        *(ContactTable.load(before.path(f"{n}.csv")) for n in ("preload", "kept")),
    )
    assert found["stuck_hz"]["tuned"] == pytest.approx(target, abs=0.1)
    for side, force in BALANCE.items():
        mine = kept.side == side
        part = found["area"]["sides"][side]
        assert kept.preload[mine & kept.carrying].sum() == pytest.approx(force, rel=1e-6)
        assert kept.weight[mine] @ kept.area[mine] * 1e6 == pytest.approx(part["kept"], rel=1e-6)
        assert part["kept"] / part["closed"] == pytest.approx(found["area"]["share"], rel=1e-6)
    right = whole.side == "right"
    pressure = whole.preload / whole.area
    assert pressure[right & kept.carrying].min() > 0.8 * pressure[right & ~kept.carrying].max()


def test_matching_meshes_as_surfaces_and_as_nodes(tmp_path):
    """One pair of meshes taken both ways: stuck frequency within 0.1 %, the centres of the side
    forces within 2 % of the width of the flats."""
    verbs = ("reduce", "preload", "tune")
    nodes = run(
        tmp_path, "nodes", "coarse", ("[contact]", '[contact]\nshares = "tributary"'), verbs=verbs
    )
    surfaces = run(
        tmp_path, "surfaces", "coarse", ("[contact]", '[contact]\nmethod = "surfaces"'), verbs=verbs
    )
    hz = [store.read_json("tune.json")["stuck_hz"]["full_area"] for store in (nodes, surfaces)]
    assert hz[1] == pytest.approx(hz[0], rel=1e-3)
    tables = [ContactTable.load(store.path("preload.csv")) for store in (nodes, surfaces)]
    assert len(tables[0]) == 102 and not tables[0].on_surface.any() and tables[1].on_surface.all()
    for side in BALANCE:
        one, two = (t.select(t.side == side) for t in tables)
        centre = [
            np.average(t.position, axis=0, weights=np.maximum(t.preload, 0)) for t in (one, two)
        ]
        assert np.linalg.norm(centre[1] - centre[0]) < 0.02 * 4.6e-3


def per_station(store, mesh, count=9):
    """(2, count) N: the pressure between the corners of the damper's faces, linear on each, over
    strips along y."""
    pairs, forces = ContactTable.load(store.path("preload.csv")), []
    at = (np.stack(np.meshgrid(*[(np.arange(60) + 0.5) / 60] * 2), axis=-1)).reshape(-1, 2)
    at = at[at.sum(axis=1) < 1]
    shares = np.column_stack([1 - at.sum(axis=1), at])
    for side, group in (("left", "wd_L"), ("right", "wd_R")):
        mine = pairs.select(pairs.side == side)
        corners = np.concatenate(group_faces(mesh, group))[:, :3]
        vertex, place = np.unique(corners), mesh.position[corners]
        nearest = vertex[cKDTree(mesh.position[vertex]).query(mine.position)[1]]
        assert len(np.unique(nearest)) == len(mine) == len(vertex)
        pressure = np.zeros(len(mesh.node))
        pressure[nearest] = np.maximum(mine.preload, 0) / mine.area
        area = (
            np.linalg.norm(np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1)
            / 2
        )
        y = place[:, :, 1] @ shares.T
        force = pressure[corners] @ shares.T * area[:, None] / len(shares)
        strip = np.minimum((y - y.min()) / np.ptp(y) * count, count - 1).astype(int)
        forces.append(np.bincount(strip.ravel(), force.ravel(), count))
        assert forces[-1].sum() == pytest.approx(BALANCE[side], rel=2e-3)
    return np.array(forces)


def test_unlike_damper_on_the_blades_of_the_matching_one(tmp_path):
    """The damper that matches, its cells cut into eight, and the unlike one, whose cells are of
    that size: stuck frequency within 0.3 %, preload per station within 3 %; peak within 1 % of that
    with matching nodes."""
    stores, forces = [], []
    for name, damper in (
        ("alike", FOLDER / "coarse_damper.msh"),
        ("unlike", FOLDER / "unlike_damper.msh"),
    ):
        folder = tmp_path / name
        folder.mkdir()
        (refine if name == "alike" else shutil.copy)(damper, folder / "damper.msh")
        verbs = ("reduce", "preload", "tune") + ("respond",) * (name == "unlike")
        stores.append(
            run(
                folder,
                name,
                "coarse",
                ("coarse_damper", "damper"),
                ("pull = 60", 'pull = 60\nhold = "y"'),
                ("[contact]", '[contact]\nmethod = "surfaces"'),
                ("levels = [0.1, 1, 3]", "levels = [3]\nboth_ways = false"),
                verbs=verbs,
            )
        )
        forces.append(per_station(stores[-1], read_mesh(folder / "damper.msh", 1e-3)))
    hz = [store.read_json("tune.json")["stuck_hz"]["full_area"] for store in stores]
    assert hz[1] == pytest.approx(hz[0], rel=3e-3) and forces[1] == pytest.approx(
        forces[0], rel=0.03
    )
    (curve,) = stores[1].read_json("respond.json")["responses"]
    assert curve["complete"] and curve["peak_m"] == pytest.approx(3.1395e-3, rel=0.01)
    assert curve["peak_hz"] == pytest.approx(823.62, rel=1e-3)
