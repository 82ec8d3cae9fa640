"""Figures of a benchmark in build/benchmarks/NAME.json, with the day, the processor, the versions
and the commit."""

import json
import os
import platform
import resource
import subprocess
from pathlib import Path

from tests.validation.__main__ import ROOT, made

RESULTS = ROOT / "build" / "benchmarks"


def record(name: str, figures: dict) -> Path:
    """Write what a run found; an earlier one is replaced."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(
        json.dumps({"made": made(), "processor": processor()} | figures, indent=1) + "\n",
        encoding="utf-8",
    )
    return path


def one_thread():
    """Refuse to measure where the libraries may use more than one thread: it is too late to tell
    them."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        raise SystemExit(
            "benchmarks run on one thread: python -m tests.benchmarks, or set OMP_NUM_THREADS=1"
        )


def processor():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    return next(
        (x.split(":")[1].strip() for x in lines if x.startswith("model name")), platform.processor()
    )


def run_ccx(folder, job) -> float:
    """CPU seconds of CalculiX on job.inp in a folder, on one thread."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        ["ccx", "-i", job],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_EQUATION_SOLVER": "1"},
    )
    if done.returncode:
        raise SystemExit(f"ccx failed: {done.stdout[-800:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def ccx_version() -> str:
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    return " ".join(said.split()[3:]) or "CalculiX"
