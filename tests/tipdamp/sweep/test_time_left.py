"""The time left of a sweep as it is told, beside the true one: sweeps whose costs were recorded are
run again by a clock that jumps from one finished task to the next."""

import heapq
from itertools import product

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from tests.tipdamp.rig_study import CHAIN
from tipdamp.engine.store import Store
from tipdamp.sweep import run as sweep_run
from tipdamp.sweep.index import Index
from tipdamp.sweep.plan import CURVES, SweepStep, Task
from tipdamp.sweep.queue import Queue
from tipdamp.sweep.run import planned
from tipdamp.sweep.time_left import Clock
from tipdamp.sweep.work import SweepWork

# CPU s of responses that were recorded: {(pull, H, level): s}, a row for each pull and H, a column
# for each level. A damper that hardly sticks, whose curve folds again and again, takes about as
# long as all other cases of its sweep: these two, the last of their tables, stand apart as HEAVY.


def table(pulls, orders, levels, seconds):
    return {
        (pull, H, level): s
        for (pull, H), row in zip(product(pulls, orders), seconds, strict=True)
        for level, s in zip(levels, row, strict=False)
    }


# the small rig of tests/conftest.py, without a search
RIG = table(
    [113, 80, 56, 40, 28],
    [3],
    [1.0, 1.8206, 3.3145, 6.0342, 10.986, 20.0],
    [
        [1.437, 1.265, 1.709, 2.071, 2.006, 3.315],
        [1.244, 1.450, 1.878, 2.060, 3.224, 3.180],
        [1.389, 1.480, 1.576, 1.897, 2.461, 5.572],
        [1.416, 1.849, 1.900, 2.671, 3.743, 9.748],
        [1.776, 2.077, 2.792, 2.843, 7.565],
    ],
)
# the same with a search, over the number of harmonics
ORDERS = table(
    [113, 56],
    [1, 5, 9, 15],
    [1, 5, 10, 20],
    [
        [1.837, 1.771, 2.207, 3.031],
        [1.942, 2.688, 3.277, 5.705],
        [2.201, 2.886, 4.866, 8.380],
        [2.283, 4.694, 7.821, 17.979],
        [1.665, 2.415, 3.117, 3.202],
        [1.527, 2.912, 5.534, 10.394],
        [2.132, 4.929, 8.671, 31.390],
        [2.994, 9.172, 19.332, 74.796],
    ],
)
# the matrices of docs/studies/matrices_only
MATRICES = table(
    [80, 60, 45, 30, 22],
    [3],
    [2.0, 3.0683, 4.7071, 7.2213, 11.078, 16.996, 26.073, 40.0],
    [
        [0.96, 0.72, 0.57, 0.77, 0.78, 0.75, 1.17, 1.29],
        [0.79, 0.74, 0.74, 0.74, 0.71, 0.88, 0.98, 1.26],
        [0.76, 0.71, 0.75, 0.69, 0.72, 0.79, 1.11, 1.34],
        [0.61, 0.63, 0.67, 0.57, 0.80, 1.04, 1.12, 7.42],
        [0.69, 0.59, 0.85, 0.93, 0.90, 1.28, 4.27],
    ],
)
HEAVY = {"rig": {(28, 3, 20.0): 131.0}, "matrices": {(22, 3, 40.0): 49.0}}
OF_RIG = {"reduce": 11.4, "preload": 0.22, "tune": 1.8}
OF_MATRICES = {"reduce": 0.69, "preload": 0.13, "tune": 0.16}


RECORDED = {"rig": (RIG, OF_RIG), "matrices": (MATRICES, OF_MATRICES)}


class Processes:
    """So many, that do nothing but let the time of their tasks pass; now - s."""

    at_once = True

    def __init__(self, jobs, cost):
        self.jobs, self.cost, self.now = jobs, cost, 0.0

    def spread(self, work, common, tasks, report, failed):
        begun, running = 0, []
        while begun < len(tasks) or running:
            while begun < len(tasks) and len(running) < self.jobs:
                heapq.heappush(running, (self.now + self.cost(tasks[begun]), begun))
                begun += 1
            self.now, i = heapq.heappop(running)
            yield i


