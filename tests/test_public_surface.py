"""What users import has a docstring and type hints; mypy (./dev lint) then holds the bodies to the
hints."""

import ast
import inspect
import tomllib
from pathlib import Path

import pytest

import tipdamp

ROOT = Path(__file__).parents[1]
PUBLIC = (
    "hbm/contact.py",
    "hbm/errors.py",
    "hbm/model.py",
    "hbm/curve/peaks.py",
    "hbm/response.py",
    "hbm/amplitude.py",
    "hbm/periodic_solution.py",
    "hbm/result.py",
    "hbm/curve/solutions.py",
    "hbm/fitting/*.py",
    "hbm/following/*.py",
    "hbm/modes/*.py",
    "hbm/testing.py",
    "hbm/io/*.py",
    "hbm/laws/base.py",
    "modal/body.py",
    "modal/craig_bampton.py",
    "modal/eigen.py",
    "modal/elasticity.py",
    "modal/loads.py",
    "modal/mesh.py",
    "modal/stress_recovery.py",
    "modal/truncation.py",
    "static_contact/bodies/rigid_motions.py",
    "static_contact/contact/equilibrium.py",
    "static_contact/contact/frictional_preload.py",
    "static_contact/surfaces/pairing.py",
    "static_contact/contact/preload.py",
    "static_contact/contact/pull.py",
    "static_contact/normal/complementarity.py",
    "static_contact/tuning/station_detachment.py",
    "static_contact/tuning/redistribution.py",
    "tipdamp/cli.py",
    "tipdamp/doctor.py",
    "tipdamp/engine/store.py",
    "tipdamp/readers/*.py",
    "tipdamp/stages/run.py",
    "tipdamp/study/*.py",
)
FILES = sorted(path for pattern in PUBLIC for path in ROOT.glob(pattern))


def public(tree):
    """Functions and classes of a module, and methods of its classes, that start without
    underscore."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from public(node)


def without_hints(function):
    a = function.args
    given = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg))]
    missing = [x.arg for x in given if x.annotation is None and x.arg not in ("self", "cls")]
    return missing + ["return"] * (function.returns is None)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_public_functions_have_hints(path):
    functions = [
        n
        for n in public(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(n, ast.FunctionDef)
    ]
    assert {f.name: without_hints(f) for f in functions if without_hints(f)} == {}


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_public_names_have_docstrings(path):
    names = public(ast.parse(path.read_text(encoding="utf-8")))
    assert [n.name for n in names if ast.get_docstring(n) is None] == []


def test_the_list_names_files_that_exist():
    assert [pattern for pattern in PUBLIC if not list(ROOT.glob(pattern))] == []


@pytest.mark.parametrize("package", ["hbm", "modal", "static_contact", "tipdamp"])
def test_packages_ship_their_types_and_data(package):
    """Files beside the code are data of a package that pyproject.toml names; documents and images
    stay behind."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "setuptools"
    ]
    name = package if package == "tipdamp" else f"tipdamp.{package}"
    inside = [found for found in settings["packages"] if f"{found}.".startswith(f"{name}.")]
    folders = [ROOT / found.replace(".", "/") for found in inside]
    patterns = ("*.py", *settings["package-data"]["*"])
    shipped = {f for folder in folders for pattern in patterns for f in folder.glob(pattern)}
    shipped = {path.resolve() for path in shipped}
    there = {f for f in (ROOT / package).rglob("*") if f.is_file() and "__pycache__" not in f.parts}
    assert there - shipped == set()
    assert (ROOT / "tipdamp" / "py.typed").is_file()


def signatures():
    """(name, signature) of what `from tipdamp import ...` gives, and of public methods."""
    for name in tipdamp.__all__:
        thing = getattr(tipdamp, name)
        methods = inspect.getmembers(thing, callable) if inspect.isclass(thing) else []
        public = [(f"{name}.{own}", of) for own, of in methods if not own.startswith("_")]
        for known, of in [(name, thing), *public]:
            try:
                yield known, inspect.signature(of)
            except (TypeError, ValueError):  # a module, or of the interpreter
                continue


def test_help_shows_types_by_their_names():
    """ArrayLike, not the 300 characters that numpy makes of it."""
    known = dict(signatures())
    assert "follow_peak" in known and "Body.motion_of" in known
    long = [
        f"{name}: {p.name}"
        for name, of in known.items()
        for p in of.parameters.values()
        if len(str(p.replace(default=p.empty))) > 150 or "numpy._typing" in str(p)
    ]
    assert not long
