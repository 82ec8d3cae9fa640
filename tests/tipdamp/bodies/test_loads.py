"""Load cases and hard contact of a study, on the small rig: figures that hand calculation gives."""

import shutil

import numpy as np
import pytest

from tests.conftest import STUDY
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow

CASES = """
[rotation]
axis = [0, 1, 0]
point = [0, 0.035, -0.4]
speed = 600
[loads.heavier]
pull = 226
[loads.standing]
pull = 0
gravity = [0, 0, 98.1]
[loads.turning]
pull = 0
speed = 314.159
[loads.pressed]
forces = [["damper", "load_points", 0, 0, 40]]
"""


def with_meshes(rig, folder):
    for mesh in rig.glob("*.msh"):
        shutil.copy(mesh, folder)
    return folder


@pytest.fixture(scope="module")
def store(rig, tmp_path_factory):
    path = with_meshes(rig, tmp_path_factory.mktemp("cases")) / "cases.toml"
    path.write_text(STUDY.replace("[contact]", '[contact]\nnormal = "hard"', 1) + CASES)
    study = load_study(path)
    store = results_folder(study, None)
    for name in ("reduce", "preload"):
        run_stage(name, study, store, quiet=True)
    return store


def upward(store, case):
    """Resultant of the contact forces of a case against the pull direction z, N."""
    pairs = ContactTable.load(store.path(f"loads/{case}.csv"))
    return np.maximum(pairs.preload, 0) @ pairs.normal[:, 2]


def test_every_case_carries_its_load(store, rig):
    """226 N; the damper's weight at ten times gravity; its mass times speed^2 r; 113 + 40 N."""
    from tipdamp.modal.elasticity import Material, elastic_body
    from tipdamp.readers.dispatch import read_mesh

    mesh = read_mesh(rig / "asymmetric_damper.msh")
    body = elastic_body(mesh, Material(207e9, 0.3, 7850.0), "damper", free=True)
    unit = np.tile(np.eye(3), (len(mesh.node), 1))[3 * body.dof_node + body.dof_direction]
    mass = body.mass()[2]
    height = unit[:, 2] @ (body.M @ (unit[:, 2] * mesh.position[body.dof_node, 2])) / mass
    assert upward(store, "heavier") == pytest.approx(226, rel=1e-7)
    assert upward(store, "standing") == pytest.approx(mass * 98.1, rel=1e-7)
    assert upward(store, "turning") == pytest.approx(mass * 314.159**2 * (height + 0.4), rel=1e-7)
    assert upward(store, "pressed") == pytest.approx(153, rel=1e-7)
    cases = store.read_json("preload.json")["cases"]
    assert all(c["residual"] < 1e-8 and c["balance_error"] < 1e-6 for c in cases.values())


def test_hard_contact_keeps_the_springs_of_the_table(store):
    """Open pairs stand open by -preload/kn, so that the table serves the dynamics; side forces are
    the equilibrium."""
    whole = ContactTable.load(store.path("preload.csv"))
    assert np.isfinite(whole.kn).all() and (whole.kn > 0).all()
    for side in ("left", "right"):
        force = np.maximum(whole.preload[whole.side == side], 0).sum()
        assert force == pytest.approx(113 / np.sqrt(2), rel=1e-6)


def test_blades_at_speed(store, rig_results):
    """Centrifugal stress raises the first frequencies of blades that stand along the radius."""
    at_rest = np.array(rig_results.read_json("reduce.json")["free_modes_hz"])
    turning = np.array(store.read_json("reduce.json")["free_modes_hz"])
    assert (turning[:2] > at_rest[:2] * 1.0005).all() and (turning[:2] < at_rest[:2] * 1.1).all()


@pytest.mark.parametrize(
    "line, message",
    [
        ("[loads.pull]\n", "not 'pull'"),
        ("[loads.a]\nspeed = 10\n", r"section \[rotation\] is missing"),
        (
            '[loads.a]\nforces = [["damper", "load_points", 1]]\n',
            r"list of \[body, group, x, y, z\]",
        ),
        ('[loads.a]\npressure = [["blade", "clamp", 1]]\n', "no body 'blade'.*blades"),
        ("[loads.a]\nweight = 1\n", "unknown key 'weight'"),
        (
            '[loads.a]\nforces = [["damper", "loads", 0, 0, 1]]\n',
            r"\[loads.a\] forces: .*no group 'loads'",
        ),
        (
            '[loads.a]\nforces = [["damper", "load_points", 0, 1, 0]]\n',
            r"\[loads.a\]: slide along y is loaded: 1 N",
        ),
    ],
)
def test_bad_cases(rig, tmp_path, line, message):
    path = with_meshes(rig, tmp_path) / "bad_case.toml"
    path.write_text(STUDY + line)
    with pytest.raises(InputError, match=message):
        study = load_study(path)
        store = results_folder(study, None)
        for name in ("reduce", "preload"):
            run_stage(name, study, store, quiet=True, force=True)
