"""[damper] hold: the cube in its corner slides along y where nothing holds it; a pull with a part
along y."""

import json
import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.tipdamp import corner_study
from tests.tipdamp.report.files import table
from tipdamp.checks import only_friction
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.rigid_motion import parse_motion
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.results.static_results import PreloadResult
from tipdamp.stages.adrift import adrift
from tipdamp.stages.assembly import assembled
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.documentation import json_schema
from tipdamp.study.hold import HOLD
from tipdamp.study.study import load_study

TILTED = ("pull_direction = [1, 0, 1]", "pull_direction = [1, 0.2, 1]")
MEAN_OF_Y = '{ motion = "y", mean = true }'
MEAN = f"[damper] hold = {MEAN_OF_Y}"
ALONG = 10 * 0.2 / np.sqrt(2.04)
ACROSS = 10 / np.sqrt(2.04)  # on each side


def held(hold, more="", section='mesh = "damper.inp"'):
    return (section, f"{section}\nhold = {hold}{more}")


def run(folder, *change, stages=("reduce", "preload")):
    study = load_study(corner_study.write(folder, change=change))
    store = results_folder(study, None)
    for name in stages:
        run_stage(name, study, store, quiet=True)
    return store


def test_nothing_holds_the_pull(tmp_path):
    with pytest.raises(
        InputError,
        match=r"residual of 1.4 N along \[0.0, 1.0, 0.0\] remains; .*hold, in \[damper\]",
    ):
        run(tmp_path, TILTED)


@pytest.mark.parametrize(
    "hold",
    [
        '"y"',
        "[0, 1, 0]",
        '{ motion = "slide along y", stiffness = 20 }',
        '{ motion = "y", mean = true }',
    ],
)
def test_statics_take_the_load_on_the_hold(tmp_path, hold):
    """Its force is the part of the pull along it, through the centre of mass: the couple that this
    makes with the pull on the edge shifts the contact forces along y."""
    store = run(tmp_path, TILTED, held(hold))
    found = store.read_json("preload.json")
    assert found["held"] == {"damper: slide along y": pytest.approx(ALONG, rel=1e-7)}
    assert found["reactions"] == {} and found["free_motions"] == [] and found["warnings"] == []
    for side in found["sides"].values():
        assert side["sum_N"] == pytest.approx(ACROSS, rel=1e-7) and side["balance_error"] < 1e-8
        assert side["equilibrium_N"] == pytest.approx(ACROSS, rel=1e-12)
    pairs = ContactTable.load(store.path("preload.csv"))
    for side in pairs.sides:
        mine = pairs.side == side
        couple = pairs.preload[mine] @ (pairs.position[mine, 1] - corner_study.A / 2)
        assert couple == pytest.approx(ALONG * corner_study.A / 2, rel=1e-6)


def test_friction_leaves_the_hold_little(tmp_path):
    """Stuck pairs carry the load beside a hold a hundred thousand times softer."""
    store = run(
        tmp_path,
        ("pull_direction = [1, 0, 1]", "pull_direction = [1, 0.02, 1]"),
        held('"y"'),
        ("[respond]", "[preload]\nfriction = true\n[respond]"),
    )
    found = store.read_json("preload.json")
    assert 0 < found["held"]["damper: slide along y"] < 1e-3 * ALONG
    assert all(side["balance_error"] < 1e-4 for side in found["sides"].values())


@pytest.mark.parametrize("level, hold, count", [(0.01, None, 0), (1e4, None, 1), (1e4, '"y"', 0)])
def test_a_hold_is_advised_before_the_curves(tmp_path, level, hold, count):
    """The cube slides freely along y: said where all friction, 0.3 of 2 x 7.07 N, is less than
    stuck contacts carry."""
    store = run(
        tmp_path,
        ("levels = [1]", f"levels = [{level}]"),
        *([held(hold)] if hold else []),
        ("[respond]", '[tune]\nstations = "all"\n[respond]'),
        stages=("reduce", "preload", "tune"),
    )
    study = load_study(tmp_path / "corner.toml")
    found = assembled(study, store)
    free = PreloadResult.load(store).free_motions
    said = list(adrift(study, free, (found.model, found.kept), found.curves.force))
    assert len(said) == count
    assert all("(slide along y)" in s and "gives 4.24 N" in s and s.endswith(MEAN) for s in said)


@pytest.mark.parametrize(
    "hold, motions",
    [(None, ["slide along y"]), ('"y"', []), (MEAN_OF_Y, []), ('"about y"', ["slide along y"])],
)
def test_what_friction_alone_holds_is_told_by_inspect_and_preload(tmp_path, capsys, hold, motions):
    path = str(corner_study.write(tmp_path, change=[held(hold)] if hold else []))
    for verb in ("inspect", "reduce", "preload"):
        assert main([verb, path, "--quiet"]) == 0
    said = capsys.readouterr().out
    assert (
        Store(tmp_path / "results" / "corner").read_json("inspect.json")["only_friction"] == motions
    )
    assert said.count("nothing but friction holds the damper (slide along y)") == 2 * bool(motions)
    assert (f"hold its mean position: {MEAN}\n" in said) == bool(motions)


