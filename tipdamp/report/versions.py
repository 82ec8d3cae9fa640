"""Versions of the software that made a report."""

import importlib.util
import platform
import re
from importlib import metadata
from pathlib import Path

import tipdamp

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
