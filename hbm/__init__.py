"""Harmonic balance of reduced models with friction contacts; needs numpy, scipy and numba alone."""
