"""Coulomb friction in each tangent on its own, with located events."""
