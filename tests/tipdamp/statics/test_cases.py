"""[preload] bodies = "full": the static contact on the unreduced bodies is that of the reduced
model, which is exact where every pair has shapes of its own; and contact shapes of tractions, with
which it is the only one."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.bodies.test_surfaces import TOTAL
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.report.results import load_results
from tipdamp.report.subjects import key_figures
from tipdamp.results.static_results import ReduceResult
from tipdamp.stages import reduce
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.statics.at_rest import ContactAtRest, damper_at_rest
from tipdamp.statics.cases import factored_once
from tipdamp.study.study import load_study

meshio = pytest.importorskip("meshio")
CASES = corner_study.TURNING.format(pull=3) + "[preload]\nstress = true\n"
TUNE = '[tune]\nstations = [1, 1]\npreload = "resolved"\n[respond]'
TIPS = [
    ('["touch_one", "touch_two"]', '["tip_one", "tip_two"]'),
    ('"touch_one"\nshare', '"tip_one"\nshare'),
]
STAGES = ("reduce", "preload", "tune")


def run(folder, name, *change, stages=STAGES, **meshes):
    (folder / name).mkdir()
    study = load_study(corner_study.write(folder / name, change=change, **meshes))
    store = results_folder(study, None)
    for stage in stages:
        run_stage(stage, study, store, quiet=True)
    return store


def with_tips():
    """The blades with a node each that is neither clamped nor in contact."""
    mesh, A = corner_study.blades(), corner_study.A
    at = {
        name: mesh.node[np.linalg.norm(mesh.position - place, axis=1) < 1e-9][-1:]
        for name, place in (("tip_one", [1.5 * A, 0, 0]), ("tip_two", [0, 0, 1.5 * A]))
    }
    return replace(mesh, groups={**mesh.groups, **at})


def forces(store, *tables):
    return np.concatenate([ContactTable.load(store.path(table)).preload for table in tables])


@pytest.mark.parametrize(
    "unlike, more, change",
    [
        (False, "", []),
        (True, "", []),
        (True, "", [("mu = 0.3", 'mu = 0.3\nnormal = "hard"')]),
        (True, "friction = true\nsteps = 5\n", []),
        (False, "", [("pull_direction = [1, 0, 1]", 'pull_direction = [1, 0.2, 1]\nhold = "y"')]),
    ],
)
def test_the_unreduced_bodies_give_the_same(tmp_path, unlike, more, change):
    """Preload, load cases, the kept pairs solved again, what a hold takes, and the stress at
    rest."""
    change = [*(TOTAL if unlike else []), *change, ("[respond]", CASES + more + TUNE)]
    found = [
        run(
            tmp_path,
            bodies,
            *change,
            ("stress = true", f'stress = true\nbodies = "{bodies}"'),
            damper_mesh=corner_study.unlike() if unlike else None,
        )
        for bodies in ("reduced", "full")
    ]
    tables = ("preload.csv", "loads/turning.csv", "kept.csv")
    one, two = (forces(store, *tables) for store in found)
    assert two == pytest.approx(one, rel=0, abs=1e-9 * one.max()) and one.max() > 0
    one, two = (store.read_json("preload.json") for store in found)
    assert two["held"] == pytest.approx(one["held"], rel=1e-9) and len(one["held"]) == (
        "hold" in str(change)
    )
    assert two["residual"] < 1e-8 and two["cases"]["turning"]["residual"] < 1e-8
    # the spring of a hold pulls at all nodes of its model: at the masters, or everywhere
    for body in ("blades",) if two["held"] else ("blades", "damper"):
        one, two = (meshio.read(store.path(f"stress_{body}.vtu")).point_data for store in found)
        assert list(one) == list(two)
        [field] = [name for name in one if "Mises" in name]
        assert two[field] == pytest.approx(one[field], rel=0, abs=1e-6 * one[field].max())
    one, two = (store.read_json("tune.json") for store in found)
    assert two["cases"]["turning"]["sides"]["one"]["sum_N"] == pytest.approx(
        one["cases"]["turning"]["sides"]["one"]["sum_N"], rel=1e-9
    )


def test_a_changed_mesh_makes_the_preload_stale(tmp_path):
    """The unreduced bodies are read from the files again: what the reduced model does not show
    counts as well."""
    store = run(
        tmp_path, "study", ("[respond]", '[preload]\nbodies = "full"\n' + TUNE), stages=STAGES[:2]
    )
    made = json.loads(store.path(".stages/preload.from").read_text())
    assert "the contents of [damper] mesh" in made and "[material] E" in made


def test_given_matrices_have_no_other_bodies(tmp_path):
    store = run(tmp_path, "study", ("[respond]", TUNE), stages=STAGES[:2])
    for name in ("model.npz", "preload.csv"):
        (tmp_path / name).write_bytes(store.path(name).read_bytes())
    path = tmp_path / "matrices.toml"
    text = corner_study.MATRICES.replace("pairs.csv", "preload.csv")
    path.write_text(text + '[preload]\nbodies = "full"\n')
    study = load_study(path)
    run_stage("reduce", study, results_folder(study, None), quiet=True)
    with pytest.raises(
        InputError,
        match=r"\[preload\] bodies = 'full': of given matrices there are no other bodies",
    ):
        run_stage("preload", study, results_folder(study, None), quiet=True)


@pytest.fixture(scope="module")
def with_tractions(tmp_path_factory):
    """{cells: results}: unlike faces of 40 contact points in all; None: shapes of every point."""
    folder, found = tmp_path_factory.mktemp("tractions"), {}
    modes = [("modes = 5", "modes = 30"), ("modes = 3\n", "modes = 20\n"), *TIPS]
    for cells in (None, 100, 12, 4):
        key = [("mu = 0.3", f"mu = 0.3\ntractions = {cells}")] if cells else []
        found[cells] = run(
            folder,
            str(cells),
            *TOTAL,
            *modes,
            *key,
            ("[respond]", CASES + TUNE),
            blade_mesh=with_tips(),
            damper_mesh=corner_study.unlike(),
        )
    return found


def test_fewer_cells_than_points(with_tractions):
    """As many cells as points are the points themselves; fewer make the stuck assembly stiffer, by
    less than the check on the full model says, and leave preload and stress as they are."""
    tuned = {cells: store.read_json("tune.json") for cells, store in with_tractions.items()}
    assert (
        with_tractions[100].path("pairs.csv").read_text()
        == with_tractions[None].path("pairs.csv").read_text()
    )
    assert tuned[100]["stuck_hz"] == pytest.approx(tuned[None]["stuck_hz"], rel=1e-12)
    size = with_tractions[12].read_json("reduce.json")["reduction"]
    assert size["tractions"] == {"blades": 12, "damper": 12} and size["contact_shapes"] == {
        "blades": 36,
        "damper": 36,
    }
    assert with_tractions[100].read_json("reduce.json")["reduction"]["tractions"] == {}
    for cells in (12, 4):
        assert forces(
            with_tractions[cells], "preload.csv", "loads/turning.csv", "kept.csv"
        ) == pytest.approx(
            forces(with_tractions[None], "preload.csv", "loads/turning.csv", "kept.csv"),
            rel=0,
            abs=1e-8,
        )
        check = tuned[cells]["full_model_check"]["full_area"]
        assert check["error_bound"] == [] and check["full_hz"] == pytest.approx(
            tuned[None]["full_model_check"]["full_area"]["full_hz"][: len(check["full_hz"])],
            rel=1e-8,
        )
    over = [
        tuned[cells]["stuck_hz"]["full_area"] / tuned[None]["stuck_hz"]["full_area"] - 1
        for cells in (12, 4)
    ]
    assert 0 < over[0] < 2e-3 and over[0] < over[1] < 0.03


def test_tractions_are_named(with_tractions):
    """What the reader of the report is told."""
    said = reduce.line(with_tractions[4])
    assert "24 contact shapes of tractions on 8 cells" in said
    study = load_study(with_tractions[4].folder.parent.parent / "corner.toml")
    [table] = key_figures.reduction_check(
        load_results(study, with_tractions[4], {stage: [] for stage in STAGES})
    )
    assert "no bound follows" in table.caption and "bound" not in table.columns


def test_the_reduced_model_of_tractions_gives_no_preload(tmp_path):
    with pytest.raises(
        InputError,
        match=r"\[preload\] bodies = 'reduced': the reduced model knows tractions alone "
        r"\(4 cells on the blades, 4 cells on the damper\).* raise \[contact\] tr",
    ):
        run(
            tmp_path,
            "study",
            *TOTAL,
            ("mu = 0.3", "mu = 0.3\ntractions = 4"),
            *TIPS,
            ("[respond]", '[preload]\nbodies = "reduced"\n' + TUNE),
            blade_mesh=with_tips(),
            damper_mesh=corner_study.unlike(),
        )


def test_matching_nodes_in_cells(tmp_path):
    """Nodes that match, as contact points of few cells: the preload of shapes of each, and a
    stiffer stuck assembly."""
    key = 'mu = 0.3\nreduction = "contact_points"\ntractions = '
    found = [
        run(
            tmp_path,
            f"{cells}",
            *TIPS,
            ("modes = 5", "modes = 30"),
            ("modes = 3\n", "modes = 20\n"),
            ("mu = 0.3", f"{key}{cells}"),
            ("[respond]", CASES + TUNE),
            blade_mesh=with_tips(),
        )
        for cells in (18, 6)
    ]
    size = found[1].read_json("reduce.json")["reduction"]
    assert size["tractions"] == {"blades": 6, "damper": 6} and size["contact_shapes"] == {
        "blades": 18,
        "damper": 18,
    }
    one, two = (forces(store, "preload.csv", "kept.csv") for store in found)
    assert two == pytest.approx(one, rel=0, abs=1e-9 * one.max())
    one, two = (store.read_json("tune.json")["stuck_hz"]["full_area"] for store in found)
    assert one < two < 1.01 * one


@pytest.mark.parametrize("bodies", ["reduced", "full"])
def test_many_stiffnesses_on_one_factor(tmp_path, bodies):
    """To the last digit what each on its own gives; another set of pairs is factored anew."""
    store = run(
        tmp_path,
        "study",
        ("[respond]", f'[preload]\nbodies = "{bodies}"\n' + TUNE),
        stages=STAGES[:2],
    )
    study, made = load_study(tmp_path / "study" / "corner.toml"), []
    model = ReducedModel.load(store.path("model.npz"))
    damper = damper_at_rest(study, model, ReduceResult.load(store).reduction)
    own = damper.bodies

    def counted(*given):
        made.append(own.compliance(*given))
        return made[-1]

    once = factored_once(replace(own, compliance=counted))
    pairs = ContactTable.load(store.path("preload.csv"))

    def each_on(bodies, given):
        return ContactAtRest(replace(damper, bodies=bodies), given).solve(damper.loads.at_rest)

    for factor in (1.0, 3.0, 0.1):
        given = pairs.replace(kn=factor * pairs.kn)
        one, two = (each_on(bodies, given) for bodies in (own, once))
        assert (one.force == two.force).all() and one.residual < 1e-8
    assert len(made) == 1
    each_on(once, pairs.replace(weight=np.where(pairs.row == 1, 0.0, 1.0)))
    assert len(made) == 2
