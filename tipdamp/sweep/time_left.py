"""How long the rest of a sweep takes: what each step that is left should cost by those of its stage
that are finished, and how many processes work side by side."""

import heapq
import time
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from tipdamp.sweep.order import places
from tipdamp.sweep.plan import Task

COUNTED_EVERY = 1.0  # s
# The cost of a step is the exponential of a polynomial of the places of its values: of the second
# degree in up to so many keys, of the first in more; with so much ridge on its coefficients, since
# few cases say little of each [the two-blade rig over pull and level].
FEW_KEYS = 4
RIDGE = 0.01
LONGER = 0.25  # of its time so far, that a task still takes which should be done
FEW_TASKS = 10_000  # up to which their order counts
LEAST = 1e-3  # s of a step
MOST = 3.0  # times what is fitted, that one step counts for the others


class Clock:
    """The time left of the tasks of a sweep, in the order of their turns.

    jobs - tasks at a time; known - {key: s} of finished steps"""

    def __init__(self, tasks: Sequence[Task], jobs: int, known: Mapping[str, float]) -> None:
        self.jobs = jobs
        steps = [(step, task.turn) for task in tasks for step in task.steps]
        self.row = {step.key: i for i, (step, _) in enumerate(steps)}
        self.stage = np.unique([step.stage for step, _ in steps], return_inverse=True)[1]
        self.turn = np.array([turn for _, turn in steps])
        self.terms = _terms(places([task.case for task in tasks]))[self.turn]
        self.seconds = np.full(len(steps), np.nan)
        self.left = np.zeros(len(steps), dtype=bool)
        self.begun: dict[int, float] = {}  # {turn of a task that runs: when}
        self.counted: tuple[float, float] | None = None  # s left, and when that was ...
        self.costs: np.ndarray | None = None  # ... with (turns,) s of each task, 0 of what is done
        self._know(known)

    def wait_for(self, keys: Iterable[str]) -> None:
        """Steps that are to be made."""
        self.left[[self.row[key] for key in keys]] = True

    def forget(self, keys: Iterable[str]) -> None:
        """Steps that will not be made."""
        self.left[[self.row[key] for key in keys]] = False

    def begin(self, task: Task) -> None:
        """A process has it from now on."""
        self.begun[task.turn] = time.monotonic()

    def end(self, task: Task, made: Mapping[str, float]) -> None:
        """It does not run any more; made - {key: s} of its steps, none where it failed."""
        self.begun.pop(task.turn, None)
        self._know(made)
        self.forget(made)

    def _know(self, seconds: Mapping[str, float]) -> None:
        for key in self.row.keys() & seconds:
            self.seconds[self.row[key]] = max(seconds[key], LEAST)

    @property
    def seconds_left(self) -> float | None:
        """None while a stage that is left was never made; counted anew now and then."""
        now = time.monotonic()
        if self.counted is None or now - self.counted[1] >= COUNTED_EVERY:
            left = self._count()
            self.counted = None if left is None else (left, now)
        if self.counted is None:
            return None
        left, then = self.counted
        return max(left - (now - then), 0.0)

    def _count(self) -> float | None:
        expected = np.zeros(len(self.left))
        for stage in np.unique(self.stage[self.left]):
            mine = self.stage == stage
            known, wanted = mine & np.isfinite(self.seconds), mine & self.left
            if not known.any():
                return None
            expected[wanted] = _expected(self.terms[known], self.seconds[known], self.terms[wanted])
        self.costs = np.bincount(self.turn, np.where(self.left, expected, 0.0))
        return self._span(self.costs.copy())

    def _span(self, cost: np.ndarray) -> float:
        """s until all tasks are done, the costly ones first, of these costs (turns,)."""
        free = [0.0] * (self.jobs - len(self.begun))
        for turn, begun in self.begun.items():
            went_by = time.monotonic() - begun
            free.append(max(cost[turn] - went_by, LONGER * went_by))
            cost[turn] = 0.0
        waiting = cost[cost > 0]
        if len(waiting) > FEW_TASKS:
            return float(waiting.sum() + sum(free)) / self.jobs
        heapq.heapify(free)
        for one in np.sort(waiting)[::-1]:
            heapq.heapreplace(free, free[0] + float(one))
        return max(free)


def _terms(place: np.ndarray) -> np.ndarray:
    """(n, terms) of the polynomial, at places (n, keys)."""
    keys = place.shape[1]
    first, second = np.triu_indices(keys if keys <= FEW_KEYS else 0)
    return np.column_stack([np.ones(len(place)), place, place[:, first] * place[:, second]])


def _expected(known: np.ndarray, seconds: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(n,) s of steps with terms wanted (n, t), by those that took seconds (m,) with terms known
    (m, t): least squares of the logarithms, then scaled to their sum, in which none counts more
    than a few times what it should have taken."""
    ridge = np.append(0.0, np.full(known.shape[1] - 1, RIDGE))
    b = np.linalg.solve(known.T @ known + np.diag(ridge), known.T @ np.log(seconds))
    fitted = np.exp(known @ b)
    return np.exp(wanted @ b) * np.minimum(seconds, MOST * fitted).sum() / fitted.sum()
