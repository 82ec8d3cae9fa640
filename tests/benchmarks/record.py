"""Figures of a benchmark in build/benchmarks/NAME.json, with the day, the processor, the versions and the commit."""

import json
import os
import platform
import subprocess
from pathlib import Path

from tests.validation.__main__ import ROOT, made

RESULTS = ROOT / "build" / "benchmarks"


def record(name: str, figures: dict) -> Path:
    """Write what a run found; an earlier one is replaced."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps({"made": made(), "processor": processor()} | figures, indent=1) + "\n", encoding="utf-8")
    return path


def one_thread():
    """Refuse to measure where the libraries may use more than one thread: it is too late to tell them."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        raise SystemExit("benchmarks run on one thread: python -m tests.benchmarks, or set OMP_NUM_THREADS=1")


def processor():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    return next((x.split(":")[1].strip() for x in lines if x.startswith("model name")), platform.processor())


def ccx_version() -> str:
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    return " ".join(said.split()[3:]) or "CalculiX"
