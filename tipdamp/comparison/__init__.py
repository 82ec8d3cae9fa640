"""Studies side by side: peaks of both phases over Fc/Fe, the best pull, one page."""
