"""Contact stiffness from half-space theory."""
