"""The minimum of the differences over the unknowns: Gauss and Newton's method, and where to start
it, as one fit may end at a minimum that is not the least."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.fitting.residuals import BLIND, Residuals, Solved

STEPS, HALVINGS = 40, 8
LONGEST = 0.7  # step in the logarithm of an unknown
SMALL = 1e-7  # step at which it ends
ELSEWHERE = 0.5  # of the largest measured amplitude: a point farther off is on another branch
LESS_DAMPING = (1.0, 0.5, 0.25, 0.125)  # of the values to start from, while one is
LOOKED = np.log(3.0) * np.linspace(-1, 1, 7)  # where a factor is looked for, logarithms of it
BY = 0.1  # of these from the fit: no nearer are other values of it looked at
COMPARABLE = 10.0  # times the sum of squares of the fit, up to which another minimum is gone down


class ProfilePoint(NamedTuple):
    """Of a profile: theta (p,), and the least sum of squares that its derivatives tell."""

    theta: np.ndarray
    squares: float


class Minimum(NamedTuple):
    """theta (p,) : logarithms of the unknowns; squares : their sum, of the differences; steps :
    taken; converged : whether the last one is small"""

    theta: np.ndarray
    solved: Solved
    squares: float
    steps: int
    converged: bool

    @property
    def place(self) -> ProfilePoint:
        """Where it lies."""
        return ProfilePoint(self.theta, self.squares)


def least(of: Residuals) -> tuple[Minimum, list[list[float]]]:
    """(the best fit, of each unknown the logarithms of values that fit as well within the
    scatter); factors on the contacts are looked for along a profile."""
    fits = [nearest(of)]
    looked: dict[int, list[ProfilePoint]] = {}
    for j in (j for j, one in enumerate(of.unknowns) if one.settings):
        best = min(fits, key=lambda fit: fit.squares)
        looked[j] = profile(of, j, best)
        for theta in _starts(of, j, best, looked[j]):
            try:
                fits.append(run(of, theta))
            except InputError:  # the model does not respond from there
                continue
    best = min(fits, key=lambda fit: fit.squares)
    most = of.as_good(best.squares)
    as_good: list[list[float]] = [[] for _ in of.unknowns]
    for j, places in looked.items():
        for one in (*places, *(fit.place for fit in fits)):
            if one.squares <= most and abs(one.theta[j] - best.theta[j]) > BY:
                as_good[j].append(one.theta[j])
    return best, as_good


def nearest(of: Residuals) -> Minimum:
    """The result of `run` that is nearest to the measurement. Too much damping to start from ends
    a resonance that folds before the measured one ends; no small step leads back."""
    damped = np.array([bool(one.modes) for one in of.unknowns])
    found = []
    for factor in LESS_DAMPING if damped.any() else (1.0,):
        found.append(run(of, np.where(damped, np.log(factor), 0.0)))
        if not _elsewhere(of, found[-1].solved):
            break
    return min(found, key=lambda fit: fit.squares)


def _elsewhere(of: Residuals, solved: Solved) -> bool:
    """Whether a point is on another branch than the measured one."""
    return any(
        np.abs(computed - one.response).max() > ELSEWHERE * np.abs(one.response).max()
        for computed, one in zip(solved.computed, of.measured, strict=True)
    )


def run(of: Residuals, theta: np.ndarray) -> Minimum:
    """A fit from some unknowns on."""
    solved = of.solved(theta)
    squares = of.squares(solved)
    for step in range(1, STEPS + 1):
        way = np.linalg.lstsq(of.jacobian(solved), -of.residual(solved), rcond=BLIND)[0]
        way *= min(1.0, LONGEST / max(np.abs(way).max(), 1e-300))
        for _ in range(HALVINGS):
            new = of.solved(theta + way, solved, way)
            if of.squares(new) <= squares:
                break
            way = 0.5 * way
        else:  # no better: as near as the solutions are exact, or a minimum of another kind
            small = bool(np.abs(way).max() * 2**HALVINGS <= 1e3 * SMALL)
            return Minimum(theta, solved, squares, step, small)
        theta, solved, squares = theta + way, new, of.squares(new)
        if np.abs(way).max() <= SMALL:
            return Minimum(theta, solved, squares, step, True)
    return Minimum(theta, solved, squares, STEPS, False)


def profile(of: Residuals, j: int, fit: Minimum) -> list[ProfilePoint]:
    """Places at values of unknown j about a fit, ascending: the others follow it by the
    derivatives."""
    above = [value for value in LOOKED if value > fit.theta[j] + BY]
    below = [value for value in LOOKED[::-1] if value < fit.theta[j] - BY]
    found = [*_along(of, j, fit, above), *_along(of, j, fit, below)]
    return sorted(found, key=lambda one: one.theta[j])


def _along(of: Residuals, j: int, fit: Minimum, values: list[float]) -> Iterator[ProfilePoint]:
    rest = np.arange(len(of.unknowns)) != j
    theta, solved = fit.theta, fit.solved
    r, J = of.residual(solved), of.jacobian(solved)
    for value in values:
        way = np.zeros(len(theta))
        way[j] = value - theta[j]
        way[rest] = np.linalg.lstsq(J[:, rest], -r - J[:, j] * way[j], rcond=BLIND)[0]
        way[rest] = np.clip(way[rest], -LONGEST, LONGEST)
        try:
            solved = of.solved(theta + way, solved, way)
        except InputError:  # the model does not respond from here on
            return
        theta, r, J = theta + way, of.residual(solved), of.jacobian(solved)
        left = r - J[:, rest] @ np.linalg.lstsq(J[:, rest], r, rcond=BLIND)[0]
        yield ProfilePoint(theta, float(left @ left))


def _starts(
    of: Residuals, j: int, fit: Minimum, places: list[ProfilePoint]
) -> Iterator[np.ndarray]:
    """Unknowns of a profile from which another fit may end lower: where the fit is not among the
    least within the scatter, of these the one nearest to what was given; and the least place
    beyond a ridge that may lie beside a deeper one."""
    if not places:
        return
    most = of.as_good(min(one.squares for one in places))
    if fit.squares > most:
        as_good = (one.theta for one in places if one.squares <= most)
        yield min(as_good, key=lambda theta: abs(theta[j]))
    every = sorted([*places, fit.place], key=lambda one: one.theta[j])
    s = np.array([np.inf, *(one.squares for one in every), np.inf])
    lowest = (s[1:-1] < s[:-2]) & (s[1:-1] < s[2:]) & (s[1:-1] > max(most, fit.squares))
    lowest &= s[1:-1] < COMPARABLE * fit.squares
    if lowest.any():
        yield every[int(np.where(lowest, s[1:-1], np.inf).argmin())].theta
