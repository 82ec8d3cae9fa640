"""The bodies of a study: meshes read, contact pairs matched, bodies assembled and reduced, the
reduction checked; or matrices from anywhere in their place."""

BLADES, DAMPER = "blades", "damper"
CHECK_BELOW_HZ = 5000.0  # the stuck frequencies that are checked, and that a wanted error is of
