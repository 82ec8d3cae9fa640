"""Each trouble that the doctor knows, as facts; and the doctor on the machine at hand, with and
without dolfinx."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tipdamp.doctor import (
    DEBIAN,
    FROM_MATRICES,
    MODULES,
    NO_RIG,
    NO_SHARED_MODES,
    OURS,
    OWN_CELLS,
    OWN_FACTORS,
    STUDY,
    Facts,
    Module,
    _import_all,
    _try_jobs,
    checks,
    debian_numpy,
    look,
    report,
)

ROOT = Path(__file__).parents[2]
HEALTHY = Facts(
    modules={name: Module("1.0", f"{DEBIAN}/{name}/__init__.py") for name in MODULES},
    blas=("/usr/lib/x86_64-linux-gnu/openblas-pthread/libblas.so.3",),
    scalar="float64",
    debian_numpy="1.24.2",
    origin="/home/anna/tipdamp/tipdamp",
    providers=("tipdamp",),
    python="/usr",
    root="/home/anna/tipdamp",
)


def with_module(name, **changes):
    return replace(
        HEALTHY, modules={**HEALTHY.modules, name: replace(HEALTHY.modules[name], **changes)}
    )


def troubles(facts):
    return {check.name: check for check in checks(facts) if check.status != "ok"}


def only(facts):
    """The one trouble of these facts: nothing else may be touched by it."""
    (check,) = troubles(facts).values()
    return check


def test_healthy_machine_has_no_troubles():
    assert troubles(HEALTHY) == {}
    assert report(checks(HEALTHY)).endswith("everything is in place")


def test_processes_that_cannot_be_started(monkeypatch):
    check = only(replace(HEALTHY, no_jobs="PermissionError: no sockets"))
    assert (check.name, check.repair, check.what) == (
        "jobs",
        "export TIPDAMP_JOBS=1",
        "PermissionError: no sockets",
    )
    rows = {name: {} for name in MODULES}
    monkeypatch.setenv("TIPDAMP_JOBS", "3")
    assert _try_jobs(rows) == (3, "")
    monkeypatch.setenv("TIPDAMP_JOBS", "x")
    assert _try_jobs(rows)[1].startswith("InputError: TIPDAMP_JOBS = 'x'")
    assert _try_jobs({**rows, "numba": {"error": "gone"}}) == (1, "")


def test_reference_blas():
    check = only(replace(HEALTHY, blas=("/usr/lib/x86_64-linux-gnu/blas/libblas.so.3.11.0",)))
    assert (check.name, check.status, check.repair) == ("BLAS", "warn", "./dev setup")


def test_pips_own_openblas_is_no_reference_blas():
    packages = "/home/anna/tipdamp/.venv/lib/python3.11/site-packages"
    path = f"{packages}/numpy.libs/libscipy_openblas64_-ff651d7f.so"
    assert troubles(replace(HEALTHY, blas=(path,))) == {}


@pytest.mark.parametrize("version", ["1.25.0", "2.4.1"])
def test_numpy_newer_than_debians(version):
    check = only(with_module("numpy", version=version))
    assert (
        check.status == "fail" and version in check.what and "pip uninstall numpy" in check.repair
    )


def test_numpy_too_new_explains_the_other_failed_imports():
    modules = {
        **HEALTHY.modules,
        "numpy": replace(HEALTHY.modules["numpy"], version="2.4.1"),
        "dolfinx": Module(error="ValueError: numpy.dtype size changed"),
        "plotly": Module(error="ModuleNotFoundError: No module named 'plotly'"),
    }
    found = troubles(replace(HEALTHY, modules=modules))
    assert (
        "uninstall numpy" in found["dolfinx"].repair and "install plotly" in found["plotly"].repair
    )


def test_numpy_may_be_new_where_debian_has_none():
    assert troubles(replace(with_module("numpy", version="2.4.1"), debian_numpy="")) == {}


def test_debian_counts_where_python_looks_there(monkeypatch, tmp_path):
    """An environment of its own does not see what is installed in /usr."""
    about = tmp_path / "numpy-1.24.2.dist-info" / "METADATA"
    about.parent.mkdir()
    about.write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 1.24.2\n")
    monkeypatch.setattr("tipdamp.doctor.DEBIAN", str(tmp_path))
    assert debian_numpy(["/venv/site-packages", str(tmp_path)]) == "1.24.2"
    assert debian_numpy(["/venv/site-packages"]) == ""


@pytest.mark.parametrize(
    "name, works",
    [
        ("dolfinx", OWN_CELLS),
        ("petsc4py", OWN_FACTORS),
        ("gmsh", NO_RIG),
        ("slepc4py", NO_SHARED_MODES),
    ],
)
def test_what_works_without_a_library_of_the_meshes(name, works):
    check = only(with_module(name, error=f"ModuleNotFoundError: No module named '{name}'"))
    assert (check.name, check.status, check.works, check.repair) == (
        name,
        "warn",
        works,
        "./dev setup",
    )


@pytest.mark.parametrize("name", ["dolfinx", "petsc4py"])
def test_with_a_broken_library_matrices_still_work(name):
    assert (
        only(with_module(name, error="ImportError: libsomething.so: cannot open")).works
        == FROM_MATRICES
    )


def test_doctor_on_meshes_without_libraries(tmp_path):
    """inspect, reduce and preload of a small study where neither dolfinx nor PETSc nor SLEPc can be
    imported."""
    code = """import sys
