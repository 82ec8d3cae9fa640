"""Solutions at one frequency beside those that are known.

The level of the force is followed from each known solution: where its branch folds it comes back
through the level that was asked for. Then Newton's method starts from many motions: from mixtures,
in which each contact moves as in one of the known solutions or one contact otherwise than in all
others, from known motions enlarged and delayed, and from known motions by deflation. What is found
is completed by the symmetries of the system, its level is followed in turn, and it counts as known
for the next start.

Solutions that differ in the mean position of sliders alone are one.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Level
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.symmetry import Symmetry, symmetries
from tipdamp.hbm.continuation.closed import follow_both_ways, follow_one_way
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import crossings
from tipdamp.hbm.continuation.point import size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.search.deflation import newton


@dataclass(frozen=True)
class Search:
    """How far is looked for solutions beside a curve.

    frequencies : values of the parameter, spread over the band, at which is looked
    starts : of Newton's method at each of them, in a row that leads to nothing new; four more for
        each further solution that is known there
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
    other: float = 0.1  # of the motion of a contact: motions that are nearer are mixed as one
    for_each: int = 4  # further known solution: as many more starts in a row that lead to nothing
    near: int = 2000  # mixtures, most of them, that differ from a known motion in one contact
    tries: int = 20  # for a mixture that is not one of those before
    enlarged: tuple = (-1.0, 1.5)  # decades, of a known motion