@pytest.mark.parametrize(
    "motions, remedy",
    [
        (["slide along y"], MEAN),
        (
            ["roll about x", "slide along x"],
            '[model] hold = [{ motion = "about x", mean = true }, { motion = "x", mean = true }]',
        ),
        (
            ["slide along (0.149, -0.945, -0.292)"],
            "[damper] hold = { motion = [0.149, -0.945, -0.292], mean = true }",
        ),
    ],
)
def test_the_remedy_can_be_copied(motions, remedy):
    section = remedy[1 : remedy.index("]")]
    assert only_friction.remedy(motions, section) == remedy
    [(_, table)] = tomllib.loads(remedy.replace("] ", "]\n", 1))[section].items()
    assert [one.mean for one in HOLD.read(table, None, 1.0)] == [True] * len(motions)


def round_pin():
    """(pairs, frames (6, 3, 3) of the first six): these of a pin around the x axis, and a stop on
    it."""
    angle = np.repeat(np.radians([20, 160]), 3)
    normal = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    t1 = np.tile([1.0, 0, 0], (6, 1))
    around = np.tile([[0.0], [0.01], [0.02]], (2, 1)) * [1, 0, 0] + 0.005 * normal
    frames = np.stack([t1, np.cross(normal, t1), normal], axis=1)
    pairs = (
        table()
        .select(np.arange(7))
        .replace(
            position=np.vstack([around, [[0.02, 0, 0]]]),
            frame=np.concatenate([frames, [np.roll(np.eye(3), -1, axis=0)]]),
        )
    )
    return pairs, frames


def test_a_round_pin_rolls_too():
    """Normals through one axis leave the turn about it and the slide along it; a stop on the axis
    the turn alone."""
    pairs, frames = round_pin()
    assert sorted(only_friction.held_by_friction(pairs.select(np.arange(6)))) == [
        "roll about x",
        "slide along x",
    ]
    assert only_friction.held_by_friction(pairs) == ["roll about x"]
    turn = Rotation.from_rotvec([0.1, 0.2, 0.4]).as_matrix()
    turned = pairs.select(np.arange(6)).replace(
        position=pairs.position[:6] @ turn.T, frame=frames[:6] @ turn.T
    )
    along = next(
        name for name in only_friction.held_by_friction(turned) if name.startswith("slide")
    )
    assert np.allclose(
        np.abs(parse_motion([float(v) for v in along[13:-1].split(",")])[2][:3]),
        np.abs(turn[:, 0]),
        atol=2e-3,
    )


@pytest.mark.slow
def test_a_run_with_its_reaction(tmp_path, capsys):
    """The result, the curve, the report and the summary have the force, here of pure sticking
    without a mean; another hold makes the curves anew."""
    change = [
        held('"y"'),
        ("[respond]", '[tune]\nstations = "all"\n[respond]'),
        ("levels = [1]", "levels = [0.01]\nharmonics = 1\nboth_ways = false"),
        ("band = [20000, 40000]", "band = [27000, 29000]"),
    ]
    path = corner_study.write(tmp_path, change=change)
    main(["run", str(path), "--quiet"])
    folder = tmp_path / "results" / "corner"
    summary = json.loads((folder / "summary.json").read_text())
    first = summary["responses"][0]
    force = first["held"]["damper: slide along y"]
    curve = ForcedResponse.load(folder / "responses" / "Fe_0.01N_H1.npz")
    assert curve.held.tolist() == ["damper: slide along y"]
    i = int(np.flatnonzero(curve.frequency == force["hz"])[0])
    assert (
        force["mean"] == pytest.approx(curve.reaction[i, 0, 0].real)
        and force["unit"] == "N"
        and force["spring"]
    )
    page = (folder / "report.html").read_text()
    assert "held: slide along y of the damper" in page
    assert "With a spring ten times as stiff" in page
    assert "No mean force at any level, so no figure: damper: slide along y" in page
    (path).write_text(
        path.read_text().replace('hold = "y"', 'hold = { motion = "y", mean = true }')
    )
    for stage in ("preload", "tune", "respond"):
        main([stage, str(path), "--quiet"])
    again = ForcedResponse.load(folder / "responses" / "Fe_0.01N_H1.npz")
    assert np.abs(again.reaction[:, 0, 1]).max() == 0 < np.abs(curve.reaction[:, 0, 1]).max()
    assert again.amplitude().max() == pytest.approx(curve.amplitude().max(), rel=1e-4)


