"""Who may import whom: read from the source of every file, and tried where the finite-element stack
is absent.

    tipdamp -> static_contact -> modal -> hbm          meshes stands aside: it may use all, none
    uses it

All are imported below the one name tipdamp: `tipdamp.hbm` is the folder hbm. Rooms are the folders
directly inside a package, and its files; within a package each may use those that stand before it.
"""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import tipdamp

ROOT = Path(__file__).parents[1]
MAY_USE = {
    "hbm": {"hbm"},
    "modal": {"hbm", "modal"},
    "static_contact": {"hbm", "modal", "static_contact"},
    "tipdamp": {"hbm", "modal", "static_contact", "tipdamp"},
    "meshes": {"hbm", "modal", "static_contact", "tipdamp", "meshes"},
}
LINKED = set(MAY_USE) - {"tipdamp"}
ROOMS = {
    "hbm": [
        "errors",
        "fourier",
        "ties",
        "compiled",
        "continuation",
        "memory",
        "points",
        "validation",
        "io",
        "named_point",
        "amplitude",
        "tables",
        "drawing",
        "contact",
        "influence",
        "laws",
        "model",
        "example",
        "contact_doubts",
        "matrices_out",
        "periodic_solution",
        "result",
        "hold",
        "balance",
        "interface",
        "testing",
        "time",
        "stability",
        "curve",
        "modes",
        "search",
        "comparison",
        "response",
        "compile_ahead",
        "fitting",
        "self_excited",
        "following",
        "problem",
    ],
    "modal": [
        "matrix_checks",
        "memory",
        "mesh",
        "solvers",
        "truncation",
        "eigen",
        "elements",
        "cell_shape",
        "definite",
        "faces",
        "body",
        "mesh_checks",
        "contact_shapes",
        "elasticity",
        "loads",
        "load_modes",
        "mesh_support",
        "stiffening",
        "stress_recovery",
        "reduction",
        "craig_bampton",
    ],
    "static_contact": ["stiffness", "normal", "bodies", "surfaces", "contact", "tuning", "full"],
    "tipdamp": [
        "__init__",
        "readers",
        "study",
        "engine",
        "fields",
        "results",
        "bodies",
        "statics",
        "measured",
        "checks",
        "report",
        "stages",
        "sweep",
        "comparison",
        "proposal",
        "doctor",
        "cli",
        "__main__",
    ],
}
# (from, to): hints that point up, of pictures and tables of a record that has them as its methods
FOR_HINTS = {("drawing", "contact"), ("drawing", "result"), ("tables", "result")}
KERNEL = {"numpy", "scipy", "numba"}  # all that hbm may ask of a machine
DOLFINX = {"dolfinx", "ufl", "basix", "ffcx"}
# only inside the function that needs it
HEAVY = DOLFINX | {"petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio"}
COMPAT = "modal/elements/dolfinx_compat.py"
DOLFINX_HOME = {
    "dolfinx": {COMPAT},
    "basix": {COMPAT},
    "ffcx": set(),
    "ufl": {COMPAT, "modal/elasticity.py", "modal/stiffening.py"},
}

FILES = sorted(path for package in MAY_USE for path in (ROOT / package).rglob("*.py"))
NAMES = [path.relative_to(ROOT).as_posix() for path in FILES]
each_file = pytest.mark.parametrize("path", FILES, ids=NAMES)


