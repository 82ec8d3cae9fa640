"""summary.json: the figures of a run in one plain file, put together from the files of the stages."""

import importlib.util
import platform
import re
from importlib import metadata
from pathlib import Path

import tipdamp
from tipdamp.report.checks import warnings_of
from tipdamp.report.results import Results

# name of the installed project where it is not the name that one imports
PROJECTS = {"numpy": "numpy", "scipy": "scipy", "numba": "numba", "dolfinx": "fenics-dolfinx", "petsc": "petsc4py",
            "slepc": "slepc4py", "gmsh": "gmsh", "plotly": "plotly", "matplotlib": "matplotlib"}
COPIED = ("Fe_N", "H", "peak_hz", "peak_m", "min_peak_m", "points", "failed_points", "seconds", "complete", "ended",
          "patches")


def summarise(results: Results) -> dict:
    """The content of summary.json; keys of stages that the study has no section for are left out.

    peak_m - m, half of peak-to-peak along the force, largest over the patch of blade 1; slipping_pairs - their number;
    back - the same curve followed from the other end of the band.
    """
    summary = {"title": results.study.title, "study": results.study.path.name,
               "pull_N": results.study.driver.pull}
    if "reduce" in results:
        summary.update({key: results["reduce"][key] for key in ("free_hz", "reduction")})
    if "preload" in results:
        summary["preload"] = results["preload"]["sides"]
    if "tune" in results:
        tune = results["tune"]
        summary.update(target_hz=tune["target_hz"], stuck_hz=tune["stuck_hz"], tuned_pairs=tune["tuned_pairs"],
                       preload_kept=tune["preload_kept"])
        errors = [check["largest_error"] for check in tune["full_model_check"].values()]
        if errors:
            summary["reduction"] = {**summary["reduction"], "largest_error": max(errors)}
    if "respond" in results:
        summary["responses"] = [_response(case.facts) for case in results.cases]
    return {**summary, "seconds": dict(results.seconds), "versions": versions(), "warnings": warnings_of(results)}


def _response(facts) -> dict:
    return {**{key: facts[key] for key in COPIED if key in facts}, "slipping_pairs": len(facts["slipping_pairs"]),
            "slipping": facts["slipping_pairs"], **({"back": facts["back"]} if facts.get("back") else {})}


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
    match = re.search(r'^GMSH_API_VERSION\s*=\s*"([^"]+)"', Path(spec.origin).read_text(encoding="utf-8"), re.M)
    return match[1] if match else ""
