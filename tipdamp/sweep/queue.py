"""The tasks of a sweep in the order in which processes take them."""

from bisect import insort
from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from tipdamp.sweep.plan import Task
from tipdamp.sweep.time_left import FEW_TASKS, LEAST, Clock


class Queue(Sequence[Task]):
    """Of the tasks that can begin the first of the plan, by turns with the one that should cost
    most: what the costly ones take is known early, and none of them is left for the end.

    clock - is told what begins where at_once, that is where a task begins when it is taken"""

    def __init__(self, clock: Clock, at_once: bool) -> None:
        self._clock, self._at_once = clock, at_once
        self._begun, self._waiting = list[Task](), list[Task]()

    def __len__(self) -> int:
        return len(self._begun) + len(self._waiting)

    def __getitem__(self, i: Any) -> Any:
        if i == len(self._begun) and self._waiting:
            self._begun.append(self._waiting.pop(self._next()))
            if self._at_once:
                self._clock.begin(self._begun[i])
        return self._begun[i]

    def append(self, task: Task) -> None:
        """It can begin."""
        insort(self._waiting, task, key=attrgetter("turn"))

    def _next(self) -> int:
        costs, many = self._clock.costs, len(self._waiting) > FEW_TASKS
        if costs is None or many or len(self._begun) % 2:
            return 0
        turns = [task.turn for task in self._waiting]
        return int(np.log(np.maximum(costs[turns], LEAST)).round(1).argmax())  # ties: the first
