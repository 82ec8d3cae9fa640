"""Compile what a first curve would wait for; the kernels are kept from run to run:

python -m tipdamp.hbm.compile_ahead
"""

from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.laws import CubicSpring, DryFriction2T
from tipdamp.hbm.problem import Problem
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
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.1)
    short = duffing.follow_band((0.1, 0.11), outputs={"x": 0}, harmonics=3, progress=False)
    compare(short, duffing.contact_problem, point=0)


if __name__ == "__main__":
    compile_ahead()
