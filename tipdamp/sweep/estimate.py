"""What a sweep will cost, before it begins: by the steps of each stage that were made before, else
by the forecast for some of its cases."""

import shutil
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan, nan
from pathlib import Path

from tipdamp.engine.progress import duration
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError, shown
from tipdamp.hbm.memory import available_bytes, own_bytes
from tipdamp.results.static_results import InspectResult
from tipdamp.sweep.cases import in_words, study_of_case
from tipdamp.sweep.expected import Expected, expected
from tipdamp.sweep.index import FILE, Index
from tipdamp.sweep.plan import Plan, chain
from tipdamp.sweep.work import products

STATIONS = "tune.stations"  # [front, back] or 'all'
Costs = dict[str, tuple[int, float, float]]  # as `Index.costs`


@dataclass(frozen=True)
class SweepEstimate:
    """cases; done - of them; to_make {stage: steps}; seconds, with so many jobs, and bytes on disk;
    memory - bytes at once; free - bytes of the disk, available - of the memory. nan where it is not
    known, and unlooked - why the study could not be looked at."""

    cases: int
    done: int
    to_make: dict[str, int]
    seconds: float
    jobs: int
    disk: float
    free: float
    memory: float
    available: float
    unlooked: str = ""

    @property
    def text(self) -> str:
        """In one line."""
        if not self.to_make:
            return f"{self.cases} cases, nothing to make"
        steps = ", ".join(f"{count} {stage}" for stage, count in self.to_make.items())
        told = f"{self.cases} cases, {self.done} of them there; to make: {steps}"
        if isnan(self.seconds):
            return f"{told}; time, disk and memory are not known: {self.unlooked}"
        memory = (
            f"memory is not known: {self.unlooked}"
            if self.unlooked
            else f"{_size(self.memory)} of memory of {_size(self.available)} available"
        )
        return (
            f"{told}; about {duration(self.seconds)} with {self.jobs} job{'s' * (self.jobs > 1)}, "
            f"{_size(self.disk)} on disk of {_size(self.free)} free, {memory}"
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


def sweep_estimate(
    whole: Plan, content: dict, path: Path, store: Store, jobs: int
) -> SweepEstimate:
    """Of the steps of a plan that are not in the sweep of this results folder; content - of the
    study file at this path. OSError where the folder cannot be written to; InputError where a case
    keeps more stations than there are."""
    folder = store.path("sweep")
    with store.writing("sweep/.room") as room:
        room.touch()
        room.unlink()
    there = products(folder)
    to_make = Counter(step.stage for step in whole.steps if step.key not in there)
    likely, unlooked = dict[str, Expected](), ""
    try:
        likely = expected(whole, there, (path, content), store)
    except (InputError, OSError) as error:
        unlooked = " ".join(str(error).split())
    else:
        _check_stations(whole, (path, content), InspectResult.load(store))
    processes = jobs + (jobs > 1)  # each with the program, about as much as this one
    seconds, disk = _sums(to_make, likely, _made(folder), jobs)
    return SweepEstimate(
        len(whole.cases),
        sum(key in there for key in whole.last),
        dict(to_make),
        seconds / min(jobs, max(to_make.total(), 1)),
        jobs,
        disk,
        shutil.disk_usage(_existing(folder)).free,
        jobs * max((one.memory for one in likely.values()), default=nan) + processes * own_bytes(),
        available_bytes(),
        unlooked,
    )


def _made(folder: Path) -> Costs:
    """Of the stages that were made before in the folder of a sweep."""
    if not (folder / FILE).is_file():
        return {}
    with Index(folder) as index:
        return index.costs()


def _sums(
    to_make: Mapping[str, int], likely: Mapping[str, Expected], made: Costs, jobs: int
) -> tuple[float, float]:
    """(s of one process, bytes) of all {stage: steps}, by what was made or else what is likely."""
    seconds = disk = 0.0
    for stage, count in to_make.items():
        of_one = likely.get(stage, Expected())
        once = 0.0 if stage in made else min(jobs, count) * of_one.once
        _, each, size = made.get(stage, (0, of_one.each, of_one.disk))
        seconds += count * each + once
        disk += count * size
    return seconds, disk


def _check_stations(whole: Plan, study: tuple[Path, dict], found: InspectResult) -> None:
    """InputError where a case keeps more stations than there are, of cases with the bodies and
    pairs of the study itself, which were inspected."""
    path, content = study
    most = max((one.stations for one in found.pair_checks.values()), default=0)
    chains, stated = whole.chains, content.get("tune", {}).get("stations")
    for number, (case, last) in enumerate(zip(whole.cases, whole.last, strict=True), 1):
        kept = case.get(STATIONS) or stated
        if not isinstance(kept, list) or sum(kept) <= most:
            continue
        own = {key: case[key] for key in case if key.startswith(("tune.", "respond."))}
        if chain(study_of_case(path, content, number, own))[0].key == chains[last][0]:
            raise InputError(
                f"{path}: [sweep] case {number} ({shown(in_words(case), 200)}): {STATIONS} = "
                f"{kept}: there are {most} stations, and front and back together are at most these"
            )


def _existing(folder: Path) -> Path:
    return next(one for one in (folder, *folder.absolute().parents) if one.exists())
