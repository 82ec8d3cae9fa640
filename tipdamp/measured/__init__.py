"""Measured response curves: read, averaged over repeats, their damping, and their agreement with
computed curves."""
