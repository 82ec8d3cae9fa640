"""Generators of the meshes that the studies use."""
