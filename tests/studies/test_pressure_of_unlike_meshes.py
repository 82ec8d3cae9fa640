"""The pressure that contact points of unlike meshes and pairs of nodes put between the same bodies,
per station, in two sizes of cells each: which of them moves to which."""

import shutil

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.refined_meshes import refine
from tests.studies.face_pressure import per_station
from tests.studies.test_unlike_wedge import FOLDER
from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.pair import matched
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.surfaces import SurfaceContact
from tipdamp.static_contact.surfaces.pairing import Side, join, pair
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
RIG = """[material]
E = 207e9
nu = 0.3
density = 7850
[blades]
mesh = "tet_blades.msh"
clamp = "clamp"
[damper]
mesh = "tet_damper.msh"
pull = 113
load_points = "load_points"
[contact]
mu = 0.6
method = "surfaces"
""" + "".join(
    f"""[contact.{side}]
blade = "cover_{side}"
damper = "side_{side}"
shape = "flat"
kn_per_area = 5.7e11
kt_per_area = 5.2e11
"""
    for side in ("left", "right")
)
KN = dict.fromkeys(("left", "right"), 5.7e11)
SIZES = {"coarse": (2e-3, (15, 2)), "half": (1e-3, (30, 4))}


def pairs_of_nodes(study, meshes, every):
    """Pairs of all nodes that the covers and the flats have in common, or of those of the groups
    `contact_left` and `contact_right`, which leave out the rows between the corners of the damper's
    faces."""
    found = []
    for name, side in study.sides.items():
        groups, blades = [f"contact_{name}"] * 2, meshes[BLADES]
        if every:
            groups = [f"cover_{name}", side.damper]
            place = {
                body: meshes[body].position[meshes[body].index(meshes[body].groups[group])]
                for body, group in zip((BLADES, DAMPER), groups, strict=True)
            }
            common = cKDTree(place[DAMPER]).query(place[BLADES])[0] < 1e-6
            blades.groups[groups[0]] = blades.groups[groups[0]][common]
        found.append(
            pair(
                blades,
                meshes[DAMPER],
                Side(name, *groups, BLADES, DAMPER),
                axis=study.driver.axis,
                pull=study.driver.pull_direction,
                tolerance=1e-6,
            )
        )
    return SurfaceContact(join(*found), {})


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """{(kind of contact, size): (2, 16) N}: 113 N, 79.9 N a side."""
    pytest.importorskip("gmsh")
    from tipdamp.meshes.rig import Rig
    from tipdamp.meshes.tetrahedra import generate

    found = {}
    for size, (edge, cells) in SIZES.items():
        for matching in (True, False) if size == "coarse" else (True,):
            folder = tmp_path_factory.mktemp(size)
            generate(
                Rig.named("asymmetric"),
                "wedge",
                folder,
                edge=5e-3,
                contact_edge=edge,
                cells=cells,
                matching=matching,
            )
            (folder / "rig.toml").write_text(RIG, encoding="utf-8")
            study = load_study(folder / "rig.toml")
            kinds = (
                {"points": matched, "nodes": lambda s, m: pairs_of_nodes(s, m, True)}
                if matching
                else {"unlike": matched}
            )
            if matching and size == "coarse":
                kinds["rows"] = lambda s, m: pairs_of_nodes(s, m, False)
            for kind, contact in kinds.items():
                meshes = read_meshes(study)
                found[kind, size] = per_station(study, meshes, contact(study, meshes), KN, 16)
    return found


def off(one, other):
    return np.abs(one / other - 1).max()


def test_pairs_and_points_of_the_rig(rig):
    """Both go to the same pressure; the unlike mesh is within 3 % of it as coarse as it is, and of
    the pairs of all nodes in cells of the same size."""
    nodes, points = rig["nodes", "half"], rig["points", "half"]
    assert off(nodes, points) < 0.01 and off(rig["nodes", "coarse"], rig["points", "coarse"]) < 0.02
    for reference in (nodes, points, rig["nodes", "coarse"]):
        assert off(rig["unlike", "coarse"], reference) < 0.03


def test_three_rows_of_pairs(rig):
    """Of a flat that is open along its upper edge, as the wedge's are between their ends, three
    rows of pairs see the edge of the contact too coarsely: they are what is 5 % off, beside pairs
    of all nodes and contact points alike."""
    for reference in ("nodes", "points", "unlike"):
        assert off(rig["rows", "coarse"], rig[reference, "coarse"]) > 0.04
    for reference in ("nodes", "points"):
        assert off(rig["rows", "coarse"], rig[reference, "half"]) > 0.04


def test_unlike_wedge(tmp_path):
    """The damper that matches, its cells cut into eight, and the unlike one as it is and cut into
    eight."""
    found = {}
    for name, cut in (("coarse", 1), ("unlike", 0), ("unlike", 1)):
        for mesh in ("coarse_blades", "unlike_damper"):
            shutil.copy(FOLDER / f"{mesh}.msh", tmp_path)
        (refine if cut else shutil.copy)(
            FOLDER / f"{name}_damper.msh", tmp_path / "unlike_damper.msh"
        )
        text = (
            (FOLDER / "unlike.toml")
            .read_text(encoding="utf-8")
            .replace("unlike_blades", "coarse_blades")
        )
        (tmp_path / "wedge.toml").write_text(
            text.replace("[contact]", '[contact]\nmethod = "surfaces"')
        )
        study = load_study(tmp_path / "wedge.toml")
        meshes = read_meshes(study)
        contact = matched(study, meshes)
        kn = {s: 102e6 / contact.pairs.area[contact.pairs.side == s].sum() for s in study.sides}
        found[name, cut] = per_station(study, meshes, contact, kn, 9)
    (left, right), (fine_left, fine_right) = found["unlike", 0], found["unlike", 1]
    assert off(left, found["coarse", 1][0]) < 2e-3 and off(left, fine_left) < 2e-3
    assert off(right, found["coarse", 1][1]) < 0.015 and off(right, fine_right) < 0.015
