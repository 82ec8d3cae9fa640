"""Sweeps: many cases of one study, their shared steps made once, in one store with one index."""
