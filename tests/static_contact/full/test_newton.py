"""The other route to the preload: Newton on the full finite-element model, alone and under
mpirun."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")

from tests.static_contact.corner import SHARES, corner, pulls, random_pairs  # noqa: E402
from tests.static_contact.full.on_ranks import crown, parts, solve, stuck_hz, with_hard_pairs  # noqa: E402
from tests.static_contact.full.on_ranks import rig as rig_parts  # noqa: E402
from tipdamp.hbm.contact import ContactTable  # noqa: E402
from tipdamp.hbm.errors import InputError  # noqa: E402
from tipdamp.hbm.model import ReducedModel  # noqa: E402
from tipdamp.static_contact.contact.preload import StaticContact  # noqa: E402
from tipdamp.static_contact.full.newton import full_preload  # noqa: E402
from tipdamp.static_contact.full.ranks import distributed_bodies, own_rows  # noqa: E402
from tipdamp.static_contact.normal.complementarity import NoEquilibrium  # noqa: E402


@pytest.fixture(scope="module")
def alone(rig):
    return solve(rig / "rig.toml", crown)


@pytest.fixture(scope="module")
def hz_alone(rig):
    return stuck_hz(rig / "rig.toml")


@pytest.mark.slow
def test_same_preload_as_the_condensed_route(rig_results, alone):
    """29 000 dofs by Newton against the Schur complement: same open pairs, preloads to 1e-8 of the
    largest."""
    model = ReducedModel.load(rig_results.path("model.npz"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    found = StaticContact(model, pairs).solve(113 * model.loads["pull"], gap=crown(pairs))
    assert ((found.pairs.preload < 0) == (alone.pairs.preload < 0)).all() and (
        alone.pairs.preload < 0
    ).any()
    assert alone.pairs.preload == pytest.approx(found.pairs.preload, abs=1e-8 * found.force.max())
    assert alone.iterations >= 1 and alone.residual < 1e-9


@pytest.fixture(scope="module")
def hard_alone(rig):
    return solve(rig / "rig.toml", crown, hard=True)


@pytest.mark.slow
def test_same_preload_with_hard_pairs(rig_results, hard_alone):
    """Every other pair without a spring, by multipliers on the full model: same open pairs, forces
    to 1e-8."""
    model = ReducedModel.load(rig_results.path("model.npz"))
    pairs = with_hard_pairs(ContactTable.load(rig_results.path("preload.csv")))
    found = StaticContact(model, pairs).solve(113 * model.loads["pull"], gap=crown(pairs))
    assert ((found.force > 0) == (hard_alone.force > 0)).all() and (hard_alone.force == 0).sum() > 5
    assert hard_alone.pairs.preload == pytest.approx(
        found.pairs.preload, abs=1e-8 * found.force.max()
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", SHARES)
def test_random_corners_by_both_routes(name):
    """Pairs that face two ways, random gaps, every third case hard: where Newton alone cycles, or
    meets a set that holds nothing, the full route goes on as the condensed one does. Forces to 1e-7
    of the largest."""
    both, reduced, model, pairs = corner()
    full, load = pulls(both, reduced, name)
    random = np.random.default_rng(0)
    for i in range(40):
        case = random_pairs(pairs, random, hard=i % 3 == 0)
        found = StaticContact(model, case).solve(load)
        other = full_preload(both, case, {"damper": full})
        assert other.force == pytest.approx(found.force, abs=1e-7 * found.force.max()), i
    for kn in (1e6, np.inf):
        with pytest.raises(NoEquilibrium, match="do not hold the damper"):
            full_preload(both, case.replace(kn=np.full(len(case), kn)), {"damper": -full})


@pytest.mark.slow
def test_rows_of_a_rank(rig):
    """Three ranks' rows of K and M, put together, are the matrices of the whole bodies."""
    both, meshes, _, study = rig_parts(rig / "rig.toml")
    for rank in range(3):
        comm = SimpleNamespace(rank=rank, size=3)
        held = distributed_bodies(parts(meshes, study), comm, 5)
        low, high = own_rows(comm, sum(b.dofs for b in both) + 5)
        for label in ("K", "M"):
            whole = sp.block_diag([getattr(b, label) for b in both], format="csr")
            mine = sp.block_diag([getattr(b, label) for b in held], format="csr")
            assert abs(whole[low:high] - mine[low:high]).max() < 1e-12 * abs(whole).max()
            assert mine.nnz < 0.5 * whole.nnz
        # what gravity on the clamped nodes weighs
        held_columns, mine = both[0].M_clamped, held[0].M_clamped
        own = slice(low, min(high, both[0].dofs))
        assert abs(held_columns[own] - mine[own]).max() < 1e-12 * abs(held_columns).max()
        assert held_columns.nnz > 0


@pytest.mark.slow
def test_ranks_agree(rig, alone, hard_alone, hz_alone, tmp_path):
    """Preloads and stuck frequencies of the full model to 1e-9, on four ranks: both ends and two
    between."""
    if not shutil.which("mpirun"):
        pytest.skip("mpirun is not installed")
    script = Path(__file__).with_name("on_ranks.py")
    out = tmp_path / "found.npz"
    # Open MPI asks root for both
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    run = subprocess.run(
        [
            "mpirun",
            "--oversubscribe",
            "-n",
            "4",
            sys.executable,
            "-m",
            "mpi4py",
            str(script),
            str(rig / "rig.toml"),
            str(out),
        ],
        env={**os.environ, **root, "OMP_NUM_THREADS": "1"},
        # a hang, however busy the machine
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert run.returncode == 0, run.stderr
    with np.load(out) as z:
        assert int(z["ranks"]) == 4 and int(z["iterations"]) == alone.iterations
        assert z["hz"] == pytest.approx(hz_alone, rel=1e-9)
        assert z["hard"] == pytest.approx(
            hard_alone.pairs.preload, abs=1e-9 * hard_alone.force.max()
        )
        assert z["preload"] == pytest.approx(
            alone.pairs.preload, abs=1e-9 * alone.pairs.preload.max()
        )


def test_refusals(rig):
    both, meshes, pairs, study = rig_parts(rig / "rig.toml")
    along = both[1].rigid_motions()[:, 1]
    with pytest.raises(InputError, match=r"slide along y is loaded: 2.08e\+03 N"):  # 6231 dofs / 3
        full_preload(both, pairs, {"damper": along})
