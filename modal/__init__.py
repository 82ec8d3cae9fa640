"""Elastic bodies: stiffness and mass matrices, modes, Craig-Bampton reduction, damping."""
