"""The guess from which a curve or a single solution starts, in the place of the usual ways."""

import warnings

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point, size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.validation import numbers

Guess = np.ndarray | tuple[float, np.ndarray]
"""(n,) unknowns of a motion that is near, or (value of the parameter, these)."""
FAR = 0.5  # of the motion: a solution that lies further away may be another one than was meant
SHORTER = 1e-6  # of the motion: the orders of a motion that repeats earlier are less than that


def place_and_unknowns(guess: Guess, first: float, last: float) -> tuple[float, np.ndarray]:
    """(value, (n,) unknowns); a guess without a value is one for `first`. InputError for anything
    else, and outside the band."""
    allowed = "must be (n,) finite unknowns in m, or the tuple (value, these)"
    value = first
    x = guess
    if isinstance(guess, tuple):
        if len(guess) != 2 or np.ndim(guess[1]) != 1:
            raise InputError(f"guess: is a tuple of {len(guess)}, {allowed}")
        value, x = guess
    x = numbers("guess", x, allowed)
    if x.ndim != 1:
        raise InputError(f"guess: has the shape {x.shape}, {allowed}")
    if bad := np.count_nonzero(~np.isfinite(x)):
        raise InputError(f"guess: {bad} of {len(x)} unknowns are not finite, {allowed}")
    value = float(numbers("guess", value, "its value must be a number"))
    if not min(first, last) <= value <= max(first, last):
        where = f"{first:g}" if first == last else f"between {first:g} and {last:g}"
        raise InputError(f"guess: is one at {value:g}, must be {where}")
    return value, x


def orders_of_guess(guess: Guess | None, components: int) -> int:
    """H of the unknowns of a guess for so many components; 0 without one."""
    if guess is None:
        return 0
    return (len(place_and_unknowns(guess, 0.0, np.inf)[1]) // components - 1) // 2


def with_orders(x: np.ndarray, balance: HarmonicBalance) -> np.ndarray:
    """Unknowns of as many or fewer orders as unknowns of a balance; InputError for another size."""
    n = balance.n_components
    orders = (len(x) / n - 1) / 2
    if orders % 1 or not 0 <= orders <= balance.H:
        raise InputError(
            f"guess: has {len(x)} unknowns, must have n (2 h + 1) for n = {n} components of the "
            f"contacts and h orders, at most {balance.H}: {n * balance.nh}"
        )
    return of_orders(x, n, balance.H)


def of_orders(x: np.ndarray, components: int, H: int) -> np.ndarray:
    """Unknowns (n,) of so many components in H orders: further ones are zero, others left out."""
    given = x.reshape(components, -1)
    found = np.zeros((components, fourier.n_real(H)))
    both = min(given.shape[1], found.shape[1])
    found[:, :both] = given[:, :both]
    return found.ravel()


def with_periods(x: np.ndarray, balance: HarmonicBalance, times: int) -> np.ndarray:
    """The motion x (n,) of a balance over `times` of its periods: its orders k are `times` k."""
    u = fourier.to_complex(x.reshape(balance.n_components, -1))
    found = np.zeros((len(u), times * balance.H + 1), dtype=complex)
    found[:, ::times] = u
    return fourier.to_real(found).ravel()


def solved(equation: Equation, x: np.ndarray, value: float, settings: Settings) -> Point:
    """The solution near a guess at a value of the parameter.

    Raises InputError where Newton's method finds none; warns where it lies far from the guess, and
    where it repeats earlier than after the periods that were asked for."""
    x = with_orders(x, equation.balance)
    named = equation.parameter.named(value)
    p = equation.parameter.scale * value
    weights = equation.weights
    point = solve_fixed(equation.evaluate, x, p, weights, settings, settings.start_calls)
    if not point.converged:
        raise InputError(
            f"guess: Newton's method leads from it to no solution at {named}; give one that is "
            "nearer, such as the unknowns of a solution at a neighbouring value"
        )
    for doubt in (_far(point, x, weights), repeats(point, equation)):
        if doubt:
            warnings.warn(f"guess: the solution found at {named} {doubt}", Doubt, stacklevel=6)
    return point


def _far(point: Point, x: np.ndarray, weights: np.ndarray) -> str:
    away = size(weights * (point.x - x)) / max(size(weights * point.x), 1e-300)
    return f"lies {away:.0%} of its motion away: it may be another one" if away > FAR else ""


def repeats(point: Point, equation: Equation) -> str:
    """That the motion repeats after fewer periods of the excitation than those of the equation, in
    words; empty where it does not."""
    lasts = periods_of(point, equation)
    periods = equation.periods
    return f"repeats after {lasts} of {periods} periods of the excitation" * (lasts < periods)


def periods_of(point: Point, equation: Equation) -> int:
    """Periods of the excitation after which the motion repeats: those of the equation, or fewer."""
    u = np.abs(fourier.to_complex(point.x.reshape(equation.balance.n_components, -1)))
    orders = np.arange(u.shape[1])
    periods = equation.periods
    for times in (d for d in range(periods, 1, -1) if periods % d == 0):
        if u[:, orders % times != 0].max(initial=0.0) <= SHORTER * u[:, 1:].max(initial=0.0):
            return periods // times
    return periods
