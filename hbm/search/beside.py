"""Solutions at one frequency beside those that are known.

The level of the force is followed from each known solution: where its branch folds it comes back
through the level that was asked for. Then Newton's method starts from many motions: from mixtures,
in which each contact moves as in one of the known solutions, from known motions enlarged and
delayed, and from known motions by deflation. What is found is completed by the symmetries of the
system, and counts as known for the next start.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.parameter import Equation, Level
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.closed import follow_both_ways
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import crossings
from tipdamp.hbm.continuation.point import size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.search.deflation import newton
from tipdamp.hbm.search.symmetry import Symmetry, symmetries


@dataclass(frozen=True)
class Search:
    """How far is looked for solutions beside a curve.

    frequencies : values of the parameter, spread over the band, at which is looked
    starts : of Newton's method at each of them, in a row that leads to nothing new
    level : up to so many times the force its branch over the level is followed there; 0 not at all
    curves : most further curves that are followed
    points : most of each, each way
    effort : most residual calls of the search, as a multiple of those of the curve; those of the
        curves that are found come on top of that
    least_calls : that it may make in any case
    seconds : most of the search; unlike the other limits not the same on every machine
    seed : of the starts

    >>> Search(frequencies=20).starts
    40
    """

    frequencies: int = 12
    starts: int = 40
    level: float = 10.0
    curves: int = 12
    points: int = 1000
    effort: float = float("inf")
    least_calls: int = 2000
    seconds: float = float("inf")
    seed: int = 0


@dataclass(frozen=True)
class SearchSettings:
    """Numbers of the method."""

    differs: float = 1e-3  # of the motion: solutions that are nearer are one
    calls: int = 25  # of the residual for one start: Newton takes six where it converges
    lowest: float = 0.05  # of the level, down to which its branch is followed
    points: int = 300  # of that branch, each way, in long steps: what it crosses is solved after
    aim: float = 0.01
    largest_step: float = 1.0
    most_starts: int = 1000
    scatter: float = 0.1  # decades, of the amplitudes in a mixture
    enlarged: tuple = (-1.0, 1.5)  # decades, of a known motion


SETTINGS = SearchSettings()


class Beside:
    """The solutions known at one frequency w, rad/s, and the search for more.

    known : (n,) unknowns of each; tried : starts of Newton's method so far; by_start : solutions
    that such a start has led to
    """

    def __init__(
        self,
        balance: HarmonicBalance,
        w: float,
        known: Sequence[np.ndarray],
        search: Search,
        settings: Settings,
        settings_here: SearchSettings = SETTINGS,
    ):
        self.balance, self.w, self.search, self.settings = balance, w, search, settings
        self.here, self.known = settings_here, list[np.ndarray]()
        self.tried, self.by_start = 0, 0
        self.symmetries: list[Symmetry] = (
            [] if balance.problem.reducible else symmetries(balance, w)
        )
        self.add(known)

    def add(self, known: Sequence[np.ndarray]) -> None:
        """Further solutions that are known here."""
        for x in known:
            self.known += self._new(x)

    def over_level(self) -> Iterator[np.ndarray]:
        """(n,) unknowns of each further solution on the branches over the level, as it is found."""
        passed = list[np.ndarray]()
        for x in list(self.known) if self.search.level else ():
            if self._among(x, passed):
                continue
            for found in self._over_level(x):
                passed += [found, *(image(found) for image in self.symmetries)]
                yield from self._added(found)

    def from_starts(self) -> Iterator[np.ndarray]:
        """(n,) unknowns of each further solution that starts lead to, as it is found."""
        random, last = np.random.default_rng(self.search.seed), 0
        while self.known and self.tried < min(last + self.search.starts, self.here.most_starts):
            guess, away = self._guess(random)
            self.tried += 1
            point = newton(
                self.balance.evaluate,
                guess,
                self.w,
                self.balance.weights,
                away,
                self.settings,
                self.here.calls,
            )
            for found in self._added(point.x) if point.converged else ():
                last = self.tried
                self.by_start += 1
                yield found

    def _added(self, x):
        """What is new of it and its images, after it is known."""
        new = self._new(x)
        self.known += new
        yield from new

    def _new(self, x):
        """It and what the symmetries make of it, as far as that is not known."""
        new = list[np.ndarray]()
        for one in (x, *(image(x) for image in self.symmetries)):
            if not self._among(one, self.known) and not self._among(one, new):
                new.append(one)
        return new

    def same(self, x: np.ndarray, other: np.ndarray) -> bool:
        """Whether two motions (n,) are one solution."""
        weights = self.balance.weights
        return size(weights * (x - other)) <= self.here.differs * size(weights * other)

    def _among(self, x, known):
        return any(self.same(x, one) for one in known)

    def _over_level(self, x):
        """The solutions at level 1 on the branch over the level of the force through x."""
        equation = Equation(self.balance, Level(), self.w / (2 * np.pi))
        evaluate, weights = equation.evaluate, equation.weights
        start = solve_fixed(evaluate, x, 1.0, weights, self.settings)
        if not start.converged:
            return
        band = self.here.lowest, self.search.level
        rough = replace(
            self.settings,
            aim=self.here.aim,
            largest_error=20 * self.here.aim,
            largest_step=self.here.largest_step,
        )
        branch = follow_both_ways(evaluate, start, band, weights, rough, self.here.points)
        for point, _, _ in crossings(evaluate, branch.points, 1.0, weights, self.settings):
            if point.converged:
                yield point.x

    def _guess(self, random):
        """((n,) motion to start from, the solutions to keep away from)."""
        shape = len(self.balance.problem.contacts), self.balance.nd, self.balance.nh
        one = self.known[random.integers(len(self.known))]
        if self.tried % 3 == 2:
            return one * (1 + 0.1 * random.normal(size=one.shape)), self.known
        if self.tried % 3 and shape[0] > 1:
            every = np.reshape(self.known, (-1, *shape))
            chosen = every[random.integers(len(every), size=shape[0]), np.arange(shape[0])]
            scatter = random.uniform(-self.here.scatter, self.here.scatter, size=(shape[0], 1, 1))
            return (chosen * 10**scatter).ravel(), []
        larger = 10 ** random.uniform(*self.here.enlarged)
        later = np.exp(1j * random.uniform(0, 2 * np.pi) * np.arange(self.balance.H + 1))
        return fourier.to_real(larger * later * fourier.to_complex(one.reshape(shape))).ravel(), []
