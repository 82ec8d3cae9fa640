"""Follows a branch of R(x, parameter) = 0 by arc length; knows nothing of vibration."""
