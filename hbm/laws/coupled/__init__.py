"""Coulomb friction coupled in the tangential plane."""
