"""The reduced model: load modes, and the same without the Debian packages."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from tests.tipdamp import corner_study
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.reduce import reduced_model
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.model import ReducedModel
from tipdamp.stages.run import results_folder
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.static_contact.tuning.reduction_error import stuck_error_bound
from tipdamp.static_contact.tuning.stuck_assembly import stuck_rows
from tipdamp.study.study import load_study


def springs(pairs):
    # kn = kt = 1e6 N/m in the study
    return sp.diags(np.repeat([[1e6, 1e6, 1e6]], len(pairs), axis=0).ravel())


def compliance(folder, change):
    """Way of 1 N of pull along itself, m, of the damper stuck to the blades: reduced, and
    unreduced; and the facts."""
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
    nodal[np.isin(damper.node, damper.groups["load"])] = (
        np.array([1, 0, 1]) / np.sqrt(2) / len(damper.groups["load"])
    )
    f = np.concatenate([np.zeros(whole[0].dofs), nodal[damper.dof_node, damper.dof_direction]])
    return reduced, f @ spsolve(K.tocsc(), f), store.read_json("reduce.json")["reduction"]


def test_loaded_nodes_against_the_full_model(tmp_path):
    without, full, _ = compliance(tmp_path / "without", ())
    kept, same, facts = compliance(
        tmp_path / "kept", [("modes = 3", "modes = 3\nload_modes = true")]
    )
    assert (
        same == full
        and facts["load_modes"] == {"blades": 0, "damper": 1}
        and facts["modes"]["damper"] == 3
    )
    assert kept == pytest.approx(full, rel=1e-8)
    assert abs(without / full - 1) > 1e-3


def stuck(study):
    """Frequencies of all pairs stuck, Hz, and their error bound."""
    found = reduced_model(study, lambda *_: None)
    pairs = found.pairs.replace(
        kn=np.full(len(found.pairs), 1e6), kt=np.full(len(found.pairs), 1e6)
    )
    rows = stuck_rows(found.model, pairs)
    hz = np.sqrt(sl.eigh(found.model.K + rows.T @ rows, found.model.M, eigvals_only=True)[:6]) / (
        2 * np.pi
    )
    return hz, stuck_error_bound(found.model, found.truncation, pairs, hz)


def test_contact_nodes_as_points(tmp_path):
    """Shapes of contact forces in the place of masters: the same preload, and frequencies within
    their bounds."""
    change = [
        ("modes = 5", "modes = 12"),
        ("modes = 3", "modes = 8"),
        (corner_study.TEXT[corner_study.TEXT.index("[respond]") :], ""),
        ("[contact]", "[preload]\nstress = true\n[contact]"),
    ]
    meshio = pytest.importorskip("meshio")
    preload, hz, stress = {}, {}, {}
    for name in ("craig_bampton", "contact_points"):
        (tmp_path / name).mkdir()
        path = corner_study.write(
            tmp_path / name, change=[*change, ("mu = 0.3", f'mu = 0.3\nreduction = "{name}"')]
        )
        for stage in ("reduce", "preload"):
            assert main([stage, str(path), "--quiet"]) == 0
        store = results_folder(study := load_study(path), None)
        preload[name] = ContactTable.load(store.path("preload.csv")).preload
        stress[name] = meshio.read(store.path("stress_damper.vtu")).point_data
        hz[name] = stuck(study)
        size = store.read_json("reduce.json")["reduction"]
        assert size["contact_shapes"] == (
            {"blades": 0, "damper": 0} if name == "craig_bampton" else {"blades": 54, "damper": 39}
        )
    assert preload["contact_points"] == pytest.approx(
        preload["craig_bampton"], rel=0, abs=1e-9 * preload["craig_bampton"].max()
    )
    field, found = (
        next(field for key, field in stress[name].items() if "Mises" in key) for name in preload
    )
    assert found == pytest.approx(field, rel=0, abs=1e-7 * field.max())
    (one, bound), (two, other) = hz.values()
    assert (np.abs(one / two - 1) <= bound + other).all() and max(bound.max(), other.max()) < 0.1


def test_the_same_model_without_dolfinx_petsc_and_gmsh(tmp_path):
    """Cells assembled by our own code and factorised by scipy: the same reduced matrices."""
    for name in ("with", "without"):
        (tmp_path / name).mkdir()
        corner_study.write(
            tmp_path / name, change=[("modes = 5", "modes = 0"), ("modes = 3", "modes = 0")]
        )
    assert main(["reduce", str(tmp_path / "with" / "corner.toml"), "--quiet"]) == 0
    program = (
        "import sys\nfor name in ('dolfinx', 'petsc4py', 'slepc4py', 'gmsh', 'mpi4py'): "
        "sys.modules[name] = None\nfrom tipdamp.cli import main\nsys.exit(main(['reduce', "
        "'corner.toml', '--quiet']))\n"
    )
    child = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path / "without",
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(Path(__file__).parents[3]), "PATH": "/usr/bin:/bin"},
    )
    assert child.returncode == 0, child.stderr
    one, two = (
        ReducedModel.load(tmp_path / name / "results" / "corner" / "model.npz")
        for name in ("with", "without")
    )
    for A, B in ((one.K, two.K), (one.M, two.M)):
        assert np.abs(A - B).max() < 1e-9 * np.abs(A).max()
