"""A law of your own, in numpy

A force that depends on the present motion is one function. `check_force` holds it against
differences before you trust it.
"""

from dataclasses import dataclass
from typing import ClassVar

from tipdamp import PlainForce, Problem, check_force


@dataclass(frozen=True)
class Fluid(PlainForce):
    """Drag c |v| v, smooth enough at rest."""

    components: ClassVar[tuple] = ("t1",)
    drag: float = 20.0  # N s2/m2

    def force(self, u, v):
        return self.drag * v * (v**2 + 1e-10) ** 0.5


check_force(Fluid())
blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.002).add(Fluid(), 0)
axes, per_newton = None, []
for newton in (0.5, 2.0, 8.0):
    curve = blade.force(0, newton).follow_band((600, 820), outputs={"tip": 0}, samples=128)
    axes = curve.plot(unit="um", label=f"{newton:g} N", ax=axes)
    per_newton.append(curve.peak("tip")[1] / newton)

assert per_newton[0] > per_newton[1] > per_newton[2]  # drag grows with the motion
