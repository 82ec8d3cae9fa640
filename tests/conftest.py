"""Meshes of the two-blade rig at a small size, made once for all workers of a session."""

import os

import pytest

# as `./dev test` and the processes of a study have it: curves are compared bit for bit
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", os.environ["OMP_NUM_THREADS"])

import tipdamp  # noqa: E402, F401 (before numpy, whose loops it chooses)

os.environ.setdefault("TIPDAMP_JOBS", "1")  # tests of several processes say so
if "TIPDAMP_ROUNDING" in os.environ:  # before anything imports eigh by its name
    from tests import rounding

    rounding.install(int(os.environ["TIPDAMP_ROUNDING"]))

LONG_FILES = {"studies", "validation"}  # whose files take minutes each
STUDY = """
[material]
E = 207e9
nu = 0.3
density = 7850
[blades]
mesh = "asymmetric_blades.msh"
clamp = "clamp"
modes = 30
[damper]
mesh = "asymmetric_damper.msh"
modes = 10
pull = 113
[contact]
mu = 0.6
[contact.left]
blade = "contact_left"
damper = "contact_left"
shape = "cylinder"
kn = 3.32e6
kt = 3.02e6
[contact.right]
blade = "contact_right"
damper = "contact_right"
shape = "flat"
width = 1.6e-3
kn = 1.03e6
kt = 0.94e6
rows = "edge"
[tune]
stations = [5, 4]
[respond]
levels = [1, 20]
harmonics = [1]
band = [2300, 3300]
damping_ratio = 0.022
"""


def changed(text, *changes):
    """A study with changes (old, new), each of which must apply."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def made_once(tmp_path_factory, name, make):
    """Folder of this name that make(folder) has filled; of all workers the first makes it, and the
    others wait."""
    from filelock import FileLock

    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:  # each has a folder of its own in that of the session
        base = base.parent
    folder, made = base / name, base / f"{name}.made"
    with FileLock(base / f"{name}.lock"):
        if not made.exists():
            folder.mkdir(exist_ok=True)
            make(folder)
            made.touch()
    return folder


@pytest.fixture(scope="session")
def rig(tmp_path_factory):
    """Folder with the meshes of the asymmetric rig at size 0.5 and a study file; nothing else is
    written there, as the workers share it."""
    pytest.importorskip("dolfinx")
    pytest.importorskip("gmsh")
    from tipdamp.meshes.two_blade_rig import main

    def make(folder):
        main(["--damper", "asymmetric", "--size", "0.5", "--out", str(folder)])
        (folder / "rig.toml").write_text(STUDY)

    return made_once(tmp_path_factory, "rig", make)


@pytest.fixture(scope="session")
def rig_results(rig, tmp_path_factory):
    """Store of the rig's study, run up to `respond`; the tests only read it."""
    from tipdamp.stages.run import STAGES, applies, results_folder, run_stage
    from tipdamp.study.study import load_study

    study = load_study(rig / "rig.toml")
    store = results_folder(study, None)

    def make(_):
        for name in (stage for stage in STAGES if applies(stage, study)):
            if name != "report":
                run_stage(name, study, store, quiet=True)

    made_once(tmp_path_factory, "rig_results", make)
    return store


def pytest_collection_modifyitems(items):
    """What needs the results of the rig is slow, as the first test that asks for them waits for the
    whole study."""
    for item in items:
        if "rig_results" in item.fixturenames:
            item.add_marker(pytest.mark.slow)
    if "PYTEST_XDIST_WORKER" in os.environ:  # the longest files first: no worker waits for one
        items.sort(key=lambda item: not LONG_FILES & set(item.path.parts))
