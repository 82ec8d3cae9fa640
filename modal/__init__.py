"""Elastic bodies: stiffness and mass matrices, modes, Craig-Bampton reduction, damping."""

if __name__ != "tipdamp.modal":  # a second copy of its classes would be unlike the first
    raise ImportError(f"{__name__} is a part of tipdamp: import tipdamp.modal")
