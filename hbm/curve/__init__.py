"""How a curve comes about: first solution, branch, refinement, residuals of its points, journal."""
