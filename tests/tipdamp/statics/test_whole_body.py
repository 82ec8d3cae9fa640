"""[preload] stress: what is written is the solution of the whole finite-element model."""

import numpy as np
import pytest
import scipy.sparse as sp

from tests.tipdamp import corner_study
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.stress_recovery import nodal_stress, von_mises
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.study.study import load_study

meshio = pytest.importorskip("meshio")
STEEL = Material(E=207e9, nu=0.3, density=7850.0)


def run(folder, text):
    study = load_study(corner_study.write(folder, change=[("[respond]", text + "[respond]")]))
    store = results_folder(study, None)
    return store, lambda: [
        run_stage(name, study, store, quiet=True) for name in ("reduce", "preload")
    ]


@pytest.mark.parametrize("case", [False, True])
def test_preload_stress_against_the_full_model(tmp_path, case):
    """Both bodies unreduced, joined by the springs of the closed pairs, under the pull, or 20 N and
    gravity."""
    text = "[preload]\nstress = true\n"
    if case:
        text = "[loads.heavy]\npull = 20\ngravity = [3e4, 0, 0]\n" + text + "case = 'heavy'\n"
    store, stages = run(tmp_path, text)
    assert stages() == ["done", "done"] and stages() == ["skipped", "skipped"]
    pairs = ContactTable.load(store.path("loads/heavy.csv" if case else "preload.csv"))
    blades = elastic_body(corner_study.blades(), STEEL, "blades", clamp=["clamp_one", "clamp_two"])
    damper = elastic_body(corner_study.damper(), STEEL, "damper", free=True)
    B = relative_motion(AssembledBodies([blades, damper]), pairs)[2::3]
    closed = (pairs.preload > 0) * pairs.kn
    K = (sp.block_diag([blades.K, damper.K]) + B.T @ sp.diags(closed) @ B).toarray()
    pull = np.zeros(damper.dofs)
    for node in corner_study.damper().groups["load"]:  # three nodes, equal parts along x + z
        pull[damper.node_dofs([node])] = np.array([1, 0, 1]) / np.sqrt(2) / 3
    f = np.concatenate([np.zeros(blades.dofs), (20 if case else 10) * pull])
    if case:
        from tipdamp.modal.loads import gravity

        f += np.concatenate([gravity(b, [3e4, 0, 0]) for b in (blades, damper)])
    u = np.linalg.lstsq(K, f, rcond=1e-10)[0]  # sliding along y meets nothing
    assert np.linalg.norm(K @ u - f) < 1e-8 * np.linalg.norm(f)
    word = "load case 'heavy'" if case else "pull"
    for body, mesh, own in (
        (blades, corner_study.blades(), u[: blades.dofs]),
        (damper, corner_study.damper(), u[blades.dofs :]),
    ):
        shape = np.zeros((len(body.node), 3))
        shape[body.dof_node, body.dof_direction] = own
        expected = von_mises(nodal_stress(mesh, STEEL, shape))
        found = meshio.read(store.path(f"stress_{body.name}.vtu"))
        assert np.array_equal(found.point_data["node"], body.node)
        assert found.point_data[f"von Mises stress (Pa), {word}"] == pytest.approx(
            expected, rel=1e-5, abs=1e-5 * expected.max()
        )
        assert found.point_data[f"displacement (m), {word}"][:, [0, 2]] == pytest.approx(
            shape[:, [0, 2]], rel=1e-5, abs=1e-5 * np.abs(shape).max()
        )


def test_without_it_nothing_is_written(tmp_path):
    store, stages = run(tmp_path, "")
    stages()
    assert not list(store.folder.glob("stress_*"))
