"""What runs a study and keeps it: the store of results, its curves, worker processes, progress,
compiled kernels."""
