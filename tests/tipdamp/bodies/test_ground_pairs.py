"""Pairs to the ground in a user's table: the cube in its corner against a stop, and a plate that
rubs on a blade."""

import json

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study

ALONG, ACROSS = 10 * 0.2 / np.sqrt(2.04), 10 / np.sqrt(2.04)
GIVEN = [("mu = 0.3\n", 'pairs = "mine.csv"\n')] + [
    (
        f'blade = "touch_{side}"\ndamper = "face_{face}"\nshape = "flat"\nkn = 1e6\nkt = 1e6\n',
        'shape = "flat"\n',
    )
    for side, face in (("one", "x"), ("two", "z"))
]
TILTED = ("pull_direction = [1, 0, 1]", "pull_direction = [1, 0.2, 1]")
MATRICES = corner_study.MATRICES.replace("[1, 0, 1]", "[1, 0.2, 1]").replace(
    "pairs.csv", "mine.csv"
)


def to_ground(pairs, nodes, position, normal, t1, side, blade):
    """Pairs of nodes of a body with the ground; normal : out of the damper, into the blade."""
    n, P = np.array(normal, dtype=float), len(nodes)
    frame = np.array([t1, np.cross(n, t1), n])
    one, ground = np.full(P, "blades" if blade else "damper"), np.full(P, "ground")
    more = ContactTable(
        side=np.full(P, side),
        station=np.arange(P),
        row=np.zeros(P),
        blade_body=one if blade else ground,
        blade_node=nodes if blade else np.zeros(P),
        damper_body=ground if blade else one,
        damper_node=np.zeros(P) if blade else nodes,
        position=position,
        frame=np.tile(frame, (P, 1, 1)),
        gap=np.zeros(P),
        kn=np.full(P, 1e6),
        kt=np.full(P, 1e6),
        mu=np.full(P, 0.3),
        preload=np.zeros(P),
        weight=np.ones(P),
    )
    return ContactTable(
        **{name: np.concatenate([column, vars(more)[name]]) for name, column in vars(pairs).items()}
    )


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """The matched pairs with kn, kt and mu, a stop along y on the damper's face, a plate on the
    free end of a blade."""
    study = load_study(corner_study.write(tmp_path_factory.mktemp("matched")))
    store = results_folder(study, None)
    for name in ("reduce", "preload"):
        run_stage(name, study, store, quiet=True)
    pairs = ContactTable.load(store.path("preload.csv"))
    cube = corner_study.damper()
    blades = corner_study.blades()
    A = corner_study.A
    for mesh, x, side, blade in ((cube, A / 2, "stop", False), (blades, 1.5 * A, "plate", True)):
        at = (np.abs(mesh.position - [x, A, A / 2])[:, :2] < 1e-9).all(axis=1) & (
            mesh.position[:, 2] < 1.1 * A
        )
        order = np.argsort(mesh.position[at, 2])[:1]
        pairs = to_ground(
            pairs,
            mesh.node[at][order],
            mesh.position[at][order],
            [0, 1, 0] if not blade else [0, -1, 0],
            [0, 0, 1],
            side,
            blade,
        )
    return pairs.replace(preload=np.zeros(len(pairs)))


def run(path, stages):
    study = load_study(path)
    store = results_folder(study, None)
    for name in stages:
        run_stage(name, study, store, quiet=True)
    return store


def test_a_stop_takes_the_pull_along_it(table, tmp_path):
    """Statics: the stop carries the part of the pull along y, the plate nothing; the same with
    meshes and matrices."""
    table.save(tmp_path / "mine.csv")
    mesh = run(
        corner_study.write(tmp_path, change=[*GIVEN, TILTED]), ("inspect", "reduce", "preload")
    )
    sides = mesh.read_json("preload.json")["sides"]
    assert (
        sides["stop"]["sum_N"] == pytest.approx(ALONG, rel=1e-6) == sides["stop"]["equilibrium_N"]
    )
    assert sides["one"]["sum_N"] == pytest.approx(ACROSS, rel=1e-6)
    assert 0 <= sides["plate"]["sum_N"] < 0.01 * ALONG
    (tmp_path / "matrices").mkdir()
    (tmp_path / "matrices" / "study.toml").write_text(MATRICES)
    (tmp_path / "matrices" / "model.npz").write_bytes(mesh.path("model.npz").read_bytes())
    table.save(tmp_path / "matrices" / "mine.csv")
    given = run(tmp_path / "matrices" / "study.toml", ("inspect", "reduce", "preload"))
    one, other = (ContactTable.load(store.path("preload.csv")) for store in (mesh, given))
    assert one.preload == pytest.approx(other.preload, rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_a_whole_run_with_pairs_to_the_ground(table, tmp_path):
    table.save(tmp_path / "mine.csv")
    path = corner_study.write(
        tmp_path,
        change=[
            *GIVEN,
            TILTED,
            ("[respond]", '[tune]\nstations = "all"\n[respond]'),
            ("levels = [1]", "levels = [0.01]\nharmonics = 1\nboth_ways = false"),
            ("[20000, 40000]", "[27000, 28000]"),
        ],
    )
    assert main(["run", str(path), "--quiet"]) in (0, 1)
    kept = ContactTable.load(tmp_path / "results" / "corner" / "kept.csv")
    assert kept.preload[kept.side == "stop"] == pytest.approx(ALONG, rel=1e-6)
    tune = json.loads((tmp_path / "results" / "corner" / "tune.json").read_text())
    places = [one["position_m"] for one in tune["station_worth"]]
    assert places == pytest.approx([0, corner_study.A / 2, corner_study.A])  # not the stop's
    page = (tmp_path / "results" / "corner" / "report.html").read_text(encoding="utf-8")
    assert "&#39; to ground" in page or "' to ground" in page


@pytest.mark.parametrize(
    "columns, words",
    [
        (
            {"blade_body": "grond"},
            r"\[contact\] pairs: blade_body 'grond' must be 'blades', or 'ground' for a fixed",
        ),
        (
            {"blade_body": "ground", "damper_body": "ground"},
            "pair 1: blade_body and damper_body are both 'ground'; one",
        ),
    ],
)
def test_bodies_that_are_not_there(table, tmp_path, columns, words):
    odd = {
        name: np.where(np.arange(len(table)) == 0, value, vars(table)[name])
        for name, value in columns.items()
    }
    table.replace(**odd).save(tmp_path / "mine.csv")
    with pytest.raises(InputError, match=words):
        run(corner_study.write(tmp_path, change=[*GIVEN, TILTED]), ("inspect",))
