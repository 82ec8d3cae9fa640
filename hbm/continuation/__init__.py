"""Numerical continuation of R(x, p) = 0 by arc length; what the equations mean it does not know."""
