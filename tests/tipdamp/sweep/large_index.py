"""A finished sweep of many cases that was never computed: its plan, its index with two rows a case,
and an empty file for each step."""

from tipdamp.sweep.index import Index
from tipdamp.sweep.plan import CURVES, Plan, SweepStep, Task
from tipdamp.sweep.rows import CurveRow
from tipdamp.sweep.work import product

SHARED = SweepStep("reduce", f"{0:016x}", ())


def write(folder, count):
    """The plan of so many cases, whose steps are all made in the folder."""
    cases = tuple({"model.pull": float(i)} for i in range(count))
    steps = [SweepStep(CURVES, f"{i << 48 | i:016x}", (SHARED.key,)) for i in range(1, count + 1)]
    tasks = [Task((SHARED,), (), cases[0])]
    tasks += [
        Task((step,), (SHARED,), case, turn)
        for turn, (step, case) in enumerate(zip(steps, cases, strict=True), 1)
    ]
    whole = Plan(cases, tuple(step.key for step in steps), tuple(tasks))
    rows = [
        CurveRow(step.key, patch, 5.0, 3, *[1.0] * 5, True, False, 0, 4, 1844.0, "whole")
        for step in steps
        for patch in ("patch_1", "patch_2")
    ]
    with Index(folder, write=True) as index:
        index.begin(whole.cases, whole.last, whole.chains)
        index.done([(step, 1.0, 10) for step in (SHARED, *steps)], rows)
    for step in whole.steps:
        file = product(folder, step.key)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    return whole
