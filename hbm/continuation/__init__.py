"""Numerical continuation of R(x, p) = 0 by arc length; knows nothing of what the equations mean.

point (the protocol of a linearisation, points, arc length), corrector (Newton), predictor (where
the next point is expected), step_size (the step-size rule), branch (one point after the other),
restart (across gaps), follow (the whole), crossings and maxima (solved points beside a branch),
budget and settings.
"""
