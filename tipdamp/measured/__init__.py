"""Measured response curves, their damping, and their agreement with computed ones."""