def imports(path, hints=False):
    """[(absolute dotted name, whether it happens when the file itself is imported)] of a source
    file; hints : with those for type checkers alone, which never happen."""
    package = path.relative_to(ROOT).parent.parts
    found = []

    def visit(node, at_import):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            for child in node.body if hints else ():
                visit(child, False)
            return
        if isinstance(node, ast.Import):
            found.extend((alias.name, at_import) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            found.extend((f"{module}.{alias.name}", at_import) for alias in node.names)
        inside = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        for child in ast.iter_child_nodes(node):
            visit(child, at_import and not inside)

    visit(ast.parse(path.read_text(encoding="utf-8"), str(path)), True)
    return [(in_folders(name), at_import) for name, at_import in found]


def in_folders(name):
    """`hbm.model` for `tipdamp.hbm.model`: where it stands in the repository."""
    inner = name.removeprefix("tipdamp.")
    return inner if inner.split(".")[0] in LINKED else name


def tops(path, hints=False):
    return {name.split(".")[0] for name, _ in imports(path, hints)}


def test_reader_of_imports(tmp_path, monkeypatch):
    """Relative imports are resolved, imports in functions told apart from those of the file."""
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    path = tmp_path / "tipdamp" / "report" / "page.py"
    path.parent.mkdir(parents=True)
    path.write_text(
        "import numpy as np\nfrom .. import study\nfrom . import subjects\nfrom ..stages import "
        "run\ndef draw():\n    import gmsh\n    from tipdamp.modal.body import Body\n"
        "if TYPE_CHECKING:\n    from tipdamp.hbm.model import ReducedModel\n"
    )
    hint = ("hbm.model.ReducedModel", False)
    assert hint not in imports(path)
    assert imports(path, hints=True) == [*imports(path), hint]
    assert imports(path) == [
        ("numpy", True),
        ("tipdamp.study", True),
        ("tipdamp.report.subjects", True),
        ("tipdamp.stages.run", True),
        ("gmsh", False),
        ("modal.body.Body", False),
    ]


@each_file
def test_direction(path):
    package = path.relative_to(ROOT).parts[0]
    wrong = tops(path, hints=True) & set(MAY_USE) - MAY_USE[package]
    assert not wrong, f"{package} must not import {wrong}"


@pytest.mark.parametrize("path", [p for p in FILES if "hbm" in p.parts], ids=lambda path: path.name)
def test_hbm_needs_numpy_scipy_numba_alone(path):
    assert tops(path) - {"hbm"} - KERNEL <= sys.stdlib_module_names


@pytest.mark.parametrize(
    "path", sorted((ROOT / "hbm" / "continuation").glob("*.py")), ids=lambda path: path.stem
)
def test_continuation_knows_nothing_of_vibration(path):
    """Its files import each other and nothing else of ours."""
    ours = {module for module, _ in imports(path) if module.split(".")[0] in MAY_USE}
    assert all(module.startswith("hbm.continuation.") for module in ours)


def circles(files):
    """[names of modules that import each other in a circle, or lie between two such], imports in
    functions included."""
    module = {
        path: path.relative_to(ROOT)
        .with_suffix("")
        .as_posix()
        .replace("/", ".")
        .removesuffix(".__init__")
        for path in files
    }
    uses = {module[path]: set() for path in files}
    for path, name in module.items():
        for found, _ in imports(path):
            home = found if found in uses else found.rpartition(".")[0]
            uses[name] |= {home} & uses.keys() - {name}
    while leaves := {name for name, used in uses.items() if not used & uses.keys()}:
        uses = {name: used for name, used in uses.items() if name not in leaves}
    while roots := uses.keys() - {used for name in uses for used in uses[name]}:
        uses = {name: used for name, used in uses.items() if name not in roots}
    return sorted(uses)


@pytest.mark.parametrize("package", MAY_USE)
def test_no_circle_of_imports(package):
    assert circles([path for path in FILES if path.relative_to(ROOT).parts[0] == package]) == []


def room_of(name, package):
    """The folder or file directly inside the package that a module belongs to; the package itself
    is `__init__`."""
    inside = name.split(".")[1:]
    return inside[0] if inside and inside[0] in ROOMS[package] else "__init__"


@pytest.mark.parametrize("package", ROOMS)
def test_rooms_use_those_before_them(package):
    """Hints too, but those that are listed. (Circles of hints inside a room do no harm.)"""
    order, wrong, allowed = ROOMS[package], [], set()
    for path in (path for path in FILES if path.relative_to(ROOT).parts[0] == package):
        mine = path.relative_to(ROOT).parts[1].removesuffix(".py")
        face = mine == "__init__"  # its hints are the names of all rooms
        if face and package != "tipdamp":
            continue
        used = {
            room_of(name, package)
            for name, _ in imports(path, hints=not face)
            if name.split(".")[0] == package
        }
        above = {
            room for room in used - {mine, "__init__"} if order.index(room) > order.index(mine)
        }
        allowed |= {(mine, room) for room in above} & FOR_HINTS
        wrong += [(path.name, mine, room) for room in above if (mine, room) not in FOR_HINTS]
    assert wrong == []
    assert allowed == (FOR_HINTS if package == "hbm" else set())


def test_hints_that_point_up_are_hints_alone():
    wrong = [
        (name, found)
        for path, name in zip(FILES, NAMES, strict=True)
        for found, _ in imports(path)
        for room, up in FOR_HINTS
        if name.removesuffix(".py").split("/")[:2] == ["hbm", room]
        if found.startswith(f"hbm.{up}.")
    ]
    assert wrong == []


@pytest.mark.parametrize("package", ROOMS)
def test_every_room_has_its_place(package):
    there = {
        path.relative_to(ROOT).parts[1].removesuffix(".py")
        for path in FILES
        if path.relative_to(ROOT).parts[0] == package
    }
    assert there - {"__init__"} == set(ROOMS[package]) - {"__init__"}


def test_a_circle_is_found_inside_functions(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    (tmp_path / "hbm").mkdir()
    texts = {
        "a": "from tipdamp.hbm.b import f\n",
        "b": "def f():\n    from tipdamp.hbm import c\n",
        "c": "from tipdamp.hbm.a import g\n",
        "above": "import tipdamp.hbm.a\n",
        "below": "import numpy\n",
    }
    for name, text in texts.items():
        (tmp_path / "hbm" / f"{name}.py").write_text(text)
    assert circles(sorted((tmp_path / "hbm").glob("*.py"))) == ["hbm.a", "hbm.b", "hbm.c"]


@each_file
def test_dolfinx_has_one_home(path):
    name = path.relative_to(ROOT).as_posix()
    abroad = {top for top in tops(path) & DOLFINX if name not in DOLFINX_HOME[top]}
    assert not abroad, f"only {[DOLFINX_HOME[t] for t in abroad]} may import {abroad}"


@each_file
def test_heavy_imports_wait_inside_functions(path):
    early = {name for name, at_import in imports(path) if at_import and name.split(".")[0] in HEAVY}
    assert not early, f"import inside the function that needs it: {early}"


@pytest.mark.parametrize(
    "path", [p for p in FILES if p.name == "__init__.py"], ids=lambda path: path.parent.name
)
def test_package_init_imports_nothing_heavy(path):
    assert tops(path) <= sys.stdlib_module_names


DEEP = {  # what documents import from below tipdamp, and why a script's face has it not
    "tipdamp.cli": "the command line from a script, for one file to show both",
    "tipdamp.engine.store": "results of the rig's study, for its synthetic measurements",
    "tipdamp.hbm": "inside the balance: the page of its theory",
    "tipdamp.hbm.balance": "inside the balance: the page of its theory",
    "tipdamp.measured.agreement": "inside [measured], for the rig's synthetic measurements",
    "tipdamp.meshes.structured": "meshes of examples: a user's come from a mesher",
    "tipdamp.modal.faces": "pairing of unlike meshes step by step, which a study does",
    "tipdamp.modal.stress_recovery": "stress step by step, which a study does",
    "tipdamp.stages": "the problem of a study's results folder",
    "tipdamp.static_contact.stiffness": "contact stiffness step by step, which a study does",
    "tipdamp.static_contact.surfaces": "pairing of unlike meshes step by step, which a study does",
    "tipdamp.static_contact.tuning.roll_springs": "inside a study, for synthetic measurements",
    "tipdamp.statics.model_inputs": "inside a study, for synthetic measurements",
}


def test_documents_import_from_the_face():
    """What the face has is imported from it; what it has not stands in the list."""
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.py"), *(ROOT / "docs").rglob("*.md")]
    asked = re.compile(r"^ *from (tipdamp[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
    found = [
        (page.name, home, name)
        for page in pages
        if not {"results", "site"} & set(page.parts)
        for home, names in asked.findall(page.read_text(encoding="utf-8"))
        for name in re.findall(r"\w+", names.partition("#")[0])
    ]
    assert len(found) > 100
    below = [one for one in found if one[1] != "tipdamp"]
    assert [one for one in below if one[2] in tipdamp.__all__] == []
    used = {one: {home for home in DEEP if f"{one[1]}.".startswith(f"{home}.")} for one in below}
    assert [one for one, homes in used.items() if not homes] == []
    assert set().union(*used.values()) == set(DEEP)


def test_every_package_is_declared():
    """A folder that is not named in pyproject.toml would be missing from an installed copy."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "setuptools"
    ]["packages"]
    folders = {path.parent.relative_to(ROOT).as_posix().replace("/", ".") for path in FILES}
    present = {f"tipdamp.{name}" if name.split(".")[0] in LINKED else name for name in folders}
    assert sorted(declared) == sorted(present)


@pytest.mark.parametrize("package", sorted(LINKED))
def test_one_name(package, tmp_path):
    """A second copy of a package, and of its classes, cannot be had beside the one below
    tipdamp."""
    assert (ROOT / "tipdamp" / package).resolve() == ROOT / package
    program = f"import tipdamp.{package}; import {package}"
    child = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True
    )
    assert f"ImportError: {package} is a part of tipdamp: import tipdamp.{package}" in child.stderr


WITHOUT_FINITE_ELEMENTS = """
import importlib, sys, traceback

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in BLOCKED:
            text = f"No module named {name!r} (taken away by the test)"
            raise ModuleNotFoundError(text, name=name)

BLOCKED = set(sys.argv[1].split(","))
sys.meta_path.insert(0, Blocker())
for name in sys.argv[2:]:
    try:
        importlib.import_module(name)
    except Exception:
        print(f"--- {name}")
        traceback.print_exc(file=sys.stdout)
"""


@pytest.mark.parametrize("package", ["hbm", "modal", "static_contact", "tipdamp"])
def test_imports_where_finite_elements_are_absent(package):
    """From reduced matrices onward nothing may need dolfinx, PETSc, SLEPc, gmsh or MPI."""
    modules = [name[:-3].replace("/", ".") for name in NAMES if name.startswith(f"{package}/")]
    modules = [name.removesuffix(".__init__") for name in modules if not name.endswith("__main__")]
    modules = [f"tipdamp.{name}" if package in LINKED else name for name in modules]
    child = subprocess.run(
        [sys.executable, "-c", WITHOUT_FINITE_ELEMENTS, ",".join(sorted(HEAVY)), *modules],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert child.returncode == 0, child.stderr
    assert child.stdout == ""
