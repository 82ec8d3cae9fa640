"""Mesh files of pre-processors to `modal.mesh.Mesh`, with the numbers and sets of the user."""
