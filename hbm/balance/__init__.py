"""The equations of harmonic balance at one point: alternating frequency-time, receptance, residual,
Newton system."""
