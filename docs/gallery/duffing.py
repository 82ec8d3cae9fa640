"""Duffing's oscillator

A mass on a hardening spring: the resonance leans over, and between two folds three motions exist at
one frequency. The middle one is unstable and dashed.
"""

from tipdamp import CubicSpring, Problem

duffing = Problem(M=[[1.0]], C=[[0.1]], K=[[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
curve = duffing.follow_band((0.08, 0.35), outputs={"x": 0}, harmonics=5, stability="all")
curve.plot().set_title("Duffing")

folds = [point for point in curve.named_points if point.kind == "fold"]
assert len(folds) == 2
