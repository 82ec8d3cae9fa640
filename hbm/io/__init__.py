"""Matrices from other programs, and for them."""
