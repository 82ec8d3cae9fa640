"""Contact pairs, the pull on them, and the preload with and without friction."""
