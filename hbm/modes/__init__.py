"""Nonlinear modes: free periodic motions over their amplitude."""
