"""What is missing or wrong on this machine, which jobs still work, and the command that repairs it.

`look()` gathers the facts, the small check functions judge them, `report()` writes them up. Imports
that may abort the process (mixed HDF5 or numpy builds do) happen in a child process, so that the
doctor outlives its patients.
"""

import importlib.util
import json
import re
import site
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

OURS = "tipdamp"
DEBIAN = "/usr/lib/python3/dist-packages"
# In this order: what each job needs first, and h5py after dolfinx, the order in which a foreign
# HDF5 aborts.
STUDY = (
    "pydantic",
    "rich",
    "filelock",
    "threadpoolctl",
    "jinja2",
    "plotly",
    "matplotlib",
)  # the extra `study`
MODULES = ("numpy", "scipy", "numba", "petsc4py", "slepc4py", "dolfinx", "gmsh", "h5py", *STUDY)
AFRESH = "rm -rf .venv && ./dev setup"
FROM_MATRICES = "statics, tuning and forced responses from matrices ([model]); not meshes"
OWN_CELLS = (
    "meshes too, more slowly: tipdamp assembles all cells by itself; and everything from matrices"
)
OWN_FACTORS = (
    "meshes too, more slowly, with SciPy's factors; not Newton on the full model; everything "
    "from matrices"
)
NO_SHARED_MODES = "everything but modes of the full model that several processes share (mpirun)"
NO_RIG = "everything but making the meshes of the two-blade rig; .msh files are read without it"
NO_PAGE = "everything up to the forced responses; not the report, nor the page of inspect"
NO_REPORT = "everything up to the forced responses; not the report"
NO_STUDY = "hbm, modal and static_contact from Python; not the stages of a study"


@dataclass(frozen=True)
class Check:
    """One finding: `status` is ok, warn (some jobs still work) or fail (none does, or results
    cannot be trusted)."""

    name: str
    status: str
    what: str
    repair: str = ""  # the command
    works: str = ""  # the jobs that still work


@dataclass(frozen=True)
class Module:
    """An imported module, or why it could not be imported."""

    version: str = ""
    file: str = ""
    error: str = ""


@dataclass(frozen=True)
class Facts:
    """What `look` found; tests make their own."""

    modules: Mapping[str, Module]
    blas: tuple[str, ...] = ()  # libraries that numpy, scipy and PETSc loaded
    scalar: str = ""  # of PETSc: float64, complex128
    debian_numpy: str = ""  # version that Debian's compiled packages were built with
    origin: str = ""  # folder from which our package is imported
    providers: tuple[str, ...] = ()  # installed projects that claim its name
    python: str = sys.base_prefix  # Debian's packages are seen from /usr alone
    root: str = str(Path(__file__).resolve().parents[1])
    jobs: int = 1  # curves side by side
    no_jobs: str = ""  # why there cannot be several


def checks(facts: Facts | None = None) -> list[Check]:
    """All findings about this machine, or about given facts."""
    facts = look() if facts is None else facts
    debian = "./dev setup" if facts.python == "/usr" else AFRESH
    age = _numpy_age(facts)
    found = [
        age,
        *(_needed(facts, name) for name in ("numpy", "scipy", "numba")),
        _blas(facts),
        *(
            _optional(facts, name, debian, _works_without(facts, name))
            for name in ("dolfinx", "petsc4py", "slepc4py", "gmsh")
        ),
        _scalar(facts),
        _h5py(facts),
        *(
            _optional(
                facts,
                name,
                _pip(f"install {name}"),
                {"jinja2": NO_PAGE, "plotly": NO_PAGE, "matplotlib": NO_REPORT}.get(name, NO_STUDY),
            )
            for name in STUDY
        ),
        _own_package(facts),
        _jobs(facts),
    ]
    if age.status == "ok":
        return found
    # a numpy of the wrong age explains whatever else is found but does not import
    present = {
        name
        for name, module in facts.modules.items()
        if not module.error.startswith("ModuleNotFound")
    }
    return [
        replace(c, repair=age.repair) if c.status != "ok" and c.name in present else c
        for c in found
    ]


def report(found: list[Check]) -> str:
    """The findings as text, troubles with their way out, and one closing line."""
    width = max(len(check.name) for check in found)
    lines = []
    for check in found:
        lines.append(f"{check.status:<4}  {check.name:<{width}}  {check.what}")
        for label, text in (("still works", check.works), ("repair", check.repair)):
            if text:
                lines.append(" " * (width + 8) + f"{label}: {text}")
    counts = {status: sum(check.status == status for check in found) for status in ("fail", "warn")}
    if not any(counts.values()):
        return "\n".join([*lines, "everything is in place"])
    return "\n".join(
        [*lines, f"{counts['fail']} failed, {counts['warn']} warned, {len(found)} looked at"]
    )


