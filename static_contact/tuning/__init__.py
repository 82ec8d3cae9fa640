"""Which pairs are kept: detachment until the stuck frequency meets its target, and how the rest
carries the pull."""
