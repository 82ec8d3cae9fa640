"""Figures of a benchmark run in results/NAME.json, with the day, the processor, the versions and the code it ran on.

The code is a fingerprint of the packages that the benchmark runs; the validation pages compare it with the code as it
is now, so that no figure passes for one of another code. Stores that grow while a run goes on (.jsonl) carry the same
in their first line.
"""

import datetime
import hashlib
import json
import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
ROOT = Path(__file__).parents[2]

PACKAGES = {"hbm": ("hbm",), "statics": ("hbm", "modal", "static_contact"),
            "study": ("hbm", "modal", "static_contact", "tipdamp", "tipdamp/jobs", "tipdamp/readers")}
"""What runs in a benchmark: the harmonic balance alone, the statics too, or a whole study."""

RUNS = dict.fromkeys(("speed", "rig", "robustness", "truth_rig", "truth_robustness"), "hbm") | dict.fromkeys((
    "calculix", "calculix_modes", "cost_floor", "growth", "hertz", "mpi_ranks", "preload_random_beams",
    "random_bodies"), "statics") | dict.fromkeys(("stuck_bound", "demo"), "study")
"""{store: key of PACKAGES}"""


def record(name: str, figures: dict) -> Path:
    """Write what a run found; the run on file is replaced."""
    path = RESULTS / f"{name}.json"
    RESULTS.mkdir(exist_ok=True)
    path.write_text(json.dumps(made(name) | figures, indent=1) + "\n", encoding="utf-8")
    return path


def recorded(name: str) -> dict | None:
    """The figures of a run, of a store that grows those of its first line; None where there is none."""
    path, growing = RESULTS / f"{name}.json", RESULTS / f"{name}.jsonl"
    if growing.exists():
        return json.loads(growing.read_text(encoding="utf-8").partition("\n")[0])
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def made(name: str) -> dict:
    """Day, processor, versions and code of what is measured now for a store."""
    return {"date": datetime.date.today().isoformat(), "processor": processor(), "versions": _versions(),
            "code": AT_START[RUNS[name]]}


def fingerprint(key: str) -> str:
    """Of the code and the tables of PACKAGES[key]: figures made by another are not mixed with these."""
    files = [path for package in PACKAGES[key] for kind in ("py", "csv")
             for path in sorted((ROOT / package).glob(f"*.{kind}"))]
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]


AT_START = {key: fingerprint(key) for key in PACKAGES}
"""Of the code that was loaded, whatever happens to the files while it runs."""


def one_thread():
    """Refuse to measure where the libraries may use more than one thread: it is too late to tell them."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        raise SystemExit("benchmarks run on one thread: python -m tests.benchmarks, or set OMP_NUM_THREADS=1")


def processor():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    return next((x.split(":")[1].strip() for x in lines if x.startswith("model name")), platform.processor())


def _versions():
    found = [f"Python {platform.python_version()}"]
    for package in ("numpy", "scipy", "numba", "fenics-dolfinx", "petsc4py"):
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            continue
    return ", ".join(found)


def ccx_version() -> str:
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    return " ".join(said.split()[3:]) or "CalculiX"
