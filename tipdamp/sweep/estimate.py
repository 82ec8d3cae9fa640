"""What a sweep will cost, before it begins: by the steps of each stage that were made before, else
by the forecast for the study as it stands."""

import shutil
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tipdamp.checks.forecast import Cost, Size, estimate, size_of
from tipdamp.engine.progress import duration
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.memory import available_bytes, own_bytes
from tipdamp.results.static_results import InspectResult
from tipdamp.stages.run import run_stage
from tipdamp.study.checks import CURVE_MB
from tipdamp.study.study import load_study
from tipdamp.study.view import Study
from tipdamp.sweep.index import FILE, Index
from tipdamp.sweep.plan import CURVES, STRESS, Plan
from tipdamp.sweep.work import products

LEAST_SECONDS, LEAST_BYTES = 0.1, 2e4  # of a step: what it takes to begin, read and pack it
CURVE_SECONDS = 0.2  # at least
FIELD_BYTES = 10.0  # of the fields of stress, a dof and level
ON_SURFACE = 0.15  # of the dofs of a mesh of some ten thousand, for which `reduce` keeps the shapes
Costs = dict[str, tuple[int, float, float]]  # as `Index.costs`


@dataclass(frozen=True)
class SweepEstimate:
    """cases; done - of them; to_make {stage: steps}; seconds, with so many jobs, and bytes on disk;
    memory - bytes at once; free - bytes of the disk, available - of the memory."""

    cases: int
    done: int
    to_make: dict[str, int]
    seconds: float
    jobs: int
    disk: float
    free: float
    memory: float
    available: float

    @property
    def text(self) -> str:
        """In one line."""
        if not self.to_make:
            return f"{self.cases} cases, nothing to make"
        steps = ", ".join(f"{count} {stage}" for stage, count in self.to_make.items())
        return (
            f"{self.cases} cases, {self.done} of them there; to make: {steps}; about "
            f"{duration(self.seconds)} with {self.jobs} job{'s' * (self.jobs > 1)}, "
            f"{_size(self.disk)} on disk of {_size(self.free)} free, {_size(self.memory)} of "
            f"memory of {_size(self.available)} available"
        )

    @property
    def warnings(self) -> list[str]:
        """What there is too little of."""
        found = []
        if self.disk > self.free:
            found.append(
                f"the results need about {_size(self.disk)}, {_size(self.free)} are free: choose "
                "another disk with --out, or fewer cases"
            )
        if self.memory > self.available:
            found.append(
                f"{self.jobs} cases side by side need about {_size(self.memory)} of memory, "
                f"{_size(self.available)} are available: run with fewer --jobs"
            )
        return found


def _size(number: float) -> str:
    unit, factor = next(
        u for u in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)) if number >= u[1] / 10 or u[1] == 1e3
    )
    return f"{number / factor:.3g} {unit}"


def sweep_estimate(whole: Plan, study: Study, store: Store, jobs: int) -> SweepEstimate:
    """Of the steps of a plan that are not in the sweep of this results folder; OSError where it
    cannot be written to."""
    folder = store.path("sweep")
    with store.writing("sweep/.room") as path:
        path.touch()
        path.unlink()
    there = products(folder)
    costs: Costs = {}
    if (folder / FILE).is_file():
        with Index(folder) as index:
            costs = index.costs()
    to_make = Counter(step.stage for step in whole.steps if step.key not in there)
    known, files = _forecast(study, store)
    processes = jobs + (jobs > 1)  # each with the program, about as much as this one
    seconds = disk = 0.0
    for stage, count in to_make.items():
        _, each, size = costs.get(stage) or _step(stage, study, known, files)
        seconds += count * each
        disk += count * size
    return SweepEstimate(
        len(whole.cases),
        sum(key in there for key in whole.last),
        dict(to_make),
        seconds / min(jobs, max(to_make.total(), 1)),
        jobs,
        disk,
        shutil.disk_usage(_existing(folder)).free,
        jobs * max((known[stage].bytes for stage in to_make if stage in known), default=0.0)
        + processes * own_bytes(),
        available_bytes(),
    )


def _forecast(study: Study, store: Store) -> tuple[dict[str, Cost], dict[str, float]]:
    """{stage: cost of the study as it stands}, of one job, and {stage: bytes on disk} of what is
    large beside curves; both empty where it cannot be looked at."""
    with suppress(InputError, OSError):
        alone = load_study(study.path)
        run_stage("inspect", alone, store, quiet=True)
        found = InspectResult.load(store)
        return estimate(alone, found)[1], _on_disk(size_of(alone, found))
    return {}, {}


def _on_disk(size: Size) -> dict[str, float]:
    """Of the reduced matrices with the shapes on the surfaces that are drawn, and of the fields of
    stress."""
    return {
        "reduce": 8.0 * size.reduced * (2 * size.reduced + ON_SURFACE * size.dofs),
        STRESS: FIELD_BYTES * size.stressed * size.dofs,
    }


def _step(
    stage: str, study: Study, known: dict[str, Cost], files: dict[str, float]
) -> tuple[int, float, float]:
    cost = known.get(stage, Cost(0.0, 0.0))
    curves = len(study.respond.levels) * (stage == CURVES)
    seconds = max(cost.seconds, LEAST_SECONDS + CURVE_SECONDS * curves)
    return 0, seconds, LEAST_BYTES + 1e6 * CURVE_MB * curves + files.get(stage, 0.0)


def _existing(folder: Path) -> Path:
    return next(one for one in (folder, *folder.absolute().parents) if one.exists())
