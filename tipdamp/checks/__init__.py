"""Is it plausible: pairs, tables and figures of a study held against its model, and what a run will
take."""