SETTINGS = SearchSettings()
JUST_BELOW = 0.999  # of the level: up to where a branch is followed that comes back to it


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
    ) -> None:
        self.balance, self.w, self.search, self.settings = balance, w, search, settings
        self.here, self.known = settings_here, list[np.ndarray]()
        self.passed = list[np.ndarray]()  # by branches over the level, with their images
        self.tried, self.by_start = 0, 0
        self.weights = motion_weights(balance)
        self.symmetries: list[Symmetry] = (
            [] if balance.problem.reducible else symmetries(balance, w)
        )
        self.add(known)

    def add(self, known: Sequence[np.ndarray]) -> None:
        """Further solutions that are known here."""
        for x in known:
            self.known += self._new(x)

    def on_branch(self, crossed: Sequence[np.ndarray]) -> Iterator[np.ndarray]:
        """(n,) unknowns of each further solution among those that a branch over the level of the
        smallest known motion has crossed."""
        self._pass(self._smallest)
        for x in crossed:
            self._pass(x)
            yield from self._added(x)

    def above_level(self) -> Iterator[np.ndarray]:
        """(n,) unknowns of each further solution over which the smallest known motion comes back to
        the level from above, as it is found."""
        if self.known and self.search.level > 1:
            for found in self._over_level(self._smallest, follow_one_way, JUST_BELOW):
                yield from self._added(found)

    def over_level(self) -> Iterator[np.ndarray]:
        """(n,) unknowns of each further solution on the branches over the level, as it is found."""
        for x in list(self.known) if self.search.level else ():
            if self._among(x, self.passed):
                continue
            for found in self._over_level(x):
                self._pass(found)
                yield from self._added(found)

    def from_starts(self) -> Iterator[np.ndarray]:
        """(n,) unknowns of each further solution that starts lead to, as it is found."""
        random, last, mixed = np.random.default_rng(self.search.seed), 0, _Mixtures(self)
        while self.known and self.tried < min(last + self._patience, self.here.most_starts):
            guess, away = self._guess(random, mixed)
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
            if not point.converged or not (new := list(self._added(point.x))):
                continue
            last = self.tried
            self.by_start += len(new)
            yield from new
            for found in self._over_level(point.x) if self.search.level else ():
                yield from self._added(found)

    @property
    def _smallest(self) -> np.ndarray:
        return min(self.known, key=lambda one: size(self.weights * one))

    @property
    def _patience(self) -> int:
        return self.search.starts + self.here.for_each * (len(self.known) - 1)

    def _pass(self, x: np.ndarray) -> None:
        self.passed += [x, *(image(x) for image in self.symmetries)]

    def _added(self, x: np.ndarray) -> Iterator[np.ndarray]:
        """What is new of it and its images, after it is known."""
        new = self._new(x)
        self.known += new
        yield from new

    def _new(self, x: np.ndarray) -> list[np.ndarray]:
        """It and what the symmetries make of it, as far as that is not known."""
        new = list[np.ndarray]()
        for one in (x, *(image(x) for image in self.symmetries)):
            if not self._among(one, self.known) and not self._among(one, new):
                new.append(one)
        return new

    def same(self, x: np.ndarray, other: np.ndarray) -> bool:
        """Whether two motions (n,) are one solution."""
        weights = self.weights
        return size(weights * (x - other)) <= self.here.differs * size(weights * other)

    def _among(self, x: np.ndarray, known: Sequence[np.ndarray]) -> bool:
        return any(self.same(x, one) for one in known)

    @property
    def _level(self) -> Equation:
        return Equation(self.balance, Level(), self.w / (2 * np.pi))

    def _over_level(
        self, x: np.ndarray, follow: Callable = follow_both_ways, lowest: float | None = None
    ) -> Iterator[np.ndarray]:
        """The solutions at level 1 on the branch over the level of the force through x."""
        evaluate, weights = self._level.evaluate, self._level.weights
        start = solve_fixed(evaluate, x, 1.0, weights, self.settings)
        if not start.converged:
            return
        band = lowest or self.here.lowest, self.search.level
        rough = replace(
            self.settings,
            aim=self.here.aim,
            largest_error=20 * self.here.aim,
            largest_step=self.here.largest_step,
        )
        branch = follow(evaluate, start, band, weights, rough, self.here.points)
        for point, _, _ in crossings(evaluate, branch.points, 1.0, weights, self.settings):
            if point.converged:
                yield point.x

    def _guess(
        self, random: np.random.Generator, mixed: "_Mixtures"
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """((n,) motion to start from, the solutions to keep away from)."""
        shape = len(self.balance.problem.contacts), self.balance.nd, self.balance.nh
        one = self.known[random.integers(len(self.known))]
        if self.tried % 4:
            mixture = mixed.near(random) if self.tried % 2 else mixed.any(random)
            if mixture is not None:
                return mixture, []
        if self.tried % 2:
            return one * (1 + 0.1 * random.normal(size=one.shape)), self.known
        larger = 10 ** random.uniform(*self.here.enlarged)
        later = np.exp(1j * random.uniform(0, 2 * np.pi) * np.arange(self.balance.H + 1))
        return fourier.to_real(larger * later * fourier.to_complex(one.reshape(shape))).ravel(), []


def motion_weights(balance: HarmonicBalance) -> np.ndarray:
    """(n,) weights of the unknowns by which motions are told apart: sliders may rest anywhere."""
    weights = balance.weights.copy()
    if balance.problem.law.sliders:
        weights[:: balance.nh] = 0.0
    return weights


def growth(balance: HarmonicBalance, w: float, x: np.ndarray) -> float:
    """By how many per cent the motion x (n,) at w rad/s grows with one per cent of the force: more
    than one where its branch over the level nears a fold."""
    here = Equation(balance, Level(), w / (2 * np.pi)).evaluate(x, 1.0)
    along, by_level, _ = here.direction(np.zeros(len(x)), 1.0)
    weights = balance.weights**2
    return float((weights * x) @ along / max((weights * x) @ x, 1e-300) / by_level)


class _Mixtures:
    """Motions in which each contact moves as it does in some known solution, none twice, and none
    that is the image of another one."""

    def __init__(self, beside: Beside) -> None:
        self.beside, self.here = beside, beside.here
        self.shape = len(beside.balance.problem.contacts), beside.balance.nd * beside.balance.nh
        self.motions = list[np.ndarray]()  # (nd nh,) of a contact
        self.solutions = list[tuple[int, ...]]()  # the motion of each contact, by its number
        self.made = set[tuple[int, ...]]()
        self.orders = {tuple(one.order) for one in beside.symmetries}

    def near(self, random: np.random.Generator) -> np.ndarray | None:
        """(n,) that differs from a known solution in one contact alone, at random; None where there
        is no further one."""
        places, _ = self._known()
        every = [
            (*solution[:p], motion, *solution[p + 1 :])
            for solution in self.solutions
            for p, own in enumerate(places)
            for motion in own
        ]
        if len(every) > self.here.near:
            return self.any(random)
        left = [one for one in dict.fromkeys(every) if self._least(one) not in self.made]
        return self._taken(left[random.integers(len(left))]) if left else self.any(random)

    def any(self, random: np.random.Generator) -> np.ndarray | None:
        """(n,) in which all contacts may differ; None where no further one was found."""
        places, several = self._known()
        for _ in range(self.here.tries if several else 0):
            one = tuple(own[random.integers(len(own))] for own in places)
            if self._least(one) not in self.made:
                return self._taken(one)
        return None

    def _known(self) -> tuple[list[list[int]], bool]:
        """([numbers of the motions known at each contact], whether there are several anywhere)."""
        for x in self.beside.known[len(self.solutions) :]:
            solution = tuple(self._number(u) for u in x.reshape(self.shape))
            self.solutions.append(solution)
            self.made.add(self._least(solution))
        places = [sorted(set(own)) for own in zip(*self.solutions, strict=True)]
        return places, max(map(len, places)) > 1

    def _number(self, u: np.ndarray) -> int:
        for number, motion in enumerate(self.motions):
            if size(u - motion) <= self.here.other * max(size(u), size(motion)):
                return number
        self.motions.append(u)
        return len(self.motions) - 1

    def _least(self, mixture: tuple[int, ...]) -> tuple[int, ...]:
        """Of its images under exchanges of contacts, the first."""
        return min([mixture, *(tuple(mixture[p] for p in order) for order in self.orders)])

    def _taken(self, mixture: tuple[int, ...]) -> np.ndarray:
        self.made.add(self._least(mixture))
        return np.concatenate([self.motions[number] for number in mixture])
