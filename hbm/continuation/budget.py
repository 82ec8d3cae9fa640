"""The budget of residual evaluations of a branch, and the progress that is reported between its
points."""

from collections.abc import Callable

from tipdamp.hbm.continuation.settings import Settings


class BudgetExceeded(Exception):
    """A branch has cost more residual calls than its settings allow."""


class Budget:
    """Counts residual calls and points; `progress(value, step, calls)` or None is called for both.

    Between points progress comes with the value of the last one, step 0 and the calls since.
    """

    def __init__(self, settings: Settings, progress: Callable | None, first: float, unknowns: int):
        # a call costs about the cube of the unknowns: small problems may make more
        self.most = settings.max_calls * max(1.0, settings.large / unknowns) ** 2
        self.settings, self.progress, self.value = settings, progress, first
        self.calls, self.points, self.since = 0, 0, 0

    def point(self, value: float, step: float, calls: int) -> None:
        """A point is taken into the branch."""
        self.points, self.value, self.since = self.points + 1, value, 0
        if self.progress:
            self.progress(value, step, calls)

    def call(self) -> None:
        """The residual is evaluated once more; raises BudgetExceeded above the limit, then and from
        then on."""
        self.calls, self.since = self.calls + 1, self.since + 1
        if self.progress and self.since % self.settings.progress_interval == 0:
            self.progress(self.value, 0.0, self.since)
        most = self.most if self.points else min(self.most, self.settings.max_first_calls)
        if self.calls > most + self.settings.calls_per_point * self.points:
            raise BudgetExceeded
