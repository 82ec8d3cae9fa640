"""Time integration of the same contact problems, and steady states by shooting."""
