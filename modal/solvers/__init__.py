"""Eigenvalue solvers and factorisations behind modal.eigen."""
