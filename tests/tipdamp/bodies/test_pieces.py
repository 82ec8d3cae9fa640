"""Dampers in pieces that share no node: cut by unmerged nodes, there twice, left out of contact or
load."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.corner_study import A, on
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.mesh_checks import parts

pytest.importorskip("dolfinx")

ALL = ("[respond]", '[tune]\nstations = "all"\n[respond]')
SURFACES = (
    ("mu = 0.3", 'mu = 0.3\nmethod = "surfaces"'),
    *[("kn = 1e6", "kn_per_area = 1e11"), ("kt = 1e6", "kt_per_area = 1e11")] * 2,
)
POINTS = (("mu = 0.3", 'mu = 0.3\nreduction = "contact_points"'),)
UNREDUCED = ("[respond]", '[preload]\nbodies = "full"\n[respond]')


@pytest.fixture
def finer(monkeypatch):
    """The cubes with four layers of cells along y."""
    cube = corner_study.cube
    monkeypatch.setattr(
        corner_study,
        "cube",
        lambda kind="hexahedron", at=(0.0, 0.0, 0.0): cube(kind, at, (2, 4, 2)),
    )


def cut(mesh, load=slice(None)):
    """The damper with two nodes at every place in the middle of its length: two pieces. load - of
    its load points."""
    [kind] = mesh.cells
    cells = mesh.cells[kind].copy()
    upper = mesh.position[cells].mean(axis=1)[:, 1] > A / 2
    shared = np.intersect1d(cells[upper], cells[~upper])
    new = np.arange(len(mesh.node))
    new[shared] = len(mesh.node) + np.arange(len(shared))
    cells[upper] = new[cells[upper]]
    mesh = replace(
        mesh,
        node=np.r_[mesh.node, mesh.node.max() + 1 + np.arange(len(shared))],
        cells={kind: cells},
        position=np.vstack([mesh.position, mesh.position[shared]]),
    )
    points = np.intersect1d(on(mesh, 0, 0.0), on(mesh, 2, 0.0))
    return replace(
        mesh, groups={"face_x": on(mesh, 0, A), "face_z": on(mesh, 2, A), "load": points[load]}
    )


def twice(mesh, away=0.0):
    """Two dampers, the other one `away` m further along y; groups of the first."""
    [kind] = mesh.cells
    n, last = len(mesh.node), mesh.node.max()
    cells = np.vstack([mesh.cells[kind], mesh.cells[kind] + n])
    return replace(
        mesh,
        node=np.r_[mesh.node, mesh.node + last],
        cells={kind: cells},
        number={kind: np.r_[mesh.number[kind], mesh.number[kind] + 99]},
        position=np.vstack([mesh.position, mesh.position + [0, away, 0]]),
    )


def said_of(folder, capsys, damper, *change, verbs=("inspect",)):
    """What the last of the commands says on stderr; its exit code."""
    study = corner_study.write(folder, damper_mesh=damper, change=[ALL, *change])
    for verb in verbs:
        code = main([verb, str(study), "--quiet"])
    return capsys.readouterr().err, code


@pytest.mark.parametrize("verbs", [("inspect",), ("reduce",)])
def test_a_piece_without_load_is_refused(tmp_path, capsys, verbs):
    """Cut in two by unmerged nodes, and pulled at one of the pieces alone."""
    said, code = said_of(tmp_path, capsys, cut(corner_study.damper(), slice(0, 1)), verbs=verbs)
    assert code == 2 and "2 pieces that share no node" in said and "has no load of its own" in said
    assert (
        "9 of its nodes lie on nodes of other pieces" in said and "merge coincident nodes" in said
    )


def test_a_piece_without_contact_is_refused(tmp_path, capsys):
    said, code = said_of(tmp_path, capsys, twice(corner_study.damper(), away=0.05))
    assert (
        code == 2
        and "around [0.005, 0.055, 0.005] m" in said
        and "has no contact and no load of its own" in said
    )


@pytest.mark.parametrize("change", [(), SURFACES])
def test_a_damper_that_is_there_twice_is_refused(tmp_path, capsys, change):
    """Whether its groups name one of the pieces or both."""
    both = twice(corner_study.damper())
    groups = {"face_x": on(both, 0, A), "face_z": on(both, 2, A), "load": both.groups["load"]}
    for damper in (both, replace(both, groups=groups)):
        said, code = said_of(tmp_path, capsys, damper, *change)
        assert (
            code == 2
            and "has a piece twice: all 27 nodes" in said
            and "merge coincident nodes" in said
        )


def test_a_load_at_rest_on_one_piece_alone_is_refused(tmp_path, capsys):
    """Another load case presses both, but the damper vibrates under the pull."""
    case = ("[respond]", '[loads.both]\ntraction = [["damper", "face_y", 1, 0, 1]]\n[respond]')
    mesh = cut(corner_study.damper(), slice(0, 1))
    mesh = replace(mesh, groups={**mesh.groups, "face_y": on(mesh, 1, A)})
    said, code = said_of(tmp_path, capsys, mesh, case, verbs=("reduce", "preload"))
    assert code == 2 and "has no load of its own in the pull" in said


@pytest.mark.parametrize("change", [(), SURFACES, POINTS], ids=["nodes", "surfaces", "points"])
def test_two_pieces_with_contact_and_load_each(tmp_path, finer, change):
    """Each floats by itself and balances its half of the pull, 10 / (2 sqrt(2)) N on both of its
    sides; the stuck frequencies are those of the unreduced bodies. Nodes that have no partner are
    told."""
    damper = cut(corner_study.damper())
    study = corner_study.write(tmp_path, corner_study.blades(), damper, [ALL, *change])
    for verb in ("inspect", "reduce", "preload", "tune"):
        assert main([verb, str(study), "--quiet"]) == 0
    store = Store(tmp_path / "results" / "corner")
    inspected = store.read_json("inspect.json")
    said = " ".join(inspected["warnings"])
    assert (
        inspected["bodies"]["damper"]["rigid_modes"] == 12
        and "9 of its nodes lie on nodes of other pieces" in said
    )
    assert ("3 of 18 nodes of 'face_x' of the damper have no partner" in said) == (
        change != SURFACES
    )
    pairs = ContactTable.load(store.path("preload.csv"))
    lower = (
        pairs.position[:, 1] < A / 2
        if change == SURFACES
        else parts(damper)[1][damper.index(pairs.damper_node)] == 0
    )
    for side in pairs.sides:
        for piece in (lower, ~lower):
            mine = piece & (pairs.side == side)
            assert np.maximum(pairs.preload[mine], 0).sum() == pytest.approx(
                10 / 2 / 2**0.5, rel=1e-9
            )
    for check in store.read_json("tune.json")["full_model_check"].values():
        # the lowest: with the few modes of these cubes those far above it are off by percents
        assert check["reduced_hz"][0] == pytest.approx(check["full_hz"][0], rel=1e-3)


def test_unreduced_bodies_float_in_one_piece(tmp_path, capsys, finer):
    damper = cut(corner_study.damper())
    study = corner_study.write(tmp_path, corner_study.blades(), damper, [ALL, UNREDUCED])
    assert [main([verb, str(study), "--quiet"]) for verb in ("reduce", "preload")] == [0, 2]
    assert (
        "body 'damper' floats in 2 pieces" in (said := capsys.readouterr().err)
        and "bodies = 'auto'" in said
    )


def test_one_piece_says_nothing_of_pieces(tmp_path, capsys):
    said, code = said_of(tmp_path, capsys, corner_study.damper())
    said += " ".join(Store(tmp_path / "results" / "corner").read_json("inspect.json")["warnings"])
    assert (
        code == 0 and "lock in bending" in said and "pieces" not in said and "partner" not in said
    )
