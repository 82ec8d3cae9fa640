"""Peaks and folds of a curve followed over a parameter."""