def told(tmp_path, monkeypatch, study, recorded, jobs):
    """(n, 2) s: time left as it was told after each task, from a tenth of the time on, and as it
    was; recorded(step, case) - s."""

    def seconds(task):
        return {step.key: recorded(step.stage, task.case) for step in task.steps}

    whole, content = planned(study)
    processes = Processes(jobs, lambda task: sum(seconds(task).values()))
    of_key = {key: s for task in whole.tasks for key, s in seconds(task).items()}
    monkeypatch.setattr("time.monotonic", lambda: processes.now)
    monkeypatch.setattr(
        sweep_run._Running, "_enter", lambda _, steps: [(step, of_key[step.key]) for step in steps]
    )
    with Index(tmp_path, write=True) as index:
        common = SweepWork(study, content, Store(tmp_path).folder)
        sweep = sweep_run._Running(common, whole, index, processes)
        sweep.take_stock(False)
        found = []
        sweep.run(lambda *_: found.append((processes.now, sweep.clock.seconds_left)))
    late = [(at, left) for at, left in found if 0.1 * processes.now <= at < processes.now]
    return np.array([(left, processes.now - at) for at, left in late if left is not None])


def right(found):
    """Share of the moments at which the time left was right within 30 %."""
    return np.mean(np.abs(found[:, 0] / found[:, 1] - 1) < 0.3)


def study_over(folder_study, cases):
    """The study with a table of cases."""
    keys = list(cases[0])
    rows = [",".join(map(str, (case[key] for key in keys))) for case in cases]
    folder_study.with_name("cases.csv").write_text("\n".join([",".join(keys), *rows]))
    folder_study.write_text(CHAIN + '\n[sweep]\ncases = "cases.csv"\n')
    return folder_study


def preload_and_responses(count):
    """Tasks of a sweep over the level at one pull: the preload that all need, and its responses."""
    preload = SweepStep("preload", "p", ())
    steps = [SweepStep(CURVES, f"r{i}", ("p",)) for i in range(count)]
    return [
        Task((preload,), (), {"level": 0}),
        *(Task((one,), (preload,), {"level": i}, i + 1) for i, one in enumerate(steps)),
    ]


@pytest.fixture
def now(monkeypatch):
    """[s] of the clock."""
    found = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: found[0])
    return found


def test_no_time_left_is_told_before_it_is_known(now):
    """A preload says nothing of the responses that follow; all of these are alike."""
    preload, *responses = tasks = preload_and_responses(50)
    clock = Clock(tasks, 2, {})
    clock.wait_for(clock.row)
    clock.end(preload, {"p": 1.0})
    assert clock.seconds_left is None
    for task in responses[:2]:
        clock.end(task, {task.last.key: 4.0})
    assert clock.seconds_left == pytest.approx(48 * 4.0 / 2, rel=1e-12)


def test_steps_of_before_tell_at_once(now):
    """After a kill: the time left is told before anything is made; failed steps are not waited
    for."""
    tasks = preload_and_responses(10)
    clock = Clock(tasks, 1, {"p": 1.0, "r0": 3.0, "r9": 3.0, "of another sweep": 1e6})
    clock.wait_for([f"r{i}" for i in range(1, 9)])
    clock.forget(["r3", "r4"])
    assert clock.seconds_left == pytest.approx(6 * 3.0, rel=1e-12)


def test_costs_grow_along_a_key(now):
    """Each level takes 1.5 times as long as the one before; from four of ten the others follow to
    10 %."""
    tasks = preload_and_responses(10)
    made = {f"r{i}": 1.5**i for i in (2, 4, 6, 7)}
    clock = Clock(tasks, 1, {"p": 1.0, **made})
    clock.wait_for([f"r{i}" for i in (0, 1, 3, 5, 8, 9)])
    true = sum(1.5**i for i in (0, 1, 3, 5, 8, 9))
    assert clock.seconds_left == pytest.approx(true, rel=0.1)


def test_a_case_that_takes_fifty_times_as_long_tells_of_itself(now):
    """Of alike steps, 4 s each, one took 200 s: those that are left are not taken for longer."""
    tasks = preload_and_responses(50)
    made = {f"r{i}": 4.0 for i in range(0, 50, 2)} | {"r24": 200.0}
    clock = Clock(tasks, 1, {"p": 1.0, **made})
    clock.wait_for([f"r{i}" for i in range(1, 50, 2)])
    assert clock.seconds_left == pytest.approx(25 * 4.0, rel=0.2)