for name in ("dolfinx", "petsc4py", "slepc4py"):
    sys.modules[name] = None
from pathlib import Path
from tests.tipdamp import corner_study
from tipdamp.cli import main
meshes = [make("tetra10") for make in (corner_study.blades, corner_study.damper)]
path = corner_study.write(Path(sys.argv[1]), *meshes)
sys.exit(max(main([verb, str(path), "--quiet"]) for verb in ("inspect", "reduce", "preload")))"""
    child = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], cwd=ROOT, capture_output=True, text=True
    )
    assert child.returncode == 0, child.stderr


def test_slepc_is_needed_under_mpirun_alone():
    assert (
        only(with_module("slepc4py", error="ImportError: libsomething.so: cannot open")).works
        == NO_SHARED_MODES
    )


def test_another_python_does_not_see_debians_packages():
    facts = replace(
        with_module("dolfinx", error="ModuleNotFoundError: No module named 'dolfinx'"),
        python="/opt/py",
    )
    assert only(facts).repair.startswith("rm -rf .venv")


def test_h5py_from_pip_beside_dolfinx():
    check = only(
        with_module(
            "h5py", file="/home/anna/tipdamp/.venv/lib/python3.11/site-packages/h5py/__init__.py"
        )
    )
    assert check.status == "fail" and "pip uninstall h5py" in check.repair


def test_h5py_is_not_missed():
    """No reader of ours opens HDF5."""
    assert troubles(with_module("h5py", error="ModuleNotFoundError: No module named 'h5py'")) == {}


def test_complex_petsc():
    assert only(replace(HEALTHY, scalar="complex128")).status == "fail"


@pytest.mark.parametrize("name", STUDY)
def test_without_a_package_of_the_study(name):
    check = only(with_module(name, error=f"ModuleNotFoundError: No module named '{name}'"))
    lost = "not the report" if name in ("jinja2", "plotly", "matplotlib") else "not the stages"
    assert check.status == "warn" and lost in check.works and f"install {name}" in check.repair


def test_numba_is_needed():
    assert (
        only(with_module("numba", error="ImportError: Numba needs NumPy 1.22 or greater")).status
        == "fail"
    )


def test_foreign_package_imported_instead_of_ours():
    elsewhere = "/home/anna/tipdamp/.venv/lib/python3.11/site-packages/tipdamp"
    check = only(replace(HEALTHY, origin=elsewhere))
    assert check.name == "tipdamp" and check.status == "fail" and elsewhere in check.what


def test_foreign_project_that_claims_our_name():
    check = only(replace(HEALTHY, providers=("dampers", "tipdamp")))
    assert check.name == "tipdamp" and check.status == "warn"
    assert "uninstall dampers;" in check.repair


def test_report_names_trouble_repair_and_what_works():
    text = report(
        checks(with_module("dolfinx", error="ModuleNotFoundError: No module named 'dolfinx'"))
    )
    assert f"still works: {OWN_CELLS}" in text and "repair: ./dev setup" in text
    assert text.endswith("0 failed, 1 warned, 20 looked at")


def test_import_that_aborts_the_process(tmp_path, monkeypatch):
    (tmp_path / "aborts.py").write_text("import os\nos.abort()\n")
    (tmp_path / "raises.py").write_text("raise ImportError('built for another numpy')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    rows = _import_all(["json", "aborts", "raises", "math"])
    assert "ended the process (exit status -6)" in rows["aborts"]["error"]  # SIGABRT is 6
    assert rows["raises"]["error"] == "ImportError: built for another numpy"
    assert "error" not in rows["json"] and "error" not in rows["math"]


def test_this_machine_imports_our_own_packages():
    facts = look()
    assert set(facts.modules) == set(MODULES)
    assert facts.origin == str(ROOT / OURS)
    assert not facts.modules["numpy"].error and facts.blas


def test_runs_where_dolfinx_cannot_be_imported(tmp_path):
    for name in ("dolfinx", "petsc4py", "slepc4py", "gmsh"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('taken away by the test')\n")
    script = "from tipdamp import doctor; print(doctor.report(doctor.checks()))"
    child = subprocess.run(
        [sys.executable, "-c", script],
        cwd=ROOT,
        text=True,
        capture_output=True,
        env={"PYTHONPATH": str(tmp_path), "PATH": "/usr/bin"},
    )
    assert child.returncode == 0, child.stderr
    assert child.stdout.count("taken away by the test") == 4
    assert f"still works: {FROM_MATRICES}" in child.stdout
