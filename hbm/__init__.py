"""Harmonic balance of reduced models with friction contacts; needs numpy, scipy and numba alone."""

if __name__ != "tipdamp.hbm":  # a second copy of its classes would be unlike the first
    raise ImportError(f"{__name__} is a part of tipdamp: import tipdamp.hbm")
