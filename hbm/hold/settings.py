"""Tolerances of held and of named rigid motions, each with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class HoldSettings:
    """Numbers that the answer does not depend on, but for the holds that they refuse or warn of."""

    rigid: float = 0.05  # share of a motion that is left beside the rigid one of its body
    hold: float = 1e-5  # of the stiffness of the sticking pairs along a motion: a hold that is soft
    faced: float = 3e-3  # direction cosine from which contact normals resist a motion that is held
    # times the stiffness of a hold: the solution that shows whether it is soft
    stiffer: float = 10.0
    stiffer_steps: tuple = (1, 4, 16)  # in which it is reached, where fewer lead to no solution
    # times itself: a mean reaction that grows more by ten times the stiffness follows
    follows: float = 2.0
    # it, contacts that stick carry what it would be on a stop ...
    no_reaction: float = 1e-7  # ... unless it is rounding beside the excitation
    small_angle: float = 0.01  # rad, and as a share of a body's size: displacements that are small
    # of the peak: how much lower the points beside it lie, from which it is solved
    hold_flank: float = 1e-3
    # again
    # of a body's size: nodes that near to an axis lie on it, turning moves nothing
    on_axis: float = 1e-6
    one_point: float = 1e-12  # of the distance from the origin: a body that small does not turn
    # of the peak, or of the force: more change by a stiffer hold is worth a warning
    hold_differs: float = 1e-4
    noise: float = 50.0  # times the rounding of the stiffness: what a restrained motion must store


HOLD = HoldSettings()
