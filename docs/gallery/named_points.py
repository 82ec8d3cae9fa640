"""Where a symmetry breaks

The symmetry of an oscillator breaks: there two unequal motions begin, images of
each other. `branch_from` follows them.
"""

from tipdamp import CubicSpring, Problem, branch_from

duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 2.0)
given = dict(outputs={"x": 0}, harmonics=7, stability="all")
curve = duffing.follow_band((0.12, 0.16), **given)
axes = curve.plot(label="symmetric")
branches = [
    branch
    for point in curve.named_points[:1]
    for branch in branch_from(curve, duffing.contact_problem, point)
]
for branch in branches:
    branch.plot(label="unequal", color="#D55E00", width=1.0, ax=axes)
axes.set(xlim=(0.12, 0.16), ylim=(1.2, 1.7))  # they go on to a fold at 0.68 Hz

assert all(abs(branch.harmonics[:, 0, 0]).max() > 0.01 for branch in branches)  # a mean
