"""Which pairs are kept, and how the rest carries the pull."""
