"""A chain with three kinds of force, a MixedLaw

Friction, a gap and a cubic spring stand in one chain of masses, each where `Problem.add` puts it;
its `contact_problem` has them as one law.
"""

import numpy as np

from tipdamp import CubicSpring, Jenkins1D, MixedLaw, Problem, UnilateralSpring

n, k = 5, 1e4
springs = k * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
chain = (
    Problem(M=np.eye(n), C=4e-4 * springs, K=springs)
    .add(Jenkins1D(), (0, 1), kt=2e3, mu=0.3, preload=10.0)
    .add(UnilateralSpring(), 2, kn=5e3, preload=-5.0)
    .add(CubicSpring(1e7), 4)
    .force(0, 20.0)
)
curve = chain.follow_band((6, 18), outputs={"first": 0, "last": 4}, harmonics=5)
curve.plot(unit="mm")

law = chain.contact_problem.law
assert isinstance(law, MixedLaw)
assert {type(part) for part in law.laws} == {Jenkins1D, UnilateralSpring, CubicSpring}
assert curve.complete and curve.force_residual.max() < 1e-8
