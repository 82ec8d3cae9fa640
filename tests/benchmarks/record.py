"""Figures of a benchmark run in results/NAME.json, with the day, the processor, the versions and the code it ran on."""

import datetime
import hashlib
import json
import platform
import subprocess
from importlib import metadata
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
ROOT = Path(__file__).parents[2]


def record(name: str, figures: dict) -> Path:
    """Write what a run found; the run on file is replaced."""
    path = RESULTS / f"{name}.json"
    RESULTS.mkdir(exist_ok=True)
    path.write_text(json.dumps(made() | figures, indent=1) + "\n", encoding="utf-8")
    return path


def recorded(name: str) -> dict | None:
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def made() -> dict:
    """Day, processor and versions of what is measured now."""
    return {"date": datetime.date.today().isoformat(), "processor": processor(), "versions": _versions()}


def fingerprint(package: str) -> str:
    """Of the code of a package: figures made by another are not mixed with these."""
    files = sorted((ROOT / package).glob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]


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
