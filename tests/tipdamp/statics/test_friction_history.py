"""[preload] friction in a study: the history, the friction forces at its end, and a response that
starts from them."""

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import solve_at
from tipdamp.hbm.result import ForcedResponse
from tipdamp.stages.assembly import assembled
from tipdamp.stages.run import STAGES, results_folder, run_stage
from tipdamp.statics import friction_history
from tipdamp.study.study import load_study

# N = Fc / (sqrt 2 (1 + mu)) on each side: the other one's friction helps
SLIPPING = 10 / np.sqrt(2) / 1.3
LOADS = "[loads.heavy]\npull = 25\n[preload]\nfriction = true\n"
TUNE = "[tune]\nstations = [1, 1]\n[respond]"


def run(folder, text, *stages, tune="[respond]"):
    study = load_study(
        corner_study.write(
            folder,
            change=[
                ("[respond]", text + tune),
                ("levels = [1]", "levels = [0.01]\nharmonics = 1\nboth_ways = false"),
                ("band = [20000, 40000]", "band = [20000, 20400]"),
            ],
        )
    )
    store = results_folder(study, None)
    for name in ("reduce", "preload", *stages):
        run_stage(name, study, store, quiet=True)
    return study, store


def state(store, study, name="preload"):
    table = ContactTable.load(store.path(f"{name}.csv"))
    return table, friction_history.load(store.path(f"{name}_friction.csv"), table)


@pytest.fixture(scope="module")
def whole_run(tmp_path_factory):
    return run(tmp_path_factory.mktemp("corner"), LOADS, "tune", "respond", tune=TUNE)


def test_cube_slips_into_its_corner(whole_run):
    """Pulled along the diagonal with kt = kn every pair slips: the closed form of both side sums,
    |T| = mu N."""
    study, store = whole_run
    pairs, T = state(store, study)
    for side, found in store.read_json("preload.json")["sides"].items():
        assert found["sum_N"] == pytest.approx(SLIPPING, rel=1e-3), side
        assert found["balance_error"] < 1e-8
    closed = pairs.preload > 0
    assert np.abs(T[closed]).max(axis=1) == pytest.approx(0.3 * pairs.preload[closed], rel=1e-6)
    assert all(
        STAGES[name].writes(o)
        for name in ("preload", "tune", "respond")
        for o in store.outputs(name)
    )
    facts = store.read_json("preload.json")
    assert facts["friction"]["slipping_pairs"] == closed.sum()
    assert facts["friction"]["without_friction_N"] == pytest.approx(
        {"one": 10 / np.sqrt(2), "two": 10 / np.sqrt(2)}
    )
    assert facts["cases"]["heavy"]["sides"]["one"]["sum_N"] == pytest.approx(
        2.5 * SLIPPING, rel=1e-3
    )
    assert facts["cases"]["heavy"]["balance_error"] < 1e-8


def test_history_matters(whole_run, tmp_path):
    """Pulled with 25 N first and let down to 10 N the cube is wedged: more side force than pulled
    to 10 N."""
    study, store = run(tmp_path, LOADS + 'history = ["heavy"]\nsteps = 10\n')
    wedged, straight = (
        s.read_json("preload.json")["sides"]["one"]["sum_N"] for s in (store, whole_run[1])
    )
    assert (
        wedged > 1.1 * straight
        and store.read_json("preload.json")["sides"]["one"]["balance_error"] < 1e-8
    )


def test_kept_pairs_and_cases(whole_run):
    """The kept stations carry the side sums and friction within the cone; each load case on them is
    in tune.json."""
    study, store = whole_run
    pairs, T = state(store, study, "kept")
    kept = pairs.carrying
    assert 0 < kept.sum() < len(pairs) and not T[~kept].any() and T[kept].any()
    assert (
        np.abs(T[kept])
        <= pairs.mu[kept, None] * np.maximum(pairs.preload[kept, None], 0) * (1 + 1e-6)
    ).all()
    found = store.read_json("tune.json")
    assert found["preload_kept"]["one"]["sum_N"] == pytest.approx(SLIPPING, rel=1e-3)
    assert found["preload_kept"]["one"]["balance_error"] < 1e-4
    heavy = found["cases"]["heavy"]
    assert (
        heavy["sides"]["one"]["sum_N"] == pytest.approx(25 / np.sqrt(2), rel=1e-6)
        and heavy["residual"] < 1e-8
    )


