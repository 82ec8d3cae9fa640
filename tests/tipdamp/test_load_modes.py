"""`load_modes`: the whole body follows the pull exactly, not only its masters."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from hbm.contact import relative_motion
from static_contact.full.assembled import AssembledBodies
from tests.tipdamp import corner_study
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.reduce import reduced_model
from tipdamp.cli import main
from tipdamp.stages.run import results_folder
from tipdamp.study.study import load_study


def springs(pairs):
    return sp.diags(np.repeat([[1e6, 1e6, 1e6]], len(pairs), axis=0).ravel())  # kn = kt = 1e6 N/m in the study


def compliance(folder, change):
    """Way of 1 N of pull along itself, m, of the damper stuck to the blades: reduced, and unreduced; and the facts."""
    folder.mkdir()
    path = corner_study.write(folder, change=change)
    assert main(["reduce", str(path), "--quiet"]) == 0
    study = load_study(path)
    store = results_folder(study, None)
    found = reduced_model(study, lambda *_: None)
    model, pairs = found.model, found.pairs
    B = sp.csr_matrix(relative_motion(model, pairs))
    f = model.loads["pull"]
    reduced = f @ np.linalg.solve(model.K + (B.T @ springs(pairs) @ B).toarray(), f)
    whole = assemble_bodies(study, read_meshes(study), lambda *_: None)
    B = relative_motion(AssembledBodies(whole), pairs)
    K = sp.block_diag([b.K for b in whole]) + B.T @ springs(pairs) @ B
    damper = whole[1]
    nodal = np.zeros((len(damper.node), 3))
    nodal[np.isin(damper.node, damper.groups["load"])] = np.array([1, 0, 1]) / np.sqrt(2) / len(damper.groups["load"])
    f = np.concatenate([np.zeros(whole[0].dofs), nodal[damper.dof_node, damper.dof_direction]])
    return reduced, f @ spsolve(K.tocsc(), f), store.read_json("reduce.json")["reduction"]


def test_loaded_nodes_against_the_full_model(tmp_path):
    without, full, _ = compliance(tmp_path / "without", ())
    kept, same, facts = compliance(tmp_path / "kept", [("modes = 3", "modes = 3\nload_modes = true")])
    assert same == full and facts["load_modes"] == {"blades": 0, "damper": 1} and facts["modes"]["damper"] == 3
    assert kept == pytest.approx(full, rel=1e-8)
    assert abs(without / full - 1) > 1e-3
