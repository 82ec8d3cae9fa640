"""Eigenvalue solvers and factorisations behind tipdamp.modal.eigen."""
