"""Solutions beside those of a curve: at one frequency, and the curves they belong to."""
