"""Mesh files of pre-processors to `tipdamp.modal.mesh.Mesh`, with the numbers and sets of the
user."""
