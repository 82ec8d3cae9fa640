"""The libraries of the pages, which a study of matrices alone does not need; versions of the
software that made a report."""

import importlib.util
import platform
import re
from importlib import metadata
from pathlib import Path

import tipdamp
from tipdamp.hbm.errors import InputError

# name of the installed project where it is not the name that one imports
PROJECTS = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "dolfinx": "fenics-dolfinx",
    "petsc": "petsc4py",
    "slepc": "slepc4py",
    "gmsh": "gmsh",
    "plotly": "plotly",
    "matplotlib": "matplotlib",
}


class MissingLibrary(InputError):
    """A library of the report is not installed: nothing is wrong with the study."""


def missing(*names: str) -> str:
    """The first of these libraries that is not installed, or ''."""
    return next((name for name in names if importlib.util.find_spec(name) is None), "")


def need(name: str) -> None:
    """MissingLibrary where a library of the report is not installed, with the extra that brings
    it."""
    if missing(name):
        raise MissingLibrary(
            f"the report needs {name}, which is not installed; get the extra 'study': "
            "pip install -e '.[study]'"
        )


def versions() -> dict:
    """Versions of what is installed, read without importing it; what is missing is left out."""
    found = {"tipdamp": tipdamp.__version__, "python": platform.python_version()}
    for name, project in PROJECTS.items():
        try:
            found[name] = metadata.version(project)
        except metadata.PackageNotFoundError:
            if name == "gmsh" and (version := _gmsh()):
                found[name] = version
    return found


def _gmsh() -> str:
    """Debian's gmsh is a single file without metadata: its version stands in the source."""
    spec = importlib.util.find_spec("gmsh")
    if spec is None or not spec.origin or not Path(spec.origin).is_file():
        return ""
    match = re.search(
        r'^GMSH_API_VERSION\s*=\s*"([^"]+)"', Path(spec.origin).read_text(encoding="utf-8"), re.M
    )
    return match[1] if match else ""
