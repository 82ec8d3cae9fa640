"""The equations of harmonic balance at one point."""
