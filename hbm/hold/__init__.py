"""Springs that keep a rigid motion from drifting, and what they take."""