@pytest.mark.parametrize(
    "hold, words",
    [
        (
            '"axially"',
            r"\[damper\] hold = 'axially': must be a direction \[x, y, z\], 'x', 'y' or 'z', or a "
            r"rotation",
        ),
        ("[0, 1]", r"\[damper\] hold = \[0, 1\]: must be a direction"),
        ("[0, 0, 0]", r"\[damper\] hold = \[0, 0, 0\]: must be a direction"),
        ("5", r"\[damper\] hold = 5: must be a direction"),
        ("[]", r"\[damper\] hold = \[\]: must be a direction"),
        ("{ stiffness = 5 }", r"\[damper\] hold = .*: motion is missing"),
        (
            '{ motion = "y", stifness = 5 }',
            r"\[damper\] hold = .*: unknown key 'stifness'; did you mean 'stiffness'",
        ),
        ('{ motion = "y", stiffness = -5 }', r"\[damper\] hold = .*: stiffness must be above 0"),
        (
            '{ motion = "y", stiffness = "soft" }',
            r"\[damper\] hold = .*: stiffness must be a number",
        ),
        ('{ motion = "y", mean = 1 }', r"\[damper\] hold = .*: mean must be true or false"),
        ('["y", "q"]', r"\[damper\] hold = \['y', 'q'\]: must be a direction"),
    ],
)
def test_refused_with_the_study(tmp_path, hold, words):
    with pytest.raises(InputError, match=words):
        load_study(corner_study.write(tmp_path, change=[held(hold)]))


def test_units_of_the_stiffness(tmp_path):
    """Of a slide in force per length of the file; of a rotation in N m/rad."""
    hold = '[{ motion = "y", stiffness = 5 }, { motion = "about y", stiffness = 5 }, [0, 0, 2]]'
    change = [held(hold), ("[material]", '[units]\nlength = "mm"\n[material]')]
    one, two, three = load_study(corner_study.write(tmp_path, change=change)).damper.hold
    assert one.stiffness == pytest.approx(5000) and two.stiffness == 5 and three.motion == (0, 0, 1)


def test_held_twice_and_held_already(tmp_path):
    with pytest.raises(
        InputError, match=r"corner.toml: \[damper\] hold = .*a motion is held twice"
    ):
        run(tmp_path, held('["y", [0, 1, 0]]'))
    store = run(tmp_path, held('["y", "x"]'))
    assert [
        w
        for w in store.read_json("preload.json")["warnings"]
        if "contact normals face the slide along x" in w
    ]


def test_schema_for_editors():
    schema = json_schema()["properties"]["damper"]["properties"]["hold"]
    assert {"type": "boolean"} in [
        table["properties"]["mean"] for table in schema["anyOf"] if "properties" in table
    ]


def test_matrices_with_a_stop_and_without(matrices_study):
    """A spring along x in K holds already; where it is taken out, `hold` stands in its place."""
    matrices_study.write_text(
        matrices_study.read_text().replace("pull = 60", 'pull = 60\nhold = "x"')
    )
    study = load_study(matrices_study)
    store = results_folder(study, None)
    run_stage("reduce", study, store, quiet=True)
    with pytest.raises(
        InputError,
        match=r"\[model\] hold = 'x': the damper is supported: its own stiffness resists "
        r"this motion with 3e\+05, and the hold would with 150; there is nothing to",
    ):
        run_stage("preload", study, store, quiet=True)
    model = ReducedModel.load(matrices_study.parent / "model.npz")
    stop = np.diag(np.where((model.body == "damper") & (model.direction == "x"), 1e5, 0.0))
    model.with_stiffness(model.K - stop).save(matrices_study.parent / "model.npz")
    for name in ("reduce", "preload", "tune", "respond"):
        run_stage(name, study, store, quiet=True)
    curve = store.read_json("respond.json")["responses"][0]
    assert (
        curve["complete"]
        and curve["held"]["damper: slide along x"]["unit"] == "N"
        and curve["held_change"] < 1e-4
    )


def test_a_pull_beside_the_axis_of_a_pin_is_told():
    """By how much, and how it has to be moved; nothing on the axis, along which it may lie
    anywhere, nor where the roll is held."""
    pairs = round_pin()[0]
    place = np.array([[-0.01, 4e-4, 0.003], [0.03, 4e-4, 0.001]])
    forces = np.tile([0.0, 0.0, -5.0], (2, 1))
    [said] = only_friction.loaded(pairs, (), place, forces)
    assert said.startswith("roll about x is loaded: 0.004 N m, and no contact resists it")
    assert "passes 0.4 mm beside where the normals meet" in said
    assert "when moved by (0, -0.4, 0) mm" in said
    assert not only_friction.loaded(pairs, (), place - [0, 4e-4, 0], forces)
    held = HOLD.read({"motion": "about x", "mean": True}, None, 1.0)
    assert not only_friction.loaded(pairs, held, place, forces)