def test_what_runs_takes_the_rest_of_its_time(now):
    """Of the last two tasks, 8 s each, one began 6 s and one 2 s ago; one that should be done long
    since takes a quarter of its time more."""
    _, one, other, *done = tasks = preload_and_responses(10)
    clock = Clock(tasks, 2, {"p": 1.0, **{task.last.key: 8.0 for task in done}})
    clock.wait_for([one.last.key, other.last.key])
    clock.begin(one)
    now[0] = 4.0
    clock.begin(other)
    now[0] = 6.0
    assert clock.seconds_left == pytest.approx(6.0, rel=1e-12)
    now[0] = 24.0
    assert clock.seconds_left == pytest.approx(0.25 * 24.0, rel=1e-12)
    clock.end(one, {one.last.key: 20.0})
    clock.end(other, {other.last.key: 20.0})
    now[0] = 30.0
    assert clock.seconds_left == 0.0


def test_costly_tasks_are_taken_by_turns(now):
    """Every second task is the one that should cost most, the others come as they stand in the
    plan."""
    preload, *responses = tasks = preload_and_responses(8)
    clock = Clock(tasks, 1, {"p": 1.0, "r3": 2.0, "r4": 3.0})
    clock.wait_for([task.last.key for task in responses if task not in responses[3:5]])
    assert clock.seconds_left
    queue = Queue(clock, at_once=True)
    for task in reversed([*responses[:3], *responses[5:]]):
        queue.append(task)
    assert len(queue) == 6
    assert [task.last.key for task in queue] == ["r7", "r0", "r6", "r1", "r5", "r2"]
    assert len(clock.begun) == len(queue) == 6


KEYS = ("model.pull", "respond.harmonics", "respond.levels")


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(
    "costs, others",
    [(RIG, OF_RIG), (MATRICES, OF_MATRICES), (ORDERS, OF_RIG)],
    ids=["rig", "matrices", "harmonics"],
)
def test_the_time_left_is_right(matrices_study, tmp_path, monkeypatch, jobs, costs, others):
    """From a tenth of the time on, at 80 to 95 % of all moments. Costs grow 8 to 50 times along the
    keys, and in the order of the file the costly cases come last."""

    def recorded(stage, case):
        return others.get(stage) or costs[tuple(case[key] for key in KEYS)]

    study = study_over(matrices_study, [dict(zip(KEYS, values, strict=True)) for values in costs])
    found = told(tmp_path, monkeypatch, study, recorded, jobs)
    assert right(found) > 0.75


def replayed(name, costs, study, tmp_path, monkeypatch, jobs):
    """As `told`, of cases with these costs {(pull, H, level): s} and the other steps as
    recorded."""
    others = RECORDED[name][1]

    def recorded(stage, case):
        return others.get(stage) or costs[tuple(case[key] for key in KEYS)]

    study = study_over(study, [dict(zip(KEYS, values, strict=True)) for values in costs])
    return told(tmp_path, monkeypatch, study, recorded, jobs)


@pytest.mark.parametrize("name", RECORDED)
def test_a_case_as_long_as_all_others_is_not_foreseen(matrices_study, tmp_path, monkeypatch, name):
    """While it waits the time left is too short; once it is made, at most a few times too long."""
    costs = RECORDED[name][0] | HEAVY[name]
    found = replayed(name, costs, matrices_study, tmp_path, monkeypatch, 1)
    assert right(found) > 0.25


@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDED)
def test_the_time_left_of_2000_cases_is_right(matrices_study, tmp_path, monkeypatch, name):
    """Pull and level at random within those recorded, the heavy corner among them; costs as
    recorded between them, scattered by 10 %."""
    recorded = RECORDED[name][0] | HEAVY[name]
    ends = pulls, levels = [sorted({key[i] for key in recorded}) for i in (0, 2)]
    table = [[recorded[pull, 3, level] for level in levels] for pull in pulls]
    surface = RegularGridInterpolator([np.log(values) for values in ends], np.log(table))
    rng = np.random.default_rng(0)
    low, high = (np.log([values[end] for values in ends]) for end in (0, -1))
    at = rng.uniform(low, high, (2000, 2))
    seconds = np.exp(surface(at) + 0.1 * rng.standard_normal(len(at)))
    costs = {(p, 3, level): s for (p, level), s in zip(np.exp(at).tolist(), seconds, strict=True)}
    assert max(seconds) > 30 * np.median(seconds)
    found = replayed(name, costs, matrices_study, tmp_path, monkeypatch, 2)
    assert right(found) > 0.85
