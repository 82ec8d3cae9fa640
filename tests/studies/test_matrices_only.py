"""The example docs/studies/matrices_only in a virtual environment that holds what pip installs and
nothing else.

The environment has neither dolfinx nor petsc4py nor slepc4py. It is made once from the package
index (a minute) and kept under build/, until pyproject.toml or the Python changes; the project
itself is installed anew when it changed."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tipdamp.readers.dispatch import read_mesh

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "studies" / "matrices_only"
HEAVY = ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio")
LIGHT = {"tipdamp", "numpy", "scipy", "numba", "llvmlite", "pip", "setuptools", "packaging"}


def run(*command, cwd):
    """Standard output; nothing of this process's packages or settings of Python leaks in."""
    clean = {
        k: v for k, v in os.environ.items() if not k.startswith("PYTHON") and k != "VIRTUAL_ENV"
    }
    done = subprocess.run(
        [str(c) for c in command],
        cwd=cwd,
        capture_output=True,
        text=True,
        env=clean | {"PYTHONNOUSERSITE": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout


def is_link(path):
    return path.is_symlink() and path.is_dir()


def source_of_the_project(folder):
    """A copy of what a build reads, links as links, so that it leaves nothing behind in the
    tree."""
    folder.mkdir()
    for name in ("tipdamp", *(link.name for link in (ROOT / "tipdamp").iterdir() if is_link(link))):
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=ignore)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    return folder


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """Interpreter of the environment, with the project as it stands installed in it."""
    made_of = (ROOT / "pyproject.toml").read_bytes() + sys.version.encode()
    venv = ROOT / "build" / f"light-venv-{hashlib.sha256(made_of).hexdigest()[:12]}"
    interpreter = venv / "bin" / "python"
    stamp = venv / "ready"
    work = tmp_path_factory.mktemp("light")
    source = source_of_the_project(work / "source")
    if not stamp.exists():
        shutil.rmtree(venv, ignore_errors=True)
        for old in venv.parent.glob("light-venv-*"):
            shutil.rmtree(old)
        run(sys.executable, "-m", "venv", venv, cwd=work)
        reached = subprocess.run(
            [interpreter, "-m", "pip", "download", "-q", "--no-deps", "-d", work, "wheel"],
            capture_output=True,
            timeout=120,
        )
        if reached.returncode:
            pytest.skip("no package index can be reached")
        run(interpreter, "-m", "pip", "install", "setuptools>=77", cwd=work)
        run(interpreter, "-m", "pip", "install", source, cwd=work)  # with its dependencies
        stamp.touch()
    files = sorted(path for path in source.rglob("*") if path.is_file())
    content = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
    if stamp.read_text() != content:
        run(
            interpreter,
            "-m",
            "pip",
            "install",
            "--no-deps",
            "--no-build-isolation",
            "--force-reinstall",
            source,
            cwd=work,
        )
        stamp.write_text(content)
    return interpreter


def test_what_pip_installs_is_light(python, tmp_path):
    installed = {
        line.split("==")[0].lower()
        for line in run(python, "-m", "pip", "list", "--format=freeze", cwd=tmp_path).split()
    }
    assert {"tipdamp", "numpy", "scipy", "numba"} <= installed <= LIGHT
    found = run(
        python,
        "-c",
        f"import importlib.util as u; print([n for n in {HEAVY} if u.find_spec(n)])",
        cwd=tmp_path,
    )
    assert found.strip() == "[]"
    assert "site-packages" in run(
        python, "-c", "import tipdamp; print(tipdamp.__file__)", cwd=tmp_path
    )
    told = run(
        python,
        "-c",
        "from importlib import metadata, resources as r; import re\n"
        "print(sorted(re.match(r'\\w+', d)[0] for d in metadata.requires('tipdamp') if 'extra' "
        "not in d),\n      all((r.files(p) / 'py.typed').is_file() for p in ('tipdamp',)))",
        cwd=tmp_path,
    )
    assert told.split("] ") == ["['numba', 'numpy', 'scipy'", "True\n"]


def test_the_example_runs_from_its_files_alone(python, tmp_path):
    run(python, EXAMPLE / "make_matrices.py", cwd=tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["K.mtx", "M.mtx", "dofs.csv", "pairs.csv"]
    lines = run(python, EXAMPLE / "run.py", cwd=tmp_path).splitlines()[1:]
    assert len(lines) == 3 and all(line.endswith("reached the end of the band") for line in lines)
    hz, per_newton, slipping = np.array([line.split()[1:4] for line in lines], dtype=float).T
    assert slipping[0] == 0 and slipping[-1] == 6
    assert (np.diff(per_newton) <= 0).all() and hz[-1] < hz[0]
    assert {p.name for p in tmp_path.glob("curve_*.npz")} == {
        f"curve_{level}N.npz" for level in (5, 40, 60)
    }


def test_beside_a_package_called_modal(python, tmp_path):
    """The package index has a `modal`, an `hbm` and a `meshes` of others: both stay whole."""
    other = tmp_path / "other"
    (other / "modal").mkdir(parents=True)
    (other / "modal" / "__init__.py").write_text('OWNER = "others"\n')
    (other / "modal" / "mesh.py").write_text("CELLS = 7\n")
    (other / "pyproject.toml").write_text(
        '[build-system]\nrequires = ["setuptools"]\nbuild-backend = "setuptools.build_meta"\n'
        '[project]\nname = "modal"\nversion = "1.0"\n[tool.setuptools]\npackages = ["modal"]\n'
    )
    site = tmp_path / "site"
    sources = (source_of_the_project(tmp_path / "source"), other)
    for source in (*sources, *sources):  # whichever comes last overwrites nothing of the other
        options = ("--no-deps", "--no-build-isolation", "--upgrade", "--target", site)
        run(python, "-m", "pip", "install", "-q", *options, source, cwd=tmp_path)
    owned = [
        set(line.split(",")[0] for line in record.read_text().splitlines())
        for record in site.glob("*.dist-info/RECORD")
    ]
    assert len(owned) == 2 and not owned[0] & owned[1]
    assert all((site / name).is_file() for name in owned[0] | owned[1] if ".." not in name)
    tops = {name.split("/")[0] for name in owned[0] | owned[1] if ".." not in name}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"tipdamp", "modal"}
    said = run(
        python,
        "-c",
        f"import sys; sys.path.insert(0, {str(site)!r})\n"
        "import modal, modal.mesh, tipdamp.modal.mesh, tipdamp.hbm.response, importlib.util\n"
        "print(modal.OWNER, modal.mesh.CELLS, tipdamp.modal.mesh.__name__,"
        " importlib.util.find_spec('hbm'))",
        cwd=tmp_path,
    )
    assert said.split() == ["others", "7", "tipdamp.modal.mesh", "None"]


def test_the_command_line_starts(python, tmp_path):
    assert "tipdamp" in run(python.parent / "tipdamp", "--help", cwd=tmp_path)


def test_what_is_installed_reads_meshes_and_checks_own_laws(python, tmp_path):
    """All readers, without a mesh library; the law of the example; no file of the tests or
    documents."""
    shutil.copy(ROOT / "docs" / "studies" / "own_law" / "dahl.py", tmp_path)
    run(
        python,
        "-c",
        "from dahl import Dahl; from tipdamp.hbm.testing import check_law; check_law(Dahl())",
        cwd=tmp_path,
    )
    meshes = [
        path
        for path in sorted((ROOT / "tests" / "reference" / "meshes").iterdir())
        if path.suffix != ".md"
    ]
    assert {path.suffix for path in meshes} == {".bdf", ".cdb", ".inp", ".msh"}
    told = run(
        python,
        "-c",
        "import sys; from pathlib import Path; from tipdamp.readers.dispatch import read_mesh\n"
        "print([len(read_mesh(Path(mesh)).node) for mesh in sys.argv[1:]])",
        *meshes,
        cwd=tmp_path,
    )
    assert told.strip() == str([len(read_mesh(mesh).node) for mesh in meshes])
    files = run(
        python,
        "-c",
        "from importlib import metadata; print(*{f.parts[0] for f in metadata.files('tipdamp')})",
        cwd=tmp_path,
    ).split()
    assert {"tipdamp"} == {
        name for name in files if name != ".." and not name.endswith(".dist-info")
    }