def test_response_starts_from_the_friction_forces(whole_run):
    """The constant loads hold the pull together with the preloads, and under a small excitation the
    assembly stays where the statics left it: order 0 of the response is nothing beside the stretch
    T/kt of the friction springs."""
    study, store = whole_run
    model = ReducedModel.load(store.path("model.npz"))
    table, T = state(store, study, "kept")
    kept = table.select(table.carrying)
    begin = friction_history.start(model, kept, T[table.carrying])
    held = begin.static + relative_motion(model, kept)[2::3].T @ np.maximum(kept.preload, 0)
    on_damper = [held[(model.body == "damper") & (model.direction == d)].sum() for d in "xyz"]
    assert on_damper == pytest.approx([10 / np.sqrt(2), 0, 10 / np.sqrt(2)], abs=1e-3)
    assert -kept.kt[:, None] * begin.sliders == pytest.approx(T[table.carrying])
    found = store.read_json("respond.json")["responses"][0]
    curve = ForcedResponse.load(store.path(found["file"]))
    assert found["failed_points"] == 0 and curve.start == "given"
    assert np.abs(curve.harmonics[..., 0]).max() < 1e-3 * np.abs(begin.sliders).max()


@pytest.mark.parametrize("law", ["DryFriction2T", "IsotropicFriction"])
def test_preload_in_the_cone_of_the_law(tmp_path, law):
    """Pushed along the axis on the way, the pairs slip with both tangents, to the limit of the law
    of the response."""
    askew = (
        '[loads.askew]\nforces = [["damper", "load", 0, 3, 0]]\n[preload]\nfriction = '
        'true\nhistory = ["askew"]\n'
    )
    study, store = run(
        tmp_path,
        askew + "[tune]\nstations = [1, 1]\npreload = 'resolved'\n",
        "tune",
        tune=f"[respond]\nlaw = '{law}'",
    )
    for name in ("preload", "kept"):
        pairs, T = state(store, study, name)
        on = pairs.carrying & (pairs.preload > 0)
        size = np.hypot(*T.T) if law == "IsotropicFriction" else np.abs(T).max(axis=1)
        assert (size[on] / (pairs.mu * pairs.preload)[on]).max() == pytest.approx(1, rel=1e-6), name


def test_one_tangent_starts_from_its_friction(whole_run, tmp_path):
    """A law with one slider takes the friction of t1 alone, and rests where the statics left it."""
    study, store = whole_run
    pairs, T = state(store, study, "kept")
    change = [("[respond]", f'{LOADS}{TUNE}\nlaw = "DryFriction1T"')]
    assembly = assembled(load_study(corner_study.write(tmp_path, change=change)), store)
    assert -assembly.kept.kt[:, None] * assembly.curves.start == pytest.approx(
        T[pairs.carrying][:, :1]
    )
    curves = assembly.curves
    found = solve_at(
        curves.problem,
        1e-6 * curves.force,
        20000.0,
        harmonics=1,
        outputs=curves.rows,
        start=curves.start,
    )
    assert (
        found.converged
        and np.abs(found.harmonics[:, 0]).max() < 1e-3 * np.abs(assembly.curves.start).max()
    )


@pytest.mark.parametrize(
    "text, words",
    [
        ('[preload]\nhistory = ["heavy"]\n', "set friction = true"),
        (
            '[preload]\nfriction = true\nhistory = ["heavi"]\n[loads.heavy]\npull = 2\n',
            "did you mean 'heavy'",
        ),
        ("[preload]\nfriction = 1\n", "must be true or false"),
        *(
            (
                f"[preload]\nfriction = true\n[respond]\nlaw = {law}\n#",
                rf"corner.toml: \[respond\] law = '{name}': has no sliders, and with \[preload\] "
                rf"friction = true .*laws with "
                "sliders: .*IsotropicFriction",
            )
            for name, law in (
                ("UnilateralSpring", '"UnilateralSpring"'),
                ("CubicSpring", '{ name = "CubicSpring", cubic = 1.0 }'),
            )
        ),
        ("[preload]\nfriction = true\nsteps = 0\n", "must lie between 1 and 10000"),
    ],
)
def test_bad_friction_input_is_refused(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        load_study(corner_study.write(tmp_path, change=[("[respond]", text + "[respond]")]))


def test_load_that_has_no_equilibrium(tmp_path):
    """Pushed away from the corner the cube lifts off: the answer names the load of the history and
    the way out."""
    with pytest.raises(InputError, match="no equilibrium was found on the way to away"):
        run(
            tmp_path,
            '[loads.away]\npull = 0\nforces = [["damper", "load", -5, 0, '
            '-5]]\n[preload]\nfriction = true\nhistory = ["away"]\n',
        )


@pytest.mark.parametrize(
    "history, where",
    [
        ('history = ["away"]\n', r"\[preload\] friction"),
        ("", r"\[loads.away\]: \[preload\] friction"),
    ],
)
def test_the_study_is_named_once(tmp_path, history, where):
    """Whether the load is one of the history or a case of its own."""
    with pytest.raises(InputError, match=rf"corner.toml: {where}: no equilibrium") as raised:
        run(
            tmp_path,
            f'[loads.away]\npull = 0\nforces = [["damper", "load", -5, 0, '
            f"-5]]\n[preload]\nfriction = true\n"
            f"{history}",
        )
    assert str(raised.value).count("corner.toml") == 1
