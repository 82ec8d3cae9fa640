"""The other route to the preload: Newton on the full finite-element model, alone and under mpirun."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("petsc4py")

from hbm.contact import ContactTable  # noqa: E402
from hbm.errors import InputError  # noqa: E402
from hbm.model import ReducedModel  # noqa: E402
from static_contact.newton import full_preload  # noqa: E402
from static_contact.preload import StaticContact  # noqa: E402
from tests.static_contact.full_route import crown, solve, stuck_hz  # noqa: E402
from tipdamp import bodies  # noqa: E402
from tipdamp.study import load_study  # noqa: E402


@pytest.fixture(scope="module")
def alone(rig):
    return solve(rig / "rig.toml", crown)


@pytest.fixture(scope="module")
def hz_alone(rig):
    return stuck_hz(rig / "rig.toml")


def test_same_preload_as_the_condensed_route(rig_results, alone):
    """29 000 dofs by Newton against the Schur complement: same open pairs, preloads to 1e-8 of the largest."""
    model = ReducedModel.load(rig_results.path("model.npz"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    found = StaticContact(model, pairs).solve(113 * model.loads["pull"], gap=crown(pairs))
    assert ((found.pairs.preload < 0) == (alone.pairs.preload < 0)).all() and (alone.pairs.preload < 0).any()
    assert alone.pairs.preload == pytest.approx(found.pairs.preload, abs=1e-8 * found.force.max())
    assert alone.iterations >= 1 and alone.residual < 1e-9


@pytest.mark.parametrize("ranks", [2, 4])
def test_ranks_agree(rig, alone, hz_alone, ranks, tmp_path):
    """Preloads and stuck frequencies of the full model to 1e-9."""
    if not shutil.which("mpirun"):
        pytest.skip("mpirun is not installed")
    script = Path(__file__).with_name("full_route.py")
    out = tmp_path / "found.npz"
    # Open MPI asks root for both
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    run = subprocess.run(["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, str(script),
                          str(rig / "rig.toml"), str(out)], env={**os.environ, **root, "OMP_NUM_THREADS": "1"},
                         capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    with np.load(out) as z:
        assert int(z["ranks"]) == ranks and int(z["iterations"]) == alone.iterations
        assert z["hz"] == pytest.approx(hz_alone, rel=1e-9)
        assert z["preload"] == pytest.approx(alone.pairs.preload, abs=1e-9 * alone.pairs.preload.max())


def test_refusals(rig):
    study = load_study(rig / "rig.toml")
    meshes = bodies.read_meshes(study)
    pairs = bodies.with_values(study, bodies.matched_pairs(study, meshes), {})
    both = bodies.assemble_bodies(study, meshes, lambda *_: None)
    along = both[1].rigid_motions()[:, 1]
    with pytest.raises(InputError, match=r"slide along y is loaded: 2.08e\+03 N"):      # 6231 dofs / 3
        full_preload(both, pairs, {"damper": along})
    with pytest.raises(InputError, match="kn = inf"):
        full_preload(both, pairs.replace(kn=np.full(len(pairs), np.inf)), {})
