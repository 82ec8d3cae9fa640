"""Branches along which no contact moves: there is no force, or no mode that it excites reaches a
contact.

The unknowns of the balance stay what they are at rest, and with them a continuation would step over
the resonances of the outputs: the points stand where the modes have theirs.
"""

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import heading, solve_fixed
from tipdamp.hbm.continuation.point import OnPoint, Point
from tipdamp.hbm.continuation.settings import Settings


def moves_contacts(balance: HarmonicBalance) -> bool:
    """Whether a mode that the vibrating forces excite reaches a contact, beyond rounding."""
    shapes = np.abs(balance.shapes)
    force = np.abs(balance.force)
    reached = shapes.max(axis=0, initial=0.0)[:, None] * force
    return bool(
        reached.max(initial=0.0)
        > DEFAULT.unreached * shapes.max(initial=0.0) * force.max(initial=0.0)
    )


def follow_unmoved(
    equation: Equation, begin: Point, last: float, settings: Settings, on_point: OnPoint
) -> Branch:
    """The branch from a point to `last`: at both ends, around the resonances between and evenly
    beside them."""
    forced = any(np.any(F) for F in begin.detail.balance.forces.values())
    way = np.sign(last - begin.parameter)
    values = [last]
    if forced:
        low, high = sorted((begin.parameter, last))
        modes = equation.evaluate(begin.x, high).balance  # those that matter in the whole band
        values = [*_around_resonances(modes, low, high)[:: int(way)], last]
    branch = Branch([heading(begin, way)])
    for value in values:
        point = solve_fixed(equation.evaluate, begin.x, value, equation.weights, settings)
        branch.points.append(heading(point, way) if point.converged else point)
        on_point(branch.points[-1], 0.0)
    branch.finish("end" if forced else "static", last)
    branch.complete = branch.points[-1].converged
    return branch


def _around_resonances(balance: HarmonicBalance, low: float, high: float) -> np.ndarray:
    """Angular frequencies inside the band, in rising order, close where a forced mode is at its
    resonance."""
    R = balance.receptance
    force = np.abs(balance.force)
    if R.poles.size:
        own = np.abs(R.poles)
        ratio = -R.poles.real / own
    else:
        own = np.sqrt(R.stiffness / np.maximum(R.mass, DEFAULT.light * R.mass.max()))
        ratio = R.ratio
    places = [np.linspace(low, high, DEFAULT.evenly)]
    for j, k in np.argwhere(force[: len(own), 1:] > DEFAULT.unreached * force.max()):
        width = max(ratio[j], DEFAULT.least_width)
        far = np.arcsinh(0.5 / width)
        places.append(
            own[j] / (k + 1) * (1 + width * np.sinh(np.linspace(-far, far, DEFAULT.around)))
        )
    found = np.sort(np.concatenate(places))
    apart = np.diff(found, prepend=0.0) > DEFAULT.least_width * found
    return found[apart & (low < found) & (found < high)]
