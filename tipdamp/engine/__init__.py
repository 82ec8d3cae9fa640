"""What runs a study and keeps it: store, curves, workers, progress, compiled kernels."""
