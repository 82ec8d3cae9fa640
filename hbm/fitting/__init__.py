"""Damping and contact settings fitted to measured responses, with the contacts in the model."""