# ---- judging -------------------------------------------------------------------------------------


def _pip(command: str) -> str:
    return f"{sys.executable} -m pip {command}"


def _present(name: str, module: Module) -> Check:
    return Check(name, "ok", f"{module.version} ({Path(module.file).parent})")


def _needed(facts: Facts, name: str) -> Check:
    module = facts.modules[name]
    if not module.error:
        return _present(name, module)
    return Check(name, "fail", module.error, AFRESH)


def _numpy_age(facts: Facts) -> Check:
    numpy = facts.modules["numpy"]
    name, debian = "numpy's age", facts.debian_numpy
    if numpy.error or not debian or _minor(numpy.version) <= _minor(debian):
        return Check(
            name,
            "ok",
            f"not newer than Debian's {debian}" if debian else "no Debian packages to agree with",
        )
    what = (
        f"numpy {numpy.version} hides Debian's {debian}, for which scipy, petsc4py and dolfinx "
        "were compiled"
    )
    in_home = numpy.file.startswith(site.getusersitepackages())
    return Check(
        name,
        "fail",
        what,
        "export PYTHONNOUSERSITE=1" if in_home else _pip("uninstall numpy scipy"),
    )


def _minor(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:2])


def _blas(facts: Facts) -> Check:
    # Debian's reference BLAS lives in .../blas/, tuned ones in folders or files of their own name
    slow = [path for path in facts.blas if re.search(r"/blas/libblas\.so", path)]
    if slow:
        what = f"the reference BLAS ({slow[0]}): factorisations take 5 to 12 times longer"
        return Check("BLAS", "warn", what, "./dev setup", "all, slowly")
    if not facts.blas:
        return Check("BLAS", "warn", "no BLAS library seen: its speed is unknown", works="all")
    return Check("BLAS", "ok", ", ".join(facts.blas))


def _optional(facts: Facts, name: str, repair: str, works: str) -> Check:
    module = facts.modules[name]
    return (
        Check(name, "warn", module.error, repair, works) if module.error else _present(name, module)
    )


def _works_without(facts: Facts, name: str) -> str:
    """What is left; a module that is there and does not import is in the way of the meshes, an
    absent one is not."""

    def absent(module: str) -> bool:
        return facts.modules[module].error.startswith("ModuleNotFoundError")

    if name == "gmsh":
        return NO_RIG
    if name == "slepc4py" and not facts.modules["petsc4py"].error:
        return NO_SHARED_MODES
    if not absent(name):
        return FROM_MATRICES
    return OWN_CELLS if name == "dolfinx" else OWN_FACTORS


def _scalar(facts: Facts) -> Check:
    if facts.scalar.startswith("complex"):
        return Check(
            "PETSc's scalars",
            "fail",
            "complex: the meshes need the real build",
            "unset PETSC_DIR SLEPC_DIR",
            FROM_MATRICES,
        )
    return Check("PETSc's scalars", "ok", facts.scalar or "no PETSc")


def _h5py(facts: Facts) -> Check:
    module = facts.modules["h5py"]
    if not module.error and (module.file.startswith(DEBIAN) or facts.modules["dolfinx"].error):
        return _present("h5py", module)
    if module.error.startswith("ModuleNotFoundError"):
        return Check("h5py", "ok", "not found, and not needed: no mesh is read from HDF5")
    what = module.error or f"{module.version} from {Path(module.file).parent} aborts beside dolfinx"
    return Check("h5py", "fail", what, f"{_pip('uninstall h5py')}; ./dev setup", FROM_MATRICES)


def _own_package(facts: Facts) -> Check:
    """Another project of our name would hide ours or overwrite it, and pip keeps silent."""
    strangers = sorted(set(facts.providers) - {OURS})
    others = " ".join(strangers or [OURS])
    away = f"{_pip(f'uninstall {others}')}; {_pip('install --force-reinstall --no-deps -e .')}"
    if not facts.origin:
        return Check(OURS, "fail", "not found", _pip("install -e ."))
    if facts.origin != str(Path(facts.root, OURS)):
        what = f"imported from {facts.origin}, which is not this project ({facts.root})"
        return Check(OURS, "fail", what, away)
    if strangers:
        what = f"also claimed by the installed project {', '.join(strangers)}"
        return Check(OURS, "warn", what, away, "unknown")
    return Check(OURS, "ok", facts.origin)


