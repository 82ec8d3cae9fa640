"""Compile what a first curve would wait for; the kernels are kept from run to run:

python -m tipdamp.hbm.compile_ahead
"""

import numpy as np

from tipdamp.hbm.balance.problem import ContactProblem, contact_problem
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.laws import Contacts, CubicSpring, DryFriction2T
from tipdamp.hbm.response import follow_band


def compile_ahead() -> None:
    """A short curve of the default law that slips at its peak, with all that a study asks of one:
    estimate, stability, contact forces, time integration; and that of a force of another kind,
    whose time integration has kernels of its own."""
    model, pairs = two_blades()
    tip, other = (model.displacement_row(body, 1, [0, 1, 0]) for body in ("blade1", "blade2"))
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.01)
    curve = follow_band(
        problem,
        20.0 * (tip - other),
        (1250.0, 1300.0),
        outputs={"tip": tip},
        harmonics=3,
        contact=True,
        stability="all",
        progress=False,
    )
    compare(curve, problem, point=len(curve) // 2)
    one, cubic = np.eye(1), Contacts(*np.zeros((4, 1)))
    duffing = ContactProblem(one, 0.1 * one, one, one, CubicSpring(1.0), cubic)
    force, band = 0.1 * one[0], (0.1, 0.11)
    short = follow_band(duffing, force, band, outputs={"x": 0}, harmonics=3, progress=False)
    compare(short, duffing, point=0)


if __name__ == "__main__":
    compile_ahead()
