"""What meshes alone tell of a study, written as one that a person completes."""
