"""Is it plausible: a study held against its model, and what a run will take."""
