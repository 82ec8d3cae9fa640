"""Mesh files of pre-processors to `modal.mesh.Mesh`, with the user's node numbers, element numbers
and sets."""
