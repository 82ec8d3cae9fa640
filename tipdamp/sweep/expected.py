"""What the steps of a sweep should cost, by the forecast for some of its cases."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from math import nan
from pathlib import Path

import numpy as np

from tipdamp.checks import curve_cost
from tipdamp.checks.forecast import SETTINGS, Cost, forecast
from tipdamp.checks.machine import COMMON, Machine, measured
from tipdamp.checks.sizes import Size, size_of
from tipdamp.engine.store import Store
from tipdamp.results.static_results import InspectResult
from tipdamp.stages.run import run_stage
from tipdamp.study.study import load_study, study_of
from tipdamp.sweep.cases import Case, content_of
from tipdamp.sweep.plan import CURVES, STRESS, Plan

LEAST_SECONDS = 0.1  # of a step: what it takes to begin, read and pack it
# bytes of a step: of its records, of each pair, of each dof of a mesh [rigs, example of matrices]
STEP_BYTES = {
    "reduce": (5.5e4, 250.0, 0.0),
    "preload": (5e3, 350.0, 0.0),
    "tune": (1e4, 300.0, 30.0),
    CURVES: (5e3, 0.0, 0.0),
}
FIELD_BYTES = 10.0  # of the fields of stress, a dof and level
ON_SURFACE = 0.15  # of the dofs of a mesh of some ten thousand, for which `reduce` keeps the shapes
SAMPLED = 12  # about so many steps of each stage stand for all
# longer than most responses: those at the ends of the ranges, where the damper hardly sticks, take
# up to a hundred times as long [the small rig, the example of matrices, over pull and level]
TAIL = 1.4


@dataclass(frozen=True)
class Expected:
    """Of a step of a stage: each - s, and once - for each process; disk, memory - bytes. nan where
    nothing is known."""

    each: float = nan
    once: float = nan
    disk: float = nan
    memory: float = nan


def expected(
    whole: Plan, there: Collection[str], study: tuple[Path, dict], store: Store
) -> dict[str, Expected]:
    """{stage: means} of the steps of a plan that are not there; study - its file and the content;
    InputError or OSError where it cannot be looked at."""
    path, content = study
    cases: dict[str, list[Case]] = {}
    for task in whole.tasks:
        for step in task.steps:
            if step.key not in there:
                cases.setdefault(step.stage, []).append(task.case)
    run_stage("inspect", load_study(path), store, quiet=True)
    found = InspectResult.load(store)
    sizes = {
        stage: [size_of(study_of(path, content_of(content, case)), found) for case in some]
        for stage, some in ((stage, _some(every)) for stage, every in cases.items())
    }
    likely = _means(sizes, COMMON)
    seconds = sum(len(cases[stage]) * one.each for stage, one in likely.items())
    return likely if seconds < SETTINGS.short else _means(sizes, measured())


def _some(cases: Sequence[Case]) -> list[Case]:
    """Both ends among them, where ranges are the largest."""
    places = np.linspace(0, len(cases) - 1, min(len(cases), SAMPLED)).round().astype(int)
    return [cases[i] for i in places]


def _means(sizes: Mapping[str, Sequence[Size]], machine: Machine) -> dict[str, Expected]:
    return {
        stage: _mean([_step(stage, size, forecast(size, machine)) for size in some])
        for stage, some in sizes.items()
    }


def _mean(steps: Sequence[Expected]) -> Expected:
    """Of time and disk, which add up; the memory is that of the largest step."""
    mean = Expected(*np.mean([astuple(step) for step in steps], axis=0).tolist())
    return replace(mean, memory=max(step.memory for step in steps))


def _step(stage: str, size: Size, costs: Mapping[str, Cost]) -> Expected:
    cost = costs.get(stage, Cost(0.0, 0.0))
    dofs = sum(dofs for dofs, columns, _ in size.bodies.values() if columns)
    fixed, of_pair, of_dof = STEP_BYTES.get(stage, STEP_BYTES[CURVES])
    disk = fixed + of_pair * size.pairs + of_dof * dofs
    if stage == "reduce":
        disk += reduced_bytes(size)
    seconds = LEAST_SECONDS + cost.seconds - cost.once
    if stage == STRESS:
        disk += FIELD_BYTES * size.stressed * size.dofs
    if stage == CURVES:
        disk += curve_cost.disk(size, size.slipping)
        seconds *= TAIL
    return Expected(seconds, cost.once, disk, cost.bytes)


def reduced_bytes(size: Size) -> float:
    """Of the reduced matrices, and of the shapes on the surfaces that are drawn."""
    return 8.0 * size.reduced * (2 * size.reduced + ON_SURFACE * size.dofs)
