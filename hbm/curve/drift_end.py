"""Where a branch ends because a mean motion drifts: whether it does so with more orders, too.

Near the end a few contacts still hold the mean; whether they slip through the cycle may be decided
by orders that the balance does not have."""

from collections.abc import Sequence
from dataclasses import replace

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.follow import BudgetExceeded, follow
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.truncation import wider
from tipdamp.hbm.errors import InputError

REACH = 0.01  # of the parameter, before the end and beyond it: ends move by less with the orders
UNKNOWNS = 1000  # with more orders, up to which it is tried: in a second or two
CALLS = 400  # of the residual, at most: a branch that goes on takes about a hundred


def goes_on(equation: Equation, points: Sequence[Point]) -> int:
    """The number of orders, about twice that of the branch, with which it goes on beyond its last
    solved point; 0 where it ends with them, too, is not found, or has too many unknowns.

    points : solved ones, in the order of the branch"""
    last = points[-1].parameter
    reach = REACH * abs(last) * (-1.0 if last < points[0].parameter else 1.0)
    before = [p for p in points if (last - p.parameter) * reach >= reach**2]
    begin = before[-1] if before else points[0]
    left = CALLS

    def count() -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise BudgetExceeded

    try:
        wide = replace(equation, balance=wider(equation.balance))
        if len(wide.weights) > UNKNOWNS:
            return 0
        wide.balance.on_call = count
        x = wide.balance.padded(begin.x)
        start = solve_fixed(wide.evaluate, x, begin.parameter, wide.weights)
        if not start.converged:
            return 0
        settings = replace(DEFAULT, max_restarts=0, max_gaps=0, outside=0.0)
        branch = follow(wide.evaluate, start, last + reach, wide.weights, settings)
    except (BudgetExceeded, InputError):  # not found soon, or too large for the memory
        return 0
    return wide.balance.H if branch.complete else 0
