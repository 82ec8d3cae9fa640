"""Compile what a first curve would wait for; the kernels are kept from run to run:

python -m tipdamp.hbm.compile_ahead
"""

from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.response import follow_band


def compile_ahead() -> None:
    """A short curve of the default law that slips at its peak, with all that a study asks of one:
    estimate, stability, contact forces, time integration."""
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


if __name__ == "__main__":
    compile_ahead()
