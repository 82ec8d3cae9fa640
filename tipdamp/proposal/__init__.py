"""What meshes alone tell of a study: bodies, contact sides, directions; written as a study that a
person completes."""