def _jobs(facts: Facts) -> Check:
    if facts.no_jobs:
        return Check(
            "jobs",
            "warn",
            facts.no_jobs,
            "export TIPDAMP_JOBS=1",
            "everything, one curve after the other",
        )
    return Check(
        "jobs",
        "ok",
        f"{facts.jobs} curve{'s' * (facts.jobs > 1)} side by side (TIPDAMP_JOBS, --jobs)",
    )


# ---- looking -------------------------------------------------------------------------------------

_CHILD = r"""
import importlib, json, re, sys
for name in sys.argv[1:]:
    row = {"module": name}
    print("\n?" + json.dumps(row), flush=True)
    try:
        if name == "petsc4py":
            import petsc4py
            petsc4py.init(["doctor", "-skip_petscrc"])
            from petsc4py import PETSc
            row["scalar"] = PETSc.ScalarType.__name__
        module = importlib.import_module(name)
        if name == "slepc4py":
            from slepc4py import SLEPc
        if name == "scipy":
            import scipy.linalg, scipy.sparse.linalg
        row["version"] = str(getattr(module, "__version__", ""))
        row["file"] = getattr(module, "__file__", None) or ""
    except BaseException as error:
        row["error"] = f"{type(error).__name__}: {error}".splitlines()[0]
    with open("/proc/self/maps") as maps:
        paths = {line.split()[-1] for line in maps if "/" in line}
    blas = re.compile("lib.*(blas|mkl_rt|blis)")
    row["blas"] = sorted(p for p in paths if blas.match(p.rsplit("/", 1)[-1]))
    print("\n!" + json.dumps(row), flush=True)
"""


def look() -> Facts:
    """Import everything in a child process and find out where our own packages come from."""
    rows = _import_all(list(MODULES))
    jobs, no_jobs = _try_jobs(rows)
    return Facts(
        jobs=jobs,
        no_jobs=no_jobs,
        modules={
            n: Module(r.get("version", ""), r.get("file", ""), r.get("error", ""))
            for n, r in rows.items()
        },
        blas=tuple(
            sorted(
                {
                    path
                    for row in rows.values()
                    for path in row.get("blas", ())
                    if "gslcblas" not in path
                }
            )
        ),
        scalar=rows["petsc4py"].get("scalar", ""),
        debian_numpy=debian_numpy(sys.path),
        origin=_origin(OURS),
        providers=tuple(metadata.packages_distributions().get(OURS, ())),
    )


def debian_numpy(places: Sequence[str]) -> str:
    """Version of Debian's numpy, "" where these places (of sys.path) hold no packages of Debian."""
    seen = [place for place in places if place == DEBIAN]
    return next((d.version for d in metadata.distributions(name="numpy", path=seen)), "")


def _try_jobs(rows: dict[str, dict]) -> tuple[int, str]:
    """(curves side by side, why there cannot be several): two processes are started."""
    if any(rows[name].get("error") for name in ("numpy", "scipy", "numba")):
        return 1, ""  # told elsewhere
    from tipdamp.engine.workers import Workers, default_jobs, nothing

    try:
        with Workers(2) as workers:
            list(workers.spread(nothing, None, ["one", "other"], lambda *_: None))
        return default_jobs(), ""
    except Exception as error:
        return 1, f"{type(error).__name__}: {error}".splitlines()[0]


def _import_all(names: list[str]) -> dict[str, dict]:
    """{module: row of the child}; a module that takes the child down is noted, and a new child goes
    on behind it."""
    rows = {}
    while names:
        try:
            child = subprocess.run(
                [sys.executable, "-c", _CHILD, *names], capture_output=True, text=True, timeout=120
            )
            output = child.stdout
            end = f"the import ended the process (exit status {child.returncode})"
        except subprocess.TimeoutExpired as late:
            output = (late.stdout or b"").decode()
            end = "the import did not end within 120 s"
        for line in output.splitlines():
            if line[:1] in "?!" and line[1:2] == "{":
                row = json.loads(line[1:])
                rows[row["module"]] = {"error": end} if line[0] == "?" else row
        if names[0] not in rows:  # the child never started
            rows[names[0]] = {"error": end}
        names = [name for name in names if name not in rows]
    return rows


def _origin(name: str) -> str:
    spec = importlib.util.find_spec(name)
    if not spec:
        return ""
    places = list(spec.submodule_search_locations or [])
    return str(Path(places[0]).resolve()) if places else spec.origin or ""
